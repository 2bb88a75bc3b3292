//! Start values by linear least squares in continuous time.
//!
//! # Electrical side
//! `u = R i + K φ ω + L di/dt`: the products are formed on the raw samples, then every column and the target go through
//! the same Butterworth filter. (The product of filtered signals is not the filtered product.)
//!
//! # Mechanical side
//! In integral (weak) form over windows of whole mains periods,
//! `J (ω₂ − ω₁) = K ∫φ i dt − ∫(s μ0 + μ1 ω + μ2 ω|ω|) dt`,
//! so that nothing is differentiated and the pulsation of the torque at twice the mains frequency cancels.
//!
//! # Source
//! Rakar & Juričić 2004, section 2.2, for the least squares in continuous time; the weak form after the modulating
//! functions of M. Shinbrot: On the analysis of linear and nonlinear systems, Trans. ASME 79 (1957) 547–552.

use greyrig::motor::BaseParameter;
use greyrig::scalar::Scalar;
use nalgebra::{DMatrix, DVector};

use super::space::{Freedom, Space};
use crate::experiment::{Drive, Experiment, derivative};
use crate::filtering::directions;
use crate::model::Kind;

/// Windows of the weak form are this long, s, rounded up to whole periods of the mains.
const WINDOW_S: f64 = 0.1;
/// Or shorter where the recordings together would hold fewer of them: six for each of four unknowns.
const WINDOWS: f64 = 24.0;
/// Speeds at the ends of a window are means over this share of it at most, where no mains tells the time.
const AT_ITS_ENDS: f64 = 0.2;

/// Singular values below this share of the largest are rounding.
const ROUNDING: f64 = 1e-7;
/// The same of slow samples, where short windows are of few samples and sums over reversals miss by their noise: a
/// thirtieth of the largest is a tenth of a per cent of the squares.
const NOISE_OF_SLOW_SAMPLES: f64 = 0.03;
/// Share of a window without a direction that slow samples may have: they pass through standstill within a few.
const WITHOUT_DIRECTION: f64 = 0.2;

/// A linear regression with a column for each of some parameters, some of them with a known coefficient.
#[derive(Debug, Clone)]
pub struct Regression {
    parameters: Vec<BaseParameter>,
    rows: Vec<Vec<f64>>,
    target: Vec<f64>,
}

impl Regression {
    /// With columns to come in this order.
    pub fn new(parameters: &[BaseParameter]) -> Self {
        Self { parameters: parameters.to_vec(), rows: vec![Vec::new(); parameters.len()], target: Vec::new() }
    }

    /// Adds a row.
    pub fn push(&mut self, columns: &[f64], target: f64) {
        for (column, value) in self.rows.iter_mut().zip(columns) {
            column.push(*value);
        }
        self.target.push(target);
    }

    /// Solves for the free coefficients, with the fixed ones moved to the target. `None` when there are fewer than
    /// twice as many rows as unknowns or a column says nothing.
    pub fn solve(&self, space: &Space) -> Option<Vec<(BaseParameter, f64)>> {
        self.solve_within(space, ROUNDING)
    }

    /// The same, where directions in which the columns, each of a mean square of 1, have less than a share of the
    /// largest singular value are left alone: of columns that say the same each takes a part.
    pub fn solve_within(&self, space: &Space, share: f64) -> Option<Vec<(BaseParameter, f64)>> {
        let mut target = self.target.clone();
        let mut columns = Vec::new();
        let mut parameters = Vec::new();
        for (parameter, column) in self.parameters.iter().zip(&self.rows) {
            let entry = space.get(*parameter)?;
            match entry.freedom {
                Freedom::Free(_) => {
                    let size = (column.iter().map(|x| x * x).sum::<f64>() / column.len().max(1) as f64).sqrt();
                    if size > 0.0 {
                        columns.push((column, size));
                        parameters.push(*parameter);
                    }
                }
                Freedom::Absent => {}
                Freedom::Fixed | Freedom::Pinned | Freedom::Untold => {
                    for (t, x) in target.iter_mut().zip(column) {
                        *t -= entry.value * x;
                    }
                }
            }
        }
        if columns.is_empty() || target.len() < 2 * columns.len() {
            return None;
        }
        let matrix = DMatrix::from_fn(target.len(), columns.len(), |r, c| columns[c].0[r] / columns[c].1);
        let svd = matrix.svd(true, true);
        let largest = svd.singular_values.max();
        let solution = svd.solve(&DVector::from_vec(target), share * largest).ok()?;
        let sizes = parameters.iter().zip(solution.iter()).zip(&columns);
        Some(sizes.map(|((parameter, x), (_, size))| (*parameter, x / size)).collect())
    }
}

