//! The error of the balances of voltage and torque on the held-out ramp, at the measured state: what a regression is
//! judged by.

use greyrig::effects::EffectId;
use greyrig::motor::BaseParameter;
use greyrig_host::context::Context;
use greyrig_host::error::Result;
use greyrig_host::identify::equation_error::{Balance, EquationError};
use greyrig_host::identify::minimise::{Residuals, rms_of};
use greyrig_host::identify::{Settings, build_space, identify, prepare};
use greyrig_host::model::Model;

use crate::cases::Case;
use crate::score::Outcome;

/// RMS of what the voltage balance leaves over that of the voltage, and of what the torque balance leaves over that of
/// the air-gap torque.
pub type Left = [f64; 2];

/// What the base model leaves, and what one with the named effects does.
///
/// # Errors
/// Recordings that cannot be used, an interrupt.
pub fn left(case: &Case, outcome: &Outcome) -> Result<(Left, Left)> {
    let training = case.recordings()?;
    let with = |effects: Vec<EffectId>| -> Result<Left> {
        let settings = Settings { effects, ..Settings::new(case.excitation.kind()) };
        of(&identify(&training, &settings, &Context::quiet())?.model, case)
    };
    Ok((with(Vec::new())?, with(outcome.named.clone())?))
}

fn of(model: &Model, case: &Case) -> Result<Left> {
    let held_out = prepare(&[case.held_out()?], &model.filter, &model.chain)?;
    let mut space = build_space(&Settings::of_model(model))?;
    space.take_model(model);
    let Some(problem) = EquationError::new(&held_out) else { return Ok([f64::NAN; 2]) };
    let groups = problem.groups();
    let rms = rms_of(&problem.at(&space, &space.coordinates()), groups);
    let air_gap = rms_of(&problem.column(Balance::Torque, &|i, _, _| model.value(BaseParameter::K) * i * i), groups);
    Ok([rms[0] / problem.sizes()[0], rms[1] / air_gap[1]])
}
