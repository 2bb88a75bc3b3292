//! The answer of a diagnosis: its verdict in a line, and its fields for a program.

use greyrig::effects::EffectId;
use serde_json::{Value, json};

use super::{Diagnosis, VerdictKind, odds};
use crate::compare::Comparison;
use crate::model::catalogue;

impl Diagnosis {
    /// The verdict in a line.
    pub fn headline(&self) -> String {
        let verdict = &self.verdict;
        let others = |id: &EffectId| {
            let class = verdict.classes.iter().find(|class| class.contains(id))?;
            Some(catalogue::joined(&class.iter().copied().filter(|other| other != id).collect::<Vec<_>>(), " or "))
        };
        let with_class = |id: &EffectId| others(id).map_or(id.to_string(), |others| format!("{id} (or {others})"));
        let effects = verdict.effects.iter().map(with_class).collect::<Vec<_>>().join(", ");
        match verdict.kind {
            VerdictKind::MissingEffect => format!("missing: {effects}"),
            VerdictKind::None => "nothing is missing that these recordings could show".to_owned(),
            VerdictKind::Ambiguous if verdict.effects.len() == 1 => {
                format!("ambiguous: {effects}, or something else")
            }
            VerdictKind::Ambiguous => format!("ambiguous: {effects}"),
            VerdictKind::OutsideCatalogue => "something is missing that the catalogue does not hold".to_owned(),
            VerdictKind::InsufficientData => "insufficient data".to_owned(),
        }
    }

    /// How sure the verdict is, as odds: `20 to 1`.
    pub fn odds(&self) -> Option<String> {
        self.verdict.probability.map(odds::in_words)
    }

    /// Its fields, with those of the comparison of the model as it is, where there is one.
    pub fn as_json(&self, comparison: Option<&Comparison>) -> Value {
        let verdict = &self.verdict;
        let screened = |(effect, gain): &(EffectId, f64)| json!({ "effect": effect, "gain": gain });
        json!({
            "esr_before": self.esr_before,
            "esr_after": self.esr_after,
            "noise_floor": comparison.map(|c| c.noise_floor),
            "where": comparison.map(|c| &c.regions),
            "verdict": {
                "kind": verdict.kind,
                "effects": verdict.effects,
                "sizes": verdict.sizes,
                "probability": verdict.probability,
                "text": verdict.text,
                "next_experiment": verdict.next_experiment,
                "remaining": verdict.remaining,
            },
            "remaining": verdict.remaining,
            "classes": verdict.classes,
            "candidates": self.candidates,
            "screening": self.screening.iter().map(screened).collect::<Vec<_>>(),
            "lead": self.lead,
            "shape": self.shape,
            "decoy_gain": self.decoy_gain,
            "dithered": self.clean,
        })
    }
}
