//! The course of a training: the errors of its epochs, the best network so far, and when to stop.

use std::ops::ControlFlow;

use super::fold::Workers;
use super::sweep::{Want, sweep};
use super::table::Table;
use super::{Epoch, Keep, Stopped};
use crate::context::Context;
use crate::error::Result;
use crate::network::{Net, Scale};

/// What is trained on, and how.
#[derive(Debug)]
pub struct Problem<'a> {
    /// Threads.
    pub workers: Workers,
    /// Training data.
    pub table: &'a Table,
    /// Checking data.
    pub check: Option<&'a Table>,
    /// Units in which the inputs are trained.
    pub scales: Vec<Scale>,
    /// λ.
    pub ridge: f64,
    /// Whether the exponents b are trained.
    pub free: bool,
}

/// A network at its epoch.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// Epoch, from zero.
    pub epoch: usize,
    /// The network in the units of training.
    pub net: Net,
}

/// Epochs so far.
pub struct Course<'a> {
    /// All of them.
    pub epochs: Vec<Epoch>,
    /// Training errors alone.
    errors: Vec<f64>,
    /// Smallest training error.
    pub best_training: Option<Snapshot>,
    /// Smallest checking error.
    pub best_checking: Option<Snapshot>,
    limit: usize,
    patience: Option<usize>,
    ctx: &'a Context,
    progress: &'a mut dyn FnMut(&Epoch) -> ControlFlow<()>,
}

impl<'a> Course<'a> {
    /// Nothing yet.
    pub fn new(
        limit: usize,
        patience: Option<usize>,
        ctx: &'a Context,
        progress: &'a mut dyn FnMut(&Epoch) -> ControlFlow<()>,
    ) -> Self {
        Self {
            epochs: Vec::new(),
            errors: Vec::new(),
            best_training: None,
            best_checking: None,
            limit,
            patience,
            ctx,
            progress,
        }
    }

    /// Training errors of all epochs.
    pub fn errors(&self) -> &[f64] {
        &self.errors
    }

    /// Fails once the training is to stop.
    ///
    /// # Errors
    /// An interrupt.
    pub fn check(&self) -> Result<()> {
        Ok(self.ctx.check()?)
    }

    /// Notes an epoch and says whether it was the last.
    ///
    /// # Errors
    /// The checking data cannot be read; an interrupt.
    pub fn note(
        &mut self,
        problem: &Problem<'_>,
        net: &Net,
        squared_error: f64,
        step: Option<f64>,
    ) -> Result<Option<Stopped>> {
        self.check()?;
        self.ctx.at("training", self.epochs.len() as f64 / self.limit.max(1) as f64);
        let rms = |squared: f64, table: &Table| (squared / table.rows() as f64).sqrt();
        let rmse_trn = rms(squared_error, problem.table);
        if !rmse_trn.is_finite() {
            return Ok(Some(Stopped::Diverged));
        }
        let rmse_chk = problem
            .check
            .map(|check| {
                sweep(&problem.workers, net, false, check, &problem.scales, Want::Error)
                    .map(|s| rms(s.squared_error, check))
            })
            .transpose()?
            .filter(|e| e.is_finite());
        let epoch = self.epochs.len();
        let this = Epoch { rmse_trn, rmse_chk, step };
        let snapshot = || Some(Snapshot { epoch, net: net.clone() });
        let least = |get: fn(&Epoch) -> Option<f64>| self.epochs.iter().filter_map(get).fold(f64::INFINITY, f64::min);
        if rmse_trn < least(|e| Some(e.rmse_trn)) {
            self.best_training = snapshot();
        }
        if rmse_chk.is_some_and(|e| e < least(|e| e.rmse_chk)) {
            self.best_checking = snapshot();
        }
        self.epochs.push(this);
        self.errors.push(rmse_trn);
        if (self.progress)(&this).is_break() {
            return Ok(Some(Stopped::Asked));
        }
        if self.epochs.len() >= self.limit {
            return Ok(Some(Stopped::Epochs));
        }
        let waited = self.best_checking.as_ref().map(|best| epoch - best.epoch);
        if self.patience.zip(waited).is_some_and(|(patience, waited)| waited >= patience) {
            return Ok(Some(Stopped::Check));
        }
        Ok(None)
    }

    /// The network to keep.
    pub fn best(&self, keep: Keep) -> Option<&Snapshot> {
        match keep {
            Keep::Training => self.best_training.as_ref(),
            Keep::Checking => self.best_checking.as_ref().or(self.best_training.as_ref()),
        }
    }
}
