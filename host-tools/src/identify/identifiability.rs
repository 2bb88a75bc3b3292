//! What the recordings cannot tell, why, and which recording would.

use greyrig::motor::BaseParameter;
use nalgebra::DMatrix;

use super::intervals::Covariance;
use super::inverse_dynamics::Columns;
use super::minimise::Fit;
use super::space::{Entry, Freedom, Key, Space};
use crate::error::{Error, Insufficient, Result};
use crate::experiment::{Drive, Experiment};
use crate::model::Kind;

/// A standard deviation in the optimiser's coordinates above which a parameter counts as not determined: half of its
/// value for R, L, K and J, and for friction half of its typical share of a tenth of the largest torque.
const LARGEST_DEVIATION: f64 = 0.5;

/// Parameters with a loading above this take part in a weak direction.
const LOADING: f64 = 0.3;

/// The same for shapes of effects, which have a usual value: wherever one takes part at all, holding it costs least.
const SHAPE_LOADING: f64 = 0.03;

/// Relative variation of voltage, current and speed below which a recording holds one operating point only.
const CONSTANT: f64 = 0.01;

/// A direction in which the data leave the parameters open.
#[derive(Debug, Clone, PartialEq)]
pub struct Weakness {
    /// The parameter that is held to close it.
    pub held: Key,
    /// Reason and remedy in words.
    pub text: String,
}

/// Holds the parameter of a weak direction: friction at zero, anything else at its start value.
pub fn close(space: &mut Space, weakness: &Weakness) {
    if let Some(entry) = space.get_mut(weakness.held) {
        if !entry.positive {
            entry.value = 0.0;
        }
        entry.freedom = Freedom::Pinned;
    }
}

/// Holds what needs a channel that no recording has.
///
/// # Errors
/// When nothing could be simulated without the held value.
pub fn missing_channels(space: &mut Space, experiments: &[Experiment]) -> Result<Vec<Weakness>> {
    let mut found = Vec::new();
    let has_current = experiments.iter().any(|e| e.current.is_some());
    let moves = experiments.iter().any(|e| e.speed.is_some());
    if !has_current {
        let open: Vec<&'static str> = [BaseParameter::R, BaseParameter::L]
            .into_iter()
            .filter(|p| space.get(*p).is_some_and(|e| matches!(e.freedom, Freedom::Free(_))))
            .map(BaseParameter::name)
            .collect();
        if !open.is_empty() {
            return Err(Error::insufficient(experiments[0].place(), Insufficient::NoCurrent(open)));
        }
        if space.kind() == Kind::Universal {
            return Err(Error::insufficient(experiments[0].place(), Insufficient::NoFlux));
        }
    }
    if !moves {
        if let Some(e) = experiments.iter().find(|e| !(0..e.len()).all(|n| e.is_locked(n))) {
            return Err(Error::insufficient(e.place(), Insufficient::NoSpeed));
        }
        for parameter in [BaseParameter::K, BaseParameter::J].into_iter().chain(BaseParameter::FRICTIONS) {
            if let Some(entry) = space.get_mut(parameter)
                && matches!(entry.freedom, Freedom::Free(_))
            {
                entry.freedom = Freedom::Untold;
            }
        }
        found.push(Weakness {
            held: BaseParameter::K.into(),
            text: "with a locked rotor, K, J and the friction do not act: record the running motor as well".to_owned(),
        });
    }
    Ok(found)
}

/// Refuses recordings that together hold a single constant operating point.
///
/// # Errors
/// [`Insufficient::OneOperatingPoint`].
pub fn check_excitation(experiments: &[Experiment]) -> Result<()> {
    match rests(experiments) {
        true => Err(Error::insufficient(experiments[0].place(), Insufficient::OneOperatingPoint)),
        false => Ok(()),
    }
}

/// Whether voltage, current and speed hardly vary in any recording and are alike in all.
fn rests(experiments: &[Experiment]) -> bool {
    let varies = |signal: &Option<Vec<f64>>, e: &Experiment| {
        signal.as_ref().is_some_and(|s| {
            let filtered = e.filtered(s);
            relative_spread((0..e.len()).filter(|n| e.counted[*n]).map(|n| filtered[n])) > CONSTANT
        })
    };
    let constant = |e: &Experiment| {
        let input = Some(e.input.clone());
        !varies(&input, e) && !varies(&e.current, e) && !varies(&e.speed, e)
    };
    if !experiments.iter().all(constant) {
        return false;
    }
    let level = |e: &Experiment| e.input.iter().sum::<f64>() / e.len() as f64;
    let first = level(&experiments[0]);
    experiments.iter().all(|e| (level(e) - first).abs() <= CONSTANT * first.abs())
}

fn relative_spread(values: impl Iterator<Item = f64>) -> f64 {
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for x in values {
        n += 1.0;
        sum += x;
        squares += x * x;
    }
    if n == 0.0 || squares == 0.0 {
        return 0.0;
    }
    let variance = (squares / n - (sum / n).powi(2)).max(0.0);
    (variance / (squares / n)).sqrt()
}

/// The weakest direction of an output-error fit, if it is too weak.
pub fn of_fit(refined: &Fit, covariance: Option<&Covariance>, experiments: &[Experiment]) -> Option<Weakness> {
    let entries: Vec<&Entry> = refined.space.free().collect();
    let direction = open_direction(refined, covariance)?;
    let has_current = experiments.iter().any(|e| e.drive == Drive::Voltage && e.current.is_some());
    Some(describe(&entries, &direction, has_current))
}

