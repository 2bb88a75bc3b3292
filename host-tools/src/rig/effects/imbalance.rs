//! An unbalanced rotor with a horizontal shaft: gravity pulls once a turn.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "imbalance",
    what: "torque once a turn from an unbalanced rotor",
    size: "amplitude",
    unit: "N m",
    forms: &[],
    universal: Sizes::new(0.02, 0.001, 0.2),
    pm_dc: Sizes::new(4e-3, 2e-4, 0.05),
    install: |size, _, rig| rig.torques.push(Box::new(move |_: f64, _: f64, theta: f64, _: f64| size * theta.cos())),
};
