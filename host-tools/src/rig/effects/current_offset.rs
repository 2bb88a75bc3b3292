//! Offset of the current sensor.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, Measured};

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "current_offset",
    what: "offset of the current sensor",
    size: "offset",
    unit: "A",
    forms: &[],
    universal: Sizes::new(0.1, -2.0, 2.0),
    pm_dc: Sizes::new(0.05, -2.0, 2.0),
    install: |size, _, rig| {
        rig.channel(Measured::Current).sensors.push(Box::new(move |x: f64, _: &Instant, _: f64| x + size));
    },
};
