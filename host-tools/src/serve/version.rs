//! A version of the model, as a page shows it.

use serde_json::{Value, json};

use crate::addition::Stage;
use crate::compare::PerSignal;
use crate::identify::{Estimate, Identification};
use crate::model::Model;

/// A version of the model.
#[derive(Debug, Clone)]
pub struct Version {
    /// What it has got last.
    pub label: String,
    /// As identified from all recordings.
    pub model: Model,
    /// Its parameters with their intervals.
    pub parameters: Vec<Estimate>,
    /// What the identification has to say.
    pub notes: Vec<String>,
    /// Error-to-signal ratio on the data that a fit of the training data has seen.
    pub training: PerSignal,
    /// The same on the data held out from it.
    pub held_out: PerSignal,
    /// Noise floor of these.
    pub floor: PerSignal,
    /// Whether the error on data held out falls by what it has got last; the first version has no such thing.
    pub accepted: Option<bool>,
    /// Number of the recordings that all this rests on.
    pub recordings: usize,
    /// The answer of a diagnosis, with its headline and odds.
    pub diagnosis: Option<Value>,
}

impl Version {
    /// Of a number of recordings, judged on what a stage was held out from.
    pub fn new(
        label: String,
        whole: Identification,
        judged: &Stage,
        accepted: Option<bool>,
        recordings: usize,
    ) -> Self {
        Self {
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

    /// As the page reads it.
    pub fn as_json(&self) -> Value {
        json!({
            "label": self.label,
            "effects": self.model.effects.iter().map(|e| &e.id).collect::<Vec<_>>(),
            "parameters": self.parameters,
            "notes": self.notes,
            "training": self.training,
            "held_out": self.held_out,
            "noise_floor": self.floor,
            "accepted": self.accepted,
            "recordings": self.recordings,
            "diagnosis": self.diagnosis,
        })
    }
}
