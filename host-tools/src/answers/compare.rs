//! A model against measurements, and where it fails.

use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use super::{Given, object};
use crate::between::Course;
use crate::check::Purpose;
use crate::compare::{Comparison, compare_along};
use crate::context::Context;
use crate::error::Result;
use crate::model::Model;
use crate::recording::Recording;
use crate::recording::finding::DataFinding;
use crate::recording::series::Series;
use crate::report::Report;

/// How they are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Request {
    /// What the voltage does between its samples; by itself what the data tell.
    pub course: Option<Course>,
}

impl Request {
    /// Questions recordings, as this request takes them.
    pub fn question(&self, model: &Model, recordings: Vec<Recording>) -> Given {
        Given::questioned(recordings, model.kind, Purpose::Fit)
    }

    /// The answer from a model and recordings.
    ///
    /// # Errors
    /// Recordings from which nothing can be told, or on which the model cannot be simulated; an interrupt.
    pub fn answer(&self, model: &Model, given: Given, ctx: &Context) -> Result<Answer> {
        given.refuse()?;
        let comparison = compare_along(model, &given.recordings, self.course, ctx)?;
        Ok(Answer { given, model: model.clone(), comparison })
    }
}

/// A comparison.
#[derive(Debug, Clone)]
pub struct Answer {
    /// What it rests on.
    pub given: Given,
    /// The model.
    pub model: Model,
    /// How far it is off, and where.
    pub comparison: Comparison,
}

/// A comparison, where it was written to sample by sample, and what was found about the data.
#[derive(Serialize)]
struct Written<'a> {
    #[serde(flatten)]
    comparison: &'a Comparison,
    #[serde(skip_serializing_if = "Option::is_none")]
    out: Option<&'a Path>,
    data_findings: &'a [DataFinding],
}

impl Answer {
    /// The JSON object of the interface; `out` is where the series were written.
    ///
    /// # Errors
    /// As [`object`].
    pub fn as_json(&self, out: Option<&Path>) -> Result<Value> {
        let body = Written { comparison: &self.comparison, out, data_findings: &self.given.findings };
        object("compare", &self.given.names(), body)
    }

    /// Measured, modelled and residual, sample by sample.
    pub fn series(&self) -> Series {
        self.comparison.series(self.given.recordings.first().map(Recording::motion).unwrap_or_default())
    }

    /// The report.
    pub fn report(&self) -> Report<'_> {
        let name = self.model.motor.as_deref().unwrap_or("motor");
        Report::new(format!("{name}: model against measurement"))
            .comparison("Model against measurement", &self.comparison, &self.model)
            .recordings(&self.given.origins())
    }
}
