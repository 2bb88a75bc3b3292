//! Nonlinear least squares for the parameters of a motor, whatever the residuals are.
//!
//! The Levenberg–Marquardt method with the physical ranges as bounds (a parameter at its bound that is pushed outwards
//! stays there) and with a prior on the shapes of effects: each counts as one more sample that says "as usual, within a
//! factor of e", so that a shape on which the data say nothing stays where it is usual. The coordinates of R, L, K and
//! J are their logarithms, which keeps them positive, but a step is one of the parameters themselves, in which the
//! balances are straight: R may grow to its sixfold in one step, with all else that goes with it. The rows are of two
//! groups, the electrical and the mechanical side, each weighted by the RMS of its residuals from step to step, which
//! is the maximum-likelihood choice for two noises of unknown size. Derivatives are forward differences, which may be
//! carried on over a few steps by Broyden's update; but for a first trial a fit does not end on derivatives that were
//! carried on over more than its last step, in which hardly anything has changed.
//!
//! Source: J. J. Moré: The Levenberg–Marquardt algorithm, implementation and theory, Lecture Notes in Mathematics 630
//! (1978); C. G. Broyden: A class of methods for solving nonlinear simultaneous equations, Mathematics of Computation
//! 19 (1965) 577–593.

mod damping;
mod errors;

use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

pub use errors::{HeldOut, have_rows, log_error};

use damping::{ALIKE, Coordinate, Trial, bounded_step, descend};

use super::space::{Entry, Freedom, Key, Space};
use crate::context::Context;
use crate::error::Result;

/// Step of the forward differences in the optimiser's coordinates (logarithms and relative sizes). The rounding error
/// of a simulation, about 1e-13, and the curvature then both stay near 1e-6 of the derivative.
const DIFFERENCE: f64 = 1e-6;

/// Step limit of each coordinate: ln 4 for logarithms, 1.4 typical sizes for others; a magnitude already above its
/// typical size may change by 1.4 times itself, since what is typical is known to an order of magnitude or two. R, L, K
/// and J have no limit upwards.
const LONGEST: f64 = 1.4;

/// Damping relative to the diagonal of the normal equations, in the limit of steps that succeed.
const LEAST_DAMPING: f64 = 1e-12;

/// Change of a weight, as a logarithm, below which it has settled.
const SETTLED: f64 = 1e-3;

/// The shortest step that tells of derivatives; what shorter ones change is rounding.
const SHORTEST: f64 = 1e-3 * DIFFERENCE;

/// Steps over which derivatives are carried on where a fit is one of dozens.
pub const CARRIED_ON: usize = 3;

/// What a fit is called where its progress is shown.
const FITTING: &str = "fit";

/// Number of samples that the prior on a shape counts as.
pub const PRIOR: f64 = 10.0;

/// What is to be made small.
pub trait Residuals: Sync {
    /// Unweighted residuals at a point of a space.
    fn at(&self, space: &Space, theta: &[f64]) -> DVector<f64>;
    /// The same at several points, which lie close together.
    fn at_each(&self, space: &Space, thetas: &[Vec<f64>]) -> Vec<DVector<f64>> {
        thetas.par_iter().map(|theta| self.at(space, theta)).collect()
    }
    /// The group of each row: 0 the electrical side, 1 the mechanical one.
    fn groups(&self) -> &[u8];
    /// RMS of the signals that the rows of the two groups are compared with.
    fn sizes(&self) -> [f64; 2];
}

/// How hard a fit is tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Steps at most.
    pub steps: usize,
    /// Relative fall of the error below which a step was the last.
    pub tolerance: f64,
    /// Steps over which derivatives are carried on at most. That is quicker, and may end in another valley.
    pub carried_on: usize,
    /// Whether the end has to be confirmed by derivatives that were computed there.
    pub confirmed: bool,
}

impl Effort {
    /// To the last digit that matters.
    pub const FULL: Self = Self { steps: 60, tolerance: 1e-7, carried_on: 0, confirmed: true };
    /// To where fits can be compared.
    pub const USUAL: Self = Self { steps: 12, tolerance: 1e-3, carried_on: CARRIED_ON, confirmed: true };
    /// The same along a valley that winds.
    pub const PATIENT: Self = Self { steps: 36, ..Self::USUAL };
    /// To where something else has to be done next.
    pub const ROUGH: Self = Self { steps: 8, tolerance: 1e-3, carried_on: CARRIED_ON, confirmed: true };
    /// To an error that is known to a hundredth.
    pub const ESTIMATE: Self = Self { steps: 8, tolerance: 1e-2, carried_on: 4, confirmed: false };
}

