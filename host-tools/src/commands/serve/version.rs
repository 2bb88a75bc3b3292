//! A version of the model, as the page shows it.

use serde_json::Value;

use crate::compare::PerSignal;
use crate::error::Error;
use crate::identify::Estimate;
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
    /// The answer of `diagnose`, with its headline.
    pub diagnosis: Option<Value>,
}

/// What a task says that needs a model.
pub fn no_model() -> Error {
    Error::usage("there is no model", "identify one first")
}
