//! A current channel that is late: a digital filter, a slow sensor, sampling in sequence. Linear between integration
//! steps.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, Measured, Sensor};
use std::collections::VecDeque;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "channel_delay",
    what: "current channel that is late",
    size: "delay",
    unit: "s",
    forms: &[],
    universal: Sizes::new(100e-6, 5e-6, 5e-3),
    pm_dc: Sizes::new(100e-6, 5e-6, 5e-3),
    install: |size, _, rig| {
        rig.channel(Measured::Current).sensors.push(Box::new(Late { delay: size, past: VecDeque::new() }))
    },
};

struct Late {
    delay: f64,
    /// The newest value first.
    past: VecDeque<f64>,
}

impl Sensor for Late {
    fn sense(&mut self, value: f64, _now: &Instant, dt: f64) -> f64 {
        let steps = self.delay / dt;
        let whole = steps as usize;
        self.past.push_front(value);
        self.past.truncate(whole + 2);
        // Before the run the current was zero.
        let at = |n: usize| self.past.get(n).copied().unwrap_or(0.0);
        at(whole) + (steps - whole as f64) * (at(whole + 1) - at(whole))
    }
}
