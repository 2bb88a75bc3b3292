//! A tacho or frequency-to-voltage converter that is slow: a first-order lag.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, Measured};

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "speed_lag",
    what: "speed sensor that lags",
    size: "time constant",
    unit: "s",
    forms: &[],
    universal: Sizes::new(10e-3, 0.5e-3, 0.2),
    pm_dc: Sizes::new(5e-3, 0.2e-3, 0.1),
    install: |size, _, rig| {
        let mut shown = 0.0;
        rig.channel(Measured::Speed).sensors.push(Box::new(move |omega: f64, _: &Instant, dt: f64| {
            shown += -(-dt / size).exp_m1() * (omega - shown);
            shown
        }));
    },
};
