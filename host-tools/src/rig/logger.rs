//! What stands between a rig's samples and a file of others: a speed that is counted, averaged or held, and a logger
//! that keeps one sample of several.

use std::f64::consts::TAU;

use super::SAMPLE_RATE_HZ;
use crate::error::{Error, Result};
use crate::recording::{Channel, InvalidRecording, Recording};
use crate::speed_sensor::{self, SpeedSensor};

/// Distance of a rate from a whole part of the rig's that is a matter of digits.
const ROUNDED: f64 = 1e-6;

/// A logger. The default one keeps each sample as it is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Logger {
    /// Samples a second that are kept, a whole part of the rig's 10,000; none: all.
    pub rate_hz: Option<f64>,
    /// How the speed is measured, if it is not sampled.
    pub speed_sensor: Option<SpeedSensor>,
}

impl Logger {
    /// What it writes of a rig's recording; how the speed was measured is told in the metadata.
    ///
    /// # Errors
    /// A rate that is no whole part of the rig's.
    pub fn record(&self, recording: &Recording) -> Result<Recording> {
        let rate_hz = self.rate_hz.unwrap_or(SAMPLE_RATE_HZ);
        let every = SAMPLE_RATE_HZ / rate_hz;
        if !(every >= 1.0 && (every - every.round()).abs() < ROUNDED * every) {
            return Err(Error::usage(
                format!("a logger cannot keep {rate_hz} samples a second of the rig's {SAMPLE_RATE_HZ}"),
                "give a whole part of it: 5000, 2000, 1000, 500, 200, 100 or 50, say",
            ));
        }
        let mut seen = recording.clone();
        if let (Some(sensor), Some(speed)) = (self.speed_sensor, recording.channel(Channel::Speed)) {
            seen.set_channel(Channel::Speed, shown(sensor, speed, recording.sample_time_s())).map_err(invalid)?;
            seen.set_metadata(speed_sensor::KEY, sensor.to_string());
        }
        if every.round() == 1.0 {
            return Ok(seen);
        }
        one_of(&seen, every.round() as usize).map_err(invalid)
    }
}

/// One sample of so many.
///
/// # Errors
/// Nothing is left.
pub fn one_of(recording: &Recording, every: usize) -> std::result::Result<Recording, InvalidRecording> {
    let kept = |x: &[f64]| x.iter().copied().step_by(every).collect::<Vec<f64>>();
    let flags = |x: &[bool]| x.iter().copied().step_by(every).collect::<Vec<bool>>();
    let builder = Recording::builder(recording.sample_time_s() * every as f64)
        .path(recording.path())
        .rotor_locked(flags(recording.rotor_locked()))
        .supply_open(flags(recording.supply_open()))
        .metadata(recording.metadata().clone());
    recording.channels().iter().fold(builder, |builder, (channel, x)| builder.channel(*channel, kept(x))).build()
}

/// What the rig has made is no recording any more.
fn invalid(error: InvalidRecording) -> Error {
    Error::usage(format!("nothing is left of the recording: {error}"), "keep more samples a second, or record longer")
}

/// What a sensor shows of a speed, rad/s, that is sampled every so many seconds.
fn shown(sensor: SpeedSensor, speed: &[f64], interval_s: f64) -> Vec<f64> {
    let window = sensor.window_s().map_or(1, |window_s| (window_s / interval_s).round().max(1.0) as usize);
    match sensor {
        SpeedSensor::Period { pulses } => timed(speed, interval_s, pulses),
        SpeedSensor::Counts { pulses, .. } => counted(speed, interval_s, pulses, window),
        SpeedSensor::Mean { .. } => {
            let angle = angle(speed, interval_s);
            at_window_ends(speed.len(), window, |n| (angle[n] - angle[n - window]) / (window as f64 * interval_s))
        }
        SpeedSensor::Held { .. } => at_window_ends(speed.len(), window, |n| speed[n]),
    }
}

/// A value at the end of each window, shown until the next; zero before the first.
fn at_window_ends(length: usize, window: usize, value: impl Fn(usize) -> f64) -> Vec<f64> {
    let shown = |n: usize| if n < window { 0.0 } else { value(n / window * window) };
    (0..length).map(shown).collect()
}

