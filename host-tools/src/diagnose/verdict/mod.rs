//! The verdict, in one word and in a motor engineer's.

mod doubt;
mod outside;
mod remaining;
mod strained;
mod words;

use greyrig::effects::{EffectId, Seen};
use serde::Serialize;

use super::classes::class_of;
use super::completeness::Completeness;
use super::constancy::{Variation, With, jump};
use super::holds::Holds;
use super::ladder::{Ladder, Objection};
use super::lead::Lead;
use super::samples::Finding;
use super::sizes::Size;
use crate::error::Insufficient;
use crate::model::Kind;
use doubt::Doubt;
use words::name;

pub use remaining::Remaining;
pub use strained::Strained;

/// What was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum VerdictKind {
    /// Named effects.
    MissingEffect,
    /// The model is as good as the data.
    None,
    /// A set that these data cannot tell apart, but another recording could.
    Ambiguous,
    /// Real structure that no effect of the catalogue explains.
    OutsideCatalogue,
    /// The recordings do not hold what it takes.
    InsufficientData,
}

/// The verdict.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// In one word.
    pub kind: VerdictKind,
    /// The effects, in the order in which they should be added.
    pub effects: Vec<EffectId>,
    /// Sets whose members no recording could separate.
    pub classes: Vec<Vec<EffectId>>,
    /// The parameters of the effects that were fitted, with their intervals.
    pub sizes: Vec<Size>,
    /// Chance that exactly this is missing, or one of a set, among all that was compared; none where that explains
    /// nothing.
    pub probability: Option<f64>,
    /// In a motor engineer's words.
    pub text: String,
    /// The recording that would tell more.
    pub next_experiment: Option<String>,
    /// What is left though it stands.
    pub remaining: Option<Remaining>,
}

impl Verdict {
    /// The recordings do not hold what it takes.
    pub fn insufficient(reason: &Insufficient) -> Self {
        Self {
            text: format!("these recordings cannot tell: {reason}"),
            next_experiment: Some(
                "a ramp, a staircase or a sine of the voltage over the whole range, and a coast-down".to_owned(),
            ),
            ..Self::without_effects(VerdictKind::InsufficientData, Vec::new())
        }
    }

    /// An effect would lower the error, but here it looks like the supply or the base model.
    fn swallowed(id: EffectId, sizes: Vec<Size>, holds: Holds) -> Self {
        let also = holds.what_else_tells(id.description());
        Self {
            text: format!(
                "{} would lower the error, but in these recordings its contribution can hardly be told from the supply \
                 or from the base parameters, so it is not named",
                name(id)
            ),
            next_experiment: Some(format!(
                "a ramp, a staircase or a sine of the voltage through zero{}",
                also.map_or_else(String::new, |ways| format!("; {ways}"))
            )),
            ..Self::without_effects(VerdictKind::InsufficientData, sizes)
        }
    }

    /// The model is as good as the data.
    fn none(kind: Kind, sizes: Vec<Size>) -> Self {
        let never_visible = match kind {
            Kind::Universal => {
                "Gains of the sensors, an impedance of the supply and a resistance that grows with the speed are"
            }
            Kind::PmDc => "Gains of the sensors and an impedance of the supply are",
        };
        Self {
            text: format!(
                "the model is as good as the data: what is left is as noise and a load that fluctuates are, and no effect of the \
                 catalogue lowers the error on data held out. {never_visible} never visible in voltage, current and speed"
            ),
            ..Self::without_effects(VerdictKind::None, sizes)
        }
    }

    /// The same beside a parameter that varies, where nothing was found: if it changes in time, that is what is
    /// missing; if it is the form of a law that the model has, and explains all, nothing else is.
    pub fn beside(self, varies: &Variation) -> Self {
        match (self.kind, varies.of_law()) {
            (VerdictKind::None, None) => Self::changed(varies),
            (VerdictKind::OutsideCatalogue, None) if varies.explains => Self::changed(varies),
            (VerdictKind::OutsideCatalogue, Some(_)) if varies.explains => Self::but_for_a_form(self.sizes),
            _ => self,
        }
    }

    /// The same where the model's effects explain nearly all that the motor leaves without them: no other one is
    /// missing.
    pub fn but_for_forms(self) -> Self {
        if self.kind == VerdictKind::OutsideCatalogue { Self::but_for_a_form(self.sizes) } else { self }
    }

    /// A parameter of the model changes in time: an effect if it jumps and leaves next to nothing, and of no known law
    /// else.
    pub fn changed(varies: &Variation) -> Self {
        let jumps = jump().filter(|_| varies.explains && matches!(varies.with, With::Time(_)));
        let kind = if jumps.is_some() { VerdictKind::MissingEffect } else { VerdictKind::OutsideCatalogue };
        Self {
            effects: jumps.map(|d| d.id).into_iter().collect(),
            text: "no law of the catalogue explains the error as well as a motor that is not the same all the time:"
                .to_owned(),
            next_experiment: Some(
                "the same once more: what comes back at the same time is the motor's, as where it warms up".to_owned(),
            ),
            ..Self::without_effects(kind, Vec::new())
        }
    }

