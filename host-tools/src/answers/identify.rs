//! The physical parameters of a motor type.

use std::path::Path;

use serde_json::{Value, json};

use super::{Given, object};
use crate::between::Course;
use crate::check::Purpose;
use crate::compare::{Comparison, compare_along};
use crate::context::Context;
use crate::diagnose::change;
use crate::error::{Error, Result, if_possible};
use crate::identify::{Identification, Method, Settings, identify};
use crate::model::{Assignment, Base, Kind};
use crate::recording::Recording;
use crate::report::Report;
use crate::term::Formula;
use greyrig::effects::EffectId;

/// What is wanted of the model.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Request {
    /// Kind of motor; by itself what the recordings tell, or else universal.
    pub kind: Option<Kind>,
    /// How far the estimation goes.
    pub method: Method,
    /// Friction terms; by itself those that are usual for the kind.
    pub base: Option<Base>,
    /// Effects of the catalogue that the model shall have.
    pub effects: Vec<EffectId>,
    /// Terms of the user's own.
    pub terms: Vec<Formula>,
    /// Parameters with a known value, SI.
    pub fixed: Vec<Assignment>,
    /// Parameters with bounds, SI: name, least, greatest.
    pub bounds: Vec<(String, f64, f64)>,
    /// What the voltage does between its samples; by itself what the data tell.
    pub course: Option<Course>,
    /// Cut-off of the Butterworth filter, Hz; by itself that of [`Settings`].
    pub cutoff_hz: Option<f64>,
    /// Order of the Butterworth filter; by itself that of [`Settings`].
    pub order: Option<u8>,
}

impl Request {
    /// Whether the request is one at all, before anything is read.
    ///
    /// # Errors
    /// A cut-off that is no frequency.
    pub fn check(&self) -> Result<()> {
        if self.cutoff_hz.is_some_and(|hz| !(hz > 0.0 && hz.is_finite())) {
            return Err(Error::usage("--cutoff must be a positive frequency", "give it in Hz, such as --cutoff 250"));
        }
        Ok(())
    }

    /// Questions recordings, as this request takes them.
    pub fn question(&self, recordings: Vec<Recording>) -> Given {
        let kind = Kind::of(self.kind, &recordings);
        Given::questioned(recordings, kind, Purpose::Fit)
    }

    /// The answer from recordings.
    ///
    /// # Errors
    /// A request that is none; recordings from which nothing can be identified; an interrupt.
    pub fn answer(&self, given: Given, ctx: &Context) -> Result<Answer> {
        self.check()?;
        given.refuse()?;
        let recordings = &given.recordings;
        let kind = Kind::of(self.kind, recordings);
        let mut settings = self.settings(kind);
        change::hold(&mut settings, recordings, ctx)?;
        let mut identification = identify(recordings, &settings, ctx)?;
        // A model without K, say, cannot be simulated on these recordings; the estimate stands all the same.
        let compared = compare_along(&identification.model, recordings, self.course, &ctx.quietly());
        let comparison = if_possible(compared)?;
        if let Some(c) = &comparison {
            for (name, esr) in [("current", c.esr.current), ("speed", c.esr.speed), ("torque", c.esr.torque)] {
                if let Some(esr) = esr {
                    identification.model.provenance.esr.insert(name.to_owned(), esr);
                }
            }
        }
        Ok(Answer { given, kind, identification, comparison })
    }

    fn settings(&self, kind: Kind) -> Settings {
        let mut settings = Settings::new(kind);
        settings.method = self.method;
        settings.base = self.base.unwrap_or(settings.base);
        settings.effects.clone_from(&self.effects);
        settings.terms.clone_from(&self.terms);
        settings.fixed.clone_from(&self.fixed);
        settings.bounds.clone_from(&self.bounds);
        settings.course = self.course;
        settings.filter.order = self.order.unwrap_or(settings.filter.order);
        if let Some(cutoff) = self.cutoff_hz {
            settings.filter.cutoff_hz = cutoff;
            settings.cutoff_given = true;
        }
        settings
    }
}

/// A model, and how far it is off.
#[derive(Debug, Clone)]
pub struct Answer {
    /// What it rests on.
    pub given: Given,
    /// Kind of motor.
    pub kind: Kind,
    /// The model and its parameters.
    pub identification: Identification,
    /// Against the same recordings, where it can be simulated on them.
    pub comparison: Option<Comparison>,
}

impl Answer {
    /// The JSON object of the interface; `model` is where the model was written.
    ///
    /// # Errors
    /// As [`object`].
    pub fn as_json(&self, model: Option<&Path>) -> Result<Value> {
        let Self { identification, comparison, .. } = self;
        let comparison = comparison.as_ref();
        let body = json!({
            "kind": self.kind,
            "parameters": identification.parameters,
            "flux_at_peak": identification.flux,
            "condition": identification.condition,
            "esr": comparison.map(|c| c.esr),
            "noise_floor": comparison.map(|c| c.noise_floor),
            "noise_floor_source": comparison.and_then(|c| c.noise_floor_source.clone()),
            "filter": identification.model.filter,
            "input": comparison.and_then(|c| c.input),
            "notes": identification.notes,
            "data_findings": self.given.findings,
            "model": model,
        });
        object("identify", &self.given.names(), body)
    }

    /// The report: the model against what it was identified from. None: it cannot be simulated on that.
    pub fn report(&self) -> Option<Report<'_>> {
        let comparison = self.comparison.as_ref()?;
        let model = &self.identification.model;
        let name = model.motor.as_deref().unwrap_or("motor");
        let report = Report::new(format!("{name}: identified"));
        Some(report.comparison("Model against measurement", comparison, model).recordings(&self.given.origins()))
    }
}
