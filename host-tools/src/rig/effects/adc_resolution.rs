//! A converter with fewer effective bits, on all channels.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "adc_resolution",
    what: "converter with fewer effective bits",
    size: "effective bits, whole",
    unit: "bit",
    forms: &[],
    universal: Sizes::new(9.0, 5.0, 12.0),
    pm_dc: Sizes::new(9.0, 5.0, 12.0),
    install: |size, _, rig| {
        for channel in &mut rig.channels {
            channel.bits = Some(size.round() as u32);
        }
    },
};
