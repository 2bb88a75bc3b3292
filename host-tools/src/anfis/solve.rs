//! Least squares for the consequents: min |A c − y|² + λ|c|².
//!
//! Jang's recursive least squares, started from c = 0 and S = α I, ends at this minimum with λ = 1/α (α = 10^6: λ =
//! 10^-6). The ridge bounds the condition number of AᵀA + λI by about 10^10 for 10^5 rows, which Cholesky in `f64`
//! bears.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::moments::Moments;
use crate::error::{Error, Result};

/// A solution, and the factors of AᵀA + λI.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The consequents.
    pub consequents: DVector<f64>,
    /// The factors.
    pub factors: Cholesky<f64, Dyn>,
}

/// Solves for the consequents.
///
/// # Errors
/// Sums that are not finite: the data are beyond the range of numbers.
pub fn solve(moments: &Moments, ridge: f64) -> Result<Solution> {
    let mut ridge = ridge;
    // Rounding can make the sum indefinite where λ is below 10^-16 of it; then λ grows.
    for _ in 0..40 {
        let mut matrix = moments.gram.clone();
        for k in 0..matrix.nrows() {
            matrix[(k, k)] += ridge;
        }
        if let Some(factors) = Cholesky::new(matrix) {
            let consequents = factors.solve(&moments.rhs);
            if consequents.iter().all(|c| c.is_finite()) {
                return Ok(Solution { consequents, factors });
            }
        }
        ridge *= 10.0;
    }
    Err(Error::usage(
        "least squares has no finite solution",
        "check the data for values that are out of all proportion, or raise --ridge",
    ))
}

/// As [`solve`], with the consequents of some rules held at zero.
///
/// # Errors
/// As [`solve`].
pub fn solve_active(moments: &Moments, ridge: f64, active: &[bool], width: usize) -> Result<DVector<f64>> {
    let kept: Vec<usize> = (0..moments.rhs.len()).filter(|k| active[k / width]).collect();
    let part = Moments {
        gram: DMatrix::from_fn(kept.len(), kept.len(), |a, b| moments.gram[(kept[a], kept[b])]),
        rhs: DVector::from_fn(kept.len(), |a, _| moments.rhs[kept[a]]),
    };
    let solution = solve(&part, ridge)?;
    let mut all = DVector::zeros(moments.rhs.len());
    for (k, c) in kept.iter().zip(solution.consequents.iter()) {
        all[*k] = *c;
    }
    Ok(all)
}
