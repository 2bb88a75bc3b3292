//! A current amplifier that runs into its supply: flat tops.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::Measured;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "adc_clipping",
    what: "current channel that clips",
    size: "current at which it clips",
    unit: "A",
    forms: &[],
    universal: Sizes::new(8.0, 0.5, 39.0),
    pm_dc: Sizes::new(3.0, 0.2, 9.9),
    install: |size, _, rig| rig.channel(Measured::Current).limits = Some((-size, size)),
};
