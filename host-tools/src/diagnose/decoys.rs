//! Causes that are none: what a candidate has to beat before it counts.
//!
//! A random walk and a sine of unrelated frequency in the voltage and in the torque, and the best candidates' own columns
//! shifted in time. A residual with structure of its own is "explained" by such things to some degree, often with an
//! impressive t-value; nothing that does not clearly beat them is named.

use std::f64::consts::TAU;

use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::blocks::{HeldOut, held_out};
use super::screening::Complement;
use crate::identify::minimise::Refined;

/// Cosine to a candidate's column above which a decoy is none.
const LIKENESS: f64 = 0.2;

/// How many of each sort.
const EACH: usize = 4;

/// Held-out errors of a fit with each decoy added.
pub fn tried(
    fit: &Refined,
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
    decoys.iter().filter(unlike).filter_map(|decoy| with_column(fit, &complement, decoy, groups, blocks)).collect()
}

/// The held-out errors of a fit with one more column, at its least-squares coefficient.
fn with_column(
    fit: &Refined,
    complement: &Complement,
    column: &DVector<f64>,
    groups: &[u8],
    blocks: &[usize],
) -> Option<HeldOut> {
    let orthogonal = complement.project(column);
    let square = orthogonal.norm_squared();
    if square <= 1e-12 * column.norm_squared() || !square.is_finite() {
        return None;
    }
    let coefficient = -orthogonal.dot(&fit.residuals) / square;
    let mut more = fit.clone();
    more.residuals += orthogonal.clone() * coefficient;
    let place = more.jacobian.ncols();
    more.jacobian = more.jacobian.insert_column(place, 0.0);
    more.jacobian.set_column(place, &orthogonal);
    Some(held_out(&more, groups, blocks))
}
