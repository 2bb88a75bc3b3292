//! A learned correction beside the model, and how much of the current it makes.

use serde_json::{Value, json};

use super::attempts::Data;
use crate::anfis;
use crate::compare::{Comparison, compare};
use crate::context::Context;
use crate::error::Result;
use crate::hybrid;
use crate::model::Model;
use crate::recording::Recording;

/// Begin of a recording that is neither learnt nor judged, s.
const BLANKING_S: f64 = 1.0;
const EPOCHS: usize = 60;

/// A model with a learned correction, and what that does for the current on data held out.
pub struct Corrected {
    /// Which model.
    pub label: &'static str,
    /// The model with the correction.
    pub model: Model,
    /// Without and with it.
    pub comparisons: [Comparison; 2],
    /// Part of the current that the correction makes.
    pub share: Option<f64>,
}

impl Corrected {
    /// Trains a correction of a model.
    ///
    /// # Errors
    /// An interrupt.
    pub fn new(label: &'static str, model: &Model, data: &Data, ctx: &Context) -> Result<Self> {
        let settings = hybrid::settings(anfis::Method::Varpro, EPOCHS);
        let (hybrid, _) = hybrid::train(model, &data.training, BLANKING_S, &settings, ctx)?;
        let judged: Vec<Recording> = data.held_out.iter().map(|r| hybrid::without_start(r, BLANKING_S)).collect();
        let (before, after) = (compare(model, &judged, ctx)?, compare(&hybrid, &judged, ctx)?);
        let share = hybrid::share_of_correction(&before, &after);
        Ok(Self { label, model: hybrid, share, comparisons: [before, after] })
    }

    /// Error-to-signal ratio of the current, without and with the correction.
    pub fn errors(&self) -> [Option<f64>; 2] {
        self.comparisons.each_ref().map(|comparison| comparison.esr.current)
    }

    /// For a program.
    pub fn in_json(&self) -> Value {
        let [before, after] = self.errors();
        json!({
            "model": self.label, "held_out_before": before, "held_out_after": after, "correction_share": self.share,
        })
    }
}
