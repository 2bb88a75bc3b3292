//! A version of the model, with what is kept of it.

use std::sync::Arc;

use super::api;
use crate::addition::Stage;
use crate::compare::PerSignal;
use crate::identify::Estimate;
use crate::model::Model;

/// A version of the model.
#[derive(Debug, Clone)]
pub struct Version {
    /// What is told and kept.
    pub told: api::Version,
    /// As identified from all recordings.
    pub model: Arc<Model>,
}

/// A model that has just been made.
#[derive(Debug, Clone)]
pub struct Made {
    /// What it has got last.
    pub label: String,
    /// As identified from all recordings.
    pub model: Model,
    /// Its parameters.
    pub parameters: Vec<Estimate>,
    /// What the identification has to say.
    pub notes: Vec<String>,
    /// Error on the data that a fit of the training data has seen.
    pub training: PerSignal,
    /// The same on the data held out from it.
    pub held_out: PerSignal,
    /// Noise floor of these.
    pub floor: PerSignal,
    /// Whether the error on data held out falls by what it has got last.
    pub accepted: Option<bool>,
}

impl Made {
    /// Judged on what a stage was held out from.
    pub fn judged(self, stage: &Stage) -> Self {
        let (held_out, floor) = (stage.held_out.esr, stage.held_out.noise_floor);
        Self { training: stage.training, held_out, floor, ..self }
    }

    /// As a version.
    pub fn version(self, id: u32, parent: Option<u32>, command: String, basis: String) -> Version {
        let told = api::Version {
            id,
            parent,
            label: self.label,
            command,
            effects: self.model.effects.iter().map(|e| e.id.to_string()).collect(),
            terms: self.model.terms.iter().map(|t| t.formula.text().to_owned()).collect(),
            parameters: self.parameters.iter().map(Into::into).collect(),
            notes: self.notes,
            note: None,
            training: self.training.into(),
            held_out: self.held_out.into(),
            floor: self.floor.into(),
            accepted: self.accepted,
            basis,
            diagnosis: None,
            corrected: Some(self.model.correction.is_some()),
            plan: None,
            challenge: None,
        };
        Version { told, model: Arc::new(self.model) }
    }
}
