//! Each sample of current and speed, predicted from the one before: what tells the course of the voltage between
//! samples.
//!
//! For each course of the voltage ([`crate::between`]) the model starts at each measured state and runs to the next
//! sample. The course with the smallest error is taken: the likelihood of the one-step error, both noises of unknown
//! size.

use greyrig::motor::{Motor, State, Stepper};

use crate::between::{Between, Course};
use crate::experiment::Experiment;
use crate::noise;

/// Fall of the error of prediction, mean of the logarithms of both signals, for which the smooth course is left. By
/// chance two courses differ by 1/√n at n samples, 0.02 at the 2,500 of a short recording.
const FOR_LESS_NOT: f64 = 0.02;

/// Shares of the interval that are tried first, and how often the distance is halved afterwards.
const SHARES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
const HALVINGS: usize = 5;
/// A usual share this close to 0 or 1 is that: twice the last distance looked at, and what noise does to a median.
const NEAR_AN_END: f64 = 0.04;

/// Least step of a hard edge, as a share of the largest voltage, and in standard deviations of its noise.
const HARD: f64 = 0.05;
const ABOVE_NOISE: f64 = 20.0;
/// Largest change of the voltage beside it, as a share of its step.
const STILL: f64 = 0.04;
/// Fall of the squared error of prediction, in its variance, that tells an edge's instant from the usual one: three
/// standard deviations.
const ANOTHER: f64 = 9.0;
/// Median of the magnitude of a Gaussian variable, in standard deviations.
const MEDIAN: f64 = 0.674_490;

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
    if e.is_slow(Some(motor)) { choose(&e, motor) } else { e }
}

/// A recording along the course of its voltage that predicts each sample of current and speed best from the one before;
/// a hard edge that lies elsewhere than that course has it gets an instant of its own.
fn choose(e: &Experiment, motor: &Motor<f64>) -> Experiment {
    let along = |between: Between| {
        let along = with_own_instants(e.clone().with_course(between, motor), motor);
        (misfit(&along, motor), along)
    };
    let (smooth, as_smooth) = along(Between::Smooth);
    let [linear, switched] = [Between::Linear, switched(e, motor)].map(along);
    let (best, along) = if linear.0 <= switched.0 { linear } else { switched };
    if best < smooth - FOR_LESS_NOT { along } else { as_smooth }
}

/// The share of the interval by which a supply is switched before a sample: the usual one of its hard edges or, without
/// any, the one that predicts best.
fn switched(e: &Experiment, motor: &Motor<f64>) -> Between {
    let shares: Vec<f64> =
        Edges::of(e, motor).map_or_else(Vec::new, |edges| edges.samples.iter().map(|n| edges.best(*n).0).collect());
    let share = if shares.is_empty() {
        let at = |share: f64| misfit(&e.clone().with_course(Between::Switched(share), motor), motor);
        least(at).0
    } else {
        noise::median(shares)
    };
    Between::Switched(if share < NEAR_AN_END {
        0.0
    } else if share > 1.0 - NEAR_AN_END {
        1.0
    } else {
        share
    })
}

/// The share from 0 to 1 at which a function is least, and its value there.
fn least(of: impl Fn(f64) -> f64) -> (f64, f64) {
    let at = |share: f64| (share, of(share));
    let better = |a: (f64, f64), b: (f64, f64)| if b.1 < a.1 { b } else { a };
    let mut best = SHARES.map(at).into_iter().fold((0.0, f64::INFINITY), better);
    let mut distance = SHARES[1] - SHARES[0];
    for _ in 0..HALVINGS {
        distance *= 0.5;
        let beside = [best.0 - distance, best.0 + distance].into_iter().filter(|share| (0.0..=1.0).contains(share));
        best = beside.map(at).fold(best, better);
    }
    best
}

/// Hard edges that lie elsewhere than the course of the voltage has them, each at its own instant.
fn with_own_instants(mut e: Experiment, motor: &Motor<f64>) -> Experiment {
    if e.is_as_sampled() {
        return e;
    }
    let instants = match Edges::of(&e, motor) {
        Some(edges) => edges.samples.iter().filter_map(|n| edges.own(*n)).collect(),
        None => return e,
    };
    e.instants = instants;
    e
}

