//! Which effects could be missing: all candidates tried at once, by linearisation.
//!
//! At the fit of the present model each candidate's columns are the changes of the balances when the effect appears at
//! a small size, with its usual shape and with neighbouring ones. How much of the residual they take, with all other
//! parameters free to move, is the candidate's promise. It ranks; it does not judge.

use std::sync::OnceLock;

use greyrig::effects::{Acts, Description, EffectId, Role};
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use rayon::prelude::*;

use super::classes;
use super::holds::Holds;
use crate::identify::minimise::{Fit, Residuals};
use crate::identify::scales::Scales;
use crate::identify::space::{Freedom, Key, Space};
use crate::model::Kind;

/// Size at which a candidate appears, in typical sizes.
const SMALL: f64 = 0.03;
/// Sensor effects with memory are also linearised at their typical size, because a long lag is not proportional to a
/// short one, and so is what swings, whose frequency rises with its size; other effects with memory only in the second
/// pass ([`Loops::HiddenByNoise`]).
const LONG: f64 = 1.0;
/// Largest size that a linearisation suggests, in typical sizes.
const FARTHEST: f64 = 1.5;
/// Root mean square of a column, for a typical size and in that of the residual, below which it is rounding.
const ROUNDING: f64 = 1e-7;
/// Factor to the neighbouring shapes.
const NEIGHBOUR: f64 = 2.0;
/// Factor between the frequencies of a swing that are tried: with the usual damping of 0.05 a resonance is a tenth
/// wide, so that one of them is no farther off than that.
const NEXT_FREQUENCY: f64 = 1.2;

/// A candidate and what it promises.
#[derive(Debug, Clone)]
pub struct Promise {
    /// The effect.
    pub id: EffectId,
    /// Fall of the error that the linearisation predicts: sum of the logarithms of both balances' RMS.
    pub gain: f64,
    /// The model with it, at the size and shape that the linearisation suggests.
    pub space: Space,
    /// Share of the candidate's column that neither the other parameters nor the supply voltage already explain.
    pub independent: f64,
    /// Its column, weighted.
    pub column: DVector<f64>,
}

/// The effects of the catalogue that a kind of motor can have, that show in the error of a free run, and that
/// recordings of this sort can tell, but for those that are `left_out`; of those that are one while the rotor stands
/// still, one.
pub fn candidates(kind: Kind, holds: Holds, left_out: impl Fn(EffectId) -> bool) -> Vec<&'static Description> {
    let tried = |d: &&Description| d.is_tried(kind.flux_law()) && holds.tells(d) && !left_out(d.id);
    let all: Vec<&'static Description> = Description::all().filter(tried).collect();
    let is_there = |id: &EffectId| all.iter().any(|d| d.id == *id);
    let is_stood_for =
        |d: &Description| classes::at_standstill(d.id).iter().take_while(|id| **id != d.id).any(is_there);
    all.iter().copied().filter(|d| holds.motion || !is_stood_for(d)).collect()
}

/// The part of columns that is orthogonal to the column space of a Jacobian.
pub struct Complement {
    q: DMatrix<f64>,
}

impl Complement {
    /// Of a Jacobian with full column rank; columns without length are left out.
    pub fn of(jacobian: &DMatrix<f64>) -> Self {
        let columns: Vec<DVector<f64>> = jacobian
            .column_iter()
            .filter_map(|c| {
                let length = c.norm();
                (length > 0.0 && length.is_finite()).then(|| c / length)
            })
            .collect();
        let q = if columns.is_empty() {
            DMatrix::zeros(jacobian.nrows(), 0)
        } else {
            DMatrix::from_columns(&columns).qr().q()
        };
        Self { q }
    }

    /// The orthogonal part.
    pub fn project(&self, column: &DVector<f64>) -> DVector<f64> {
        let once = column - &self.q * self.q.tr_mul(column);
        // Twice is enough (Kahan): the first pass leaves rounding errors of the size of the column.
        &once - &self.q * self.q.tr_mul(&once)
    }

    /// A fit with one more column and the step along it, all other parameters free to move; the residuals stay in the
    /// same unit. `fit` is the one whose Jacobian this is of. `None`: hardly `least` of the column is its own.
    pub fn with_column(&self, fit: &Fit, column: &DVector<f64>, least: f64) -> Option<(Fit, f64)> {
        let own = self.project(column);
        let square = own.norm_squared();
        if !square.is_finite() || square <= least * least * column.norm_squared() {
            return None;
        }
        let step = -own.dot(&fit.residuals) / square;
        let mut more = fit.clone();
        more.residuals.axpy(step, &own, 1.0);
        let place = more.jacobian.ncols();
        more.jacobian = more.jacobian.insert_column(place, 0.0);
        more.jacobian.set_column(place, column);
        more.known_held_out = OnceLock::new();
        Some((more, step))
    }
}

