//! What a page can ask for that takes its time: each what the command of the same name does.

use std::sync::Arc;

use greyrig::effects::EffectId;

use super::api;
use super::correction;
use super::error::{Error, Result};
use super::judge::{self, Station};
use super::planning::{self, Wanted};
use super::recordings::Recordings;
use super::version::{Made, Version};
use crate::addition::{Additions, add_to, held_of, stage};
use crate::answers::{self, Given};
use crate::compare::{PerSignal, compare};
use crate::context::Context;
use crate::diagnose::Diagnosis;
use crate::held_out::split;
use crate::identify::{Settings, identify};
use crate::model::{Kind, Model, catalogue};
use crate::recording::Recording;
use crate::term::Formula;

/// A task.
#[derive(Debug, Clone)]
pub enum Task {
    /// The base model of the recordings.
    Identify,
    /// A model from a file: its name, and it.
    Open(String, Box<Model>),
    /// What the present model lacks.
    Diagnose,
    /// The present model with more.
    Add(Added),
    /// Which recording would tell rivals of the present model apart.
    Plan(Wanted),
    /// From what size on the recordings would have revealed these effects, or all.
    Challenge(Vec<EffectId>),
    /// The present model with a learned correction.
    Train(Training),
    /// Limits of the present model, from recordings of healthy motors.
    Calibrate(Vec<u32>),
    /// Motors judged by their recordings.
    Judge(Arc<Station>, Vec<u32>),
}

/// What is added to a model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Added {
    /// Effects of the catalogue.
    pub effects: Vec<EffectId>,
    /// Terms of the user's own.
    pub terms: Vec<Formula>,
}

/// How a correction is learnt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Training {
    /// Epochs at most.
    pub epochs: usize,
    /// Begin of each recording that is neither learnt nor judged, s.
    pub blanking_s: f64,
}

impl Training {
    /// As a command takes it.
    pub fn arguments(self) -> Vec<String> {
        ["--epochs".to_owned(), self.epochs.to_string(), "--blanking".to_owned(), self.blanking_s.to_string()].to_vec()
    }
}

/// What comes of a task.
pub enum Outcome {
    /// A model to begin with.
    First(Box<Made>),
    /// A model that follows the present one.
    Next(Box<Made>),
    /// The answer of a diagnosis.
    Diagnosis(Box<api::Diagnosis>),
    /// A model that follows the present one, with what it has learnt.
    Corrected(Box<Made>, Box<api::Correction>),
    /// A plan.
    Plan(Box<api::Plan>),
    /// A challenge.
    Challenge(Box<api::Challenge>),
    /// A model with limits.
    Station(Box<Model>),
    /// Motors that have been judged.
    Judged(Box<api::Judged>),
}

impl Added {
    /// By their names, with commas between effects.
    ///
    /// # Errors
    /// An effect that is not in the catalogue, a formula that cannot be read; nothing at all.
    pub fn parse(effects: Option<&str>, term: Option<&str>) -> Result<Self> {
        let names = effects.unwrap_or_default().split(',').filter(|name| !name.is_empty());
        let effect = |name: &str| name.parse().map_err(|_| Error::NoEffect(name.to_owned()));
        let added = Self {
            effects: names.map(effect).collect::<Result<_>>()?,
            terms: term.map(str::parse).transpose()?.into_iter().collect(),
        };
        if added == Self::default() { Err(Error::Missing("effect")) } else { Ok(added) }
    }

    /// As a command takes it.
    pub fn arguments(&self) -> Vec<String> {
        let terms = self.terms.iter().flat_map(|t| ["--term".to_owned(), t.text().to_owned()]);
        self.effects.iter().map(ToString::to_string).chain(terms).collect()
    }
}

