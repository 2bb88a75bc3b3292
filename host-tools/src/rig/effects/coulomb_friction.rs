//! Dry friction beyond that of the base model: a constant torque against the motion, the same that holds the rotor at
//! rest.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "coulomb_friction",
    what: "dry friction beyond the base model's",
    size: "torque",
    unit: "N m",
    forms: &[],
    universal: Sizes::new(0.01, 0.001, 0.2),
    pm_dc: Sizes::new(9.8e-3, 5e-4, 0.1),
    install: |size, _, rig| rig.dry.push(Box::new(move |_: f64, _: f64| size)),
};
