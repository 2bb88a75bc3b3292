//! A learned correction beside the model, and how much of the current it makes.

use std::ops::ControlFlow;

use serde_json::{Value, json};

use super::attempts::Data;
use crate::anfis;
use crate::commands::train::{correction_share, without_start};
use crate::commands::words;
use crate::compare::{Comparison, compare};
use crate::error::Result;
use crate::hybrid;
use crate::model::Model;
use crate::recording::Recording;
use crate::report::Table;

/// Begin of a recording that is neither learnt nor judged, s.
const BLANKING_S: f64 = 1.0;
const EPOCHS: usize = 60;
const COLUMNS: [&str; 4] = ["model", "current", "with correction", "black box"];

/// A model with a learned correction, and what that does for the current on data held out.
pub struct Corrected {
    label: &'static str,
    /// The model with the correction.
    pub model: Model,
    /// Without and with it.
    pub comparisons: [Comparison; 2],
    share: Option<f64>,
}

impl Corrected {
    /// Trains a correction of a model.
    pub fn new(label: &'static str, model: &Model, data: &Data) -> Result<Self> {
        let settings = hybrid::settings(anfis::Method::Varpro, EPOCHS);
        let (hybrid, _) =
            hybrid::train(model, &data.training, BLANKING_S, &settings, &mut |_| ControlFlow::Continue(()))?;
        let judged: Vec<Recording> = data.held_out.iter().map(|r| without_start(r, BLANKING_S)).collect();
        let (before, after) = (compare(model, &judged)?, compare(&hybrid, &judged)?);
        let share = correction_share(&before, &after);
        Ok(Self { label, model: hybrid, share, comparisons: [before, after] })
    }

    fn row(&self) -> [String; 4] {
        let [before, after] = self.errors();
        [self.label.to_owned(), words::percent(before), words::percent(after), words::percent(self.share)]
    }

    /// Error-to-signal ratio of the current, without and with the correction.
    fn errors(&self) -> [Option<f64>; 2] {
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

/// For the terminal.
pub fn table(corrections: &[Corrected]) -> String {
    let mut table = words::table(&COLUMNS);
    table.add_rows(corrections.iter().map(Corrected::row));
    table.to_string()
}

/// For the report.
pub fn in_report(corrections: &[Corrected]) -> Table {
    Table {
        caption: "Error-to-signal ratio of the current on the held-out ramp from 1 s on, and the part of the current that the \
                  correction makes: the more is named, the less is black box"
            .to_owned(),
        columns: COLUMNS.map(str::to_owned).to_vec(),
        rows: corrections.iter().map(|c| c.row().to_vec()).collect(),
    }
}