/// A fit to one problem: where it has ended.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The parameters there.
    pub space: Space,
    /// Weighted residuals, experiment by experiment.
    pub residuals: DVector<f64>,
    /// Derivatives of the residuals by the coordinates.
    pub jacobian: DMatrix<f64>,
    /// RMS of the residuals of the two groups, in their units: what they are weighted by.
    pub rms: [f64; 2],
    /// Whether the search came to an end before its steps did.
    pub ended: bool,
    /// The errors on blocks of time held out, once they have been asked for: [`Fit::held_out`].
    pub known_held_out: OnceLock<HeldOut>,
}

impl Fit {
    /// Holds a free parameter where it is.
    pub fn hold(&mut self, key: Key) {
        let place = self.space.free().position(|entry| entry.key == key);
        if let Some(place) = place {
            self.space.hold([key], Freedom::Pinned);
            self.jacobian = std::mem::take(&mut self.jacobian).remove_column(place);
            self.known_held_out = OnceLock::new();
        }
    }

    /// Its errors on blocks of time held out, found `by` leaving them out the first time.
    ///
    /// # Errors
    /// Those of `by`; it is asked again the next time.
    pub fn held_out(&self, by: impl FnOnce(&Self) -> Result<HeldOut>) -> Result<&HeldOut> {
        match self.known_held_out.get() {
            Some(known) => Ok(known),
            None => {
                // Not within `get_or_init`: what leaves blocks out waits for other work meanwhile, which may ask for
                // the same.
                let held_out = by(self)?;
                Ok(self.known_held_out.get_or_init(|| held_out))
            }
        }
    }

    /// The logarithm of its error: [`log_error`].
    pub fn log_error(&self, groups: &[u8]) -> f64 {
        log_error(self.rms, have_rows(groups))
    }
}

/// Minimises from the present values of a space; `weights` are the RMS residuals to start from, if they are known. The
/// context is told which part of the steps allowed is done.
///
/// # Errors
/// An interrupt.
pub fn minimise(
    space: &Space,
    problem: &impl Residuals,
    effort: Effort,
    weights: Option<[f64; 2]>,
    ctx: &Context,
) -> Result<Fit> {
    let theta = within_limits(space);
    let start = Point {
        residuals: problem.at(space, &theta),
        theta,
        weights: weights.unwrap_or_else(|| problem.sizes()),
        known: None,
    };
    search(space, problem, effort, start, ctx)
}

/// Minimises from a space that is that of a fit and a few parameters more, with the weights of the fit and, to begin
/// with, its derivatives: only those by the new parameters are computed. For residuals that are nearly straight, as the
/// balances are: in the free run such derivatives may lead to another valley.
///
/// # Errors
/// An interrupt.
pub fn minimise_beside(
    fit: &Fit,
    space: &Space,
    problem: &impl Residuals,
    effort: Effort,
    ctx: &Context,
) -> Result<Fit> {
    let theta = within_limits(space);
    let residuals = problem.at(space, &theta);
    let mut known = fit.jacobian.clone();
    weigh(&mut DVector::zeros(residuals.len()), &mut known, problem.groups(), fit.rms);
    let keys: Vec<Key> = fit.space.free().map(|e| e.key).collect();
    let place = |entry: &Entry| keys.iter().position(|key| *key == entry.key);
    let new: Vec<usize> = space.free().enumerate().filter(|(_, e)| place(e).is_none()).map(|(k, _)| k).collect();
    let mut computed = derivatives(space, problem, &theta, &residuals, &new, DIFFERENCE).into_iter();
    let known_or_computed = |entry| place(entry).map(|j| known.column(j).into_owned()).or_else(|| computed.next());
    let columns: Vec<DVector<f64>> = space.free().filter_map(known_or_computed).collect();
    let known = Some((from_columns(&columns, residuals.len()), 1));
    search(space, problem, effort, Point { theta, residuals, weights: fit.rms, known }, ctx)
}

/// The coordinates of a space's values, as far as the limits let them be.
fn within_limits(space: &Space) -> Vec<f64> {
    let within = |(x, entry): (f64, &Entry)| {
        let (low, high) = entry.limits();
        x.clamp(low, high)
    };
    space.coordinates().into_iter().zip(space.free()).map(within).collect()
}

