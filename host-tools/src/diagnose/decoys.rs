//! Causes that are none: what a candidate has to beat before it counts.
//!
//! A random walk and a sine of unrelated frequency in the voltage and in the torque, and the best candidates' own
//! columns shifted in time. A residual with structure of its own is "explained" by such things to some degree, often
//! with an impressive t-value; nothing that does not clearly beat them is named.

use std::f64::consts::TAU;

use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::screening::Complement;
use crate::identify::cross_validation::held_out;
use crate::identify::minimise::{Fit, HeldOut};

/// Cosine to a candidate's column above which a decoy is none.
const LIKENESS: f64 = 0.2;

/// Least part of a decoy that the parameters do not already explain, above rounding.
const LEAST_OWN: f64 = 1e-6;

/// How many of each sort.
const EACH: usize = 4;

/// Held-out errors of a fit with each decoy added.
pub fn tried(
    fit: &Fit,
    groups: &[u8],
    times: &[(usize, f64)],
    blocks: &[usize],
    columns: &[DVector<f64>],
    seed: u64,
) -> Vec<HeldOut> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut decoys: Vec<DVector<f64>> = Vec::new();
    let rows = groups.len();
    for n in 0..EACH {
        for group in [0u8, 1] {
            let mut walk = 0.0;
            decoys.push(DVector::from_iterator(
                rows,
                groups.iter().map(|g| {
                    let z: f64 = StandardNormal.sample(&mut random);
                    walk += z;
                    if *g == group { walk } else { 0.0 }
                }),
            ));
            let frequency = [0.137, 1.73, 7.31, 23.9][n % 4];
            let phase = random.random_range(0.0..TAU);
            decoys.push(DVector::from_iterator(
                rows,
                groups
                    .iter()
                    .zip(times)
                    .map(|(g, (_, t))| if *g == group { (TAU * frequency * t + phase).sin() } else { 0.0 }),
            ));
        }
    }
    for column in columns.iter().take(EACH) {
        let shift = random.random_range(rows / 5..rows - rows / 5);
        decoys.push(DVector::from_iterator(
            rows,
            (0..rows).map(|k| {
                let from = (k + shift) % rows;
                if groups[from] == groups[k] { column[from] } else { 0.0 }
            }),
        ));
    }
    let complement = Complement::of(&fit.jacobian);
    let real: Vec<DVector<f64>> = columns.iter().map(|c| complement.project(c)).collect();
    // What looks like an effect is no decoy: a shifted copy of a slowly changing column is that column.
    let unlike = |decoy: &&DVector<f64>| {
        let own = complement.project(decoy);
        real.iter().all(|r| own.dot(r).abs() < LIKENESS * own.norm() * r.norm())
    };
    let with = |decoy| complement.with_column(fit, decoy, LEAST_OWN).map(|(more, _)| held_out(&more, groups, blocks));
    decoys.iter().filter(unlike).filter_map(with).collect()
}

#[cfg(test)]
mod tests {
    use greyrig::motor::BaseParameter;
    use nalgebra::DMatrix;

    use super::*;
    use crate::identify::space::{Freedom, Space};
    use crate::model::{Base, Kind};

    const ROWS: usize = 400;

    /// A fit of R alone, whose column is a constant, with these residuals.
    fn fit(residuals: DVector<f64>) -> Fit {
        let mut space = Space::new(Kind::PmDc, Base::Full, &[]);
        let others = BaseParameter::ALL.into_iter().filter(|p| *p != BaseParameter::R);
        space.hold(others, Freedom::Pinned);
        let jacobian = DMatrix::from_element(residuals.len(), 1, 1.0);
        Fit { space, residuals, jacobian, rms: [1.0; 2], ended: true, known_held_out: std::sync::OnceLock::new() }
    }

    fn blocks() -> Vec<usize> {
        (0..ROWS).map(|row| row / 40).collect()
    }

    fn sine(periods: f64) -> DVector<f64> {
        DVector::from_fn(ROWS, |row, _| (TAU * periods * row as f64 / ROWS as f64).sin())
    }

    #[test]
    fn a_column_takes_what_it_explains_on_data_held_out_and_no_more() {
        let fit = fit(sine(3.0));
        let complement = Complement::of(&fit.jacobian);
        let error = |column: &DVector<f64>| {
            let (more, _) = complement.with_column(&fit, column, LEAST_OWN).unwrap();
            held_out(&more, &[0; ROWS], &blocks()).rms()[0]
        };
        // Of either sign and any size; the curvature that keeps parameters in place is a millionth.
        assert!(error(&(sine(3.0) * -7.0)) < 1e-4);
        // One that is orthogonal to the residuals takes nothing. Least squares of a constant and that sine
        // (numpy.linalg), each block left out, predict it with 0.834 188.
        let unrelated = error(&sine(5.0));
        assert!((unrelated - 0.834_188).abs() < 1e-5, "{unrelated}");
    }

    #[test]
    fn a_column_that_the_fit_has_already_is_no_decoy() {
        let fit = fit(sine(3.0));
        let complement = Complement::of(&fit.jacobian);
        let tried = |column: DVector<f64>| complement.with_column(&fit, &column, LEAST_OWN).is_some();
        assert!(!tried(DVector::from_element(ROWS, 2.0)) && !tried(DVector::zeros(ROWS)));
        assert!(!tried(DVector::from_element(ROWS, f64::NAN)));
        assert!(tried(sine(1.0)));
    }

    /// Four random walks and four sines in either balance, and a shifted copy of each of the four best candidates, but
    /// for those that look like a candidate.
    #[test]
    fn decoys_are_repeatable_and_unlike_the_candidates() {
        let groups: Vec<u8> = (0..ROWS).map(|row| (row % 2) as u8).collect();
        let times: Vec<(usize, f64)> = (0..ROWS).map(|row| (0, 0.01 * row as f64)).collect();
        let fit = fit(sine(3.0));
        let of = |columns: &[DVector<f64>], seed| {
            let errors = tried(&fit, &groups, &times, &blocks(), columns, seed);
            errors.iter().map(|held_out| held_out.rms()).collect::<Vec<_>>()
        };
        assert_eq!(of(&[], 1).len(), 16);
        assert_eq!(of(&[], 1), of(&[], 1));
        assert_ne!(of(&[], 1), of(&[], 2));
        // The shifted copy of a constant in one balance is that constant, and is left out.
        let constant = DVector::from_fn(ROWS, |row, _| f64::from(row % 2 == 0));
        assert!(of(&[constant], 1).len() <= 16);
        let quick: Vec<DVector<f64>> = (0..6).map(|n| sine(50.0 + 3.0 * f64::from(n))).collect();
        assert!(of(&quick, 1).len() <= 20, "copies of the four best alone");
    }
}