/// Angle at each sample, rad, of a speed that is straight between them.
pub fn angle(speed: &[f64], interval_s: f64) -> Vec<f64> {
    let (mut angle, mut before) = (0.0, speed.first().copied().unwrap_or_default());
    let step = |w: &f64| {
        angle += 0.5 * (before + w) * interval_s;
        before = *w;
        angle
    };
    speed.iter().map(step).collect()
}

/// The speed, rad/s, by an encoder's pulses in windows of so many samples.
pub fn counted(speed: &[f64], interval_s: f64, pulses: u32, window: usize) -> Vec<f64> {
    let step = TAU / f64::from(pulses);
    let counts: Vec<f64> = angle(speed, interval_s).into_iter().map(|a| (a / step).floor()).collect();
    let by_count = |n: usize| (counts[n] - counts[n - window]) * step / (window as f64 * interval_s);
    at_window_ends(speed.len(), window, by_count)
}

/// The speed, rad/s, by the time between the last two pulses, held until the next.
pub fn timed(speed: &[f64], interval_s: f64, pulses: u32) -> Vec<f64> {
    let step = TAU / f64::from(pulses);
    let turned = angle(speed, interval_s);
    let (mut last, mut shown, mut direction) = (None::<f64>, 0.0, 0.0);
    let mut out = vec![0.0];
    for n in 1..speed.len() {
        let (a, b) = (turned[n - 1] / step, turned[n] / step);
        if a.floor() != b.floor() {
            // A counter that sees the direction begins anew where it changes.
            if (b - a) * direction < 0.0 {
                last = None;
            }
            direction = b - a;
            let edge = if b > a { b.floor() } else { a.floor() };
            let instant = (n as f64 - 1.0 + (edge - a) / (b - a)) * interval_s;
            if let Some(before) = last {
                shown = (b - a).signum() * step / (instant - before).max(1e-9);
            }
            last = Some(instant);
        }
        out.push(shown);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_encoder_shows_whole_pulses() {
        // 100 rad/s for 1 s are 15.9 turns, 1910 pulses of 120 a turn: 19 or 20 of them in 10 ms.
        let speed = vec![100.0; 10_001];
        let shown = counted(&speed, 1e-4, 120, 100);
        let pulse = TAU / 120.0 / 0.01;
        assert!(shown[..100].iter().all(|w| *w == 0.0));
        assert!(shown[100..].iter().all(|w| (w / pulse).round() * pulse == *w && (w - 100.0).abs() < pulse));
        let mean = shown[100..10_000].iter().sum::<f64>() / 9900.0;
        assert!((mean - 100.0).abs() < pulse / 99.0, "{mean}: counts lose nothing from window to window");
    }

    #[test]
    fn pulses_tell_the_mean_speed_since_the_one_before() {
        // ω = 10 t: a turn takes as long as from √(0.4 π k) to √(0.4 π (k + 1)).
        let ramp: Vec<f64> = (0..50_000).map(|n| f64::from(n) * 1e-3).collect();
        let shown = timed(&ramp, 1e-4, 1);
        for k in 2..19u32 {
            let at = |k: u32| (0.4 * std::f64::consts::PI * f64::from(k)).sqrt();
            let (from, to) = (at(k), at(k + 1));
            let n = (1e4 * to).ceil() as usize;
            assert!((shown[n] * (to - from) / TAU - 1.0).abs() < 1e-6, "turn {k}: {}", shown[n]);
            assert!((shown[n - 1] * (from - at(k - 1)) / TAU - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn means_and_holds_of_a_ramp() {
        let ramp: Vec<f64> = (0..50).map(f64::from).collect();
        let mean = shown(SpeedSensor::Mean { window_s: 1.0 }, &ramp, 0.1);
        let held = shown(SpeedSensor::Held { window_s: 1.0 }, &ramp, 0.1);
        assert!((mean[20] - 15.0).abs() < 1e-9 && mean[29] == mean[20] && (mean[30] - 25.0).abs() < 1e-9);
        assert_eq!((held[9], held[10], held[19], held[20]), (0.0, 10.0, 10.0, 20.0));
    }
}
