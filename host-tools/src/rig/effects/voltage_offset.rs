//! Offset of the voltage sensor.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, Measured};

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "voltage_offset",
    what: "offset of the voltage sensor",
    size: "offset",
    unit: "V",
    forms: &[],
    universal: Sizes::new(2.0, -20.0, 20.0),
    pm_dc: Sizes::new(0.2, -4.0, 4.0),
    install: |size, _, rig| {
        rig.channel(Measured::Voltage).sensors.push(Box::new(move |x: f64, _: &Instant, _: f64| x + size));
    },
};