    /// The same where some effects cannot be it: the next member of its class is named in the place of one of them.
    pub fn but_for(mut self, excluded: &[EffectId]) -> Self {
        for class in &mut self.classes {
            let (first, found) = (class[0], class.clone());
            class.retain(|id| !excluded.contains(id));
            if let Some(next) = class.first().filter(|_| found.len() > class.len()) {
                self.effects.iter_mut().filter(|id| **id == first).for_each(|id| *id = *next);
            }
        }
        self.classes.retain(|class| class.len() > 1);
        self
    }

    /// Whether a parameter of the model changes in time, and nothing else is missing.
    pub fn is_of_a_change(&self) -> bool {
        self.kind == VerdictKind::MissingEffect
            && matches!(&self.effects[..], [id] if id.description().seen == Seen::Course)
    }

    /// All that the model lacks is the form of a law that it has.
    fn but_for_a_form(sizes: Vec<Size>) -> Self {
        Self {
            text: "no effect is missing, but a law of the model has another form than the motor's:".to_owned(),
            ..Self::without_effects(VerdictKind::None, sizes)
        }
    }

    fn without_effects(kind: VerdictKind, sizes: Vec<Size>) -> Self {
        Self {
            kind,
            effects: Vec::new(),
            classes: Vec::new(),
            sizes,
            probability: None,
            text: String::new(),
            next_experiment: None,
            remaining: None,
        }
    }
}

/// Judges what a climb has found, which is `explained` or leaves structure; `lead` is of what is left beside the
/// effects, but for one that is strained.
pub fn judge(
    ladder: &Ladder,
    explained: bool,
    findings: &[Finding],
    lead: &Lead,
    strained: Option<&Strained>,
    sizes: Vec<Size>,
    holds: Holds,
) -> Verdict {
    let kind = ladder.fit.space.kind();
    let mut effects: Vec<EffectId> = super::ids(findings);
    effects.extend(ladder.found.iter().map(|id| id.description().named_as(kind.flux_law())));
    if effects.is_empty() {
        let swallowed = blocked(ladder, Objection::NotIndependent).or_else(|| blocked(ladder, Objection::Implausible));
        return match swallowed {
            Some(id) => Verdict::swallowed(id, sizes, holds),
            None if explained => Verdict::none(kind, sizes),
            None => outside::unexplained(ladder, lead, sizes, Vec::new(), holds),
        };
    }
    let seen = findings.iter().map(|f| f.text.clone());
    let mut text: Vec<String> = seen.chain(words::reasons(ladder, &sizes)).collect();
    if !explained && !ladder.found.is_empty() {
        return outside::unexplained(ladder, lead, sizes, text, holds);
    }
    if let Some(strained) = strained {
        text.push(strained.in_words(&sizes));
        return outside::strained(lead, sizes, text, holds);
    }
    let alone = || if findings.is_empty() { Doubt::about_size(ladder, &sizes, holds) } else { None };
    let doubt = Doubt::about(ladder, holds).or_else(alone);
    match &doubt {
        Some(doubt) => {
            for id in doubt.rivals.iter().map(|id| id.description().named_as(kind.flux_law())) {
                if !effects.contains(&id) {
                    effects.push(id);
                }
            }
            text.push(doubt.reason.clone());
        }
        None if ladder.floor.is_known() && ladder.after.is_complete() && !ladder.found.is_empty() => {
            text.push("with that, nothing is left that repeats from one period to the next".to_owned());
        }
        None => {}
    }
    let mut classes: Vec<Vec<EffectId>> = ladder.found.iter().filter_map(|id| class_of(kind, *id)).collect();
    classes.dedup();
    Verdict {
        kind: if doubt.is_some() { VerdictKind::Ambiguous } else { VerdictKind::MissingEffect },
        effects,
        classes,
        sizes,
        probability: None,
        text: text.join("\n"),
        next_experiment: doubt.map(|doubt| doubt.experiment),
        remaining: None,
    }
}

/// A candidate of the first step that would explain everything, and that only one objection keeps from being named.
fn blocked(ladder: &Ladder, objection: Objection) -> Option<EffectId> {
    let first = ladder.steps.first()?;
    first
        .tried
        .iter()
        .filter(|t| t.objection == Some(objection))
        .find(|t| Completeness::of(&t.fit, &ladder.floor).explains(&ladder.before))
        .map(|t| t.id)
}
