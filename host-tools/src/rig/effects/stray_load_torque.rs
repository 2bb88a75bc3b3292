//! Stray load torque: P/ω_n (i/i_n)² |ω/ω_n|^1.3 against the motion.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "stray_load_torque",
    what: "stray load torque",
    size: "loss at nominal speed and current",
    unit: "W",
    forms: &[],
    universal: Sizes::new(40.0, 5.0, 300.0),
    pm_dc: Sizes::new(1.0, 0.05, 10.0),
    install: |size, _, rig| {
        let (nominal, rms) = (rig.motor.nameplate.speed_rad_s, rig.motor.nameplate.rms_current_a);
        rig.torques.push(Box::new(move |i: f64, omega: f64, _: f64, _: f64| {
            -size / nominal * (i / rms).powi(2) * (omega.abs() / nominal).powf(1.3).copysign(omega)
        }));
    },
};
