//! The base model: where its fit starts, how far off it is by itself, and what recordings cannot say of it.

use greyrig::effects::Description;
use greyrig::motor::BaseParameter;

use super::audit::Audit;
use super::climb::Climb;
use crate::context::Context;
use crate::error::{Insufficient, Result};
use crate::experiment::{Drive, Experiment};
use crate::identify::minimise::Fit;
use crate::identify::space::{Freedom, Space};
use crate::identify::{self, Settings, identifiability, regression, slow_sampling};
use crate::recording::Recording;

/// Free-run error-to-signal ratios, current and speed, of a model that has been fitted to recordings.
///
/// # Errors
/// Recordings that cannot be used, an interrupt.
pub fn error(recordings: &[Recording], settings: &Settings, ctx: &Context) -> Result<[f64; 2]> {
    let (coarse, space) = prepared(recordings, settings, ctx)?;
    let audit = Audit::new(&coarse, &space, ctx)?;
    let esr = audit.ratio(audit.fit(&space)?.rms);
    Ok([esr.current.unwrap_or(0.0), esr.speed.unwrap_or(0.0)])
}

/// Recordings at the rate at which models are tried on them, and a model with its start values.
///
/// # Errors
/// Recordings that cannot be used, settings that no model has, an interrupt.
pub fn prepared(recordings: &[Recording], settings: &Settings, ctx: &Context) -> Result<(Vec<Experiment>, Space)> {
    let mut full = identify::prepare(recordings, &settings.filter, &settings.chain)?;
    let mut space = identify::build_space(settings)?;
    slow_sampling::prepare(&mut space, &mut full, settings.course, None, &ctx.quietly())?;
    let coarse = start(&mut space, &full)?;
    Ok((coarse, space))
}

/// Start values of the base model, where slow samples have not told them already, and what these recordings cannot hold
/// taken out of it; and the recordings at the rate at which models are tried on them, which is their own where the
/// motor is too fast for a lower one.
///
/// # Errors
/// A channel is missing without which a parameter that is to be identified cannot be.
pub fn start(space: &mut Space, full: &[Experiment]) -> Result<Vec<Experiment>> {
    let coarse: Vec<Experiment> = full.iter().map(Experiment::coarse).collect();
    start_at(space, full, &coarse)?;
    let Ok(motor) = space.motor() else { return Ok(coarse) };
    let is_slow_enough = |e: &Experiment| e.substeps(&motor).is_ok();
    let with = |(coarse, full): (Experiment, &Experiment)| if is_slow_enough(&coarse) { coarse } else { full.clone() };
    Ok(coarse.into_iter().zip(full).map(with).collect())
}

fn start_at(space: &mut Space, full: &[Experiment], coarse: &[Experiment]) -> Result<()> {
    if full.iter().all(|e| e.drive == Drive::Torque) {
        space.hold(BaseParameter::ELECTRICAL, Freedom::Absent);
        space.take_scales(&space.scales(coarse));
        return Ok(());
    }
    if full.iter().all(|e| e.current.is_none()) {
        // Without a current R is a unit of torque, and viscous friction counts to K: what is found does not depend on
        // it.
        space.hold([BaseParameter::Mu1], Freedom::Pinned);
        for (parameter, value) in [(BaseParameter::R, 1.0), (BaseParameter::L, 1e-6)] {
            if space.get(parameter).is_some_and(|e| matches!(e.freedom, Freedom::Free(_))) {
                space.hold([parameter], Freedom::Fixed);
                if let Some(entry) = space.get_mut(parameter) {
                    entry.value = value;
                }
            }
        }
    }
    identifiability::missing_channels(space, full)?;
    if !slow_sampling::is_slow(coarse) {
        space.take_typical_values();
        regression::start_values(space, coarse);
    }
    space.take_scales(&space.scales(coarse));
    Ok(())
}

/// Least part of its column that dry friction has to have for itself.
const VISIBLE_FRICTION: f64 = 0.05;

/// Every motor has dry friction: where the base model lacks it and the recordings could not show it, they cannot
/// acquit.
pub fn hidden_dry_friction(climb: &Climb<'_>, base: &Fit, space: &Space) -> Option<Insufficient> {
    if space.get(BaseParameter::Mu0).is_some_and(|e| e.freedom != Freedom::Absent) {
        return None;
    }
    let d = Description::all().find(|d| d.stands_for == Some(BaseParameter::Mu0))?;
    let own = climb.independence(base, d).unwrap_or(0.0);
    (own < VISIBLE_FRICTION).then_some(Insufficient::HiddenDryFriction(own))
}