impl Task {
    /// What is being done, in words.
    pub fn name(&self) -> String {
        match self {
            Self::Identify => "identification".to_owned(),
            Self::Open(name, _) => format!("opening {name}"),
            Self::Diagnose => "diagnosis".to_owned(),
            Self::Add(added) => {
                let all = added.effects.iter().map(ToString::to_string);
                let all: Vec<String> = all.chain(added.terms.iter().map(|t| t.text().to_owned())).collect();
                format!("adding {}", all.join(", "))
            }
            Self::Train(_) => "training".to_owned(),
            Self::Plan(_) => "plan".to_owned(),
            Self::Challenge(_) => "challenge".to_owned(),
            Self::Calibrate(_) => "calibration".to_owned(),
            Self::Judge(..) => "judging".to_owned(),
        }
    }

    /// Whether it is about models of the recordings with a role, which have to be sound then.
    pub fn rests_on_recordings(&self) -> bool {
        !matches!(self, Self::Plan(_) | Self::Calibrate(_) | Self::Judge(..))
    }

    /// Whether it begins with the present version.
    pub fn rests_on_version(&self) -> bool {
        !matches!(self, Self::Identify | Self::Open(..) | Self::Judge(..))
    }

    /// Does it, from a version of the model.
    ///
    /// # Errors
    /// Recordings from which it cannot be done; an interrupt.
    pub fn run(
        &self,
        recordings: &Recordings,
        kind: Option<Kind>,
        before: Option<&Version>,
        ctx: &Context,
    ) -> Result<Outcome> {
        let usable = &recordings.usable;
        let model = || before.map(|version| &*version.model).ok_or(Error::NoModel);
        Ok(match self {
            Self::Identify => Outcome::First(Box::new(identified(usable, kind, ctx)?)),
            Self::Open(name, model) => Outcome::First(Box::new(opened(usable, name, model, ctx)?)),
            Self::Diagnose => Outcome::Diagnosis(Box::new(diagnosed(recordings, model()?, ctx)?)),
            Self::Add(added) => Outcome::Next(Box::new(with(usable, model()?, added, ctx)?)),
            Self::Train(Training { epochs, blanking_s }) => {
                let request =
                    answers::train::Request { epochs: *epochs, blanking_s: *blanking_s, ..Default::default() };
                let (made, correction) = correction::learnt(model()?, given(recordings), &request, ctx)?;
                Outcome::Corrected(Box::new(made), Box::new(correction))
            }
            Self::Plan(wanted) => Outcome::Plan(Box::new(planning::planned(model()?, wanted, ctx)?)),
            Self::Challenge(effects) => {
                Outcome::Challenge(Box::new(planning::challenged(usable, model()?, effects, ctx)?))
            }
            Self::Calibrate(ids) => Outcome::Station(Box::new(judge::learnt(model()?, recordings, ids, ctx)?)),
            Self::Judge(station, ids) => Outcome::Judged(Box::new(judge::judged(station, recordings, ids, ctx)?)),
        })
    }
}

fn identified(recordings: &[Recording], kind: Option<Kind>, ctx: &Context) -> Result<Made> {
    ctx.doing("all recordings");
    let whole = identify(recordings, &Settings::new(Kind::of(kind, recordings)), ctx)?;
    ctx.doing("data held out");
    let (training, held_out) = split(recordings);
    let judged = stage(&whole.model, Additions::default(), &training, &held_out, ctx)?;
    let made = Made {
        label: "base model".to_owned(),
        model: whole.model,
        parameters: whole.parameters,
        notes: whole.notes,
        training: PerSignal::default(),
        held_out: PerSignal::default(),
        floor: PerSignal::default(),
        accepted: None,
    };
    Ok(made.judged(&judged))
}

/// A model of a file, judged as it is.
fn opened(recordings: &[Recording], name: &str, model: &Model, ctx: &Context) -> Result<Made> {
    let (training, held_out) = split(recordings);
    ctx.doing("training data");
    let seen = compare(model, &training, ctx)?;
    ctx.doing("data held out");
    let judged = compare(model, &held_out, ctx)?;
    Ok(Made {
        label: name.to_owned(),
        model: model.clone(),
        parameters: Vec::new(),
        notes: vec!["as it was in its file; it has seen other data than these".to_owned()],
        training: seen.esr,
        held_out: judged.esr,
        floor: judged.noise_floor,
        accepted: None,
    })
}

