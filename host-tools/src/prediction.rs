//! Each sample of current and speed, predicted from the one before: what tells the course of the voltage between
//! samples.
//!
//! For each course of the voltage ([`crate::between`]) the model starts at each measured state and runs to the next
//! sample. The course with the smallest error is taken: the likelihood of the one-step error, both noises of unknown
//! size.

use greyrig::motor::{Motor, State, Stepper};

use crate::between::{Between, Course};
use crate::counts::Window;
use crate::edges::{Common, Share, UNKNOWN};
use crate::experiment::Experiment;
use crate::noise;
use crate::speed_sensor::SpeedSensor;

/// Fall of the error of prediction, mean of the logarithms of both signals, for which the smooth course is left. By
/// chance two courses differ by 1/√n at n samples, 0.02 at the 2,500 of a short recording.
pub(crate) const FOR_LESS_NOT: f64 = 0.02;

/// Shares of the interval that are tried first, and how often the distance is halved afterwards.
const SHARES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
const HALVINGS: usize = 5;
/// Standard deviations of what all edges have in common within which that is 0 or 1, as of a supply that is switched by
/// the clock that samples, and the least distance: the last one looked at.
const NEAR_AN_END: f64 = 3.0;
const LEAST_NEAR: f64 = 0.008;
/// Distance from an end within which both ends lie: the intervals of the edges tell nothing.
const BOTH_ENDS: f64 = 0.5;
/// Gains of the observer that predicts.
const GAINS: [f64; 3] = [1.0, 0.3, 0.0];
/// Distance from the best share at which its variance is looked for, and how far beyond the interval an instant is
/// believed to lie, as a share of it.
const BESIDE: f64 = 1.0 / 32.0;
const BEYOND: f64 = 0.25;

/// Courses along which the usual error of prediction is looked for: that of the best.
const COURSES: [Between; 4] = [Between::Linear, Between::Switched(0.0), Between::Switched(0.5), Between::Switched(1.0)];

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
    with_window_told(along_course(e, course, motor), motor)
}

fn along_course(e: Experiment, course: Option<Course>, motor: &Motor<f64>) -> Experiment {
    let known = match course {
        None => return as_told(e, motor),
        Some(Course::Smooth) => Between::Smooth,
        Some(Course::Linear) => Between::Linear,
        Some(Course::Held) => Between::Switched(0.0),
        Some(Course::Mean) => Between::Switched(1.0),
        Some(Course::Edges) => {
            let common = Edges::of(&e, motor).and_then(|edges| edges.in_common());
            switched(&e, common.as_ref(), motor)
        }
    };
    e.with_course(known, motor)
}

/// A recording along the course of the voltage that its data tell with a motor, where they are sampled slowly.
#[must_use]
pub fn as_told(e: Experiment, motor: &Motor<f64>) -> Experiment {
    if e.is_slow(Some(motor)) { choose(&e, motor) } else { e }
}

/// What a speed shows that is held over several samples by nobody knows what: the mean over its window or the speed at
/// the end of it, whichever predicts better.
fn with_window_told(mut e: Experiment, motor: &Motor<f64>) -> Experiment {
    let Some(window) = e.window.filter(|window| window.samples > 1 && e.sensor.is_none()) else { return e };
    let mut with = |is_mean: bool| {
        e.window = Some(Window { is_mean, ..window });
        misfit(&e, motor)
    };
    let is_mean = with(true) <= with(false);
    e.window = Some(Window { is_mean, ..window });
    let window_s = window.samples as f64 * e.interval_s;
    e.sensor = Some(if is_mean { SpeedSensor::Mean { window_s } } else { SpeedSensor::Held { window_s } });
    e
}

/// A recording along the course of its voltage that predicts each sample of current and speed best from the one before;
/// a hard edge that lies elsewhere than that course has it gets an instant of its own.
fn choose(e: &Experiment, motor: &Motor<f64>) -> Experiment {
    let edges = Edges::of(e, motor).and_then(|edges| Some((edges.in_common()?, edges)));
    let along = |between: Between| {
        let mut along = e.clone().with_course(between, motor);
        if let Some((common, edges)) = edges.as_ref().filter(|_| !along.is_as_sampled()) {
            along.instants = common.told.iter().filter_map(|told| edges.own(&along, common, told)).collect();
        }
        (misfit(&along, motor), along)
    };
    let (smooth, as_smooth) = along(Between::Smooth);
    let usual = switched(e, edges.as_ref().map(|(common, _)| common), motor);
    let [linear, switched] = [Between::Linear, usual].map(along);
    let (best, along) = if linear.0 <= switched.0 { linear } else { switched };
    if best < smooth - FOR_LESS_NOT { along } else { as_smooth }
}

