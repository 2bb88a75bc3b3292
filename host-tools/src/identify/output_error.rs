//! Output-error refinement: the free-run simulation against the measurement, all recordings jointly.
//!
//! The residuals are modelled − measured current and speed, both through the Butterworth filter, each divided by a
//! weight per signal; the weights are first the RMS of the signals and then the RMS of their residuals, which is the
//! maximum-likelihood choice for unknown noise in two signals. The minimiser is the Levenberg–Marquardt method of MINPACK
//! (crate `levenberg-marquardt`); derivatives are forward differences of the simulation in `f64`.

use greyrig::butterworth::Cascade;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use rayon::prelude::*;

use super::regression::stride;
use super::space::Space;
use crate::error::{Error, Result};
use crate::experiment::{Experiment, Imposed};
use crate::output;

/// Step of the forward differences in the optimiser's coordinates (logarithms and relative sizes). The rounding error of
/// the simulation, about 1e-13, and the curvature then both stay near 1e-6 of the derivative.
const DIFFERENCE: f64 = 1e-6;

/// Stands for a residual that cannot be computed, so that the optimiser turns back.
const HOPELESS: f64 = 1e6;

/// One signal of one experiment: its measured values at the rows that count.
#[derive(Debug, Clone)]
struct Observation {
    samples: Vec<usize>,
    measured: Vec<f64>,
    is_speed: bool,
}

/// The rows of one experiment: current first, then speed.
#[derive(Debug, Clone)]
pub struct Rows<'a> {
    experiment: &'a Experiment,
    observations: Vec<Observation>,
    substeps: u8,
}

impl<'a> Rows<'a> {
    /// Chooses the rows of an experiment.
    pub fn new(experiment: &'a Experiment, substeps: u8) -> Self {
        let every = stride(experiment);
        let mut observations = Vec::new();
        for (signal, is_speed) in [(&experiment.current, false), (&experiment.speed, true)] {
            let Some(signal) = signal else { continue };
            let filtered = experiment.filtered(signal);
            let samples: Vec<usize> = (0..experiment.len())
                .step_by(every)
                .filter(|n| experiment.counted[*n])
                .filter(|n| if is_speed { !experiment.is_locked(*n) } else { !experiment.is_open(*n) })
                .collect();
            let measured = samples.iter().map(|n| filtered[*n]).collect();
            observations.push(Observation { samples, measured, is_speed });
        }
        Self { experiment, observations, substeps }
    }

    fn len(&self) -> usize {
        self.observations.iter().map(|o| o.samples.len()).sum()
    }

    /// Time block of each row.
    pub fn blocks(&self, length_s: f64) -> Vec<usize> {
        let samples = (length_s / self.experiment.interval_s).max(1.0);
        self.observations.iter().flat_map(|o| &o.samples).map(|n| (*n as f64 / samples) as usize).collect()
    }

    /// Whether each row is of the speed.
    pub fn speed_rows(&self) -> impl Iterator<Item = bool> {
        self.observations.iter().flat_map(|o| std::iter::repeat_n(o.is_speed, o.samples.len()))
    }

    /// Interval between the rows of a signal, s.
    pub fn row_interval_s(&self) -> f64 {
        stride(self.experiment) as f64 * self.experiment.interval_s
    }

    fn measured(&self) -> impl Iterator<Item = (f64, bool)> {
        self.observations.iter().flat_map(|o| o.measured.iter().map(|m| (*m, o.is_speed)))
    }

    /// Modelled signals at the rows.
    fn modelled(&self, space: &Space, theta: &[f64]) -> Vec<f64> {
        let attempt = || {
            let motor = space.motor_at(theta).ok()?;
            let coefficients = self.experiment.coefficients::<f64>();
            let mut filters = [Cascade::<f64>::default(), Cascade::default()];
            let mut outputs: Vec<Vec<f64>> =
                self.observations.iter().map(|o| Vec::with_capacity(o.samples.len())).collect();
            let mut next = vec![0usize; self.observations.len()];
            self.experiment
                .run(&motor, self.substeps, Imposed::Nothing, |n, state| {
                    if n == 0 {
                        filters[0].reset_to(state.current);
                        filters[1].reset_to(state.speed);
                    }
                    let filtered = [
                        filters[0].process(&coefficients, state.current),
                        filters[1].process(&coefficients, state.speed),
                    ];
                    for ((o, output), next) in self.observations.iter().zip(&mut outputs).zip(&mut next) {
                        if o.samples.get(*next) == Some(&n) {
                            output.push(filtered[usize::from(o.is_speed)]);
                            *next += 1;
                        }
                    }
                })
                .ok()?;
            let flat: Vec<f64> = outputs.into_iter().flatten().collect();
            flat.iter().all(|x| x.is_finite()).then_some(flat)
        };
        attempt().unwrap_or_else(|| vec![HOPELESS; self.len()])
    }
}

/// The joint problem at its present point.
#[derive(Debug, Clone)]
pub struct Problem<'a> {
    space: Space,
    rows: &'a [Rows<'a>],
    weights: [f64; 2],
    theta: DVector<f64>,
    residuals: DVector<f64>,
}