/// By how much the error of a fit would rise without one of its effects, by linearisation: sum of the logarithms of
/// both groups' RMS.
pub fn worth(fit: &Fit, groups: &[u8], id: EffectId) -> f64 {
    let own = |key: Key| matches!(key, Key::Effect(other, _) if other == id);
    let keys: Vec<Key> = fit.space.free().map(|e| e.key).collect();
    let others: Vec<usize> = (0..keys.len()).filter(|k| !own(keys[*k])).collect();
    let Some(size) = keys.iter().position(|key| *key == Key::size_of(id)) else { return f64::INFINITY };
    let rest: DMatrix<f64> = fit.jacobian.select_columns(&others);
    let without = &fit.residuals - fit.jacobian.column(size) * fit.space.coordinates()[size];
    log_fall(&Complement::of(&rest).project(&without), &fit.residuals, groups)
}

/// A model with one of its effects at a small size.
pub fn at_small_size(space: &Space, id: EffectId) -> Space {
    at_size(space, id, SMALL)
}

/// A model with one of its effects at a size, in typical ones.
fn at_size(space: &Space, id: EffectId, size: f64) -> Space {
    let mut sized = space.clone();
    if let Some(entry) = sized.get_mut(Key::size_of(id)) {
        entry.value = entry.scale * size;
    }
    sized
}

/// Share of an effect's column, at its usual shape, that the other parameters do not explain; `None` where it does
/// nothing.
pub fn independence(fit: &Fit, problem: &impl Residuals, scales: &Scales, d: &Description) -> Option<f64> {
    let space = at_small_size(&fit.space.with_effect(d.id, scales), d.id);
    let mut column = problem.at(&space, &space.coordinates()) - unweighted(fit, problem);
    for (x, group) in column.iter_mut().zip(problem.groups()) {
        *x /= fit.rms[usize::from(*group)];
    }
    let length = column.norm();
    (length > 0.0).then(|| Complement::of(&fit.jacobian).project(&column).norm() / length)
}

/// What is made of candidates with memory that promise nothing at a small size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loops {
    /// Nothing.
    AsTheyAre,
    /// They are tried at their usual size: a loop is none where the noise of the current turns it round in it.
    HiddenByNoise,
}

