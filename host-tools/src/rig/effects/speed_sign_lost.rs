//! A pulse counter: the speed without its sign.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, Measured};

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "speed_sign_lost",
    what: "speed sensor that loses the sign",
    size: "none: it does or does not",
    unit: "",
    forms: &[],
    universal: None,
    pm_dc: Sizes::new(1.0, 1.0, 1.0),
    install: |_, _, rig| {
        rig.channel(Measured::Speed).sensors.push(Box::new(|omega: f64, _: &Instant, _: f64| omega.abs()))
    },
};
