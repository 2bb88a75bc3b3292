//! Delayed commutation: a series resistance r |ω|/ω_n without torque.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "commutation_resistance",
    what: "series resistance that grows with the speed",
    size: "resistance at nominal speed",
    unit: "ohm",
    forms: &[],
    universal: Sizes::new(1.0, 0.05, 5.0),
    pm_dc: Sizes::new(0.5, 0.05, 5.0),
    install: |size, _, rig| {
        let nominal = rig.motor.nameplate.speed_rad_s;
        rig.drops.push(Box::new(move |i: f64, omega: f64| size * omega.abs() / nominal * i));
    },
};
