//! The base model: where its fit starts, how far off it is by itself, and what recordings cannot say of it.

use greyrig::effects::EffectId;

use super::audit::Audit;
use super::climb::Climb;
use super::fit::Fit;
use crate::context::Context;
use crate::error::{Insufficient, Result};
use crate::experiment::{Drive, Experiment};
use crate::identify::space::{Freedom, Space};
use crate::identify::{self, Settings, identifiability, regression};
use crate::recording::Recording;

/// Free-run error-to-signal ratios, current and speed, of a model that has been fitted to recordings.
///
/// # Errors
/// Recordings that cannot be used, an interrupt.
pub fn error(recordings: &[Recording], settings: &Settings, ctx: &Context) -> Result<[f64; 2]> {
    let full = identify::prepare(recordings, &settings.filter)?;
    let coarse: Vec<Experiment> = full.iter().map(Experiment::coarse).collect();
    let mut space = identify::build_space(settings)?;
    start(&mut space, &full, &coarse)?;
    let audit = Audit::new(&coarse, &space, ctx)?;
    let esr = audit.ratio(audit.fit(&space)?.rms);
    Ok([esr.current.unwrap_or(0.0), esr.speed.unwrap_or(0.0)])
}

/// Start values of the base model, and what these recordings cannot hold taken out of it.
///
/// # Errors
/// A channel is missing without which a parameter that is to be identified cannot be.
pub fn start(space: &mut Space, full: &[Experiment], coarse: &[Experiment]) -> Result<()> {
    if full.iter().all(|e| e.drive == Drive::Torque) {
        space.hold(&["R", "L", "K"], Freedom::Absent);
        space.take_scales(&space.scales(coarse));
        return Ok(());
    }
    if full.iter().all(|e| e.current.is_none()) {
        // Without a current R is a unit of torque, and viscous friction counts to K: what is found does not depend on it.
        space.hold(&["mu1"], Freedom::Pinned);
        for name in ["R", "L"] {
            if space.get(name).is_some_and(|e| matches!(e.freedom, Freedom::Free(_))) {
                space.hold(&[name], Freedom::Fixed);
                if let Some(entry) = space.get_mut(name) {
                    entry.value = if name == "R" { 1.0 } else { 1e-6 };
                }
            }
        }
    }
    identifiability::missing_channels(space, full)?;
    space.take_typical_values();
    regression::start_values(space, coarse);
    space.take_scales(&space.scales(coarse));
    Ok(())
}

/// Least part of its column that dry friction has to have for itself.
const VISIBLE_FRICTION: f64 = 0.05;

/// Every motor has dry friction: where the base model lacks it and the recordings could not show it, they cannot acquit.
pub fn hidden_dry_friction(climb: &Climb<'_>, base: &Fit, space: &Space) -> Option<Insufficient> {
    if space.get("mu0").is_some_and(|e| e.freedom != Freedom::Absent) {
        return None;
    }
    let d = EffectId::CoulombFriction.description();
    let own = climb.independence(base, d).unwrap_or(0.0);
    (own < VISIBLE_FRICTION).then_some(Insufficient::HiddenDryFriction(own))
}
