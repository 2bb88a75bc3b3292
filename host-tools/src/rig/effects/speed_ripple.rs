//! Ripple of a tacho that runs out of true: once and, less, twice a turn.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, Measured};

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "speed_ripple",
    what: "tacho ripple once and twice a turn",
    size: "relative amplitude",
    unit: "",
    forms: &[],
    universal: Sizes::new(0.01, 0.001, 0.1),
    pm_dc: Sizes::new(0.01, 0.001, 0.1),
    install: |size, _, rig| {
        rig.channel(Measured::Speed).sensors.push(Box::new(move |omega: f64, now: &Instant, _: f64| {
            omega * (1.0 + size * (now.theta.cos() + 0.4 * (2.0 * now.theta).cos()))
        }));
    },
};
