//! The band round a free run that holds a share of what the motor's measuring chain shows.
//!
//! Half its width at a sample is `√((q σ)² + (t s)²)`:
//!
//! - σ is the deviation of measured − modelled as the fit has left it there ([`Scatter`](crate::model::Scatter)): noise
//!   of the chain, fluctuations of load and supply, and what the model lacks; q of them have held the share.
//! - s is the standard deviation that the uncertain parameters give the free run: `s² = Σ_j (∂y/∂θ · v_j)²`, v_j the
//!   principal axes of their covariance, each tried in both directions; t is Student's, of the degrees of freedom of
//!   the covariance.
//!
//! What the learned correction adds is not uncertain in s. A begin that is not measured is believed.

use nalgebra::DMatrix;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::scatter::Doing;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::experiment::{Experiment, Imposed};
use crate::model::{Fitted, Model, Uncertainty};

/// Largest relative change of a parameter that a direction is tried with, so that the free run answers in proportion.
const LARGEST_TRIED: f64 = 0.01;
/// Share of the variance of the largest axis from which another one is tried: below, rounding of the file.
const LEAST_AXIS: f64 = 1e-14;

/// Half the width of the band of current (A) and speed (rad/s) at each sample; `None` of a signal that the fit has not
/// seen.
///
/// # Errors
/// Parameters that the stepper refuses; an interrupt.
pub fn half_widths(
    model: &Model,
    fitted: &Fitted,
    e: &Experiment,
    [current, speed]: [&[f64]; 2],
    share: f64,
    ctx: &Context,
) -> Result<[Option<Vec<f64>>; 2]> {
    let none = || [vec![0.0; e.len()], vec![0.0; e.len()]];
    let (variances, times) = match &fitted.uncertainty {
        Some(uncertainty) => {
            let student = StudentsT::new(0.0, 1.0, uncertainty.freedom);
            (of_parameters(model, uncertainty, e, ctx)?, student.map_or(f64::NAN, |t| t.inverse_cdf(0.5 + 0.5 * share)))
        }
        None => (none(), 0.0),
    };
    let doing = Doing::of(current, speed, e.interval_s);
    let rest = Doing::default();
    let of = |k: usize| {
        let scatter = if k == 0 { &fitted.current } else { &fitted.speed };
        let scatter = scatter.as_ref()?;
        let q = scatter.times(share);
        let half = |n: usize| {
            // What is imposed is known: there is the noise of the chain alone.
            let is_imposed = if k == 0 { e.is_open(n) } else { e.is_locked(n) };
            let deviation = scatter.deviation(if is_imposed { &rest } else { &doing[n] });
            (q * deviation).hypot(times * variances[k][n].sqrt())
        };
        Some((0..e.len()).map(half).collect())
    };
    Ok([of(0), of(1)])
}

/// Variance that uncertain parameters give current, A², and speed, rad²/s², of the free run at each sample.
fn of_parameters(model: &Model, uncertainty: &Uncertainty, e: &Experiment, ctx: &Context) -> Result<[Vec<f64>; 2]> {
    let axes = axes(uncertainty);
    let steps = ctx.steps("band", axes.len() as u64);
    let along = |axis: &Vec<f64>| -> Result<[Vec<f64>; 2]> {
        ctx.check()?;
        let tried = largest_tried(model, uncertainty, axis);
        let [up, down] = [tried, -tried].map(|by| moved_run(model, uncertainty, axis, by, e));
        let (up, down) = (up?, down?);
        steps.next();
        Ok([0, 1].map(|k| up[k].iter().zip(&down[k]).map(|(up, down)| ((up - down) / (2.0 * tried)).powi(2)).collect()))
    };
    let none = || [vec![0.0; e.len()], vec![0.0; e.len()]];
    let sum = |mut a: [Vec<f64>; 2], b: [Vec<f64>; 2]| {
        for (a, b) in a.iter_mut().flatten().zip(b.iter().flatten()) {
            *a += b;
        }
        a
    };
    axes.par_iter().map(along).try_reduce(none, |a, b| Ok(sum(a, b)))
}

/// The principal axes of the covariance, each as long as its standard deviation, in the parameters' units.
fn axes(uncertainty: &Uncertainty) -> Vec<Vec<f64>> {
    let n = uncertainty.names.len();
    let eigen = DMatrix::from_fn(n, n, |r, c| uncertainty.correlation(r, c)).symmetric_eigen();
    let largest = eigen.eigenvalues.iter().fold(0.0f64, |m, x| m.max(*x));
    (0..n)
        .filter(|k| eigen.eigenvalues[*k] > LEAST_AXIS * largest)
        .map(|k| {
            let length = eigen.eigenvalues[k].sqrt();
            (0..n).map(|row| length * eigen.eigenvectors[(row, k)] * uncertainty.deviations[row]).collect()
        })
        .collect()
}

/// Share of an axis that moves no parameter by more than what is tried.
fn largest_tried(model: &Model, uncertainty: &Uncertainty, axis: &[f64]) -> f64 {
    let share = |(name, by): (&String, &f64)| {
        let value = model.value_of(name).unwrap_or(0.0).abs();
        if value > 0.0 && *by != 0.0 { LARGEST_TRIED * value / by.abs() } else { 1.0 }
    };
    uncertainty.names.iter().zip(axis).map(share).fold(1.0, f64::min)
}

/// The free run with the parameters moved along an axis, in `f64`: differences of `f32` would be rounding.
fn moved_run(model: &Model, uncertainty: &Uncertainty, axis: &[f64], by: f64, e: &Experiment) -> Result<[Vec<f64>; 2]> {
    let mut moved = model.clone();
    for (name, part) in uncertainty.names.iter().zip(axis) {
        if let Some(value) = moved.value_mut(name) {
            *value += by * part;
        }
    }
    let refused =
        |error: greyrig::motor::ParameterError| Error::usage(format!("{}: {error}", e.name), "leave out --band");
    let motor = moved.motor::<f64>().map_err(refused)?;
    let mut run = [Vec::with_capacity(e.len()), Vec::with_capacity(e.len())];
    let substeps = e.substeps(&motor).map_err(refused)?;
    e.run(&motor, substeps, Imposed::Nothing, |_, state| {
        run[0].push(state.current);
        run[1].push(state.speed);
    })
    .map_err(refused)?;
    Ok(run)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Σ_j v_j v_jᵀ is the covariance.
    #[test]
    fn axes_make_the_covariance_again() {
        let uncertainty = Uncertainty {
            names: ["R", "L", "K"].map(str::to_owned).to_vec(),
            deviations: vec![0.1, 1e-4, 3.0],
            correlations: vec![vec![1.0], vec![0.9, 1.0], vec![-0.3, 0.1, 1.0]],
            freedom: 9.0,
        };
        let axes = axes(&uncertainty);
        assert_eq!(axes.len(), 3);
        for r in 0..3 {
            for c in 0..3 {
                let made: f64 = axes.iter().map(|axis| axis[r] * axis[c]).sum();
                let size = uncertainty.deviations[r] * uncertainty.deviations[c];
                assert!((made / size - uncertainty.correlation(r, c)).abs() < 1e-12, "{r} {c}: {made}");
            }
        }
        // What is wholly correlated moves along one axis.
        let both = Uncertainty {
            names: uncertainty.names[..2].to_vec(),
            deviations: vec![1.0, 2.0],
            correlations: vec![vec![1.0], vec![1.0, 1.0]],
            freedom: 9.0,
        };
        let axes = super::axes(&both);
        assert_eq!(axes.len(), 1);
        assert!((axes[0][1] / axes[0][0] - 2.0).abs() < 1e-12);
    }
}
