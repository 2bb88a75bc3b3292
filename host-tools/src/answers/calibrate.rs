//! The detector's limits, from healthy motors.

use std::path::Path;

use serde_json::{Value, json};

use super::{Given, object};
use crate::check::Purpose;
use crate::context::Context;
use crate::error::Result;
use crate::model::Model;
use crate::monitor::calibrate::{Calibration, FALSE_ALARMS, Settings, calibrate};
use crate::monitor::lot::Labels;
use crate::recording::Recording;

/// How they are learnt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    /// Begin of each run that is not judged, s.
    pub blanking_s: f64,
    /// Share of healthy motors that may fail.
    pub false_alarms: f64,
    /// What is known of the motors.
    pub labels: Labels,
}

impl Default for Request {
    fn default() -> Self {
        Self { blanking_s: 1.0, false_alarms: FALSE_ALARMS, labels: Labels::Healthy }
    }
}

impl Request {
    /// Questions recordings, as this request takes them.
    pub fn question(&self, model: &Model, recordings: Vec<Recording>) -> Given {
        Given::questioned(recordings, model.kind, Purpose::Detection)
    }

    /// The answer from a model and runs of healthy motors.
    ///
    /// # Errors
    /// A model or recordings that cannot be used; an interrupt.
    pub fn answer(&self, model: &Model, given: Given, ctx: &Context) -> Result<Answer> {
        let Self { blanking_s, false_alarms, labels } = *self;
        let settings = Settings { blanking_s, false_alarms, labels };
        let calibration = calibrate(model, &given.recordings, settings, ctx)?;
        let model = Model { detector: Some(calibration.detector.clone()), ..model.clone() };
        Ok(Answer { given, model, calibration })
    }
}

/// A model with limits.
#[derive(Debug, Clone)]
pub struct Answer {
    /// What it rests on.
    pub given: Given,
    /// The model with the limits.
    pub model: Model,
    /// The limits, and what led to them.
    pub calibration: Calibration,
}

impl Answer {
    /// The JSON object of the interface; `model` is where the model was written.
    ///
    /// # Errors
    /// As [`object`].
    pub fn as_json(&self, model: Option<&Path>) -> Result<Value> {
        let Calibration { detector, shown, without_lot, outsiders, operating_points } = &self.calibration;
        let body = json!({
            "detector": detector,
            "runs": shown,
            "without_lot": without_lot,
            "outsiders": outsiders,
            "operating_points": operating_points,
            "model": model,
            "data_findings": self.given.findings,
        });
        object("calibrate", &self.given.names(), body)
    }
}
