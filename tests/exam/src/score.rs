//! What one case says, and what all say together.

use greyrig::effects::{Description, EffectId};
use greyrig_host::context::Context;
use greyrig_host::diagnose::classes::same;
use greyrig_host::diagnose::{Diagnosis, Options, VerdictKind, diagnose};
use greyrig_host::error::Result;
use greyrig_host::identify::Settings;
use greyrig_host::model::Kind;
use serde::Serialize;

use crate::cases::{Case, STANDS_OUT};

/// The outcome of a case.
#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    /// Number of the case.
    pub seed: u64,
    /// The kind of motor.
    #[serde(skip)]
    pub motor: Kind,
    /// Effects that the plant had.
    pub effects: Vec<String>,
    /// Their identifiers.
    pub truth: Vec<EffectId>,
    /// The verdict.
    pub kind: VerdictKind,
    /// The effects that it names.
    pub named: Vec<EffectId>,
    /// How sure it says that it is.
    pub probability: Option<f64>,
    /// Free-run error-to-signal ratios before: current, speed.
    pub before: [f64; 2],
    /// And after.
    pub after: [f64; 2],
    /// Sizes of effects, the first parameter of each, whose 95 % interval holds zero.
    pub open: Vec<String>,
    /// Decoys tried, and how many of them would have been accepted.
    pub decoys: [usize; 2],
    /// Time, s.
    pub seconds: f64,
}

/// Diagnoses a case.
///
/// # Errors
/// An interrupt.
pub fn run(case: &Case) -> Result<Outcome> {
    let recordings = case.recordings()?;
    let settings = Settings::new(case.excitation.kind());
    let options = Options { settings, exclude: case.exclude.clone(), candidates_refined: false };
    let start = std::time::Instant::now();
    let d: Diagnosis = diagnose(&recordings, &options, &Context::quiet())?;
    let pair = |p: greyrig_host::compare::PerSignal| [p.current.unwrap_or(0.0), p.speed.unwrap_or(0.0)];
    Ok(Outcome {
        seed: case.seed,
        motor: case.excitation.kind(),
        effects: case.effects.clone(),
        truth: case.truth.clone(),
        kind: d.verdict.kind,
        named: d.verdict.effects.clone(),
        probability: d.verdict.probability,
        before: pair(d.esr_before),
        after: pair(d.esr_after),
        open: open(&d),
        decoys: d.decoys,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// Sizes whose interval holds zero.
fn open(d: &Diagnosis) -> Vec<String> {
    let is_size = |name: &str| Description::all().any(|d| d.size().name == name);
    let sizes = d.verdict.sizes.iter().filter(|s| is_size(&s.name) && s.may_be_zero());
    sizes.map(|s| s.name.clone()).collect()
}

impl Outcome {
    /// Whether the effects' error stands out: at least three times the error of healthy motors, in current or speed.
    pub fn stands_out(&self, healthy: [f64; 2]) -> bool {
        (0..2).any(|k| self.before[k] >= STANDS_OUT * healthy[k])
    }

    /// Whether the first effect named is the truth or of its class.
    pub fn first_right(&self) -> bool {
        self.named.first().is_some_and(|n| self.truth.iter().any(|t| same(self.motor, *n, *t)))
    }

    /// Whether exactly the true effects are named, classes counting as one.
    pub fn exact(&self) -> bool {
        (self.kind == VerdictKind::MissingEffect || self.truth.is_empty() && self.kind == VerdictKind::None)
            && self.named.len() == self.truth.len()
            && self.truth.iter().all(|t| self.named.iter().any(|n| same(self.motor, *n, *t)))
    }

    /// Whether what the verdict's probability is of holds: exactly these effects, or all of them in a set.
    pub fn holds(&self) -> bool {
        match self.kind {
            VerdictKind::Ambiguous => !self.truth.is_empty() && self.hits() == self.truth.len(),
            _ => self.exact(),
        }
    }

    /// Names that are right.
    pub fn hits(&self) -> usize {
        self.truth.iter().filter(|t| self.named.iter().any(|n| same(self.motor, *n, **t))).count()
    }
}
