//! The learned correction of what the physical model leaves over.

use std::path::Path;

use serde_json::{Value, json};

use super::{Given, object};
use crate::anfis::{Epoch, Method, Ridge, Settings, Trained};
use crate::check::Purpose;
use crate::compare::{Comparison, compare};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::held_out::split;
use crate::hybrid;
use crate::model::Model;
use crate::network::FiringName;
use crate::numbers::percent_in_column;
use crate::recording::Recording;
use crate::report::training::network;
use crate::report::{Curves, Report, Step};

/// How it is learnt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    /// Begin of each recording that is neither learnt nor judged, s.
    pub blanking_s: f64,
    /// Epochs at most.
    pub epochs: usize,
    /// How the premises are trained.
    pub method: Method,
    /// Exponent b of the bells, if it is not trained.
    pub exponent: Option<f64>,
    /// Ridge of least squares as a fraction of rows over columns.
    pub ridge: f64,
    /// Firing operator.
    pub firing: FiringName,
    /// A fourth input of which it is told what it would gain: the modelled current so long ago, s.
    pub delay_s: Option<f64>,
    /// Threads, 0 for all processors.
    pub threads: usize,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            blanking_s: 1.0,
            epochs: 60,
            method: Method::Varpro,
            exponent: None,
            ridge: hybrid::RIDGE,
            firing: FiringName::Product,
            delay_s: None,
            threads: 0,
        }
    }
}

impl Request {
    /// Whether the request is one at all, before anything is read.
    ///
    /// # Errors
    /// A delay that cannot be.
    pub fn check(&self) -> Result<()> {
        match self.delay_s.filter(|delay| !(1e-4..=1.0).contains(delay)) {
            Some(delay) => {
                Err(Error::usage(format!("a delay of {delay} s cannot be"), "choose --delay from 0.0001 to 1"))
            }
            None => Ok(()),
        }
    }

    /// Questions recordings, as this request takes them.
    pub fn question(&self, model: &Model, recordings: Vec<Recording>) -> Given {
        Given::questioned(recordings, model.kind, Purpose::Fit)
    }

    /// The answer from a model, whose present correction and limits do not count, and recordings. With several, the
    /// correction is judged on the last one, which it does not see; with a single one, on the last third of the time
    /// until all is at rest.
    ///
    /// # Errors
    /// A model or recordings that cannot be used; an interrupt.
    pub fn answer(&self, model: &Model, given: Given, ctx: &Context) -> Result<Answer> {
        self.check()?;
        given.refuse()?;
        let bare = &Model { correction: None, detector: None, ..model.clone() };
        let (training, held_out) = split(&given.recordings);
        let settings = Settings {
            exponent: self.exponent,
            firing: self.firing.into(),
            threads: self.threads,
            ridge: Ridge::Relative(self.ridge),
            ..hybrid::settings(self.method, self.epochs)
        };
        let (model, trained) = hybrid::train(bare, &training, self.blanking_s, &settings, ctx)?;
        let quietly = &ctx.quietly();
        let with_delay =
            |delay| hybrid::with_rows_kept_back(bare, &training, self.blanking_s, Some(delay), &settings, quietly);
        let delayed = self.delay_s.map(with_delay).transpose()?;
        let judged = |recordings: &[Recording]| -> Vec<Recording> {
            recordings.iter().map(|r| hybrid::without_start(r, self.blanking_s)).collect()
        };
        let data = [judged(&training), judged(&held_out)];
        let before = [compare(bare, &data[0], quietly)?, compare(bare, &data[1], quietly)?];
        let after = [compare(&model, &data[0], quietly)?, compare(&model, &data[1], quietly)?];
        let share = hybrid::share_of_correction(&before[1], &after[1]);
        Ok(Answer { given, delay_s: self.delay_s, model, trained, delayed, before, after, share })
    }
}

/// What the correction does, on training data and on data held out.
#[derive(Debug, Clone)]
pub struct Answer {
    /// What it rests on.
    pub given: Given,
    /// The delay of the fourth input, s.
    pub delay_s: Option<f64>,
    /// The model with the correction.
    pub model: Model,
    /// The correction, as it was trained.
    pub trained: Trained,
    /// With the fourth input.
    pub delayed: Option<Trained>,
    /// Without the correction: on training data, on data held out.
    pub before: [Comparison; 2],
    /// With it.
    pub after: [Comparison; 2],
    /// Share of the current that the correction makes.
    pub share: Option<f64>,
}

impl Answer {
    /// Whether the error falls on data held out.
    pub fn accepted(&self) -> bool {
        self.before[1].esr.falls_to(&self.after[1].esr)
    }

    /// What the correction does, in a sentence.
    pub fn in_words(&self) -> String {
        let current = |c: &Comparison| percent_in_column(c.esr.current);
        format!(
            "on data held out the error of the current falls from {} to {}; the black box makes {} of the current, physics the rest",
            current(&self.before[1]),
            current(&self.after[1]),
            percent_in_column(self.share)
        )
    }

    /// The JSON object of the interface; `model` is where the model was written.
    ///
    /// # Errors
    /// As [`object`].
    pub fn as_json(&self, model: Option<&Path>) -> Result<Value> {
        let delayed = |d: &Trained| json!({ "delay_s": self.delay_s, "rmse_trn": d.rmse_trn, "rmse_chk": d.rmse_chk });
        let body = json!({
            "epochs": self.trained.epochs,
            "rmse_trn": self.trained.rmse_trn,
            "rmse_chk": self.trained.rmse_chk,
            "esr_before": self.before[0].esr,
            "esr_after": self.after[0].esr,
            "held_out_before": self.before[1].esr,
            "held_out_after": self.after[1].esr,
            "noise_floor": self.after[1].noise_floor,
            "correction_share": self.share,
            "accepted": self.accepted(),
            "delayed": self.delayed.as_ref().map(delayed),
            "notes": self.trained.notes(),
            "model": model,
            "data_findings": self.given.findings,
        });
        object("train", &self.given.names(), body)
    }

    /// The report.
    pub fn report(&self) -> Report<'_> {
        let step = |label: &str, c: &Comparison| Step { label: label.to_owned(), esr: c.esr };
        let held_out = &self.after[1];
        let steps = [step("physical model", &self.before[1]), step("+ correction", held_out)];
        let report = Report::new("The learned correction")
            .lead(self.in_words())
            .waterfall("Error-to-signal ratio on data held out", &steps, held_out.noise_floor)
            .curves("Learning curve", learning_curve(&self.trained));
        network(report, &hybrid::INPUTS.map(str::to_owned), hybrid::TARGET, &self.trained)
            .comparison("With the correction, on data held out", held_out, &self.model)
            .recordings(&self.given.origins())
    }
}

/// The error over the epochs.
pub fn learning_curve(trained: &Trained) -> Curves {
    let of = |get: &dyn Fn(&Epoch) -> Option<f64>| -> Vec<(f64, f64)> {
        trained.epochs.iter().enumerate().filter_map(|(k, e)| Some((k as f64 + 1.0, get(e)?))).collect()
    };
    Curves {
        caption: "Root mean square error of the raw current on the rows trained on and on those kept back to tell when to stop"
            .to_owned(),
        x: "epoch".to_owned(),
        y: "A".to_owned(),
        logarithmic: true,
        curves: vec![("training".to_owned(), of(&|e| Some(e.rmse_trn))), ("checking".to_owned(), of(&|e| e.rmse_chk))],
    }
}
