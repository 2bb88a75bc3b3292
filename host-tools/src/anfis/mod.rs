//! Training of the network whose evaluation is [`greyrig::anfis`]; any number of inputs and membership functions.
//!
//! ```
//! use greyrig_host::anfis::{Method, Settings, Table, train};
//! use greyrig_host::context::Context;
//!
//! let rows = (0..=40).map(|k| f64::from(k) / 10.0).map(|x| ([x], x.sin()));
//! let table = Table::collect(1, rows)?;
//! let trained = train(&table, None, &Settings::new(Method::Varpro, 3, 20), &Context::quiet())?;
//! assert!(trained.rmse_trn < 1e-3);
//! # Ok::<(), greyrig_host::error::Error>(())
//! ```
//!
//! Two methods. [`varpro`], the default, finds the smallest error in few passes over the data; [`hybrid`] is Jang's,
//! step by step as published. Both pass over the rows in blocks and keep sums alone, so that memory does not grow with
//! the rows ([`Table`] puts many of them into a temporary file), and give the same result on any number of threads.
//!
//! # What stands against a network that runs away
//!
//! A rule's share of the output is never quite zero anywhere, so least squares also sets rules on which there are no
//! data, and sets them at random. Against that: the ridge (relative to the number of rows in [`Method::Varpro`]), the
//! support of each rule ([`Support`]; rules below [`Settings::prune`] get zero consequents, so that where nothing is
//! known nothing is corrected), and the [`Reach`] of the output over the whole box, which says whether it worked.

mod block;
mod course;
pub mod csv;
mod elementary;
mod file;
mod finish;
mod fold;
pub mod hybrid;
mod moments;
mod solve;
mod sweep;
mod table;
pub mod varpro;

use std::ops::ControlFlow;

use greyrig::anfis::{Firing, Shape};
use serde::Serialize;

pub use finish::{Reach, Support};
pub use table::{Builder, CHUNK, Table};

use crate::context::Context;
use crate::error::{Error, Result};
use crate::network::{Net, Scale};
use course::{Course, Problem};

/// Consequent parameters that a network may have: their normal matrix then takes 32 MB.
const MAX_COLUMNS: usize = 2048;

/// How the premises are trained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Variable projection with the method of Levenberg and Marquardt, within bounds.
    #[default]
    Varpro,
    /// Jang's hybrid learning: steepest descent with his step-size rules.
    Hybrid,
}

/// Which epoch's network is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Keep {
    /// That with the smallest training error.
    Training,
    /// That with the smallest checking error, where there are checking data.
    Checking,
}

/// The ridge λ of least squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ridge {
    /// λ itself.
    Absolute(f64),
    /// λ over rows/columns: independent of the number of rows and, as the inputs are then scaled, of their units.
    Relative(f64),
}

/// What the user chooses.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Method.
    pub method: Method,
    /// Membership functions of each input, M.
    pub functions: usize,
    /// Epochs at most: passes with a changed premise.
    pub epochs: usize,
    /// Range of each input over which the first membership functions are spread; from the data if none.
    pub ranges: Option<Vec<(f64, f64)>>,
    /// Form of the membership functions.
    pub shape: Shape,
    /// Exponent b of all bells, 1 or 2, which spares the microcontroller half its work; trained if none.
    pub exponent: Option<f64>,
    /// Firing operator.
    pub firing: Firing,
    /// Ridge.
    pub ridge: Ridge,
    /// First step size k of [`Method::Hybrid`]: the length of a step in the space of all premise parameters.
    pub step: f64,
    /// Which network is kept.
    pub keep: Keep,
    /// Epochs without a smaller checking error after which training stops; never if none.
    pub patience: Option<usize>,
    /// Rules whose normalised strength exceeds this on no row get zero consequents; none do if none.
    pub prune: Option<f64>,
    /// Threads; zero for all processors.
    pub threads: usize,
}

