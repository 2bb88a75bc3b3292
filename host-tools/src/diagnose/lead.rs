//! When no effect of the catalogue explains what is left: its shape, and a sparse formula as a lead.
//!
//! Generic terms in current, speed and their signs are tried in the voltage and in the torque balance by orthogonal
//! matching pursuit on data held out. They have no physical meaning by themselves; they show what a term for `--term`
//! would have to look like.
//!
//! Source: S. Billings, S. Chen, M. Korenberg: Identification of MIMO non-linear systems using a forward-regression
//! orthogonal estimator, Int. J. Control 49 (1989) 2157–2189.

use greyrig::motor::BaseParameter;
use nalgebra::DVector;
use serde::Serialize;

use super::screening::Complement;
use crate::identify::cross_validation::{held_out, p_value};
use crate::identify::equation_error::{Balance, EquationError};
use crate::identify::minimise::{Fit, Residuals};
use crate::model::Kind;

/// Terms in a lead at most.
const MOST_TERMS: usize = 3;
/// Least fall of the held-out error for a term to count, sum of logarithms.
const LEAST_GAIN: f64 = 0.05;
/// Least part of a column that the parameters do not already explain.
const LEAST_OWN: f64 = 3e-3;
/// Largest p-value over the number of terms tried.
const SIGNIFICANCE: f64 = 0.01;

/// Share of the drive K φ i that a term of the torque balance may have. With inertia and friction free, one that takes
/// the drive away takes the whole balance away, and with it what is left over.
const LARGEST_SHARE: f64 = 0.5;

/// A generic term: its formula, its balance, its value at current (A), speed (rad/s) and di/dt (A/s).
type Generic = (&'static str, Balance, fn(f64, f64, f64) -> f64);

const TERMS: &[Generic] = &[
    ("1", Balance::Voltage, |_, _, _| 1.0),
    ("sign(i)", Balance::Voltage, |i, _, _| i.signum()),
    ("i*abs(i)", Balance::Voltage, |i, _, _| i * i.abs()),
    ("i^3", Balance::Voltage, |i, _, _| i.powi(3)),
    ("w", Balance::Voltage, |_, w, _| w),
    ("i*w^2", Balance::Voltage, |i, w, _| i * w * w),
    ("i*abs(i)*w", Balance::Voltage, |i, w, _| i * i.abs() * w),
    ("i^3*w", Balance::Voltage, |i, w, _| i.powi(3) * w),
    ("sign(i)*w", Balance::Voltage, |i, w, _| i.signum() * w),
    ("i^2*di/dt", Balance::Voltage, |i, _, d| i * i * d),
    ("abs(i)*di/dt", Balance::Voltage, |i, _, d| i.abs() * d),
    ("w*di/dt", Balance::Voltage, |_, w, d| w * d),
    ("w*sign(di/dt)", Balance::Voltage, |_, w, d| w * d.signum()),
    ("1", Balance::Torque, |_, _, _| 1.0),
    ("sign(w)", Balance::Torque, |_, w, _| w.signum()),
    ("abs(w)", Balance::Torque, |_, w, _| w.abs()),
    ("w", Balance::Torque, |_, w, _| w),
    ("w*abs(w)", Balance::Torque, |_, w, _| w * w.abs()),
    ("w^3", Balance::Torque, |_, w, _| w.powi(3)),
    ("i^2", Balance::Torque, |i, _, _| i * i),
    ("i^4", Balance::Torque, |i, _, _| i.powi(4)),
    ("i^2*w", Balance::Torque, |i, w, _| i * i * w),
    ("i", Balance::Torque, |i, _, _| i),
];

/// A term of a lead.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeadTerm {
    /// Formula without its coefficient.
    pub formula: String,
    /// `voltage` (V, on the side of R i) or `torque` (N m, braking).
    pub balance: &'static str,
    /// Its coefficient, SI.
    pub coefficient: f64,
}

/// A sparse formula for what is left, and by how much it would lower the error on data held out (0.4 is 40 %).
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Lead {
    /// Its terms, the strongest first.
    pub terms: Vec<LeadTerm>,
    /// Fall of the held-out error.
    pub held_out_gain: f64,
}