/// Goes on from where a fit has ended, with the derivatives that it ended on.
///
/// # Errors
/// An interrupt.
pub fn resume(fit: &Fit, problem: &impl Residuals, effort: Effort, ctx: &Context) -> Result<Fit> {
    let mut residuals = fit.residuals.clone();
    let mut jacobian = fit.jacobian.clone();
    weigh(&mut residuals, &mut jacobian, problem.groups(), fit.rms);
    let start = Point { theta: fit.space.coordinates(), residuals, weights: fit.rms, known: Some((jacobian, 1)) };
    search(&fit.space, problem, effort, start, ctx)
}

/// Where a search is.
struct Point {
    theta: Vec<f64>,
    /// Unweighted.
    residuals: DVector<f64>,
    /// RMS residuals that they are weighted by.
    weights: [f64; 2],
    /// Unweighted derivatives, if they are known, and over how many steps they have been carried on.
    known: Option<(DMatrix<f64>, usize)>,
}

fn search(space: &Space, problem: &impl Residuals, effort: Effort, start: Point, ctx: &Context) -> Result<Fit> {
    let Point { mut theta, mut residuals, mut weights, mut known } = start;
    let groups = problem.groups();
    let limits: Vec<(f64, f64)> = space.free().map(Entry::limits).collect();
    let usual: Vec<Option<f64>> = space.free().map(Entry::usual).collect();
    let coordinates: Vec<Coordinate> = space.free().map(coordinate).collect();
    let mut damping = 1e-6;
    let mut ended_on = None;
    for step in 0..effort.steps {
        ctx.check()?;
        ctx.at(FITTING, step as f64 / effort.steps as f64);
        let (mut jacobian, age) =
            known.take().unwrap_or_else(|| (jacobian_at(space, problem, &theta, &residuals, DIFFERENCE), 0));
        let scale: Vec<f64> = groups.iter().map(|g| 1.0 / weights[usize::from(*g)]).collect();
        let (normal, gradient) = normal_equations(&jacobian, &residuals, &scale, &theta, &usual);
        let cost = |r: &DVector<f64>, at: &[f64]| {
            let data: f64 = r.iter().zip(&scale).map(|(r, s)| (r * s).powi(2)).sum();
            data + PRIOR * at.iter().zip(&usual).filter_map(|(x, u)| Some((x - (*u)?).powi(2))).sum::<f64>()
        };
        let present = cost(&residuals, &theta);
        let longest: Vec<f64> = space.free().zip(&theta).map(|(entry, x)| LONGEST * entry.reach(*x)).collect();
        let place = |damping| bounded_step(&normal, &gradient, &theta, &limits, &longest, &coordinates, damping);
        let at = |there: Vec<f64>| {
            let residuals = problem.at(space, &there);
            Trial { cost: cost(&residuals, &there), there, residuals }
        };
        // Each coordinate by what it changes.
        let size = |a: &[f64], b: &[f64]| -> f64 {
            a.iter().zip(b).enumerate().map(|(k, (a, b))| normal[(k, k)] * (a - b).powi(2)).sum::<f64>().sqrt()
        };
        let alike = |worse: &[f64], there: &[f64]| size(worse, there) < ALIKE * size(worse, &theta);
        let (accepted, last) = descend(damping, present, &place, &alike, &at);
        damping = last;
        let fell = accepted.map(|trial| {
            carry_on(&mut jacobian, &theta, &trial.there, &residuals, &trial.residuals, &coordinates);
            (theta, residuals) = (trial.there, trial.residuals);
            damping = (damping / 30.0).max(LEAST_DAMPING);
            1.0 - trial.cost / present
        });
        let before = weights;
        weights = weights_of(&residuals, problem);
        let settled = (0..2).all(|k| (weights[k] / before[k]).ln().abs() < SETTLED);
        let last = fell.is_none_or(|fall| fall < effort.tolerance);
        if last && settled && (age == 0 || !effort.confirmed) {
            ended_on = Some(jacobian);
            break;
        }
        let still_good = if effort.confirmed { !last } else { fell.is_some() };
        if still_good && age < effort.carried_on {
            known = Some((jacobian, age + 1));
        }
    }
    let ended = ended_on.is_some();
    let carried_on = || known.filter(|_| !effort.confirmed).map(|(jacobian, _)| jacobian);
    let jacobian =
        ended_on.or_else(carried_on).unwrap_or_else(|| jacobian_at(space, problem, &theta, &residuals, DIFFERENCE));
    let mut space = space.clone();
    space.set_coordinates(&theta);
    Ok(weighted(space, problem, residuals, jacobian, ended))
}

