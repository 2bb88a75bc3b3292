//! A load that grows with another power of the speed than 2; equal to the base load at nominal speed.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "windage_exponent",
    what: "load with another exponent than 2",
    size: "exponent",
    unit: "",
    forms: &[],
    universal: Sizes::new(2.3, 1.2, 3.5),
    pm_dc: None,
    install: |size, _, rig| {
        let nominal = rig.motor.nameplate.speed_rad_s;
        let torque = rig.motor.mu2 * nominal * nominal;
        rig.motor.mu2 = 0.0;
        rig.torques.push(Box::new(move |_: f64, omega: f64, _: f64, _: f64| {
            -torque * (omega.abs() / nominal).powf(size).copysign(omega)
        }));
    },
};
