//! The fit of the mechanical side alone, by linear least squares of the inverse dynamics.

use std::collections::BTreeMap;

use nalgebra::DVector;

use super::identification::Outcome;
use super::intervals::of_fit::numbered;
use super::intervals::{block_length_s, covariance, slowest_correlation_time_s};
use super::space::Space;
use super::{identifiability, inverse_dynamics};
use crate::error::{Error, Insufficient, Result};
use crate::experiment::Experiment;

/// The cut-off that the motion of all recordings allows, Hz.
pub fn cutoff_hz(experiments: &[Experiment]) -> f64 {
    let each = experiments.iter().filter_map(|e| {
        let (motion, derivatives) = match &e.position {
            Some(angle) => (angle, 2),
            None => (e.speed.as_ref()?, 1),
        };
        Some(inverse_dynamics::automatic_cutoff_hz(motion, derivatives, e.interval_s))
    });
    each.fold(f64::INFINITY, f64::min).min(250.0)
}

/// Fits what is free.
///
/// # Errors
/// Recordings that are too short, or move too little.
pub fn fit(mut space: Space, experiments: &[Experiment], cutoff_hz: f64) -> Result<Outcome> {
    let few = || Error::insufficient(experiments[0].place(), Insufficient::TooLittleMotion);
    let mut weaknesses = Vec::new();
    loop {
        let columns = inverse_dynamics::columns(&space, experiments, cutoff_hz).ok_or_else(few)?;
        let p = columns.entries.len();
        if p == 0 || columns.target.len() < 4 * p {
            return Err(few());
        }
        let lengths: Vec<f64> = columns.matrix.column_iter().map(|c| c.norm().max(1e-300)).collect();
        let scaled = nalgebra::DMatrix::from_fn(columns.target.len(), p, |r, c| columns.matrix[(r, c)] / lengths[c]);
        let solution = scaled.clone().svd(true, true).solve(&columns.target, 1e-12).map_err(|_| few())?;
        for (c, entry) in columns.entries.iter().enumerate() {
            space.entries[*entry].value = solution[c] / lengths[c];
            // Coordinates of the covariance below: the coefficient itself.
            space.entries[*entry].positive = false;
            space.entries[*entry].scale = 1.0;
        }
        let residuals: DVector<f64> = &scaled * &solution - &columns.target;
        let interval = columns.times.windows(2).map(|t| t[1].1 - t[0].1).find(|d| *d > 0.0).unwrap_or(1.0);
        let total = columns.target.len() as f64 * interval;
        let correlation = slowest_correlation_time_s(residuals.as_slice(), interval);
        let block = block_length_s(correlation, total, p);
        let blocks = numbered(columns.times.iter().map(|(r, t)| (*r, (t / block) as usize)));
        let covariance = covariance(&columns.matrix, &residuals, &blocks);
        if let Some(weakness) = covariance.as_ref().and_then(|c| identifiability::of_columns(&space, &columns, c))
            && weaknesses.len() < p
        {
            identifiability::close(&mut space, &weakness);
            weaknesses.push(weakness);
            continue;
        }
        let esr = BTreeMap::from([("torque".to_owned(), residuals.norm() / columns.target.norm())]);
        return Ok(Outcome { space, covariance, weaknesses, method: "inverse dynamics", esr, ambiguous: Vec::new() });
    }
}
