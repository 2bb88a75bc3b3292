//! Each sample of current and speed, predicted from the one before: what tells the course of the voltage between samples.
//!
//! For each course of the voltage ([`crate::between`]) the model starts at each measured state and runs to the next sample. The course with the smallest
//! error is taken: the likelihood of the one-step error, both noises of unknown size.

use greyrig::motor::{Motor, State, Stepper};

use crate::between::{Between, Course};
use crate::experiment::Experiment;

/// Fall of the error of prediction, mean of the logarithms of both signals, for which the smooth course is left. By chance two courses differ by
/// 1/√n at n samples, 0.02 at the 2,500 of a short recording.
const FOR_LESS_NOT: f64 = 0.02;

/// Shares of the interval that are tried first, and how often the distance is halved afterwards.
const SHARES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
const HALVINGS: usize = 5;

/// A recording along a course of the voltage that the user knows, or else the one that the data tell with a motor.
#[must_use]
pub fn along(e: Experiment, course: Option<Course>, motor: &Motor<f64>) -> Experiment {
    let known = match course {
        None => return as_told(e, motor),
        Some(Course::Smooth) => Between::Smooth,
        Some(Course::Linear) => Between::Linear,
        Some(Course::Held) => Between::Switched(0.0),
        Some(Course::Mean) => Between::Switched(1.0),
        Some(Course::Edges) => switched(&e, motor),
    };
    e.with_course(known, motor)
}

/// A recording along the course of the voltage that its data tell with a motor, where they are sampled slowly.
#[must_use]
pub fn as_told(e: Experiment, motor: &Motor<f64>) -> Experiment {
    if !e.is_slow(Some(motor)) {
        return e;
    }
    let told = choose(&e, motor);
    e.with_course(told, motor)
}

/// The course of the voltage that predicts each sample of current and speed best from the one before.
pub fn choose(e: &Experiment, motor: &Motor<f64>) -> Between {
    let misfit = |between: Between| misfit(e, motor, between);
    let switched = switched(e, motor);
    let [smooth, linear, jumps] = [Between::Smooth, Between::Linear, switched].map(misfit);
    if linear.min(jumps) > smooth - FOR_LESS_NOT || !linear.min(jumps).is_finite() {
        Between::Smooth
    } else if linear <= jumps {
        Between::Linear
    } else {
        switched
    }
}

/// The share of the interval, one for all edges, by which a supply is switched before a sample.
pub fn switched(e: &Experiment, motor: &Motor<f64>) -> Between {
    let at = |share: f64| (share, misfit(e, motor, Between::Switched(share)));
    let better = |a: (f64, f64), b: (f64, f64)| if b.1 < a.1 { b } else { a };
    let mut best = SHARES.map(at).into_iter().fold((0.0, f64::INFINITY), better);
    let mut distance = SHARES[1] - SHARES[0];
    for _ in 0..HALVINGS {
        distance *= 0.5;
        let beside = [best.0 - distance, best.0 + distance].into_iter().filter(|share| (0.0..=1.0).contains(share));
        best = beside.map(at).fold(best, better);
    }
    Between::Switched(best.0)
}

/// Mean of the logarithms of the RMS errors of current and speed, predicted from one sample to the next.
fn misfit(e: &Experiment, motor: &Motor<f64>, between: Between) -> f64 {
    let known: Vec<f64> = sums(&e.clone().with_course(between, motor), motor)
        .into_iter()
        .flatten()
        .map(|sums| 0.5 * (sums.error / sums.samples).max(f64::MIN_POSITIVE).ln())
        .collect();
    if known.is_empty() { f64::INFINITY } else { known.iter().sum::<f64>() / known.len() as f64 }
}

/// Sums of squares over the samples that count.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sums {
    /// Modelled − measured.
    pub error: f64,
    /// Measured.
    pub signal: f64,
    /// Their number.
    pub samples: f64,
}

/// Sums of squares of the errors with which current and speed are predicted from one sample to the next, and of the signals.
pub fn sums(e: &Experiment, motor: &Motor<f64>) -> [Option<Sums>; 2] {
    let mut sums = [Sums::default(); 2];
    let mut add = |k: usize, error: f64, signal: f64| {
        sums[k].error += error * error;
        sums[k].signal += signal * signal;
        sums[k].samples += 1.0;
    };
    let Some(current) = &e.current else { return [None; 2] };
    let Ok(stepper) = Stepper::with_substeps(motor.clone(), e.step_s(), e.substeps(motor).unwrap_or(1)) else {
        return [None; 2];
    };
    let rest = vec![0.0; e.len()];
    let speed = e.speed.as_ref().unwrap_or(&rest);
    e.short_runs(stepper, 1, [current, speed], |n, reading: State<f64>| {
        if !e.counted[n] || !e.counted[n - 1] {
            return;
        }
        if !e.is_open(n) {
            add(0, reading.current - current[n], current[n]);
        }
        if e.speed.is_some() && !e.is_locked(n) {
            add(1, reading.speed - speed[n], speed[n]);
        }
    });
    sums.map(|sums| (sums.samples > 0.0 && sums.error.is_finite()).then_some(sums))
}
