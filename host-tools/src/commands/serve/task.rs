//! What a page can ask for that takes its time: each what the command of the same name does.

use greyrig::effects::EffectId;
use serde_json::{Value, json};

use super::version::{Version, no_model};
use crate::addition::{Stage, add_to, stage};
use crate::commands::{diagnose as answer, input};
use crate::compare::compare;
use crate::diagnose::{Options, Progress, diagnose};
use crate::error::{Error, Result};
use crate::held_out::split;
use crate::identify::{Identification, Settings, identify};
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
        id.parse().map(Self::Add).map_err(|_| Error::usage(format!("{id:?} is no effect"), "see greyrig effects"))
    }

    /// What is being done, in words.
    pub fn name(&self) -> String {
        match self {
            Self::Identify => "identification".to_owned(),
            Self::Diagnose => "diagnosis".to_owned(),
            Self::Add(id) => format!("adding {id}"),
        }
    }

    /// Does it, from a version of the model; `watch` is told the steps.
    ///
    /// # Errors
    /// Recordings from which it cannot be done; an interrupt.
    pub fn run(
        &self,
        recordings: &[Recording],
        kind: Option<Kind>,
        before: Option<&Version>,
        watch: &(dyn Fn(&str) + Sync),
    ) -> Result<Outcome> {
        match (self, before) {
            (Self::Identify, _) => identified(recordings, kind, watch).map(|v| Outcome::First(Box::new(v))),
            (Self::Diagnose, Some(before)) => diagnosed(recordings, before, watch).map(Outcome::Diagnosis),
            (Self::Add(id), Some(before)) => added(recordings, before, *id, watch).map(|v| Outcome::Next(Box::new(v))),
            (Self::Diagnose | Self::Add(_), None) => Err(no_model()),
        }
    }
}

fn identified(recordings: &[Recording], kind: Option<Kind>, watch: &(dyn Fn(&str) + Sync)) -> Result<Version> {
    watch("all recordings");
    let whole = identify(recordings, &Settings::new(input::kind(kind, recordings)))?;
    watch("data held out");
    let (training, held_out) = split(recordings);
    let judged = stage(&whole.model, &[], &[], &training, &held_out)?;
    Ok(version("base model".to_owned(), whole, &judged, None, recordings.len()))
}

fn added(recordings: &[Recording], before: &Version, id: EffectId, watch: &(dyn Fn(&str) + Sync)) -> Result<Version> {
    if before.model.effects.iter().any(|e| e.id == id) {
        return Err(Error::usage(format!("the model has {id} already"), "add another effect"));
    }
    let (training, held_out) = split(recordings);
    watch("without it");
    let without = stage(&before.model, &[], &[], &training, &held_out)?;
    watch("with it");
    let with = stage(&before.model, &[id], &[], &training, &held_out)?;
    let judged = with.shows(&before.model, &held_out)?;
    watch("all recordings");
    let mut whole = add_to(&before.model, &[], recordings, &[id])?;
    let accepted = judged && without.held_out.esr.falls_to(&with.held_out.esr);
    whole.identification.model.judged(accepted);
    let label = format!("+ {}", catalogue::joined(&whole.effects, " + "));
    Ok(version(label, whole.identification, &with, Some(accepted), recordings.len()))
}

fn version(label: String, whole: Identification, judged: &Stage, accepted: Option<bool>, recordings: usize) -> Version {
    Version {
        label,
        model: whole.model,
        parameters: whole.parameters,
        notes: whole.notes,
        training: judged.training,
        held_out: judged.held_out.esr,
        floor: judged.held_out.noise_floor,
        accepted,
        recordings,
        diagnosis: None,
    }
}

fn diagnosed(recordings: &[Recording], before: &Version, watch: &(dyn Fn(&str) + Sync)) -> Result<Value> {
    let settings = Settings::of_model(&before.model);
    let options = Options { settings, exclude: Vec::new(), candidates_refined: true };
    let told = |at: Progress<'_>| {
        if let Progress::Doing(what) = at {
            watch(what);
        }
    };
    let d = diagnose(recordings, &options, &told)?;
    let comparison = compare(&before.model, recordings).ok();
    let mut said = answer::as_json(&d, comparison.as_ref());
    said["headline"] = json!(answer::headline(&d));
    Ok(said)
}
