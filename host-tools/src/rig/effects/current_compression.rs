//! A current sensor whose core saturates: a arctan(i/a), a from the compression at nominal peak current.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, Measured};

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "current_compression",
    what: "current sensor that compresses high currents",
    size: "fraction lost at nominal peak current",
    unit: "",
    forms: &[],
    universal: Sizes::new(0.05, 0.005, 0.3),
    pm_dc: Sizes::new(0.05, 0.005, 0.3),
    install: |size, _, rig| {
        let peak = rig.motor.nameplate.peak_current_a;
        // arctan(z)/z falls from 1 towards 0 without turning: bisection cannot miss.
        let (mut low, mut high) = (1e-6, 1e3);
        for _ in 0..60 {
            let z: f64 = 0.5 * (low + high);
            if 1.0 - z.atan() / z < size {
                low = z;
            } else {
                high = z;
            }
        }
        let a = peak / low;
        rig.channel(Measured::Current).sensors.push(Box::new(move |i: f64, _: &Instant, _: f64| a * (i / a).atan()));
    },
};