/// Tries candidates at the fit of a model, most promising first.
pub fn screen(
    fit: &Fit,
    problem: &impl Residuals,
    scales: &Scales,
    candidates: &[&'static Description],
    loops: Loops,
) -> Vec<Promise> {
    let complement = Complement::of(&fit.jacobian);
    let left = complement.project(&fit.residuals);
    let mut promises: Vec<Promise> =
        candidates.par_iter().filter_map(|d| promise(d, fit, problem, scales, loops, &complement, &left)).collect();
    promises.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    promises
}

fn promise(
    d: &'static Description,
    fit: &Fit,
    problem: &impl Residuals,
    scales: &Scales,
    loops: Loops,
    complement: &Complement,
    left: &DVector<f64>,
) -> Option<Promise> {
    let usual = fit.space.with_effect(d.id, scales);
    let shapes = shapes(d, &usual);
    let best = |tried| best_of(d, tried, fit, problem, complement, left);
    if d.parameters.iter().any(|p| p.role == Role::Frequency) {
        return best(
            [SMALL, LONG].into_iter().flat_map(|size| shapes.iter().map(move |s| (size, s.clone()))).collect(),
        );
    }
    let small = shapes.into_iter().map(|shape| (SMALL, shape));
    let long = || vec![(LONG, usual.clone())];
    if d.acts == Acts::Measuring && d.remembers {
        return best(small.chain(long()).collect());
    }
    best(small.collect()).or_else(|| if d.remembers && loops == Loops::HiddenByNoise { best(long()) } else { None })
}

/// What an effect promises in the best of some shapes, each at a size, in typical ones.
fn best_of(
    d: &'static Description,
    mut tried: Vec<(f64, Space)>,
    fit: &Fit,
    problem: &impl Residuals,
    complement: &Complement,
    left: &DVector<f64>,
) -> Option<Promise> {
    let mut best: Option<Promise> = None;
    let plain = unweighted(fit, problem);
    tried.iter_mut().for_each(|(size, space)| *space = at_size(space, d.id, *size));
    let thetas: Vec<Vec<f64>> = tried.iter().map(|(_, space)| space.coordinates()).collect();
    // They differ in free parameters alone.
    let first = &tried.first()?.1.clone();
    for ((size, mut shaped), residuals) in tried.into_iter().zip(problem.at_each(first, &thetas)) {
        let mut column = (residuals - &plain) / size;
        for (x, group) in column.iter_mut().zip(problem.groups()) {
            *x /= fit.rms[usize::from(*group)];
        }
        let length = column.norm();
        if !length.is_finite() || length <= ROUNDING * (column.len() as f64).sqrt() {
            continue;
        }
        let orthogonal = complement.project(&column);
        let square = orthogonal.norm_squared();
        let independent = square.sqrt() / length;
        if independent < 1e-6 {
            continue;
        }
        let sizes = -orthogonal.dot(left) / square;
        let allowed = d.size().range;
        let value = sizes * shaped.get(Key::size_of(d.id))?.scale;
        if value < allowed.0 {
            continue;
        }
        let gain = log_fall(left, &(left + &orthogonal * sizes), problem.groups());
        if best.as_ref().is_none_or(|b| gain > b.gain) {
            let entry = shaped.get_mut(Key::size_of(d.id))?;
            entry.value = start_size(value, entry.scale).clamp(allowed.0, allowed.1);
            best = Some(Promise { id: d.id, gain, space: shaped, independent, column });
        }
    }
    best
}

/// Two candidates and what they promise together.
#[derive(Debug, Clone)]
pub struct Pair {
    /// The effects.
    pub ids: [EffectId; 2],
    /// Fall of the error that the linearisation predicts for both.
    pub gain: f64,
    /// The model with both, at the sizes that the linearisation suggests.
    pub space: Space,
}

/// Tries the candidates of a screening two at a time, most promising first; never two of one class, which would be
/// named once and fitted twice.
pub fn pairs(fit: &Fit, problem: &impl Residuals, scales: &Scales, promises: &[Promise]) -> Vec<Pair> {
    let complement = Complement::of(&fit.jacobian);
    let left = complement.project(&fit.residuals);
    let columns: Vec<DVector<f64>> = promises.par_iter().map(|p| complement.project(&p.column)).collect();
    let alike = |a: usize, b: usize| classes::same(fit.space.kind(), promises[a].id, promises[b].id);
    let places: Vec<(usize, usize)> = (0..promises.len())
        .flat_map(|a| (a + 1..promises.len()).map(move |b| (a, b)))
        .filter(|(a, b)| !alike(*a, *b))
        .collect();
    let together = |(a, b): &(usize, usize)| {
        let (one, other) = (&columns[*a], &columns[*b]);
        let normal = Matrix2::new(one.norm_squared(), one.dot(other), one.dot(other), other.norm_squared());
        let sizes = -(normal.try_inverse()? * Vector2::new(one.dot(&left), other.dot(&left)));
        let ids = [promises[*a].id, promises[*b].id];
        let mut space = fit.space.with_effect(ids[0], scales).with_effect(ids[1], scales);
        for (promise, size) in [&promises[*a], &promises[*b]].into_iter().zip(sizes.iter()) {
            space.start_from(&promise.space, promise.id);
            let entry = space.get_mut(Key::size_of(promise.id))?;
            let scale = entry.scale;
            let (low, high) = promise.id.description().size().range;
            if size * scale < low {
                return None;
            }
            entry.value = start_size(size * scale, scale).clamp(low, high);
        }
        let gain = log_fall(&left, &(&left + one * sizes[0] + other * sizes[1]), problem.groups());
        Some(Pair { ids, gain, space })
    };
    let mut pairs: Vec<Pair> = places.par_iter().filter_map(together).collect();
    pairs.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    pairs
}

/// A long way from the linearisation it does not hold; the fit goes on by itself.
fn start_size(value: f64, scale: f64) -> f64 {
    value.clamp(-FARTHEST * scale, FARTHEST * scale)
}

/// Sum over both balances of the logarithm by which the RMS falls.
pub fn log_fall(before: &DVector<f64>, after: &DVector<f64>, groups: &[u8]) -> f64 {
    (0u8..2)
        .map(|group| {
            let sum = |r: &DVector<f64>| -> f64 {
                r.iter().zip(groups).filter(|(_, g)| **g == group).map(|(x, _)| x * x).sum()
            };
            let (b, a) = (sum(before), sum(after));
            if b > 0.0 && a > 0.0 { 0.5 * (b / a).ln() } else { 0.0 }
        })
        .sum()
}

fn unweighted(fit: &Fit, problem: &impl Residuals) -> DVector<f64> {
    DVector::from_iterator(
        fit.residuals.len(),
        fit.residuals.iter().zip(problem.groups()).map(|(r, g)| r * fit.rms[usize::from(*g)]),
    )
}

/// The usual shape, those with the first shape parameter larger and smaller, and one that leaves the inductance alone:
/// what the inductance does at a reversal may hide what the back-EMF does.
fn shapes(d: &Description, space: &Space) -> Vec<Space> {
    let with = |place: usize, change: &dyn Fn(f64) -> f64| {
        let mut other = space.clone();
        let entry = other.get_mut(Key::Effect(d.id, place))?;
        let free = matches!(entry.freedom, Freedom::Free(_));
        entry.value = change(entry.value);
        free.then_some(other)
    };
    let frequency = d.parameters.iter().position(|p| p.role == Role::Frequency);
    let frequencies = frequency.into_iter().flat_map(|place| {
        let (low, high) = d.parameters[place].range;
        let next = move |f: &f64| Some(f * NEXT_FREQUENCY).filter(|f| *f < high);
        std::iter::successors(Some(low), next).filter_map(move |f| with(place, &|_| f))
    });
    let first = d.parameters.get(1).filter(|shape| shape.role != Role::Frequency);
    let neighbours = first.into_iter().flat_map(|shape| {
        [NEIGHBOUR, 1.0 / NEIGHBOUR]
            .into_iter()
            .filter_map(|factor| with(1, &|value| (value * factor).clamp(shape.range.0, shape.range.1)))
    });
    let linked = d.parameters.iter().enumerate().filter(|(_, p)| p.role == Role::Linked);
    let alone = linked.filter_map(|(place, p)| with(place, &|_| p.range.0));
    std::iter::once(space.clone()).chain(neighbours).chain(frequencies).chain(alone).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_other_columns_explain_is_taken_away() {
        // Orthogonal to (1, 1, 0): of (1, 0, 2) that is (½, −½, 2). A column without length takes nothing.
        let complement = Complement::of(&DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 1.0, 0.0, 0.0, 0.0]));
        let left = complement.project(&DVector::from_vec(vec![1.0, 0.0, 2.0]));
        assert!((left - DVector::from_vec(vec![0.5, -0.5, 2.0])).norm() < 1e-14);
        assert!(complement.project(&DVector::from_vec(vec![3.0, 3.0, 0.0])).norm() < 1e-14);
        let none = Complement::of(&DMatrix::zeros(2, 0));
        assert_eq!(none.project(&DVector::from_vec(vec![3.0, 4.0])).norm(), 5.0);
    }

    /// The RMS of one balance falls to a half, that of the other to a third: ln 2 + ln 3.
    #[test]
    fn falls_of_both_balances_are_added_as_logarithms() {
        let groups = [0, 1, 0, 1, 0];
        let before = DVector::from_vec(vec![2.0, 3.0, 2.0, -3.0, 2.0]);
        let after = DVector::from_vec(vec![1.0, 1.0, -1.0, 1.0, 1.0]);
        assert!((log_fall(&before, &after, &groups) - 6.0f64.ln()).abs() < 1e-14);
        assert!((log_fall(&after, &before, &groups) + 6.0f64.ln()).abs() < 1e-14, "a rise is negative");
        assert_eq!(log_fall(&before, &before, &groups), 0.0);
        // A balance that there is not, or in which nothing is left, counts for nothing.
        assert!((log_fall(&before, &after, &[0; 5]) - 0.5 * (30.0f64 / 5.0).ln()).abs() < 1e-14);
        assert_eq!(log_fall(&before, &DVector::zeros(5), &groups), 0.0);
    }

    /// A linearisation is believed up to one and a half times a typical size.
    #[test]
    fn a_start_is_not_far_from_the_linearisation() {
        assert_eq!([-9.0, -2.9, 1.0, 3.1].map(|value| start_size(value, 2.0)), [-3.0, -2.9, 1.0, 3.0]);
    }
}
