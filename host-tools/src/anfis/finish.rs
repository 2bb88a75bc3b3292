//! After training: which rules have data, which are dropped, and what the output does where there are none.

use std::sync::atomic::{AtomicU64, Ordering};

use serde::Serialize;

use super::block::{BLOCK, Block, column};
use super::course::{Course, Problem};
use super::fold::{Sum, Workers, fold};
use super::moments::moments;
use super::solve::{solve, solve_active};
use super::sweep::{Want, sweep};
use super::table::Table;
use super::{Epoch, Settings, Stopped, Trained};
use crate::error::{Error, Result};
use crate::network::{Net, Scale};

/// Points of the box at which the output is looked at.
const POINTS: usize = 20_000;

/// How much the training data say about a rule.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Support {
    /// Sum of its normalised firing strength over all rows: how many rows it stands for.
    pub rows: f64,
    /// Largest normalised firing strength on any row.
    pub largest: f64,
    /// Whether its consequents were set to zero.
    pub pruned: bool,
}

/// The output over a grid of points of the trained box, its corners among them, before it is clamped.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Reach {
    /// Smallest output.
    pub low: f64,
    /// Largest output.
    pub high: f64,
    /// How far that is beyond the range of the targets, as a fraction of that range.
    pub excess: f64,
}

impl Reach {
    /// An excess from which a network is to be flagged: it leaves the range of the targets by that range again.
    pub const FLAGGED: f64 = 1.0;
    /// An excess from which a network is not to be used.
    pub const REFUSED: f64 = 10.0;

    /// Whether the network can be used; `output` is the range of the targets.
    ///
    /// # Errors
    /// An output that runs away over the box.
    pub fn check(&self, output: (f64, f64)) -> Result<()> {
        if self.excess <= Self::REFUSED {
            return Ok(());
        }
        Err(Error::usage(
            format!(
                "the output runs from {:.3e} to {:.3e} over the box of the training data, the targets from {:.3e} to {:.3e}",
                self.low, self.high, output.0, output.1
            ),
            "raise --ridge, take fewer membership functions, or train on data that fill the box",
        ))
    }
}

/// Picks the network and judges it.
pub(super) fn finish(
    problem: &Problem<'_>,
    grid: Net,
    course: Course<'_>,
    settings: &Settings,
    stopped: Stopped,
) -> Result<Trained> {
    let Some(best) = course.best(settings.keep).cloned() else {
        return Err(Error::usage(
            "training gave no finite error at all",
            "check the data for values that are out of all proportion",
        ));
    };
    let mut initial = grid;
    let start = moments(&problem.workers, &initial, problem.table, &problem.scales)?;
    initial.consequents = solve(&start, problem.ridge)?.consequents.as_slice().to_vec();

    let Epoch { mut rmse_trn, mut rmse_chk, .. } = course.epochs[best.epoch];
    let mut net = best.net;
    let mut support = supports(&problem.workers, &net, problem.table, &problem.scales)?;
    if let Some(least) = settings.prune {
        for s in &mut support {
            s.pruned = s.largest < least;
        }
        if support.iter().any(|s| s.pruned) {
            let active: Vec<bool> = support.iter().map(|s| !s.pruned).collect();
            let sums = moments(&problem.workers, &net, problem.table, &problem.scales)?;
            net.consequents = solve_active(&sums, problem.ridge, &active, net.inputs + 1)?.as_slice().to_vec();
            let rms = |table: &Table| -> Result<f64> {
                let sums = sweep(&problem.workers, &net, false, table, &problem.scales, Want::Error)?;
                Ok((sums.squared_error / table.rows() as f64).sqrt())
            };
            rmse_trn = rms(problem.table)?;
            rmse_chk = problem.check.map(rms).transpose()?;
        }
    }
    let (net, initial) = (net.unscaled(&problem.scales), initial.unscaled(&problem.scales));
    let inputs: Vec<(f64, f64)> = (0..problem.table.inputs()).map(|i| problem.table.input_range(i)).collect();
    let output = problem.table.target_range();
    let reach = reach(&net, &inputs, output);
    Ok(Trained {
        net,
        initial,
        best: best.epoch,
        epochs: course.epochs,
        stopped,
        rmse_trn,
        rmse_chk,
        ridge: problem.ridge,
        inputs,
        output,
        support,
        reach,
    })
}

fn reach(net: &Net, inputs: &[(f64, f64)], output: (f64, f64)) -> Reach {
    let n = inputs.len();
    let each = ((POINTS as f64).powf(1.0 / n as f64) as usize).clamp(2, 1001);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut x = vec![0.0; n];
    for point in 0..each.pow(n as u32) {
        let mut rest = point;
        for (x, (from, to)) in x.iter_mut().zip(inputs) {
            *x = from + (to - from) * (rest % each) as f64 / (each as f64 - 1.0);
            rest /= each;
        }
        let y = net.output(&x);
        (low, high) = (low.min(y), high.max(y));
    }
    let width = (output.1 - output.0).max(f64::MIN_POSITIVE);
    Reach { low, high, excess: (high - output.1).max(output.0 - low).max(0.0) / width }
}

fn supports(workers: &Workers, net: &Net, table: &Table, scales: &[Scale]) -> Result<Vec<Support>> {
    // A largest value is no sum, but it does not depend on the order of the rows either.
    let largest: Vec<AtomicU64> = (0..net.rules()).map(|_| AtomicU64::new(0)).collect();
    let sums = fold(workers, net, false, table, scales, &Strengths { net, largest: &largest })?;
    let largest = largest.into_iter().map(|bits| f64::from_bits(bits.into_inner()));
    Ok(sums[0].iter().zip(largest).map(|(&rows, largest)| Support { rows, largest, pruned: false }).collect())
}

struct Strengths<'a> {
    net: &'a Net,
    /// The bits of each rule's largest strength: those of numbers that are not negative are in the numbers' order.
    largest: &'a [AtomicU64],
}

impl Sum for Strengths<'_> {
    type Partial = (Vec<f64>, Vec<f64>);

    fn start(&self) -> Self::Partial {
        (vec![0.0; self.net.rules()], vec![0.0; self.net.rules() * BLOCK])
    }

    #[inline(always)]
    fn add(&self, (sums, strengths): &mut Self::Partial, block: &Block) {
        block.strengths(self.net, strengths);
        for (rule, (sum, largest)) in sums.iter_mut().zip(self.largest).enumerate() {
            let w = column(strengths, rule, block.rows);
            *sum += w.iter().sum::<f64>();
            let here = w.iter().fold(0.0, |m: f64, w| m.max(*w));
            largest.fetch_max(here.to_bits(), Ordering::Relaxed);
        }
    }

    fn sums(partial: &Self::Partial) -> Vec<&[f64]> {
        vec![&partial.0]
    }
}