impl Lead {
    /// The formula as `--term` takes it, one for each term (those with di/dt are no formulas of the state).
    pub fn as_arguments(&self) -> Vec<String> {
        self.terms
            .iter()
            .enumerate()
            .filter(|(_, t)| !t.formula.contains("di/dt"))
            .map(|(n, t)| {
                let letter = ["a", "b", "c"][n.min(2)];
                let formula = if t.formula == "1" { letter.to_owned() } else { format!("{letter}*{}", t.formula) };
                if t.balance == "torque" { format!("torque: {formula}") } else { formula }
            })
            .collect()
    }
}

/// Looks for a lead in what a fit leaves over.
pub fn find(fit: &Fit, problem: &EquationError<'_>, blocks: &[usize]) -> Lead {
    let groups = problem.groups();
    let columns: Vec<DVector<f64>> = TERMS
        .iter()
        .map(|(_, balance, term)| {
            let mut column = problem.column(*balance, term);
            for (x, group) in column.iter_mut().zip(groups) {
                *x /= fit.rms[usize::from(*group)];
            }
            column
        })
        .collect();
    let drive = drive(fit, problem);
    let before = held_out(fit, groups, blocks);
    let (mut present, mut last) = (fit.clone(), before.clone());
    let mut chosen: Vec<usize> = Vec::new();
    while chosen.len() < MOST_TERMS {
        let complement = Complement::of(&present.jacobian);
        let with = |k: usize| {
            let (more, step) = complement.with_column(&present, &columns[k], LEAST_OWN)?;
            let is_drive =
                TERMS[k].1 == Balance::Torque && drive > 0.0 && step.abs() * columns[k].norm() > LARGEST_SHARE * drive;
            (!is_drive).then(|| (k, more.residuals.norm_squared(), more))
        };
        let others = (0..TERMS.len()).filter(|k| !chosen.contains(k));
        let best = others.filter_map(with).min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((k, _, more)) = best else { break };
        let after = held_out(&more, groups, blocks);
        let gain = last.log_error() - after.log_error();
        let p = p_value(&last, &after, &more, groups, 1) * TERMS.len() as f64;
        if gain < LEAST_GAIN || p > SIGNIFICANCE {
            break;
        }
        chosen.push(k);
        (present, last) = (more, after);
    }
    let coefficients = solve(fit, &columns, &chosen);
    let terms = chosen
        .iter()
        .zip(coefficients)
        .map(|(k, coefficient)| LeadTerm {
            formula: TERMS[*k].0.to_owned(),
            balance: if TERMS[*k].1 == Balance::Voltage { "voltage" } else { "torque" },
            coefficient,
        })
        .collect();
    Lead { terms, held_out_gain: 1.0 - (last.log_error() - before.log_error()).exp().sqrt() }
}

/// The drive K φ i in the torque balance, φ without saturation, weighted as the residuals are; 0 where the torque was
/// measured.
fn drive(fit: &Fit, problem: &EquationError<'_>) -> f64 {
    let column = match fit.space.kind() {
        Kind::Universal => problem.column(Balance::Torque, &|i, _, _| i * i),
        Kind::PmDc => problem.column(Balance::Torque, &|i, _, _| i),
    };
    fit.space.value(BaseParameter::K) * column.norm() / fit.rms[1]
}

/// Coefficients of the chosen columns with all parameters free.
fn solve(fit: &Fit, columns: &[DVector<f64>], chosen: &[usize]) -> Vec<f64> {
    if chosen.is_empty() {
        return Vec::new();
    }
    let complement = Complement::of(&fit.jacobian);
    let own: Vec<DVector<f64>> = chosen.iter().map(|k| complement.project(&columns[*k])).collect();
    let matrix = nalgebra::DMatrix::from_columns(&own);
    let left = complement.project(&fit.residuals);
    match matrix.svd(true, true).solve(&left, 1e-12) {
        Ok(solution) => solution.iter().map(|x| -x).collect(),
        Err(_) => vec![0.0; chosen.len()],
    }
}