/// Hard edges of the voltage, and how a motor predicts the samples after them.
struct Edges<'a> {
    experiment: &'a Experiment,
    motor: &'a Motor<f64>,
    measured: [Vec<f64>; 2],
    /// Standard deviations of the error of prediction of current, A, and speed, rad/s, away from edges.
    deviations: [f64; 2],
    /// Samples after an edge.
    samples: Vec<usize>,
}

impl<'a> Edges<'a> {
    fn of(experiment: &'a Experiment, motor: &'a Motor<f64>) -> Option<Self> {
        let e = experiment;
        let measured = [e.current.clone()?, e.speed.clone()?];
        let largest = e.input.iter().fold(0.0f64, |m, u| m.max(u.abs()));
        let noise = noise::of_differences(&e.input);
        let change = |n: usize| (e.input[n] - e.input[n - 1]).abs();
        let is_hard = |n: &usize| {
            let [before, after] = [n - 1, n + 1].map(|n| if n == 0 { 0.0 } else { change(n) });
            change(*n) > (HARD * largest).max(ABOVE_NOISE * noise)
                && before.max(after) < STILL * change(*n) + 4.0 * noise
                && [n - 1, *n].iter().all(|n| e.counted[*n] && !e.is_open(*n) && !e.is_locked(*n))
        };
        let samples = (1..e.len().saturating_sub(1)).filter(is_hard).collect();
        let mut errors: [Vec<f64>; 2] = Default::default();
        let stepper = Stepper::with_substeps(motor.clone(), e.step_s(), e.substeps(motor).ok()?).ok()?;
        e.short_runs(stepper, 1, [&measured[0], &measured[1]], |n, shown: State<f64>| {
            errors[0].push((shown.current - measured[0][n]).abs());
            errors[1].push((shown.speed - measured[1][n]).abs());
        });
        let deviations = errors.map(|errors| noise::median(errors) / MEDIAN);
        deviations.iter().all(|d| *d > 0.0).then_some(Self { experiment, motor, measured, deviations, samples })
    }

    /// Sum of the squares of the errors after an edge, in their usual deviations, along a course of the voltage.
    fn off(&self, n: usize, along: &Experiment) -> f64 {
        let Ok(stepper) = along
            .substeps(self.motor)
            .and_then(|substeps| Stepper::with_substeps(self.motor.clone(), along.step_s(), substeps))
        else {
            return f64::INFINITY;
        };
        let mut stepper = stepper;
        let shown = along.after_an_interval(&mut stepper, n, [&self.measured[0], &self.measured[1]]);
        let errors = [shown.current - self.measured[0][n], shown.speed - self.measured[1][n]];
        let sum: f64 = errors.iter().zip(self.deviations).map(|(error, deviation)| (error / deviation).powi(2)).sum();
        if sum.is_finite() { sum } else { f64::INFINITY }
    }

    /// The instant at which an edge is predicted best, as a share of the interval, and how far off it is then.
    fn best(&self, n: usize) -> (f64, f64) {
        let e = self.experiment;
        // The interval and the samples beside it are all that a run over it asks for.
        let from = n.saturating_sub(2);
        let around = e.head(n + 2).tail(from);
        let measured = [0, 1].map(|k| self.measured[k][from..n + 2].to_vec());
        let local = Edges {
            experiment: &around,
            motor: self.motor,
            measured,
            deviations: self.deviations,
            samples: Vec::new(),
        };
        let at = |share: f64| local.off(n - from, &around.clone().with_course(Between::Switched(share), self.motor));
        least(at)
    }

    /// The instant of an edge, if it tells the course from another by what chance does not: three standard deviations.
    fn own(&self, n: usize) -> Option<(usize, f64)> {
        let (share, off) = self.best(n);
        (self.off(n, self.experiment) > off + ANOTHER).then_some((n, share))
    }
}

/// Mean of the logarithms of the RMS errors of current and speed, predicted from one sample to the next.
fn misfit(e: &Experiment, motor: &Motor<f64>) -> f64 {
    let known: Vec<f64> = sums(e, motor)
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

/// Sums of squares of the errors with which current and speed are predicted from one sample to the next, and of the
/// signals.
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
