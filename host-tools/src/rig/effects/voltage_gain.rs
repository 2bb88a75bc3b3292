//! Gain error of the voltage sensor. A scale of the base parameters hides it completely.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, Measured};

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "voltage_gain",
    what: "gain error of the voltage sensor",
    size: "relative error",
    unit: "",
    forms: &[],
    universal: Sizes::new(0.03, -0.2, 0.2),
    pm_dc: Sizes::new(0.03, -0.2, 0.2),
    install: |size, _, rig| {
        rig.channel(Measured::Voltage).sensors.push(Box::new(move |x: f64, _: &Instant, _: f64| (1.0 + size) * x));
    },
};
