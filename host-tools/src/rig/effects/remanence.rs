//! Remanent flux: a magnetising current that is there without any current.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "remanence",
    what: "remanent flux",
    size: "equivalent magnetising current",
    unit: "A",
    forms: &[],
    universal: Sizes::new(0.15, 0.01, 1.0),
    pm_dc: None,
    install: |size, _, rig| rig.remanence += size,
};
