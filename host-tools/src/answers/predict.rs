//! What a model makes of a voltage.

use std::path::Path;

use serde_json::{Value, json};

use super::{Given, object};
use crate::check;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::forecast::{self, Prediction, Settings};
use crate::model::{Assignment, Model};
use crate::recording::Recording;
use crate::recording::series::Series;
use crate::report::{Curves, Report};

/// Points of a curve that are drawn: as many as a screen is wide.
const DRAWN: usize = 2000;

/// How the prediction is made.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Request {
    /// As in the library.
    pub settings: Settings,
}

impl Request {
    /// Gives a part of the state at the first sample: `i_a`, A, or `omega_rad_s` (`v_m_s`), rad/s.
    ///
    /// # Errors
    /// A name that is no part of it, or one that was given before.
    pub fn begin_with(&mut self, Assignment { name, value }: &Assignment) -> Result<()> {
        let state = match name.as_str() {
            "i_a" => &mut self.settings.current,
            "omega_rad_s" | "v_m_s" => &mut self.settings.speed,
            _ => {
                return Err(Error::usage(
                    format!("{name} is no part of the state at the begin"),
                    "give --initial i_a=…,omega_rad_s=…",
                ));
            }
        };
        if state.replace(*value).is_some() {
            return Err(Error::usage(format!("--initial gives {name} twice"), "give it once"));
        }
        Ok(())
    }

    /// Questions the input of a prediction.
    pub fn question(&self, model: &Model, mut recordings: Vec<Recording>) -> Given {
        let findings = check::question_an_input(&mut recordings, model.kind);
        Given { recordings, findings }
    }

    /// The answer from a model and one input.
    ///
    /// # Errors
    /// A model or an input that cannot be used; an interrupt.
    pub fn answer(&self, model: &Model, given: Given, ctx: &Context) -> Result<Answer> {
        let Some(input) = given.recordings.first() else {
            return Err(Error::usage("there is no voltage to predict from", "give one recording"));
        };
        let prediction = forecast::predict(model, input, &self.settings, ctx)?;
        Ok(Answer { series: prediction.series(model, input), given, prediction })
    }
}

/// A prediction.
#[derive(Debug, Clone)]
pub struct Answer {
    /// What it rests on: one recording.
    pub given: Given,
    /// The free run and its band.
    pub prediction: Prediction,
    /// The same sample by sample, with what else the input holds.
    pub series: Series,
}

impl Answer {
    /// The JSON object of the interface; `model` is the model's file, `out` where the series were written.
    ///
    /// # Errors
    /// As [`object`].
    pub fn as_json(&self, model: Option<&Path>, out: Option<&Path>) -> Result<Value> {
        let prediction = &self.prediction;
        let extrapolation = prediction.extrapolation.as_ref();
        let body = json!({
            "samples": prediction.recorded(),
            "sample_time_s": prediction.interval_s,
            "input": prediction.course,
            "speed_sensor": prediction.speed_sensor,
            "initial": prediction.begin,
            "band": prediction.band.as_ref().map(|band| band.share),
            "extrapolated": extrapolation.map(|e| &e.stretches),
            "final": prediction.last().map(|n| {
                let of = |values: &[f64], band: Option<&[Vec<f64>; 2]>| {
                    json!({ "value": values[n], "band": band.map(|[low, high]| [low[n], high[n]]) })
                };
                let band = prediction.band.as_ref();
                json!({
                    "t_s": prediction.time_s(n),
                    "i_a": of(&prediction.current, band.and_then(|band| band.current.as_ref())),
                    "omega_rad_s": of(&prediction.speed, band.and_then(|band| band.speed.as_ref())),
                })
            }),
            "model": model,
            "out": out,
            "data_findings": self.given.findings,
        });
        object("predict", &self.given.names(), body)
    }

    /// The report: current and speed with their bands.
    pub fn report(&self) -> Report<'_> {
        let prediction = &self.prediction;
        let band = prediction.band.as_ref();
        let signals = [
            ("Current", "A", &prediction.current, band.and_then(|b| b.current.as_ref())),
            ("Speed", "rad/s", &prediction.speed, band.and_then(|b| b.speed.as_ref())),
        ];
        let mut report = Report::new("The model's free run").recordings(&self.given.origins());
        for (name, unit, values, band) in signals {
            let points = |values: &[f64]| -> Vec<(f64, f64)> {
                let every = values.len().div_ceil(DRAWN).max(1);
                let at = (0..values.len()).step_by(every).filter(|n| values[*n].is_finite());
                at.map(|n| (prediction.time_s(n), values[n])).collect()
            };
            let mut curves = vec![("predicted".to_owned(), points(values))];
            for (side, values) in ["least", "greatest"].into_iter().zip(band.into_iter().flatten()) {
                curves.push((format!("{side} of the band"), points(values)));
            }
            let caption = format!("{name} from the voltage alone");
            let (x, y) = ("time, s".to_owned(), format!("{}, {unit}", name.to_lowercase()));
            report = report.curves(name, Curves { caption, x, y, logarithmic: false, curves });
        }
        report
    }
}
