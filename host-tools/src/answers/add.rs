//! Effects and terms added to a model, judged on data held out.

use std::path::Path;

use greyrig::effects::{EffectId, Identifiers};
use serde_json::{Value, json};

use super::{Given, object};
use crate::addition::{Addition, Additions, Stage, add_to, held_of, stage};
use crate::check::{self, Purpose};
use crate::context::Context;
use crate::error::{Error, Place, Result};
use crate::held_out::split;
use crate::identify::Identification;
use crate::model::{Assignment, Model};
use crate::recording::Recording;
use crate::report::{Report, Step};
use crate::term::Formula;

/// What is to be added.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Request {
    /// Effects of the catalogue.
    pub effects: Vec<EffectId>,
    /// Terms of the user's own.
    pub terms: Vec<Formula>,
}

impl Request {
    /// Whether there is something to add, and to judge it on: before anything is read.
    ///
    /// # Errors
    /// Nothing of one or the other.
    pub fn check(&self, has_recordings: bool) -> Result<()> {
        if (self.effects.is_empty() && self.terms.is_empty()) || !has_recordings {
            return Err(Error::usage(
                "add needs at least one effect or --term, and one recording",
                format!("effects are {Identifiers}"),
            ));
        }
        Ok(())
    }

    /// Whether a model is without these effects.
    ///
    /// # Errors
    /// One that it has.
    pub fn check_model(&self, model: &Model) -> Result<()> {
        match self.effects.iter().find(|id| model.effects.iter().any(|e| e.id == **id)) {
            Some(id) => Err(Error::usage(format!("the model has {id} already"), "leave it out, or add another effect")),
            None => Ok(()),
        }
    }

    /// Questions recordings, as this request takes them.
    pub fn question(&self, model: &Model, recordings: Vec<Recording>) -> Given {
        Given::questioned(recordings, model.kind, Purpose::Fit)
    }

    /// The answer from a model and recordings. With several, each gain is judged on the last one, which the fit does
    /// not see; with a single one, on the last third of the time until all is at rest.
    ///
    /// # Errors
    /// A request that is none; recordings from which nothing can be identified; an interrupt.
    pub fn answer(&self, model: &Model, given: Given, ctx: &Context) -> Result<Answer> {
        self.check(!given.recordings.is_empty())?;
        self.check_model(model)?;
        given.refuse()?;
        let (recordings, effects) = (&given.recordings, &self.effects);
        let (training, held_out) = split(recordings);
        refuse_seen(&training, &held_out)?;
        let held = held_of(model, effects, recordings, ctx)?;
        let additions = Additions { effects, terms: &self.terms, held: &held };
        let staged = |effects, terms| {
            // What is known of an effect is of no use to a model that does not have it yet.
            let held: Vec<Assignment> = held.iter().filter(|a| is_of(effects, a)).cloned().collect();
            stage(model, Additions { effects, terms, held: &held }, &training, &held_out, ctx)
        };
        let with_effects = (0..=effects.len()).map(|count| staged(&effects[..count], &[]));
        let with_terms = (1..=self.terms.len()).map(|count| staged(effects, &self.terms[..count]));
        let stages = with_effects.chain(with_terms).collect::<Result<Vec<Stage>>>()?;
        let (first, last) = (&stages[0], &stages[stages.len() - 1]);
        let judged = last.shows(model, &held_out, &ctx.quietly())?;
        // More effects cannot fit worse, unless the fit has ended in another valley.
        let is_better =
            |stage: &&Stage| last.training.falls_to(&stage.training) && last.held_out.esr.falls_to(&stage.held_out.esr);
        let better = stages.iter().rev().find(is_better);
        let accepted = judged && better.is_none() && first.held_out.esr.falls_to(&last.held_out.esr);
        // What is written has seen all the data; the judgement above has not.
        let Addition { effects: added, mut identification } = add_to(model, additions, recordings, ctx)?;
        if !judged {
            let note = "what was held out shows nothing of what was added, as a coast-down does of what goes with the current: give another \
                        recording";
            identification.notes.push(note.to_owned());
        }
        if let Some(better) = better.filter(|better| judged && better.label != first.label) {
            let note = format!(
                "the fit is better at '{}', on data held out, too: leave out what comes after it, which these data do not tell",
                better.label
            );
            identification.notes.push(note);
        }
        identification.model.judged(accepted);
        Ok(Answer { given, effects: added, terms: self.terms.clone(), stages, identification, judged, accepted })
    }
}

/// A model with what was added, and the judgement on it.
#[derive(Debug, Clone)]
pub struct Answer {
    /// What it rests on.
    pub given: Given,
    /// The effects that the model has got, in the order in which they were asked for.
    pub effects: Vec<EffectId>,
    /// The terms that it has got.
    pub terms: Vec<Formula>,
    /// The way there, from before on: at least one.
    pub stages: Vec<Stage>,
    /// Of all the data.
    pub identification: Identification,
    /// Whether the data held out can tell.
    pub judged: bool,
    /// Whether the error falls on data held out.
    pub accepted: bool,
}

impl Answer {
    /// Before, and with all that was added.
    pub fn ends(&self) -> [&Stage; 2] {
        [&self.stages[0], &self.stages[self.stages.len() - 1]]
    }

    /// The JSON object of the interface; `model` is where the model was written.
    ///
    /// # Errors
    /// As [`object`].
    pub fn as_json(&self, model: Option<&Path>) -> Result<Value> {
        let [first, last] = self.ends();
        let body = json!({
            "effects": self.effects,
            "terms": self.terms.iter().map(Formula::text).collect::<Vec<_>>(),
            "esr_before": first.training,
            "esr_after": last.training,
            "held_out_before": first.held_out.esr,
            "held_out_after": last.held_out.esr,
            "noise_floor": last.held_out.noise_floor,
            "parameters": self.identification.parameters,
            "notes": self.identification.notes,
            "accepted": self.accepted,
            "data_findings": self.given.findings,
            "model": model,
        });
        object("add", &self.given.names(), body)
    }

    /// The report: the error falling.
    pub fn report(&self) -> Report<'_> {
        let [first, last] = self.ends();
        let steps: Vec<Step> =
            self.stages.iter().map(|s| Step { label: s.label.clone(), esr: s.held_out.esr }).collect();
        Report::new("The error falls")
            .waterfall("Error-to-signal ratio on data held out", &steps, last.held_out.noise_floor)
            .comparison("After, on data held out", &last.held_out, &last.model)
            .comparison("Before, on data held out", &first.held_out, &first.model)
            .recordings(&self.given.origins())
    }
}

/// Whether a parameter is that of one of these effects.
fn is_of(effects: &[EffectId], assigned: &Assignment) -> bool {
    effects.iter().any(|id| id.description().parameters.iter().any(|p| p.name == assigned.name))
}

/// Data that the fit has seen prove nothing.
fn refuse_seen(training: &[Recording], held_out: &[Recording]) -> Result<()> {
    for judge in held_out {
        if let Some(seen) = training.iter().find(|seen| check::same(seen, judge)) {
            return Err(Error::input(
                Place::file(judge.path()),
                format!(
                    "it holds the same samples as {}, and cannot judge what was fitted to them",
                    seen.path().display()
                ),
                "give another recording last, or this one alone",
            ));
        }
    }
    Ok(())
}
