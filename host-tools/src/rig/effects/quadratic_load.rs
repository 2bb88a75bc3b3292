//! A fan on a motor whose base model has none: torque ∝ ω |ω|.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "quadratic_load",
    what: "fan load beyond the base model's",
    size: "torque at nominal speed",
    unit: "N m",
    forms: &[],
    universal: None,
    pm_dc: Sizes::new(0.01, 5e-4, 0.1),
    install: |size, _, rig| {
        let nominal = rig.motor.nameplate.speed_rad_s;
        rig.motor.mu2 += size / (nominal * nominal);
    },
};