/// The shape of an effect that takes part in the weakest direction of an output-error fit, if that is too weak.
pub fn open_shape(refined: &Fit, covariance: Option<&Covariance>) -> Option<Key> {
    let entries: Vec<&Entry> = refined.space.free().collect();
    let direction = open_direction(refined, covariance)?;
    involved(&entries, &direction).into_iter().find(|e| e.is_shape()).map(|e| e.key)
}

fn open_direction(refined: &Fit, covariance: Option<&Covariance>) -> Option<Vec<f64>> {
    match covariance {
        Some(c) => too_wide(&c.matrix),
        None => null_direction(&refined.jacobian),
    }
}

/// The weakest direction of a regression on torque, if it is too weak.
pub fn of_columns(space: &Space, columns: &Columns, covariance: &Covariance) -> Option<Weakness> {
    let rms = columns.target.norm();
    let p = columns.entries.len();
    // In units of the torque: a deviation of one is a column as large as the whole torque.
    let size: Vec<f64> = columns.matrix.column_iter().map(|c| c.norm() / rms).collect();
    let scaled = DMatrix::from_fn(p, p, |r, c| covariance.matrix[(r, c)] * size[r] * size[c]);
    let direction = too_wide(&scaled)?;
    let entries: Vec<&Entry> = columns.entries.iter().map(|k| &space.entries[*k]).collect();
    Some(describe(&entries, &direction, true))
}

fn too_wide(matrix: &DMatrix<f64>) -> Option<Vec<f64>> {
    let p = matrix.nrows();
    let widest = (0..p).map(|k| matrix[(k, k)].sqrt()).fold(0.0f64, f64::max);
    if widest <= LARGEST_DEVIATION {
        return None;
    }
    let eigen = matrix.clone().symmetric_eigen();
    let largest = (0..p).max_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]))?;
    Some(eigen.eigenvectors.column(largest).iter().copied().collect())
}

/// The direction that changes the residuals least, in columns of equal length.
fn null_direction(jacobian: &DMatrix<f64>) -> Option<Vec<f64>> {
    let p = jacobian.ncols();
    let lengths: Vec<f64> = jacobian.column_iter().map(|c| c.norm()).collect();
    if let Some(dead) = lengths.iter().position(|l| *l == 0.0 || !l.is_finite()) {
        return Some((0..p).map(|k| if k == dead { 1.0 } else { 0.0 }).collect());
    }
    let normal = jacobian.tr_mul(jacobian);
    let scaled = DMatrix::from_fn(p, p, |r, c| normal[(r, c)] / (lengths[r] * lengths[c]));
    let eigen = scaled.symmetric_eigen();
    let least = (0..p).min_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]))?;
    Some(eigen.eigenvectors.column(least).iter().copied().collect())
}

/// The parameters that take part in a direction.
fn involved<'e>(entries: &[&'e Entry], direction: &[f64]) -> Vec<&'e Entry> {
    let largest = direction.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let takes_part = |e: &Entry, x: f64| x.abs() > largest * if e.is_shape() { SHAPE_LOADING } else { LOADING };
    entries.iter().zip(direction).filter(|(e, x)| takes_part(e, **x)).map(|(e, _)| *e).collect()
}

fn describe(entries: &[&Entry], direction: &[f64], has_current: bool) -> Weakness {
    let taking_part = involved(entries, direction);
    let of_effect = |shape: bool| taking_part.iter().find(|e| e.of_effect() && e.is_shape() == shape);
    let of_base = |all: &[BaseParameter]| {
        all.iter().find_map(|parameter| taking_part.iter().find(|e| e.key == Key::Base(*parameter)))
    };
    // Shapes of effects have a usual value; friction terms are the ones that a motor can do without.
    let held = of_effect(true)
        .or_else(|| of_effect(false))
        .or_else(|| of_base(&[BaseParameter::Mu1, BaseParameter::Mu2, BaseParameter::Mu0]))
        .or_else(|| of_base(&[BaseParameter::L, BaseParameter::J, BaseParameter::K, BaseParameter::R]))
        .unwrap_or(&entries[0]);
    let (key, held) = (held.key, held.name.as_str());
    let others: Vec<&str> = taking_part.iter().filter(|e| e.key != key).map(|e| e.name.as_str()).collect();
    let remedy = match key.base() {
        Some(BaseParameter::Mu1) if !has_current => "record the current, or fix K or mu1",
        Some(BaseParameter::Mu0 | BaseParameter::Mu1 | BaseParameter::Mu2) => {
            "record more speeds: a staircase from low to high voltage, and a coast-down"
        }
        Some(BaseParameter::L) => "record AC, or steps of the voltage",
        Some(BaseParameter::J) => "record changes of speed: a ramp, steps, or a coast-down",
        Some(BaseParameter::K | BaseParameter::R) => "record two or more speeds, or add a run with the rotor locked",
        None => "record another excitation",
    };
    let is_friction = key.base().is_some_and(BaseParameter::is_friction);
    let at = if is_friction { "zero" } else { "its start value" };
    let text = if others.is_empty() {
        format!("{held} cannot be identified from these recordings and is held at {at}: {remedy}")
    } else {
        format!(
            "{held} cannot be separated from {} in these recordings and is held at {at}: {remedy}",
            others.join(", ")
        )
    };
    Weakness { held: key, text }
}
