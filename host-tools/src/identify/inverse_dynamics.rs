//! The mechanical side alone, from measured torque (or force) and motion.
//!
//! In a position-controlled drive the controller hides friction from the position, so the torque is compared: `T = J
//! dω/dt + s μ0 + μ1 ω + μ2 ω|ω| + …`, linear least squares ("inverse dynamic identification model"). All columns are
//! formed on the raw samples; then every column and the target go through one zero-phase Butterworth low-pass, whose
//! cut-off is found from the data.
//!
//! Source: A. Janot, P.-O. Vandanjon, M. Gautier: A generic instrumental variable approach for industrial robot
//! identification, IEEE Trans. Control Systems Technology 22 (2014) 132–145, for the procedure.

use std::f64::consts::PI;

use greyrig::butterworth::Settings;
use greyrig::motor::BaseParameter;
use nalgebra::{DMatrix, DVector};
use realfft::RealFftPlanner;

use super::space::{Entry, Freedom, Key, Space};
use crate::experiment::{Experiment, derivative};
use crate::filtering::{directions_by_quantum, zero_phase};

/// Noise that the cut-off may let through, relative to the signal.
const NOISE_SHARE: f64 = 0.02;
/// Share of the signal's power that the cut-off must keep.
const SIGNAL_SHARE: f64 = 0.99;
/// Order of the zero-phase low-pass.
const ORDER: u8 = 4;

/// Columns of the regression of all recordings together, after the filter.
#[derive(Debug, Clone)]
pub struct Columns {
    /// Index into the space's entries of each column.
    pub entries: Vec<usize>,
    /// The columns.
    pub matrix: DMatrix<f64>,
    /// Torque.
    pub target: DVector<f64>,
    /// Recording and time block base of each row: (recording, seconds).
    pub times: Vec<(usize, f64)>,
}

/// Power spectral density by Welch's method (Hann window, half overlap); frequencies are multiples of the second value.
fn spectrum(signal: &[f64], rate_hz: f64) -> (Vec<f64>, f64) {
    let length = signal.len().min(8192);
    let mut planner = RealFftPlanner::<f64>::new();
    let fft = planner.plan_fft_forward(length);
    let window: Vec<f64> = (0..length).map(|k| 0.5 - 0.5 * (2.0 * PI * k as f64 / length as f64).cos()).collect();
    let mut density = vec![0.0; length / 2 + 1];
    let mut start = 0;
    while start + length <= signal.len() {
        let piece = &signal[start..start + length];
        let mean = piece.iter().sum::<f64>() / length as f64;
        let mut input: Vec<f64> = piece.iter().zip(&window).map(|(x, w)| (x - mean) * w).collect();
        let mut output = fft.make_output_vec();
        if fft.process(&mut input, &mut output).is_ok() {
            for (d, y) in density.iter_mut().zip(&output) {
                *d += y.norm_sqr();
            }
        }
        start += (length / 2).max(1);
    }
    (density, rate_hz / length as f64)
}

/// The cut-off, Hz, from the spectrum of the highest derivative that the regression uses: low enough that white noise
/// of the measured motion stays below 2 % of the derivative, and no higher than where the signal ends.
pub fn automatic_cutoff_hz(motion: &[f64], derivatives: i32, interval_s: f64) -> f64 {
    let rate = 1.0 / interval_s;
    let mut signal = motion.to_vec();
    for _ in 0..derivatives {
        signal = signal.windows(2).map(|w| (w[1] - w[0]) * rate).collect();
    }
    let (density, step) = spectrum(&signal, rate);
    let frequency = |k: usize| k as f64 * step;
    let response = |k: usize| (2.0 * (PI * frequency(k) / rate).sin() * rate).powi(2 * derivatives);
    let high: Vec<f64> = (0..density.len())
        .filter(|k| frequency(*k) > 0.25 * rate && frequency(*k) < 0.48 * rate)
        .map(|k| density[k] / response(k))
        .collect();
    let noise_level = high.iter().sum::<f64>() / high.len().max(1) as f64;
    let noise = |k: usize| noise_level * response(k);
    let (mut signal_sum, mut noise_sum, mut by_noise) = (0.0, 0.0, step);
    for (k, d) in density.iter().enumerate().skip(1) {
        signal_sum += d;
        noise_sum += noise(k);
        if noise_sum <= NOISE_SHARE * NOISE_SHARE * signal_sum {
            by_noise = frequency(k);
        }
    }
    let smooth = |k: usize| {
        let range = k.saturating_sub(2)..(k + 3).min(density.len());
        density[range.clone()].iter().sum::<f64>() / range.len() as f64
    };
    let end = (1..density.len()).find(|k| smooth(*k) < 2.0 * noise(*k)).unwrap_or(density.len() - 1);
    let power: Vec<f64> = (1..=end).map(|k| (density[k] - noise(k)).max(0.0)).collect();
    let total: f64 = power.iter().sum();
    let mut sum = 0.0;
    let by_signal = power
        .iter()
        .position(|p| {
            sum += p;
            sum >= SIGNAL_SHARE * total
        })
        .map_or(by_noise, |k| frequency(k + 1));
    by_noise.min(by_signal).clamp(4.0 * step, 0.2 * rate)
}