/// Residuals go with R, L, K and J themselves, but with a shape as with a factor.
fn coordinate(entry: &Entry) -> Coordinate {
    if entry.is_logarithmic() && !entry.of_effect() { Coordinate::Logarithm } else { Coordinate::Plain }
}

/// The residuals and their derivatives at the present values, without a step.
pub fn as_it_is(space: &Space, problem: &impl Residuals) -> Fit {
    let theta = space.coordinates();
    let residuals = problem.at(space, &theta);
    let jacobian = jacobian_at(space, problem, &theta, &residuals, DIFFERENCE);
    weighted(space.clone(), problem, residuals, jacobian, false)
}

/// RMS of the two groups; 1 for one without rows.
pub fn rms_of(residuals: &DVector<f64>, groups: &[u8]) -> [f64; 2] {
    let mut sums = [(0.0, 0usize); 2];
    for (r, group) in residuals.iter().zip(groups) {
        let k = usize::from(*group);
        sums[k].0 += r * r;
        sums[k].1 += 1;
    }
    sums.map(|(sum, n)| if n == 0 { 1.0 } else { (sum / n as f64).sqrt() })
}

/// Unweighted derivatives of the residuals by the coordinates at a point where they are known.
pub fn jacobian_at(
    space: &Space,
    problem: &impl Residuals,
    theta: &[f64],
    residuals: &DVector<f64>,
    difference: f64,
) -> DMatrix<f64> {
    let all: Vec<usize> = (0..theta.len()).collect();
    from_columns(&derivatives(space, problem, theta, residuals, &all, difference), residuals.len())
}

/// The derivatives by some of the coordinates.
fn derivatives(
    space: &Space,
    problem: &impl Residuals,
    theta: &[f64],
    residuals: &DVector<f64>,
    coordinates: &[usize],
    difference: f64,
) -> Vec<DVector<f64>> {
    let highest: Vec<f64> = space.free().map(|entry| entry.limits().1).collect();
    let step = |k: usize| if theta[k] + difference > highest[k] { -difference } else { difference };
    let moved = |k: &usize| {
        let mut there = theta.to_vec();
        there[*k] += step(*k);
        there
    };
    let there: Vec<Vec<f64>> = coordinates.iter().map(moved).collect();
    let moved = problem.at_each(space, &there);
    moved.into_iter().zip(coordinates).map(|(there, k)| (there - residuals) / step(*k)).collect()
}

fn from_columns(columns: &[DVector<f64>], rows: usize) -> DMatrix<f64> {
    if columns.is_empty() { DMatrix::zeros(rows, 0) } else { DMatrix::from_columns(columns) }
}

/// Broyden's update: the least change of the derivatives that agrees with the step just done.
fn carry_on(
    jacobian: &mut DMatrix<f64>,
    from: &[f64],
    to: &[f64],
    before: &DVector<f64>,
    after: &DVector<f64>,
    coordinates: &[Coordinate],
) {
    let change = |k: usize| match coordinates[k] {
        Coordinate::Plain => to[k] - from[k],
        Coordinate::Logarithm => (to[k] - from[k]).exp_m1(),
    };
    let step = DVector::from_fn(from.len(), |k, _| change(k));
    let length = step.norm_squared();
    if length > SHORTEST * SHORTEST {
        let missed = after - before - &*jacobian * &step;
        jacobian.ger(1.0 / length, &missed, &step, 1.0);
        for k in (0..from.len()).filter(|k| coordinates[*k] == Coordinate::Logarithm) {
            jacobian.column_mut(k).scale_mut(1.0 + step[k]);
        }
    }
}

/// What residuals are weighted by: their RMS, but a perfect fit must not divide by zero.
fn weights_of(residuals: &DVector<f64>, problem: &impl Residuals) -> [f64; 2] {
    let (rms, sizes) = (rms_of(residuals, problem.groups()), problem.sizes());
    [0, 1].map(|g| rms[g].max(1e-9 * sizes[g]))
}

