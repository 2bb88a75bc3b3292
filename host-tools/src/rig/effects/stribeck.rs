//! Stribeck friction: the excess at low speed, T/(1 + (|ω|/ω_s)²), ω_s = 4 % of the nominal speed.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "stribeck",
    what: "excess of friction at low speed",
    size: "excess at standstill",
    unit: "N m",
    forms: &[],
    universal: Sizes::new(0.03, 0.002, 0.3),
    pm_dc: Sizes::new(6e-3, 5e-4, 0.1),
    install: |size, _, rig| {
        let omega_s = 0.04 * rig.motor.nameplate.speed_rad_s;
        rig.dry.push(Box::new(move |speed: f64, _: f64| size / (1.0 + (speed / omega_s).powi(2))));
    },
};
