//! What measured and modelled signals pass through before they are compared, and the direction of a measured motion.

use greyrig::butterworth::{self, Cascade, Settings};
use serde::{Deserialize, Serialize};

/// A speed below this share of the largest does not tell the direction of motion.
const STANDSTILL_SHARE: f64 = 0.005;

/// Highest cut-off as a fraction of the sampling rate that a slow recording is filtered with.
const LARGEST_CUTOFF_RATIO: f64 = 0.25;

/// Settling times of the filter that a recording has to last.
pub const FEWEST_SETTLINGS: usize = 4;

/// The filter that measured and modelled signals go through before they are compared.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Filter {
    /// Order of the Butterworth low-pass.
    pub order: u8,
    /// Cut-off, Hz.
    pub cutoff_hz: f64,
}

impl Default for Filter {
    fn default() -> Self {
        let usual = butterworth::Settings::default();
        Self { order: usual.order, cutoff_hz: usual.cutoff_hz }
    }
}

impl Filter {
    /// The same at a sampling interval, s, with a cut-off that it can carry.
    pub fn at(&self, interval_s: f64) -> Settings {
        let rate = 1.0 / interval_s;
        let cutoff_hz = self.cutoff_hz.min(LARGEST_CUTOFF_RATIO * rate);
        Settings { order: self.order, cutoff_hz, sample_rate_hz: rate }
    }
}

/// Runs a low-pass forward and backward, with the ends continued by point reflection.
pub fn zero_phase(signal: &[f64], settings: Settings) -> Option<Vec<f64>> {
    let coefficients = settings.build::<f64>().ok()?;
    let pad = (settings.settling_samples().ok()? as usize * 2).min(signal.len().saturating_sub(1));
    let (first, last) = (*signal.first()?, *signal.last()?);
    let mut padded: Vec<f64> = (1..=pad).rev().map(|k| 2.0 * first - signal[k]).collect();
    padded.extend_from_slice(signal);
    padded.extend((1..=pad).map(|k| 2.0 * last - signal[signal.len() - 1 - k]));
    for _ in 0..2 {
        let mut cascade = Cascade::default();
        cascade.reset_to(padded[0]);
        for x in &mut padded {
            *x = cascade.process(&coefficients, *x);
        }
        padded.reverse();
    }
    Some(padded[pad..pad + signal.len()].to_vec())
}

/// The direction of motion of each sample; 0 where the speed is too small to tell.
pub fn directions(speed: &[f64]) -> Vec<f64> {
    let largest = speed.iter().fold(0.0f64, |m, w| m.max(w.abs()));
    speed.iter().map(|w| if w.abs() <= STANDSTILL_SHARE * largest { 0.0 } else { w.signum() }).collect()
}

/// Direction of motion; 0 where the speed is below half its resolution.
pub fn directions_by_quantum(speed: &[f64]) -> Vec<f64> {
    let quantum = speed.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    let quantised = speed.windows(2).filter(|w| w[0] == w[1]).count() * 4 > speed.len();
    if !quantised || !quantum.is_finite() {
        return speed.iter().map(|w| if *w == 0.0 { 0.0 } else { w.signum() }).collect();
    }
    speed.iter().map(|w| if w.abs() < 0.5 * quantum { 0.0 } else { w.signum() }).collect()
}
