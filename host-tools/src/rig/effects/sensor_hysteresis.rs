//! A current sensor whose core keeps a little of the last current: the mean of ten plays with widths spread evenly up
//! to 10 % of the nominal peak current, of which the sensor shows its lag behind the current, scaled to c at large
//! amplitude.

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
        let widest = 0.1 * rig.motor.nameplate.peak_current_a;
        let widths: [f64; 10] = std::array::from_fn(|k| widest * (k as f64 + 1.0) / 10.0);
        let mut centres = [0.0; 10];
        rig.channel(Measured::Current).sensors.push(Box::new(move |i: f64, _: &Instant, _: f64| {
            let mut lag = 0.0;
            for (centre, w) in centres.iter_mut().zip(widths) {
                *centre = f64::clamp(*centre, i - w, i + w);
                lag += (i - *centre) / (10.0 * w);
            }
            i - size * lag
        }));
    },
};