impl<'a> Problem<'a> {
    fn new(space: Space, rows: &'a [Rows<'a>], weights: [f64; 2]) -> Self {
        let theta = DVector::from_vec(space.coordinates());
        let mut problem = Self { space, rows, weights, theta, residuals: DVector::zeros(0) };
        problem.residuals = problem.residuals_at(problem.theta.as_slice());
        problem
    }

    fn residuals_at(&self, theta: &[f64]) -> DVector<f64> {
        let parts: Vec<Vec<f64>> = self
            .rows
            .par_iter()
            .map(|rows| {
                let modelled = rows.modelled(&self.space, theta);
                modelled
                    .iter()
                    .zip(rows.measured())
                    .map(|(model, (measured, is_speed))| (model - measured) / self.weights[usize::from(is_speed)])
                    .collect()
            })
            .collect();
        DVector::from_vec(parts.concat())
    }

    fn jacobian_here(&self) -> DMatrix<f64> {
        let p = self.theta.len();
        let columns: Vec<DVector<f64>> = (0..p)
            .into_par_iter()
            .map(|k| {
                let mut theta = self.theta.clone();
                theta[k] += DIFFERENCE;
                (self.residuals_at(theta.as_slice()) - &self.residuals) / DIFFERENCE
            })
            .collect();
        if columns.is_empty() { DMatrix::zeros(self.residuals.len(), 0) } else { DMatrix::from_columns(&columns) }
    }

    /// RMS of the unweighted residuals of current and of speed.
    fn residual_rms(&self) -> [f64; 2] {
        let mut sums = [(0.0, 0usize); 2];
        let flags = self.rows.iter().flat_map(Rows::speed_rows);
        for (r, is_speed) in self.residuals.iter().zip(flags) {
            let k = usize::from(is_speed);
            sums[k].0 += (r * self.weights[k]).powi(2);
            sums[k].1 += 1;
        }
        sums.map(|(sum, n)| if n == 0 { 1.0 } else { (sum / n as f64).sqrt() })
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.theta.copy_from(x);
        self.residuals = self.residuals_at(x.as_slice());
    }
    fn params(&self) -> DVector<f64> {
        self.theta.clone()
    }
    fn residuals(&self) -> Option<DVector<f64>> {
        // Giving up is how the optimiser is told of an interrupt.
        output::check_interrupt().ok()?;
        Some(self.residuals.clone())
    }
    fn jacobian(&self) -> Option<DMatrix<f64>> {
        output::check_interrupt().ok()?;
        Some(self.jacobian_here())
    }
}

/// The end of a refinement.
#[derive(Debug, Clone)]
pub struct Refined {
    /// The parameters there.
    pub space: Space,
    /// Weighted residuals, experiment by experiment.
    pub residuals: DVector<f64>,
    /// Derivatives of the residuals by the coordinates.
    pub jacobian: DMatrix<f64>,
}

/// Refines start values by output error.
///
/// # Errors
/// An interrupt, or data without a single usable row.
pub fn refine(space: &Space, rows: &[Rows<'_>]) -> Result<Refined> {
    let mut weights = signal_rms(rows);
    let mut space = space.clone();
    let bar = output::progress("output-error fit", 3);
    for _ in 0..2 {
        let problem = Problem::new(space.clone(), rows, weights);
        usable(&problem)?;
        let (problem, _) = LevenbergMarquardt::new().with_ftol(1e-9).with_xtol(1e-9).with_patience(8).minimize(problem);
        output::check_interrupt()?;
        space.set_coordinates(problem.theta.as_slice());
        let floor = weights;
        weights = problem.residual_rms();
        for (w, signal) in weights.iter_mut().zip(floor) {
            // A perfect fit must not divide by zero.
            *w = w.max(1e-9 * signal);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(around(Problem::new(space, rows, weights)))
}

/// The residuals and their derivatives at given parameters, without refinement.
///
/// # Errors
/// Data without a single usable row.
pub fn as_it_is(space: &Space, rows: &[Rows<'_>]) -> Result<Refined> {
    let problem = Problem::new(space.clone(), rows, signal_rms(rows));
    usable(&problem)?;
    let weights = problem.residual_rms();
    Ok(around(Problem::new(space.clone(), rows, weights)))
}

fn usable(problem: &Problem<'_>) -> Result<()> {
    if problem.residuals.is_empty() {
        return Err(Error::usage(
            "no sample of these recordings can be used",
            "look at the warnings about gaps and clipping",
        ));
    }
    Ok(())
}

fn around(problem: Problem<'_>) -> Refined {
    let jacobian = problem.jacobian_here();
    Refined { space: problem.space, residuals: problem.residuals, jacobian }
}

fn signal_rms(rows: &[Rows<'_>]) -> [f64; 2] {
    let mut sums = [(0.0, 0usize); 2];
    for (m, is_speed) in rows.iter().flat_map(Rows::measured) {
        let k = usize::from(is_speed);
        sums[k].0 += m * m;
        sums[k].1 += 1;
    }
    sums.map(|(sum, n)| if sum > 0.0 { (sum / n as f64).sqrt() } else { 1.0 })
}
