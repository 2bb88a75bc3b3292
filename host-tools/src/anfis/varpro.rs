//! Variable projection: the consequents are those of least squares at every premise, and the premises are improved by
//! the method of Levenberg and Marquardt on what is left.
//!
//! With A the matrix of the consequents, D the derivatives of the output by the premises with the consequents held, and
//! G = AᵀA + λI, the normal matrix of the reduced problem is H = DᵀD − (AᵀD)ᵀ G⁻¹ AᵀD, and its right side Dᵀr: at the
//! minimum over the consequents the gradient needs no further term. All of these are sums over rows.
//!
//! A step is taken in ln a, ln b and c, within [bounds](Bounds); a parameter on its bound that is pushed outwards
//! stays. Without bounds a few bells become steps and fit the noise between two rows.
//!
//! Sources: G. Golub and V. Pereyra, SIAM Journal on Numerical Analysis 10, 1973; L. Kaufman, BIT 15, 1975 (leaving out
//! the second term of the Jacobian); H. B. Nielsen, report IMM-REP-1999-05 (damping).

use greyrig::anfis::{MAX_EXPONENT, Premise};
use nalgebra::{Cholesky, DMatrix, DVector};

use super::Stopped;
use super::course::{Course, Problem};
use super::moments::moments;
use super::solve::{Solution, solve};
use super::sweep::{Sweep, Want, parameters, sweep};
use crate::error::Result;
use crate::network::Net;

/// Trials with more and more damping before a step counts as the last.
const TRIALS: usize = 12;
/// Relative fall of the squared error below which the search has ended.
const SETTLED: f64 = 1e-9;

/// Limits of the premises in an input's range of ±1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Of the width a: 5 % to 200 % of the range.
    pub a: (f64, f64),
    /// Of the exponent b.
    pub b: (f64, f64),
    /// Of the centre c: half a range outside.
    pub c: (f64, f64),
}

impl Default for Bounds {
    fn default() -> Self {
        Self { a: (0.1, 4.0), b: (0.5, 5.0_f64.min(MAX_EXPONENT)), c: (-2.0, 2.0) }
    }
}

impl Bounds {
    fn of(&self, width: usize, parameter: usize) -> (f64, f64) {
        match parameter {
            0 => self.a,
            1 if width == 3 => self.b,
            _ => self.c,
        }
    }
}

/// A network with everything known about it.
struct Point {
    net: Net,
    solution: Solution,
    sums: Sweep,
    /// Σ r² + λ|c|².
    cost: f64,
}

impl Point {
    fn at(problem: &Problem<'_>, mut net: Net) -> Result<Self> {
        let solution = solve(&moments(&problem.workers, &net, problem.table, &problem.scales)?, problem.ridge)?;
        net.consequents = solution.consequents.as_slice().to_vec();
        let sums = sweep(&problem.workers, &net, problem.free, problem.table, &problem.scales, Want::Normal)?;
        let cost = sums.squared_error + problem.ridge * solution.consequents.norm_squared();
        Ok(Self { net, solution, sums, cost })
    }
}

/// Trains from the premises of a network.
///
/// # Errors
/// The data cannot be read, or least squares fails.
pub fn train(problem: &Problem<'_>, net: Net, course: &mut Course<'_>) -> Result<Stopped> {
    let bounds = Bounds::default();
    let (mut damping, mut growth) = (1e-2, 2.0);
    let mut here = Point::at(problem, net)?;
    loop {
        if let Some(stopped) = course.note(problem, &here.net, here.sums.squared_error, None)? {
            return Ok(stopped);
        }
        let width = parameters(&here.net, problem.free);
        let projected = here.solution.factors.solve(&here.sums.cross);
        let mut normal = &here.sums.normal - here.sums.cross.tr_mul(&projected);
        let mut gradient = here.sums.gradient.clone();
        for k in 0..gradient.len() {
            if frozen(&here.net, &bounds, width, k, gradient[k]) {
                gradient[k] = 0.0;
                normal.row_mut(k).fill(0.0);
                normal.column_mut(k).fill(0.0);
                normal[(k, k)] = 1.0;
            }
        }
        let largest = normal.diagonal().max();
        let scale = normal.diagonal().map(|d| d.max(1e-12 * largest + 1e-300));
        let mut better = None;
        for _ in 0..TRIALS {
            if let Some(step) = damped(&normal, &gradient, &scale, damping) {
                let there = Point::at(problem, moved(&here.net, &bounds, width, &step))?;
                if there.cost < here.cost {
                    let predicted = step.dot(&(step.component_mul(&scale) * damping + &gradient));
                    let gain = (here.cost - there.cost) / predicted.max(1e-300);
                    damping = (damping * (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-12);
                    growth = 2.0;
                    better = Some(there);
                    break;
                }
            }
            damping *= growth;
            growth *= 2.0;
            course.check()?;
        }
        let Some(there) = better else { return Ok(Stopped::Converged) };
        let settled = here.cost - there.cost < SETTLED * here.cost;
        here = there;
        if settled {
            course.note(problem, &here.net, here.sums.squared_error, None)?;
            return Ok(Stopped::Converged);
        }
    }
}

fn damped(normal: &DMatrix<f64>, gradient: &DVector<f64>, scale: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
    let mut matrix = normal.clone();
    for k in 0..matrix.nrows() {
        matrix[(k, k)] += damping * scale[k];
    }
    let step = Cholesky::new(matrix)?.solve(gradient);
    step.iter().all(|s| s.is_finite()).then_some(step)
}

/// Whether a parameter sits on a bound and is pushed outwards.
fn frozen(net: &Net, bounds: &Bounds, width: usize, index: usize, downhill: f64) -> bool {
    let Premise { a, b, c } = net.premise[index / width];
    let value = match index % width {
        0 => a,
        1 if width == 3 => b,
        _ => c,
    };
    let (low, high) = bounds.of(width, index % width);
    (value <= low && downhill < 0.0) || (value >= high && downhill > 0.0)
}

fn moved(net: &Net, bounds: &Bounds, width: usize, step: &DVector<f64>) -> Net {
    let mut net = net.clone();
    for (p, d) in net.premise.iter_mut().zip(step.as_slice().chunks(width)) {
        let clamp = |value: f64, (low, high): (f64, f64)| value.clamp(low, high);
        // At most by a factor e at a time.
        p.a = clamp(p.a * d[0].clamp(-1.0, 1.0).exp(), bounds.a);
        if width == 3 {
            p.b = clamp(p.b * d[1].clamp(-1.0, 1.0).exp(), bounds.b);
        }
        p.c = clamp(p.c + d[width - 1], bounds.c);
    }
    net
}
