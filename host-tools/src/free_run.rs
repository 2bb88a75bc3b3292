//! The model in free run through a recording, from the voltage alone: one run for whoever asks, in `f32` as on the
//! microcontroller, with the learned correction beside the physics.
//!
//! What compares, what predicts and what remembers how well a model fits go through [`free_run`], so that all of them
//! see the same bits.

use greyrig::anfis::Anfis3x3;
use greyrig::hybrid::corrected;
use greyrig::motor::{Constraints, Motor, State};

use crate::error::{Error, Result};
use crate::experiment::{Experiment, Imposed};

/// Modelled over largest measured value from which a free run is said to diverge. What merely fits badly stays within
/// the current at a standstill, u/R.
pub const DIVERGED: f64 = 1e3;

/// Runs a model through an experiment and hands what the measuring chain shows, before any filter, to `take`: sample,
/// current (A) and speed (rad/s), with the learned correction if there is one.
///
/// # Errors
/// Parameters that the stepper refuses at this sampling rate.
pub fn free_run(
    motor: &Motor<f32>,
    correction: Option<&Anfis3x3>,
    e: &Experiment,
    imposed: Imposed<'_>,
    mut take: impl FnMut(usize, State<f32>),
) -> Result<()> {
    let refused = |error: greyrig::motor::ParameterError| {
        Error::usage(format!("{}: {error}", e.name), "check the model's parameters")
    };
    let substeps = e.substeps(motor).map_err(refused)?;
    e.run(motor, substeps, imposed, |n, state: State<f32>| {
        let constraints = Constraints { current: e.is_open(n).then_some(0.0), speed: None };
        let state = match correction {
            Some(correction) => corrected(correction, e.input[n] as f32, state, constraints).0,
            None => state,
        };
        take(n, state);
    })
    .map_err(refused)
}
