//! A constant torque against forward motion, whatever the speed: gravity, a spring, a torque sensor's offset.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "torque_offset",
    what: "constant torque against forward motion",
    size: "torque",
    unit: "N m",
    forms: &[],
    universal: Sizes::new(0.01, 0.001, 0.1),
    pm_dc: Sizes::new(5e-3, 5e-4, 0.05),
    install: |size, _, rig| rig.torques.push(Box::new(move |_: f64, _: f64, _: f64, _: f64| -size)),
};
