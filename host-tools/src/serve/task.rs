//! What a page can ask for that takes its time: each what the command of the same name does.

use greyrig::effects::EffectId;
use serde_json::{Value, json};

use super::error::{Error, Result};
use super::version::Version;
use crate::addition::{Additions, add_to, held_of, stage};
use crate::compare::compare;
use crate::context::Context;
use crate::diagnose::{Options, diagnose};
use crate::error::if_possible;
use crate::held_out::split;
use crate::identify::{Settings, identify};
use crate::model::{Kind, catalogue};
use crate::recording::Recording;

/// A task.
pub enum Task {
    /// The base model of the recordings.
    Identify,
    /// What the present model lacks.
    Diagnose,
    /// The present model with an effect more.
    Add(EffectId),
}

/// What comes of a task.
pub enum Outcome {
    /// A model to begin with.
    First(Box<Version>),
    /// A model that follows the present one.
    Next(Box<Version>),
    /// The answer of a diagnosis.
    Diagnosis(Value),
}

impl Task {
    /// Adding an effect of the catalogue.
    ///
    /// # Errors
    /// An effect that is not in it.
    pub fn add(id: &str) -> Result<Self> {
        id.parse().map(Self::Add).map_err(|_| Error::NoEffect(id.to_owned()))
    }

    /// What is being done, in words.
    pub fn name(&self) -> String {
        match self {
            Self::Identify => "identification".to_owned(),
            Self::Diagnose => "diagnosis".to_owned(),
            Self::Add(id) => format!("adding {id}"),
        }
    }

    /// Does it, from a version of the model.
    ///
    /// # Errors
    /// Recordings from which it cannot be done; an interrupt.
    pub fn run(
        &self,
        recordings: &[Recording],
        kind: Option<Kind>,
        before: Option<&Version>,
        ctx: &Context,
    ) -> Result<Outcome> {
        match (self, before) {
            (Self::Identify, _) => identified(recordings, kind, ctx).map(|v| Outcome::First(Box::new(v))),
            (Self::Diagnose, Some(before)) => diagnosed(recordings, before, ctx).map(Outcome::Diagnosis),
            (Self::Add(id), Some(before)) => added(recordings, before, *id, ctx).map(|v| Outcome::Next(Box::new(v))),
            (Self::Diagnose | Self::Add(_), None) => Err(Error::NoModel),
        }
    }
}

fn identified(recordings: &[Recording], kind: Option<Kind>, ctx: &Context) -> Result<Version> {
    ctx.doing("all recordings");
    let whole = identify(recordings, &Settings::new(Kind::of(kind, recordings)), ctx)?;
    ctx.doing("data held out");
    let (training, held_out) = split(recordings);
    let judged = stage(&whole.model, Additions::default(), &training, &held_out, ctx)?;
    Ok(Version::new("base model".to_owned(), whole, &judged, None, recordings.len()))
}

fn added(recordings: &[Recording], before: &Version, id: EffectId, ctx: &Context) -> Result<Version> {
    if before.model.effects.iter().any(|e| e.id == id) {
        return Err(Error::HasAlready(id));
    }
    let (training, held_out) = split(recordings);
    let held = held_of(&before.model, &[id], recordings, ctx)?;
    let additions = Additions { effects: &[id], held: &held, ..Additions::default() };
    ctx.doing("without it");
    let without = stage(&before.model, Additions::default(), &training, &held_out, ctx)?;
    ctx.doing("with it");
    let with = stage(&before.model, additions, &training, &held_out, ctx)?;
    let judged = with.shows(&before.model, &held_out, ctx)?;
    ctx.doing("all recordings");
    let mut whole = add_to(&before.model, additions, recordings, ctx)?;
    let accepted = judged && without.held_out.esr.falls_to(&with.held_out.esr);
    whole.identification.model.judged(accepted);
    let label = format!("+ {}", catalogue::joined(&whole.effects, " + "));
    Ok(Version::new(label, whole.identification, &with, Some(accepted), recordings.len()))
}

fn diagnosed(recordings: &[Recording], before: &Version, ctx: &Context) -> Result<Value> {
    let settings = Settings::of_model(&before.model);
    let options = Options { settings, exclude: Vec::new(), candidates_refined: true };
    let d = diagnose(recordings, &options, ctx)?;
    let comparison = if_possible(compare(&before.model, recordings, ctx))?;
    let mut said = d.as_json(comparison.as_ref());
    said["headline"] = json!(d.headline());
    said["odds"] = json!(d.odds());
    Ok(said)
}
