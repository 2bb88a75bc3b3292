//! Whether the loop ends: what is named is added, the model asked again, until nothing is named.

use std::fmt;

use greyrig::effects::EffectId;
use greyrig_host::addition::{Additions, add_to};
use greyrig_host::context::Context;
use greyrig_host::diagnose::{Options, Verdict, VerdictKind, diagnose};
use greyrig_host::error::Result;
use greyrig_host::identify::{Settings, identify};
use greyrig_host::model::{Model, catalogue};
use greyrig_host::recording::Recording;

use crate::cases::Case;
use crate::score::Outcome;

/// Effects after which a loop counts as one that does not end: twice as many as any case has.
const MOST_ADDED: usize = 10;

/// How the effects of a verdict are added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Steps {
    /// All that it names.
    AllAtOnce,
    /// The first one; then the model is asked again.
    OneByOne,
}

impl Steps {
    /// Both ways.
    pub const ALL: [Self; 2] = [Self::AllAtOnce, Self::OneByOne];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::AllAtOnce => "all at once",
            Self::OneByOne => "one by one",
        }
    }
}

/// How a loop has ended.
#[derive(Debug, Clone)]
pub struct Ending {
    /// Number of the case.
    pub seed: u64,
    /// The effects that the plant had.
    pub truth: Vec<EffectId>,
    /// The effects that were added, in that order.
    pub added: Vec<EffectId>,
    /// The last verdict.
    pub last: Verdict,
}

impl Ending {
    /// Whether the last verdict is that nothing is missing.
    pub fn is_none(&self) -> bool {
        self.last.kind == VerdictKind::None
    }
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let joined = |ids: &[EffectId]| catalogue::joined(ids, " + ");
        write!(f, "{} {}: added {}, then {:?}", self.seed, joined(&self.truth), joined(&self.added), self.last.kind)?;
        if self.last.effects.is_empty() { Ok(()) } else { write!(f, " {}", joined(&self.last.effects)) }
    }
}

/// Adds what a diagnosis has named and asks again, until no effect is missing or the verdict is another.
///
/// # Errors
/// Recordings that cannot be used, an interrupt.
pub fn follow(case: &Case, outcome: &Outcome, steps: Steps) -> Result<Ending> {
    let recordings = case.recordings()?;
    let ctx = Context::quiet();
    let mut model = identify(&recordings, &Settings::new(case.excitation.kind()), &ctx)?.model;
    let (mut named, mut added) = (outcome.named.clone(), Vec::new());
    loop {
        if steps == Steps::OneByOne {
            named.truncate(1);
        }
        let addition = add_to(&model, Additions::effects(&named), &recordings, &ctx)?;
        added.extend(addition.effects);
        model = addition.identification.model;
        let last = asked(&model, &recordings, case, &ctx)?;
        if last.kind != VerdictKind::MissingEffect || added.len() >= MOST_ADDED {
            return Ok(Ending { seed: case.seed, truth: case.truth.clone(), added, last });
        }
        named = last.effects;
    }
}

fn asked(model: &Model, recordings: &[Recording], case: &Case, ctx: &Context) -> Result<Verdict> {
    let options =
        Options { settings: Settings::of_model(model), exclude: case.exclude.clone(), candidates_refined: false };
    Ok(diagnose(recordings, &options, ctx)?.verdict)
}