fn weighted(
    space: Space,
    problem: &impl Residuals,
    mut residuals: DVector<f64>,
    mut jacobian: DMatrix<f64>,
    ended: bool,
) -> Fit {
    let rms = weights_of(&residuals, problem);
    weigh(&mut residuals, &mut jacobian, problem.groups(), rms.map(|w| 1.0 / w));
    Fit { space, residuals, jacobian, rms, ended, known_held_out: OnceLock::new() }
}

/// Multiplies the rows of each group by a weight.
fn weigh(residuals: &mut DVector<f64>, jacobian: &mut DMatrix<f64>, groups: &[u8], weights: [f64; 2]) {
    for mut column in jacobian.column_iter_mut().chain(std::iter::once(residuals.column_mut(0))) {
        for (x, group) in column.iter_mut().zip(groups) {
            *x *= weights[usize::from(*group)];
        }
    }
}

/// JᵀJ and Jᵀr, weighted, with the priors.
fn normal_equations(
    jacobian: &DMatrix<f64>,
    residuals: &DVector<f64>,
    scale: &[f64],
    theta: &[f64],
    usual: &[Option<f64>],
) -> (DMatrix<f64>, DVector<f64>) {
    let mut scaled = jacobian.clone();
    for mut column in scaled.column_iter_mut() {
        for (x, s) in column.iter_mut().zip(scale) {
            *x *= s;
        }
    }
    let weighted = DVector::from_iterator(residuals.len(), residuals.iter().zip(scale).map(|(r, s)| r * s));
    // Symmetric: half of the products suffice.
    let p = scaled.ncols();
    let mut normal = DMatrix::zeros(p, p);
    for k in 0..p {
        for j in 0..=k {
            normal[(j, k)] = scaled.column(j).dot(&scaled.column(k));
            normal[(k, j)] = normal[(j, k)];
        }
    }
    let mut gradient = scaled.tr_mul(&weighted);
    for (k, usual) in usual.iter().enumerate() {
        if let Some(usual) = usual {
            normal[(k, k)] += PRIOR;
            gradient[k] += PRIOR * (theta[k] - usual);
        }
    }
    (normal, gradient)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use greyrig::effects::EffectId;
    use greyrig::motor::BaseParameter;

    use super::damping::RUNGS;
    use super::*;
    use crate::error::Error;
    use crate::model::{Base, Kind};

    #[test]
    fn blocks_are_held_out_once() {
        let fit = Fit {
            space: Space::new(Kind::PmDc, Base::Full, &[]),
            residuals: DVector::zeros(1),
            jacobian: DMatrix::zeros(1, 1),
            rms: [1.0; 2],
            ended: true,
            known_held_out: OnceLock::new(),
        };
        let asked = AtomicUsize::new(0);
        let by = |_: &Fit| {
            asked.fetch_add(1, Ordering::Relaxed);
            Ok(HeldOut::new(vec![[4.0, 9.0]], vec![[1.0; 2]]))
        };
        assert!(matches!(fit.held_out(|_| Err(Error::Interrupted)), Err(Error::Interrupted)), "it is not known then");
        assert_eq!(fit.held_out(by).unwrap().rms(), [2.0, 3.0]);
        // A copy knows it, too.
        assert_eq!(fit.clone().held_out(by).unwrap().rms(), [2.0, 3.0]);
        assert_eq!(asked.load(Ordering::Relaxed), 1);
    }

    /// A decay from two to nothing at the rate 3/s, which the first two coordinates stand for, above `rest`, which the
    /// eighth one stands for; the others do nothing.
    struct Decay {
        groups: Vec<u8>,
        rest: f64,
        evaluations: AtomicUsize,
    }

    impl Decay {
        fn above(rest: f64) -> Self {
            Self { groups: vec![0; 200], rest, evaluations: AtomicUsize::new(0) }
        }
    }

    impl Residuals for Decay {
        fn at(&self, _: &Space, theta: &[f64]) -> DVector<f64> {
            self.evaluations.fetch_add(1, Ordering::Relaxed);
            DVector::from_fn(self.groups.len(), |k, _| {
                let t = k as f64 / self.groups.len() as f64;
                let modelled = theta[0].exp() * (-theta[1].exp() * t).exp() + theta.get(7).unwrap_or(&0.0);
                modelled - 2.0 * (-3.0 * t).exp() - self.rest
            })
        }
        fn groups(&self) -> &[u8] {
            &self.groups
        }
        fn sizes(&self) -> [f64; 2] {
            [1.0; 2]
        }
    }

    /// 3 V/Ω times a resistance, carried on from the logarithm of one to that of another.
    fn carried_on(from: f64, to: f64, rounding: f64) -> f64 {
        let mut jacobian = DMatrix::from_element(1, 1, 3.0 * from.exp());
        let at = |theta: f64| DVector::from_element(1, 3.0 * theta.exp());
        let after = at(to).add_scalar(rounding);
        carry_on(&mut jacobian, &[from], &[to], &at(from), &after, &[Coordinate::Logarithm]);
        jacobian[0]
    }

    #[test]
    fn derivatives_by_what_residuals_go_with_are_right_after_any_step() {
        for to in [0.2, 1.4, -0.7] {
            assert!((carried_on(0.1, to, 0.0) / (3.0 * f64::exp(to)) - 1.0).abs() < 1e-12, "{to}");
        }
    }

    #[test]
    fn a_resistance_between_bounds_has_another_coordinate_than_its_logarithm() {
        let mut space = Space::new(Kind::PmDc, Base::Full, &[EffectId::SpeedLag]);
        space.hold([BaseParameter::R], Freedom::Free(Some((1.0, 3.0))));
        let of = |key: Key| coordinate(space.get(key).unwrap());
        assert_eq!(
            [
                BaseParameter::R.into(),
                BaseParameter::L.into(),
                BaseParameter::Mu1.into(),
                Key::size_of(EffectId::SpeedLag)
            ]
            .map(of)
            .map(|c| c == Coordinate::Logarithm),
            [false, true, false, false]
        );
    }

    #[test]
    fn rounding_is_no_derivative() {
        let was = 3.0 * f64::exp(0.1);
        assert!((carried_on(0.1, 0.1 + 4e-15, 4e-13) / was - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_fit_that_goes_on_ends_where_one_without_a_break_does() {
        let space = Space::new(Kind::PmDc, Base::Full, &[]);
        let problem = Decay::above(0.0);
        let begun = Effort { steps: 2, tolerance: 1e-2, carried_on: 2, confirmed: false };
        let begun = minimise(&space, &problem, begun, None, &Context::quiet()).unwrap();
        let [amplitude, rate] = [2.0f64.ln(), 3.0f64.ln()];
        assert!((begun.space.coordinates()[1] - rate).abs() > 1e-3, "two steps do not suffice");
        let ended = resume(&begun, &problem, Effort::FULL, &Context::quiet()).unwrap().space.coordinates();
        // Without noise the minimum is the truth; forward differences and the tolerance leave some 1e-6.
        assert!((ended[0] - amplitude).abs() < 1e-5 && (ended[1] - rate).abs() < 1e-5, "{ended:?}");
    }

    #[test]
    fn a_fit_beside_another_one_takes_its_derivatives_and_ends_where_one_from_scratch_does() {
        let problem = Decay::above(0.5);
        let fit = minimise(&Space::new(Kind::PmDc, Base::Full, &[]), &problem, Effort::FULL, None, &Context::quiet())
            .unwrap();
        let more = Space::new(Kind::PmDc, Base::Full, &[EffectId::TorqueOffset]);
        let ended =
            minimise_beside(&fit, &more, &problem, Effort::FULL, &Context::quiet()).unwrap().space.coordinates();
        // As above. From the values of the wider space, the first of which is one: its logarithm is not that of two.
        let expected = [2.0f64.ln(), 3.0f64.ln(), 0.5];
        for (k, value) in [0, 1, 7].into_iter().zip(expected) {
            assert!((ended[k] - value).abs() < 1e-5, "{k}: {} for {value}", ended[k]);
        }
        let one = Effort { steps: 1, tolerance: 1e-2, carried_on: 2, confirmed: false };
        let evaluations = |run: &dyn Fn()| {
            let before = problem.evaluations.load(Ordering::Relaxed);
            run();
            problem.evaluations.load(Ordering::Relaxed) - before
        };
        // Where it starts, one new parameter, and the trials of one step, which are made in pairs.
        let beside = evaluations(&|| drop(minimise_beside(&fit, &more, &problem, one, &Context::quiet())));
        assert!((3..=2 + RUNGS).contains(&beside), "{beside}");
    }
}