impl Settings {
    /// The usual choices of a method. Jang's are those of his paper and program: λ = 10^-6, k = 0.1, no early stop,
    /// nothing pruned, the network with the smallest training error.
    pub fn new(method: Method, functions: usize, epochs: usize) -> Self {
        let hybrid = method == Method::Hybrid;
        Self {
            method,
            functions,
            epochs,
            ranges: None,
            shape: Shape::Bell,
            exponent: None,
            firing: Firing::Product,
            ridge: if hybrid { Ridge::Absolute(1e-6) } else { Ridge::Relative(1e-6) },
            step: 0.1,
            keep: if hybrid { Keep::Training } else { Keep::Checking },
            patience: if hybrid { None } else { Some(10) },
            prune: if hybrid { None } else { Some(0.01) },
            threads: 1,
        }
    }
}

/// The errors of an epoch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Epoch {
    /// RMS error on the training data.
    pub rmse_trn: f64,
    /// RMS error on the checking data.
    pub rmse_chk: Option<f64>,
    /// Step size k with which the epoch ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<f64>,
}

/// Why training ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stopped {
    /// All epochs done.
    Epochs,
    /// The error falls no more.
    Converged,
    /// The checking error has not fallen for so long as patience lasts.
    Check,
    /// The error is no number any more; the network kept is an earlier one.
    Diverged,
    /// By the caller.
    Asked,
}

/// The result.
#[derive(Debug, Clone)]
pub struct Trained {
    /// The network kept.
    pub net: Net,
    /// The network at the start, with its least-squares consequents.
    pub initial: Net,
    /// Errors of all epochs.
    pub epochs: Vec<Epoch>,
    /// The epoch that is kept, from zero.
    pub best: usize,
    /// Why training ended.
    pub stopped: Stopped,
    /// RMS training error of the network kept, after pruning.
    pub rmse_trn: f64,
    /// RMS checking error, likewise.
    pub rmse_chk: Option<f64>,
    /// λ.
    pub ridge: f64,
    /// The trained box: smallest and largest value of each input in the training data.
    pub inputs: Vec<(f64, f64)>,
    /// Smallest and largest training target.
    pub output: (f64, f64),
    /// Support of each rule.
    pub support: Vec<Support>,
    /// What the output does over the whole box.
    pub reach: Reach,
}

impl Trained {
    /// What is to be known before the network is used.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let pruned = self.support.iter().filter(|s| s.pruned).count();
        let weak = self.support.iter().filter(|s| s.largest < 0.01 && !s.pruned).count();
        let rules = self.support.len();
        if pruned > 0 {
            notes.push(format!("{pruned} of {rules} rules have no data and were set to zero: there the output fades"));
        }
        if weak > 0 {
            notes.push(format!("{weak} of {rules} rules have no data, yet take part: --prune 0.01 sets them to zero"));
        }
        if self.reach.excess > Reach::FLAGGED {
            let times = match self.reach.excess {
                excess if excess < 1e4 => format!("{excess:.1}"),
                excess => format!("{excess:.0e}"),
            };
            notes.push(format!(
                "between the data the output leaves the range of the targets by {times} times that range; evaluation clamps it, \
                 a larger --ridge bounds it"
            ));
        }
        notes
    }
}

/// Trains a network.
///
/// # Errors
/// Settings that make no sense for the data; data that cannot be read; an interrupt.
pub fn train(table: &Table, check: Option<&Table>, settings: &Settings, ctx: &Context) -> Result<Trained> {
    train_until(table, check, settings, ctx, &mut |_| ControlFlow::Continue(()))
}

