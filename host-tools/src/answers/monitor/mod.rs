//! Motors judged on recordings of one run each.

mod page;

use std::path::Path;

use serde_json::{Map, Value, json};

pub use page::report;

use super::{Given, object};
use crate::check::Purpose;
use crate::compare::same_type;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::model::{DetectorEntry, Model};
use crate::monitor::test::{Outcome, Test, test};
use crate::recording::Recording;
use crate::report::Report;

/// Column of the motor's temperature.
const TEMPERATURE: &str = "temp_c";

/// What is known beside the recordings.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Request {
    /// Motor type that is being tested; a model of another type is refused.
    pub motor: Option<String>,
    /// Serial number of the one motor, where its recording does not tell it.
    pub serial: Option<String>,
    /// Pressure of the air, hPa, where a recording does not tell it.
    pub air_hpa: Option<f64>,
    /// Temperature of the motor, °C, where a recording does not tell it.
    pub temp_c: Option<f64>,
}

impl Request {
    /// Whether a model is of the type that is tested.
    ///
    /// # Errors
    /// Another one.
    pub fn check_model(&self, model: &Model) -> Result<()> {
        match self.motor.as_deref().filter(|wanted| model.motor.as_deref() != Some(*wanted)) {
            Some(wanted) => Err(Error::usage(
                format!("the model is of motor type {:?}, not {wanted:?}", model.motor.as_deref().unwrap_or("unknown")),
                "take the model of the type that is being tested",
            )),
            None => Ok(()),
        }
    }

    /// Questions recordings, with what is known beside them.
    ///
    /// # Errors
    /// What cannot be known of them: one serial number of several, or another than they tell.
    pub fn question(&self, model: &Model, mut recordings: Vec<Recording>) -> Result<Given> {
        recordings.iter_mut().try_for_each(|recording| self.circumstances(recording))?;
        self.name(&mut recordings)?;
        Ok(Given::questioned(recordings, model.kind, Purpose::Detection))
    }

    fn name(&self, recordings: &mut [Recording]) -> Result<()> {
        let Some(serial) = &self.serial else { return Ok(()) };
        let [recording] = recordings else {
            let told = format!("--serial {serial} is one motor's, and {} recordings are given", recordings.len());
            return Err(Error::usage(told, "test one recording at a time, or have each tell its own (# serial:)"));
        };
        match recording.metadata().get("serial") {
            None => recording.set_metadata("serial", serial),
            Some(known) if known == serial => {}
            Some(known) => {
                let told = format!("--serial {serial}, but {} is of motor {known}", recording.path().display());
                return Err(Error::usage(told, "leave --serial out, or name the right recording"));
            }
        }
        Ok(())
    }

    /// Adds what is known about air and temperature to a recording that does not tell it.
    ///
    /// # Errors
    /// A temperature that is none.
    pub fn circumstances(&self, recording: &mut Recording) -> Result<()> {
        if let Some(pressure) = self.air_hpa.filter(|_| !recording.metadata().contains_key("air_pressure_hpa")) {
            recording.set_metadata("air_pressure_hpa", pressure.to_string());
        }
        if let Some(temperature) = self.temp_c.filter(|_| recording.extras().iter().all(|e| e.name != TEMPERATURE)) {
            let values = vec![temperature; recording.len()];
            recording
                .add_extra(TEMPERATURE, values)
                .map_err(|e| Error::usage(format!("--temp-c {temperature}: {e}"), "give a temperature in °C"))?;
        }
        Ok(())
    }

    /// The answer from a model with limits (`path` is where it comes from) and recordings. Each test is handed to
    /// `each` when it is done, before the next one begins.
    ///
    /// # Errors
    /// A model without limits or of another type; recordings that cannot be used; what `each` says; an interrupt.
    pub fn answer(
        &self,
        model: &Model,
        path: &Path,
        given: Given,
        ctx: &Context,
        each: &mut dyn FnMut(&Test) -> Result<()>,
    ) -> Result<Answer> {
        self.check_model(model)?;
        let detector = model.limits(path)?.clone();
        let mut tests = Vec::new();
        for recording in &given.recordings {
            same_type(model, recording)?;
            let test = test(model, &detector, recording, ctx)?;
            each(&test)?;
            tests.push(test);
        }
        Ok(Answer { given, detector, tests })
    }
}

/// Motors that have been judged.
#[derive(Debug, Clone)]
pub struct Answer {
    /// What it rests on.
    pub given: Given,
    /// The limits.
    pub detector: DetectorEntry,
    /// The tests, in the order of the recordings.
    pub tests: Vec<Test>,
}

impl Answer {
    /// The JSON object of the interface; `model` is the model's file.
    ///
    /// # Errors
    /// As [`object`].
    pub fn as_json(&self, model: Option<&Path>) -> Result<Value> {
        let more = Map::from_iter([("data_findings".to_owned(), json!(self.given.findings))]);
        told(&self.given.names(), &self.tests, model, more)
    }

    /// The report.
    pub fn report(&self) -> Report<'static> {
        report(&self.tests, &self.detector, &self.given.origins())
    }
}

/// The worst verdict of some tests.
pub fn worst(tests: &[Test]) -> Outcome {
    tests.iter().map(|t| t.verdict).max().unwrap_or(Outcome::CannotJudge)
}

/// The JSON object of the interface for tests on recordings or on line, with what `more` tells.
///
/// # Errors
/// As [`object`].
pub fn told(recordings: &[String], tests: &[Test], model: Option<&Path>, more: Map<String, Value>) -> Result<Value> {
    let alarms: Vec<_> = tests.iter().flat_map(|t| &t.alarms).collect();
    let mut body = json!({ "verdict": worst(tests), "alarms": alarms, "runs": tests, "model": model });
    if let Some(body) = body.as_object_mut() {
        body.extend(more);
    }
    object("monitor", recordings, body)
}
