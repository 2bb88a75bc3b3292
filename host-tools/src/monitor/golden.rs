//! The golden motor: one that is known to be good, tested at the start of every shift. What it shows differs only as
//! the rig does.
//!
//! A check is one or several runs in a row; its figures go to a history, a line per run. The mean of a check is
//! compared with the first checks of the history ([`drift`](super::drift)), and runs against checks tell how well the
//! rig repeats ([`gauge`](super::gauge)).

use std::path::Path;

use serde::Serialize;

pub use super::drift::Point;
use super::drift::{Baseline, FALSE_ALARMS, FEWEST};
use super::gauge::{Gauge, crossed};
use super::test::{Outcome, Test};
use crate::context::Context;
use crate::error::Result;
use crate::journal::{self, Journal};
use crate::model::DetectorEntry;

/// What is followed.
pub const FIGURES: [&str; 4] =
    ["deviation of the current", "deviation of the speed", "current above 1 kHz", "voltage of the supply"];
/// Their units, and how many of these make one in SI: ratios are read in per cent.
const UNITS: [(&str, f64); FIGURES.len()] = [("%", 100.0), ("%", 100.0), ("A", 1.0), ("V", 1.0)];

/// A value of a figure with its unit.
pub fn told(figure: &str, value: f64) -> String {
    let (unit, scale) = FIGURES.iter().position(|name| *name == figure).map_or(("", 1.0), |k| UNITS[k]);
    format!("{} {unit}", crate::numbers::figure(scale * value, 4))
}

/// Charts that share the false alarms: individuals and averages of each figure.
const RULES: f64 = 2.0 * FIGURES.len() as f64;
/// First line of a history.
const HEADER: &str = "check,date,recording,serial,model,verdict,current_deviation,speed_deviation,sparking_a,voltage_v";

/// A run of the golden motor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Run {
    /// Number of the check, from 1.
    pub check: usize,
    /// When, as the recording tells it.
    pub date: String,
    /// The recording.
    pub recording: String,
    /// Serial number of the golden motor.
    pub serial: String,
    /// Digest of the model: figures of different models do not compare.
    pub model: String,
    /// The verdict.
    pub verdict: String,
    /// In the order of [`FIGURES`].
    pub figures: [f64; FIGURES.len()],
}

impl Run {
    /// From a test.
    pub fn new(check: usize, date: &str, model: &str, test: &Test) -> Self {
        let f = &test.features;
        Self {
            check,
            date: date.to_owned(),
            recording: test.recording.clone(),
            serial: test.serial.clone().unwrap_or_default(),
            model: model.to_owned(),
            verdict: test.verdict.words().to_owned(),
            figures: [f.current_deviation, f.speed_deviation, f.sparking, f.voltage_rms].map(f64::from),
        }
    }

    /// Whether it passed, so that its figures mean something.
    pub fn passed(&self) -> bool {
        self.verdict == Outcome::Pass.words()
    }

    fn line(&self) -> String {
        let mut cells: Vec<String> = vec![self.check.to_string()];
        cells.extend([&self.date, &self.recording, &self.serial, &self.model, &self.verdict].map(|s| journal::cell(s)));
        cells.extend(self.figures.map(|x| format!("{x:e}")));
        cells.join(",")
    }

    fn parse(cells: &csv::StringRecord) -> Option<Self> {
        let number = |k: usize| cells.get(k)?.parse::<f64>().ok().filter(|x| x.is_finite());
        let text = |k: usize| cells.get(k).map(str::to_owned);
        Some(Self {
            check: cells.get(0)?.parse().ok()?,
            date: text(1)?,
            recording: text(2)?,
            serial: text(3)?,
            model: text(4)?,
            verdict: text(5)?,
            figures: [number(6)?, number(7)?, number(8)?, number(9)?],
        })
        .filter(|_| cells.len() == 10)
    }
}

/// A history that is open and locked: nobody else adds a check between reading it and adding one.
#[derive(Debug)]
pub struct History {
    journal: Journal,
    /// Its runs.
    pub runs: Vec<Run>,
    /// Numbers of the lines that are no runs, from 1.
    pub torn: Vec<usize>,
}

impl History {
    /// Opens a history, or begins one.
    ///
    /// # Errors
    /// As [`Journal::open`].
    pub fn open(path: &Path, ctx: &Context) -> Result<Self> {
        let journal = Journal::open(path, HEADER, ctx)?;
        let (runs, torn) = parse(journal.text());
        Ok(Self { journal, runs, torn })
    }

    /// Fails unless a file of this name is a history, or can become one.
    ///
    /// # Errors
    /// As [`journal::check`].
    pub fn check(path: &Path) -> Result<()> {
        journal::check(path, HEADER)
    }

    /// As [`Journal::warning`].
    pub fn warning(&self) -> Option<String> {
        self.journal.warning()
    }