/// The same; `progress` sees every epoch and may stop, with the best network so far.
///
/// # Errors
/// As [`train`].
pub fn train_until(
    table: &Table,
    check: Option<&Table>,
    settings: &Settings,
    ctx: &Context,
    progress: &mut dyn FnMut(&Epoch) -> ControlFlow<()>,
) -> Result<Trained> {
    let ranges = validated(table, check, settings)?;
    let columns = greyrig::anfis::consequent_parameters(table.inputs(), settings.functions);
    let ridge = match settings.ridge {
        Ridge::Absolute(ridge) => ridge,
        Ridge::Relative(ridge) => ridge * table.rows() as f64 / columns as f64,
    };
    let problem = Problem {
        workers: fold::Workers::new(settings.threads)?,
        table,
        check,
        scales: match settings.method {
            Method::Hybrid => vec![Scale::NONE; table.inputs()],
            Method::Varpro => ranges.iter().map(|r| Scale::of(*r)).collect(),
        },
        ridge,
        free: settings.exponent.is_none(),
    };
    let b = settings.exponent.unwrap_or(2.0);
    let grid = Net::grid(settings.shape, settings.firing, b, settings.functions, &ranges).scaled(&problem.scales);
    let mut course = Course::new(settings.epochs, settings.patience, ctx, progress);
    let stopped = match settings.method {
        Method::Hybrid => hybrid::train(&problem, grid.clone(), settings.step, &mut course)?,
        Method::Varpro => varpro::train(&problem, grid.clone(), &mut course)?,
    };
    finish::finish(&problem, grid, course, settings, stopped)
}

/// The ranges to start from, if the settings fit the data.
fn validated(table: &Table, check: Option<&Table>, settings: &Settings) -> Result<Vec<(f64, f64)>> {
    let inputs = table.inputs();
    let ranges = settings.ranges.clone().unwrap_or_else(|| (0..inputs).map(|i| table.input_range(i)).collect());
    if ranges.len() != inputs {
        return Err(Error::usage(
            format!("{} ranges are given for {inputs} inputs", ranges.len()),
            "give one for each input, or none",
        ));
    }
    for (i, (low, high)) in ranges.iter().enumerate() {
        let constant = table.input_range(i).0 == table.input_range(i).1;
        if constant || low >= high || !low.is_finite() || !high.is_finite() {
            let (what, remedy) = if constant {
                (format!("input {} never changes", i + 1), "leave the column out".to_owned())
            } else {
                (format!("{low} to {high} is no range"), "give the lower end first".to_owned())
            };
            return Err(Error::usage(what, remedy));
        }
    }
    let (low, high) = table.target_range();
    // Neighbouring numbers are one rounding apart.
    if high - low <= f64::EPSILON * low.abs().max(high.abs()) {
        return Err(Error::usage(
            format!("the target never changes: it is {low} in all {} rows", table.rows()),
            "give a table whose target depends on its inputs",
        ));
    }
    if let Some(check) = check.filter(|c| c.inputs() != inputs) {
        return Err(Error::usage(
            format!("the checking data have {} inputs, the training data {inputs}", check.inputs()),
            "give both the same columns",
        ));
    }
    let rules = u32::try_from(inputs).ok().and_then(|n| settings.functions.checked_pow(n));
    let columns = rules.and_then(|r| r.checked_mul(inputs + 1));
    if settings.functions < 2 || inputs == 0 || columns.is_none_or(|c| c > MAX_COLUMNS) {
        return Err(Error::usage(
            format!("{inputs} inputs with {} membership functions each cannot be trained", settings.functions),
            format!(
                "take at least 2, and so few that all rules together have at most {MAX_COLUMNS} consequent parameters"
            ),
        ));
    }
    let (Ridge::Absolute(ridge) | Ridge::Relative(ridge)) = settings.ridge;
    let bad = |name: &str, remedy: &str| Err(Error::usage(format!("{name} is out of range"), remedy.to_owned()));
    if !(ridge > 0.0 && ridge.is_finite()) {
        return bad("the ridge", "give a small positive number, such as 1e-6");
    }
    if !(settings.step > 0.0 && settings.step.is_finite()) {
        return bad("the step size", "give a positive number, such as 0.1");
    }
    if settings.epochs == 0 {
        return bad("the number of epochs", "give at least 1");
    }
    if settings.exponent.is_some_and(|b| b != 1.0 && b != 2.0) {
        return bad("the exponent", "fix it at 1 or at 2, or leave it free");
    }
    if settings.prune.is_some_and(|p| !(0.0..0.5).contains(&p)) {
        return bad("the support below which rules are dropped", "give a fraction below 0.5, such as 0.01");
    }
    Ok(ranges)
}