/// Whether a parameter belongs to the voltage balance.
fn is_electrical(entry: &Entry) -> bool {
    entry.key.base().is_some_and(BaseParameter::is_electrical)
}

/// Forms and filters the columns of all recordings.
pub fn columns(space: &Space, experiments: &[Experiment], cutoff_hz: f64) -> Option<Columns> {
    let entries: Vec<usize> = (0..space.entries.len())
        .filter(|k| !is_electrical(&space.entries[*k]))
        .filter(|k| matches!(space.entries[*k].freedom, Freedom::Free(_)))
        .collect();
    let mut rows: Vec<Vec<f64>> = vec![Vec::new(); entries.len()];
    let (mut target, mut times) = (Vec::new(), Vec::new());
    for (recording, e) in experiments.iter().enumerate() {
        let speed = e.speed.as_ref()?;
        let settings = Settings { order: ORDER, cutoff_hz, sample_rate_hz: 1.0 / e.interval_s };
        let acceleration = derivative(speed, e.interval_s);
        let direction = directions_by_quantum(speed);
        let trim = ((2.0 / cutoff_hz) / e.interval_s) as usize;
        let stride = ((1.0 / (4.0 * cutoff_hz * e.interval_s)) as usize).max(1);
        let keep: Vec<usize> =
            (trim..speed.len().saturating_sub(trim)).step_by(stride).filter(|n| e.counted[*n]).collect();
        let mut known = vec![0.0; speed.len()];
        let unit = |k: usize, value: f64| {
            let mut one = space.clone();
            for (j, entry) in one.entries.iter_mut().enumerate() {
                if !entry.key.base().is_some_and(BaseParameter::is_positive) {
                    entry.value = if j == k { value } else { 0.0 };
                }
                entry.freedom = Freedom::Fixed;
            }
            one.motor_at(&[]).ok()
        };
        for (k, entry) in space.entries.iter().enumerate() {
            let column: Vec<f64> = if entry.key == Key::Base(BaseParameter::J) {
                acceleration.clone()
            } else {
                let motor = unit(k, 1.0)?;
                speed.iter().zip(&direction).map(|(w, s)| motor.load_torque(*w, *s)).collect()
            };
            match (entries.iter().position(|j| *j == k), entry.freedom) {
                (Some(place), _) => {
                    let filtered = zero_phase(&column, settings)?;
                    rows[place].extend(keep.iter().map(|n| filtered[*n]));
                }
                (None, Freedom::Fixed | Freedom::Pinned) if !is_electrical(entry) => {
                    for (sum, x) in known.iter_mut().zip(&column) {
                        *sum += entry.value * x;
                    }
                }
                _ => {}
            }
        }
        let torque: Vec<f64> = e.input.iter().zip(&known).map(|(t, k)| t - k).collect();
        let filtered = zero_phase(&torque, settings)?;
        target.extend(keep.iter().map(|n| filtered[*n]));
        times.extend(keep.iter().map(|n| (recording, *n as f64 * e.interval_s)));
    }
    let matrix = DMatrix::from_fn(target.len(), entries.len(), |r, c| rows[c][r]);
    Some(Columns { entries, matrix, target: DVector::from_vec(target), times })
}