/// A model with more, judged on data held out.
///
/// # Errors
/// An effect that it has already; recordings from which it cannot be identified; an interrupt.
pub fn with(recordings: &[Recording], before: &Model, added: &Added, ctx: &Context) -> Result<Made> {
    if let Some(id) = added.effects.iter().find(|id| before.effects.iter().any(|e| e.id == **id)) {
        return Err(Error::HasAlready(*id));
    }
    let (training, held_out) = split(recordings);
    let held = held_of(before, &added.effects, recordings, ctx)?;
    let additions = Additions { effects: &added.effects, terms: &added.terms, held: &held };
    ctx.doing("without it");
    let without = stage(before, Additions::default(), &training, &held_out, ctx)?;
    ctx.doing("with it");
    let with = stage(before, additions, &training, &held_out, ctx)?;
    let judged = with.shows(before, &held_out, ctx)?;
    ctx.doing("all recordings");
    let whole = add_to(before, additions, recordings, ctx)?;
    let accepted = judged && without.held_out.esr.falls_to(&with.held_out.esr);
    let mut model = whole.identification.model;
    model.judged(accepted);
    let terms = added.terms.iter().map(Formula::text).collect::<Vec<_>>();
    let names =
        [vec![catalogue::joined(&whole.effects, " + ")], terms.iter().map(|t| (*t).to_owned()).collect()].concat();
    let names: Vec<String> = names.into_iter().filter(|name| !name.is_empty()).collect();
    let made = Made {
        label: format!("+ {}", names.join(" + ")),
        model,
        parameters: whole.identification.parameters,
        notes: whole.identification.notes,
        training: PerSignal::default(),
        held_out: PerSignal::default(),
        floor: PerSignal::default(),
        accepted: Some(accepted),
    };
    Ok(made.judged(&with))
}

/// The recordings with a role, as an answer takes them.
fn given(recordings: &Recordings) -> Given {
    Given { recordings: recordings.usable.clone(), findings: recordings.findings.clone() }
}

/// What the command of that name answers: an acquittal is held against the floor of the free run.
fn diagnosed(recordings: &Recordings, before: &Model, ctx: &Context) -> Result<api::Diagnosis> {
    let given = given(recordings);
    let answer = ctx.install(|| answers::diagnose::Request::default().answer(Some(before), given, ctx, &|_| ()))?;
    answer.diagnosis.as_ref().map(told).ok_or(Error::NoRecording)
}

fn told(d: &Diagnosis) -> api::Diagnosis {
    let names = |ids: &[EffectId]| ids.iter().map(ToString::to_string).collect::<Vec<_>>();
    let candidate = d.candidates.iter().map(|c| api::Candidate {
        effect: c.effect.to_string(),
        step: u32::try_from(c.step).unwrap_or(u32::MAX),
        gain: c.held_out_gain,
        probability: c.probability,
        esr_after: c.esr_after.into(),
        objection: c.objection.map(str::to_owned),
        predicted: None,
    });
    let candidates = candidate.collect();
    let kind = serde_json::to_value(d.verdict.kind).ok();
    api::Diagnosis {
        headline: d.headline(),
        odds: d.odds(),
        probability: d.verdict.probability,
        kind: kind.as_ref().and_then(|k| k.as_str()).unwrap_or_default().to_owned(),
        effects: names(&d.verdict.effects),
        classes: d.verdict.classes.iter().map(|class| names(class)).collect(),
        text: d.verdict.text.clone(),
        remaining: d.verdict.remaining.as_ref().map(|remaining| remaining.text.clone()),
        next_experiment: d.verdict.next_experiment.clone(),
        decoy_gain: d.decoy_gain,
        candidates,
        basis: String::new(),
        command: String::new(),
    }
}
