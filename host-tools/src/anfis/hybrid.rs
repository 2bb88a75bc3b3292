//! Hybrid learning as published: each epoch least squares for the consequents, then one step of steepest descent for
//! the premises.
//!
//! The step goes against the gradient of E = Σ (y − o)² and has the length k in the space of all premise parameters, Δp
//! = −k g/|g|. After four falls of the error in a row k grows by a tenth; after two combinations of one rise and one
//! fall it shrinks by a tenth; each at most once in four epochs.
//!
//! Source: J.-S. R. Jang, "ANFIS: adaptive-network-based fuzzy inference system", IEEE Transactions on Systems, Man,
//! and Cybernetics 23(3), 1993, sections III and IV.

use greyrig::anfis::Premise;

use super::Stopped;
use super::course::{Course, Problem};
use super::moments::moments;
use super::solve::solve;
use super::sweep::{Want, parameters, sweep};
use crate::error::Result;
use crate::network::Net;

/// Trains from the premises of a network.
///
/// # Errors
/// The data cannot be read, or least squares fails.
pub fn train(problem: &Problem<'_>, mut net: Net, step: f64, course: &mut Course<'_>) -> Result<Stopped> {
    let mut rule = StepSize::new(step);
    loop {
        let sums = moments(&problem.workers, &net, problem.table, &problem.scales)?;
        net.consequents = solve(&sums, problem.ridge)?.consequents.as_slice().to_vec();
        let at = sweep(&problem.workers, &net, problem.free, problem.table, &problem.scales, Want::Gradient)?;
        if let Some(stopped) = course.note(problem, &net, at.squared_error, Some(rule.size))? {
            return Ok(stopped);
        }
        let gradient = by_parameters(&net, problem.free, at.gradient.as_slice());
        let length = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        if length > 0.0 {
            descend(&mut net.premise, problem.free, &gradient, rule.size / length);
        }
        rule.next(course.errors());
    }
}

/// Dᵀr by a, b, c instead of ln a, ln b, c: it points downhill.
fn by_parameters(net: &Net, free: bool, gradient: &[f64]) -> Vec<f64> {
    let width = parameters(net, free);
    let mut gradient = gradient.to_vec();
    for (g, p) in gradient.chunks_mut(width).zip(&net.premise) {
        g[0] /= p.a;
        if width == 3 {
            g[1] /= p.b;
        }
    }
    gradient
}

fn descend(premise: &mut [Premise], free: bool, downhill: &[f64], by: f64) {
    let width = downhill.len() / premise.len();
    for (p, g) in premise.iter_mut().zip(downhill.chunks(width)) {
        p.a += by * g[0];
        if width == 3 && free {
            p.b += by * g[1];
        }
        p.c += by * g[width - 1];
    }
}

/// The step size k and its two rules.
#[derive(Debug, Clone)]
pub struct StepSize {
    /// k.
    pub size: f64,
    raised: usize,
    lowered: usize,
}

impl StepSize {
    /// Starts from a size.
    pub fn new(size: f64) -> Self {
        Self { size, raised: 0, lowered: 0 }
    }

    /// After another epoch; `errors` are those of all epochs so far.
    pub fn next(&mut self, errors: &[f64]) {
        const EPOCHS: usize = 4;
        let Some(epoch) = errors.len().checked_sub(1).filter(|e| *e >= EPOCHS) else { return };
        // The latest first.
        let fell: Vec<bool> = (0..EPOCHS).map(|back| errors[epoch - back] < errors[epoch - back - 1]).collect();
        if epoch >= self.lowered + EPOCHS && fell == [true, false, true, false] {
            self.size *= 0.9;
            self.lowered = epoch;
        } else if epoch >= self.raised + EPOCHS && fell.iter().all(|f| *f) {
            self.size *= 1.1;
            self.raised = epoch;
        }
    }
}