/// The share of the interval by which a supply is switched before a sample: what its hard edges have in common or,
/// without any, that of a supply that is held or of one that was averaged, whichever predicts better. (Any other share
/// would be a delay of the channel.)
fn switched(e: &Experiment, common: Option<&InCommon>, motor: &Motor<f64>) -> Between {
    let by_prediction = || {
        let at = |share: f64| misfit(&e.clone().with_course(Between::Switched(share), motor), motor);
        if at(0.0) <= at(1.0) { 0.0 } else { 1.0 }
    };
    Between::Switched(common.map_or_else(by_prediction, |common| common.usual))
}

/// A share from 0 to 1, which is an end if it lies within a distance of it.
fn at_an_end(share: f64, near: f64) -> f64 {
    if share < near {
        0.0
    } else if share > 1.0 - near {
        1.0
    } else {
        share
    }
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

/// What an edge tells of its instant.
#[derive(Debug, Clone, Copy)]
struct Told {
    /// The sample after it.
    n: usize,
    /// Where it is predicted best, on either side of the interval.
    share: Share,
    /// How far off the prediction is there, within the interval.
    off: f64,
}

/// What all edges of a recording tell.
#[derive(Debug)]
struct InCommon {
    /// The share that they have in common.
    usual: f64,
    /// How they scatter round it, if they tell.
    scatter: Option<Common>,
    told: Vec<Told>,
}

impl InCommon {
    /// The share of one of them.
    fn of(&self, told: &Told) -> f64 {
        self.scatter.map_or(self.usual, |common| common.with(told.share).clamp(0.0, 1.0))
    }
}

/// Hard edges of the voltage, and how a motor predicts the samples after them.
struct Edges<'a> {
    experiment: &'a Experiment,
    motor: &'a Motor<f64>,
    measured: [Vec<f64>; 2],
    /// Standard deviations of the error of prediction of current, A, and speed, rad/s.
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
        let change = |n: usize| -> f64 { (e.input[n] - e.input[n - 1]).abs() };
        let is_hard = |n: &usize| {
            let [before, after] = [n - 1, n + 1].map(|n| if n == 0 { 0.0 } else { change(n) });
            change(*n) > (HARD * largest).max(ABOVE_NOISE * noise)
                && before.max(after) < STILL * change(*n) + 4.0 * noise
                && [n - 1, *n].iter().all(|n| e.counted[*n] && !e.is_open(*n) && !e.is_locked(*n))
        };
        let samples: Vec<usize> = (1..e.len().saturating_sub(1)).filter(is_hard).collect();
        if samples.is_empty() {
            return None;
        }
        let least = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|k: usize| a[k].min(b[k]));
        let deviations = COURSES.iter().filter_map(|course| deviations(e, *course, motor, &measured)).reduce(least)?;
        Some(Self { experiment, motor, measured, deviations, samples })
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
        // A speed that is held tells nothing of a single interval.
        let told = if along.window.is_some_and(|window| window.samples > 1) { 1 } else { 2 };
        let errors = errors.iter().zip(self.deviations).take(told);
        let sum: f64 = errors.map(|(error, deviation)| (error / deviation).powi(2)).sum();
        if sum.is_finite() { sum } else { f64::INFINITY }
    }

    /// What the edges tell of their instants; `None` without edges.
    fn in_common(&self) -> Option<InCommon> {
        let told: Vec<Told> = self.samples.iter().map(|n| self.tells(*n)).collect();
        let shares: Vec<Share> = told.iter().map(|told| told.share).collect();
        let common = Common::of(&shares)?;
        let near = (NEAR_AN_END * common.uncertain).max(LEAST_NEAR);
        if near >= BOTH_ENDS {
            return Some(InCommon { usual: self.by_what_follows(), scatter: None, told });
        }
        Some(InCommon { usual: at_an_end(common.mean, near), scatter: (common.scatter > 0.0).then_some(common), told })
    }

    /// The share of all edges with which what comes after them is predicted best: where a current has settled by the
    /// next sample, and a speed is counts, the interval of an edge tells nothing of its instant, but all samples after
    /// it do of the impulse.
    fn by_what_follows(&self) -> f64 {
        let along = self.experiment.clone().with_course(Between::Linear, self.motor);
        let (share, _) = least(|share| {
            let mut at = along.clone();
            at.instants = self.samples.iter().map(|n| (*n, share)).collect();
            misfit(&at, self.motor)
        });
        at_an_end(share, LEAST_NEAR)
    }

    /// How far off the prediction over an interval is where its edge lies at a share of it.
    fn off_at(&self, n: usize) -> impl Fn(f64) -> f64 {
        let e = self.experiment;
        // The interval and the samples beside it are all that a run over it asks for.
        let from = n.saturating_sub(2);
        let around = e.head(n + 2).tail(from);
        let measured = [0, 1].map(|k| self.measured[k][from..n + 2].to_vec());
        let local = (self.motor, measured, self.deviations);
        move |share: f64| {
            let (motor, measured, deviations) = &local;
            let edges = Edges {
                experiment: &around,
                motor,
                measured: measured.clone(),
                deviations: *deviations,
                samples: Vec::new(),
            };
            edges.off(n - from, &around.clone().with_course(Between::Switched(share), motor))
        }
    }

    /// What an edge tells of its instant: the square of what the prediction is off by, in standard deviations, is a
    /// parabola round the best share, whose bend tells the variance and whose vertex may lie beyond the interval.
    fn tells(&self, n: usize) -> Told {
        let off_at = self.off_at(n);
        let (best, off) = least(&off_at);
        let centre = best.clamp(BESIDE, 1.0 - BESIDE);
        let [before, at, after] = [centre - BESIDE, centre, centre + BESIDE].map(off_at);
        let bend = (before - 2.0 * at + after) / (BESIDE * BESIDE);
        let share = match bend > 0.0 {
            true => {
                let vertex = centre - 0.5 * (after - before) / (BESIDE * bend);
                Share { value: vertex.clamp(-BEYOND, 1.0 + BEYOND), variance: 2.0 / bend }
            }
            false => Share { value: best, variance: UNKNOWN },
        };
        Told { n, share, off }
    }

    /// The instant of an edge, if it tells the course from another by what chance does not: three standard deviations.
    fn own(&self, along: &Experiment, common: &InCommon, told: &Told) -> Option<(usize, f64)> {
        let off_at = self.off_at(told.n);
        let mut share = common.of(told);
        if off_at(share) > told.off + ANOTHER {
            share = told.share.value.clamp(0.0, 1.0);
        }
        (self.off(told.n, along) > off_at(share) + ANOTHER).then_some((told.n, share))
    }
}

