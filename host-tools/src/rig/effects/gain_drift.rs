//! A gain that drifts as its amplifier warms up: 1 + g (1 − exp(−t/30 s)), of the current or of the speed channel.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, Measured};

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "gain_drift",
    what: "gain of a channel that drifts",
    size: "final error of the gain",
    unit: "",
    forms: &["current", "speed"],
    universal: Sizes::new(0.04, 0.002, 0.2),
    pm_dc: Sizes::new(0.04, 0.002, 0.2),
    install: |size, form, rig| {
        let channel = if form == "speed" { Measured::Speed } else { Measured::Current };
        let drift = move |value: f64, now: &Instant, _: f64| value * (1.0 - size * (-now.t / 30.0).exp_m1());
        rig.channel(channel).sensors.push(Box::new(drift));
    },
};