/// Finds start values for all free parameters.
pub fn start_values(space: &mut Space, experiments: &[Experiment]) {
    space.take_scales(&space.scales(experiments));
    let with_current: Vec<_> =
        experiments.iter().filter(|e| e.drive == Drive::Voltage && e.current.is_some()).collect();
    if with_current.is_empty() {
        without_current(space, experiments);
    } else {
        electrical(space, &with_current);
    }
    space.take_scales(&space.scales(experiments));
    mechanical(space, experiments);
    space.take_scales(&space.scales(experiments));
}

fn take(space: &mut Space, solution: Option<Vec<(BaseParameter, f64)>>) {
    for (parameter, value) in solution.into_iter().flatten() {
        space.start(parameter, value);
    }
}

fn flux_of(kind: Kind, current: f64) -> f64 {
    match kind {
        Kind::Universal => current,
        Kind::PmDc => 1.0,
    }
}

fn electrical(space: &mut Space, experiments: &[&Experiment]) {
    let mut regression = Regression::new(&[BaseParameter::R, BaseParameter::K, BaseParameter::L]);
    for e in experiments {
        let Some(i) = &e.current else { continue };
        let zero = vec![0.0; i.len()];
        let speed = e.speed_itself();
        let speed = speed.as_deref();
        if speed.is_none() && !e.is_locked(0) {
            continue;
        }
        let speed = speed.unwrap_or(&zero);
        let emf: Vec<f64> = i.iter().zip(speed).map(|(i, w)| flux_of(space.kind(), *i) * w).collect();
        let columns = [e.filtered(i), e.filtered(&emf), e.filtered(&derivative(i, e.interval_s)), e.filtered(&e.input)];
        if let Some(samples) = settled_samples(e) {
            for n in samples {
                let emf = if e.is_locked(n) { 0.0 } else { emf[n] };
                regression.push(&[i[n], emf, 0.0], e.input[n]);
            }
            continue;
        }
        let (stride, counted) = (stride(e), e.counted_where_told());
        for n in (0..e.len()).step_by(stride).filter(|n| counted[*n] && !e.is_open(*n)) {
            let emf = if e.is_locked(n) { 0.0 } else { columns[1][n] };
            regression.push(&[columns[0][n], emf, columns[2][n]], columns[3][n]);
        }
    }
    let solution = regression.solve(space);
    take(space, solution);
}

/// Share of the largest voltage within which a voltage stands still.
const STILL: f64 = 0.05;

/// Samples of a slow recording before which the voltage has stood still for two intervals: there the current has
/// settled, and `u = R i + K φ ω` whatever the voltage does between samples. `None` where there are few, or samples are
/// quick enough for derivatives.
fn settled_samples(e: &Experiment) -> Option<Vec<usize>> {
    const FEWEST_SHARE: f64 = 0.2;
    if !e.is_slow(None) {
        return None;
    }
    let u = &e.input;
    let largest = u.iter().fold(0.0f64, |m, u| m.max(u.abs()));
    let still =
        |n: &usize| (n - 2..=*n).all(|k| e.counted[k] && (u[k] - u[*n]).abs() < STILL * largest && !e.is_open(k));
    let samples: Vec<usize> = (2..u.len()).filter(still).collect();
    (samples.len() as f64 > FEWEST_SHARE * u.len() as f64).then_some(samples)
}

/// Without a current: `u = (K + R μ1/K) ω + (R J/K) dω/dt + (R μ0/K) s`, for a given R and with μ1 counted to K.
fn without_current(space: &mut Space, experiments: &[Experiment]) {
    if space.kind() != Kind::PmDc {
        return;
    }
    let mut proxy = Space::new(Kind::PmDc, crate::model::Base::DryViscous, &[]);
    let mut regression = Regression::new(&[BaseParameter::K, BaseParameter::J, BaseParameter::Mu0]);
    for e in experiments {
        let Some(w) = &e.speed else { continue };
        let columns =
            [e.filtered(w), e.filtered(&derivative(w, e.interval_s)), e.filtered(&directions(w)), e.filtered(&e.input)];
        for n in (0..e.len()).step_by(stride(e)).filter(|n| e.counted[*n]) {
            regression.push(&[columns[0][n], columns[1][n], columns[2][n]], columns[3][n]);
        }
    }
    if space.get(BaseParameter::Mu0).is_some_and(|m| m.freedom == Freedom::Absent)
        && let Some(entry) = proxy.get_mut(BaseParameter::Mu0)
    {
        entry.freedom = Freedom::Absent;
    }
    let Some(solution) = regression.solve(&proxy) else { return };
    let find = |parameter| solution.iter().find(|s| s.0 == parameter).map_or(0.0, |s| s.1);
    let (k, r) = (find(BaseParameter::K), space.value(BaseParameter::R));
    space.start(BaseParameter::K, k);
    let k = space.value(BaseParameter::K);
    space.start(BaseParameter::J, (find(BaseParameter::J) * k / r).max(1e-9));
    space.start(BaseParameter::Mu0, find(BaseParameter::Mu0) * k / r);
}