/// Standard deviations of the error of prediction of current, A, and speed, rad/s, away from edges, along a course of
/// the voltage.
fn deviations(e: &Experiment, course: Between, motor: &Motor<f64>, measured: &[Vec<f64>; 2]) -> Option<[f64; 2]> {
    let e = e.clone().with_course(course, motor);
    let mut errors: [Vec<f64>; 2] = Default::default();
    let stepper = Stepper::with_substeps(motor.clone(), e.step_s(), e.substeps(motor).ok()?).ok()?;
    e.short_runs(stepper, 1, [&measured[0], &measured[1]], |n, shown: State<f64>| {
        errors[0].push((shown.current - measured[0][n]).abs());
        errors[1].push((shown.speed - measured[1][n]).abs());
    });
    let deviations = errors.map(|errors| noise::median(errors) / MEDIAN);
    deviations.iter().all(|d| *d > 0.0).then_some(deviations)
}

/// Mean of the logarithms of the RMS errors of current and speed, predicted from one sample to the next by the observer
/// whose gain predicts best: with a gain of 1 from what was measured, noise and counts included, with one of 0 by all
/// that has been before.
fn misfit(e: &Experiment, motor: &Motor<f64>) -> f64 {
    let mut e = e.clone();
    let with = |gain: f64| {
        e.gain = gain;
        let known: Vec<f64> = sums(&e, motor)
            .into_iter()
            .flatten()
            .map(|sums| 0.5 * (sums.error / sums.samples).max(f64::MIN_POSITIVE).ln())
            .collect();
        if known.is_empty() { f64::INFINITY } else { known.iter().sum::<f64>() / known.len() as f64 }
    };
    GAINS.map(with).into_iter().fold(f64::INFINITY, f64::min)
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