    /// Adds runs; they are on the disk before this returns.
    ///
    /// # Errors
    /// As [`Journal::append`].
    pub fn append(&mut self, runs: &[Run]) -> Result<()> {
        self.journal.append(&runs.iter().map(Run::line).collect::<Vec<_>>())?;
        self.runs.extend_from_slice(runs);
        Ok(())
    }
}

/// The runs of a history, and the numbers of the lines that are none.
fn parse(text: &str) -> (Vec<Run>, Vec<usize>) {
    let (mut runs, mut torn) = (Vec::new(), Vec::new());
    for (n, line) in text.lines().enumerate().skip(1) {
        let mut reader = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(line.as_bytes());
        match reader.records().next().and_then(std::result::Result::ok).as_ref().and_then(Run::parse) {
            Some(run) => runs.push(run),
            None => torn.push(n + 1),
        }
    }
    (runs, torn)
}

/// A figure followed over the checks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chart {
    /// One of [`FIGURES`].
    pub figure: &'static str,
    /// Mean of each check.
    pub checks: Vec<f64>,
    /// What the first checks have taught; none while there are too few.
    pub baseline: Option<Baseline>,
    /// The checks after those.
    pub points: Vec<Point>,
    /// How well the rig repeats the figure: parts are checks, so that `part` is what differs from check to check, and
    /// `repeatability` what differs from run to run. None without repeated runs.
    pub gauge: Option<Gauge>,
    /// Share of the detector's tolerance that six standard deviations from run to run take, where there is a tolerance.
    pub of_tolerance: Option<f64>,
}

impl Chart {
    /// Whether the newest check is out of what is usual.
    pub fn drifted(&self) -> bool {
        self.points.last().is_some_and(Point::calls)
    }
}

/// Widths of the detector's tolerances, in the order of [`FIGURES`], where there is one.
fn tolerances(detector: &DetectorEntry) -> [Option<f64>; FIGURES.len()] {
    let widths = [2.0 * detector.current_deviation[1], 2.0 * detector.speed_deviation[1], detector.sparking, 0.0];
    widths.map(|width| Some(width).filter(|width| *width > 0.0))
}

/// Charts of all figures from the runs of a golden motor that passed, whose first `baseline` checks teach what is
/// usual.
pub fn charts(runs: &[Run], baseline: usize, detector: &DetectorEntry) -> Vec<Chart> {
    let mut checks: Vec<Vec<&Run>> = Vec::new();
    for run in runs.iter().filter(|r| r.passed()) {
        match checks.last_mut() {
            Some(last) if last[0].check == run.check => last.push(run),
            _ => checks.push(vec![run]),
        }
    }
    let repeats = checks.iter().map(Vec::len).filter(|n| *n > 1).min();
    let widths = tolerances(detector);
    FIGURES
        .into_iter()
        .enumerate()
        .map(|(k, figure)| {
            let means: Vec<f64> =
                checks.iter().map(|c| c.iter().map(|r| r.figures[k]).sum::<f64>() / c.len() as f64).collect();
            let first = means.get(..baseline.max(FEWEST)).and_then(|m| Baseline::new(m, FALSE_ALARMS / RULES));
            let points = first.map_or_else(Vec::new, |b| b.judge(&means[b.checks..]));
            // A balanced study: of checks with more runs than others the first ones.
            let repeated: Vec<Vec<Vec<f64>>> = repeats.map_or_else(Vec::new, |n| {
                let enough = checks.iter().filter(|c| c.len() >= n);
                enough.map(|c| vec![c[..n].iter().map(|r| r.figures[k]).collect()]).collect()
            });
            let gauge = crossed(&repeated);
            let of_tolerance = gauge.zip(widths[k]).map(|(g, width)| 6.0 * g.repeatability / width);
            Chart { figure, checks: means, baseline: first, points, gauge, of_tolerance }
        })
        .collect()
}

/// A study of several motors, each run several times, perhaps on several rigs or by several people.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Study {
    /// One of [`FIGURES`].
    pub figure: &'static str,
    /// The analysis.
    pub gauge: Gauge,
    /// Share of the detector's tolerance that the gauge takes, where there is a tolerance.
    pub of_tolerance: Option<f64>,
}

/// Analyses runs as a crossed study: `cells[motor][appraiser]` holds the figures of the repeated runs. `None` where it
/// is not balanced or there is too little of it.
pub fn study(cells: &[Vec<Vec<[f64; FIGURES.len()]>>], detector: &DetectorEntry) -> Option<Vec<Study>> {
    // The voltage is the supply's, not the motor's.
    let widths = &tolerances(detector)[..3];
    (0..widths.len())
        .map(|k| {
            let values: Vec<Vec<Vec<f64>>> = cells
                .iter()
                .map(|motor| motor.iter().map(|runs| runs.iter().map(|f| f[k]).collect()).collect())
                .collect();
            let gauge = crossed(&values)?;
            let of_tolerance = widths[k].map(|width| gauge.of_tolerance(width));
            Some(Study { figure: FIGURES[k], gauge, of_tolerance })
        })
        .collect()
}