fn mechanical(space: &mut Space, experiments: &[Experiment]) {
    let mut regression =
        Regression::new(&[BaseParameter::J, BaseParameter::Mu0, BaseParameter::Mu1, BaseParameter::Mu2]);
    let k = space.value(BaseParameter::K);
    let driven = experiments.iter().filter(|e| e.drive == Drive::Voltage);
    let window_s = WINDOW_S.min(driven.map(|e| e.len() as f64 * e.interval_s).sum::<f64>() / WINDOWS);
    for e in experiments {
        let (Some(w), Drive::Voltage) = (e.speed_itself(), e.drive) else { continue };
        let zero = vec![0.0; w.len()];
        let Some(i) = e.current.as_ref().or(if e.open.iter().any(|o| *o) { Some(&zero) } else { None }) else {
            continue;
        };
        let period = e.mains_period_s.unwrap_or(AT_ITS_ENDS * window_s);
        let window = ((window_s / period).ceil() * period / e.interval_s).round().max(1.0) as usize;
        let smooth = SlidingMean::new(&w, (period / e.interval_s).round() as usize);
        let (direction, counted) = (directions(&w), e.counted_where_told());
        let mut from = 0;
        while from + window < w.len() {
            let range = from..from + window;
            from += window;
            let undirected = range.clone().filter(|n| direction[*n] == 0.0).count();
            let passes = if e.is_slow(None) { WITHOUT_DIRECTION * window as f64 } else { 0.0 };
            if range.clone().any(|n| !counted[n] || e.is_locked(n)) || undirected as f64 > passes {
                continue;
            }
            let sum = |f: &dyn Fn(usize) -> f64| range.clone().map(f).sum::<f64>() * e.interval_s;
            let torque = sum(&|n| if e.is_open(n) { 0.0 } else { k * flux_of(space.kind(), i[n]) * i[n] });
            regression.push(
                &[
                    smooth.at(range.end) - smooth.at(range.start),
                    sum(&|n| direction[n]),
                    sum(&|n| w[n]),
                    sum(&|n| w[n] * w[n].abs()),
                ],
                torque,
            );
        }
    }
    let slow = experiments.iter().any(|e| e.is_slow(None));
    let solution = regression.solve_within(space, if slow { NOISE_OF_SLOW_SAMPLES } else { ROUNDING });
    take(space, solution);
}

/// Mean of a signal over a window around a sample.
pub struct SlidingMean<S> {
    sums: Vec<S>,
    half: usize,
}

impl<S: Scalar> SlidingMean<S> {
    /// Of a signal, over so many samples.
    pub fn new(signal: &[S], window: usize) -> Self {
        let mut sums = Vec::with_capacity(signal.len() + 1);
        let mut sum = S::ZERO;
        sums.push(sum);
        sums.extend(signal.iter().map(|x| {
            sum += *x;
            sum
        }));
        Self::of_sums(sums, window)
    }

    /// Of a signal that is given by its sums from the beginning, the first of which is of nothing.
    pub fn of_sums(sums: Vec<S>, window: usize) -> Self {
        Self { sums, half: (window / 2).max(1) }
    }

    /// Around sample `n`; at the ends of the signal over what there is.
    pub fn at(&self, n: usize) -> S {
        let (a, b) = (n.saturating_sub(self.half), (n + self.half).min(self.sums.len() - 1));
        (self.sums[b] - self.sums[a]) / S::constant((b - a) as f64)
    }
}

/// Every how many samples a filtered signal has to be looked at: four times per period of the cut-off.
pub fn stride(e: &Experiment) -> usize {
    ((e.filter.sample_rate_hz / (4.0 * e.filter.cutoff_hz)) as usize).max(1)
}
