//! A current sensor whose core keeps a little of the last current: z of Bouc and Wen, dz = (di/w) (1 − s z), s the
//! direction of the current, w = 5 % of the nominal peak current; the sensor shows c z less.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, Measured};

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "sensor_hysteresis",
    what: "current sensor that is behind the current by a fixed amount",
    size: "half the width of its loop",
    unit: "A",
    forms: &[],
    universal: Sizes::new(0.15, 0.01, 1.0),
    pm_dc: Sizes::new(0.05, 0.005, 0.5),
    install: |size, _, rig| {
        let w = 0.05 * rig.motor.nameplate.peak_current_a;
        let (mut last, mut z) = (0.0, 0.0f64);
        rig.channel(Measured::Current).sensors.push(Box::new(move |i: f64, _: &Instant, _: f64| {
            let step: f64 = i - last;
            let side = step.signum();
            z = side - (side - z) * (-step.abs() / w).exp();
            last = i;
            i - size * z
        }));
    },
};
