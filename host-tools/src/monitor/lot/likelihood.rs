//! Whether a fault has begun, which, when and how large: the generalised likelihood ratio.
//!
//! With the rows r and the columns X of what differs from motor to motor in units of what is usual
//! ([`super::population`]), A = XᵀX + 1 and r̂ = r − X A⁻¹ Xᵀ r, a fault of column s that begins with block τ has
//!
//! ```text
//! Z = sᵀ r̂ / √(sᵀ s − bᵀ A⁻¹ b)      size = sᵀ r̂ / (sᵀ s − bᵀ A⁻¹ b)      b = Xᵀ s
//! ```
//!
//! Z² is twice the logarithm of the likelihood ratio between the fault at its best size and none. The largest |Z| over
//! τ is compared with a limit from the healthy motors, each judged by what the others say is usual. Its logarithm is
//! about normal: the limit is a quantile of Student's distribution, with a variance pooled over the faults that the
//! balances tell, and one of its own for what is watched as it is. From the start there is but one Z, about normal
//! itself, by the scatter of the lot; its limit is a quantile for its mean square.
//!
//! Sources: A. S. Willsky, H. L. Jones, A generalized likelihood ratio approach to the detection and estimation of
//! jumps in linear systems, IEEE Trans. Autom. Control 21 (1976) 108–112; M. Basseville, I. V. Nikiforov, Detection of
//! Abrupt Changes (1993).

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::fault::Course;
use super::population::Whitened;
use crate::model::lot::{Fault, Limit, Onset};

/// Blocks behind the onset, at least: two tell a size and that it lasts.
const FEWEST_BEHIND: usize = 2;
/// Share of healthy motors that one limit holds: all of them together are to hold 99.9 %, and those of faults that the
/// balances tell go together.
pub const HOLDS: f64 = 0.9995;
/// Standard deviation of the logarithm of the largest |Z| of white noise, 80 blocks with a level of their own (by 4,000
/// draws): what is left over of few motors may seem to spread by less.
const LEAST_SPREAD: f64 = 0.27;
/// Standard deviations above a limit at which 95 % of motors are beyond it.
const SEEN: f64 = 1.645;

/// A fault at its likeliest begin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// The fault.
    pub fault: Fault,
    /// When it begins.
    pub onset: Onset,
    /// The first block with it.
    pub block: usize,
    /// Z.
    pub z: f64,
    /// Its size and the standard deviation of that, in the fault's unit.
    pub size: f64,
    /// Standard deviation of the size.
    pub deviation: f64,
    /// Share of the squares of what the motor's own parameters leave over that it explains.
    pub explains: f64,
}

/// Every fault at its likeliest begin, from the start and during the test.
pub fn scan(run: &Whitened, block_s: f64) -> Vec<Hypothesis> {
    let Some(judged) = Judged::of(run) else { return Vec::new() };
    let whole = judged.left.norm_squared().max(f64::MIN_POSITIVE);
    let last = run.blocks.iter().max().map_or(0, |k| k + 1);
    let mut all = Vec::new();
    for (f, fault) in Fault::ALL.into_iter().enumerate() {
        let at = |block: usize, onset: Onset| {
            let (z, size, deviation) = judged.test(&run.faults[f], &|k| weight(fault, k, block, block_s))?;
            Some(Hypothesis { fault, onset, block, z, size, deviation, explains: z * z / whole })
        };
        if fault.course() == Course::Step {
            all.extend(at(0, Onset::Start));
        }
        let first = usize::from(fault.course() == Course::Step);
        let during = (first..last.saturating_sub(FEWEST_BEHIND)).filter_map(|block| at(block, Onset::During));
        all.extend(during.max_by(|a, b| a.z.abs().total_cmp(&b.z.abs())));
    }
    all
}

/// How large a fault is in block k if it begins with another.
fn weight(fault: Fault, k: usize, begins: usize, block_s: f64) -> f64 {
    match fault.course() {
        _ if k < begins => 0.0,
        Course::Step => 1.0,
        Course::Drift => ((k - begins) as f64 + 0.5) * block_s,
    }
}

/// A run with what differs from motor to motor taken off.
struct Judged<'a> {
    run: &'a Whitened,
    left: DVector<f64>,
    inverse: DMatrix<f64>,
}

impl<'a> Judged<'a> {
    fn of(run: &'a Whitened) -> Option<Self> {
        let (own, inverse) = run.own_of_motor();
        let left = &run.rows - &run.own * own;
        (!run.blocks.is_empty()).then_some(Self { run, left, inverse })
    }

    /// Z, size and its deviation of a column with weights by block.
    fn test(&self, column: &DVector<f64>, weight: &dyn Fn(usize) -> f64) -> Option<(f64, f64, f64)> {
        let s = DVector::from_fn(column.len(), |n, _| column[n] * weight(self.run.blocks[n]));
        let b = self.run.own.tr_mul(&s);
        let whole = s.norm_squared();
        let information = whole - b.dot(&(&self.inverse * &b));
        let product = s.dot(&self.left);
        // What the motor's own parameters explain but for rounding tells nothing.
        (information > 1e-9 * whole && information > 0.0)
            .then(|| (product / information.sqrt(), product / information, 1.0 / information.sqrt()))
    }
}

/// The limits, each of which holds a share of healthy motors, from what each motor shows when the others say what is
/// usual: the hypotheses of its runs.
pub fn limits(motors: &[Vec<Vec<Hypothesis>>], holds: f64) -> Vec<Limit> {
    let n = motors.len() as f64;
    let all_of = |fault: Fault, onset: Onset| -> Option<Vec<Hypothesis>> {
        let largest = |runs: &Vec<Vec<Hypothesis>>| {
            let of_fault = runs.iter().flatten().filter(|h| h.fault == fault && h.onset == onset);
            of_fault.max_by(|a, b| a.z.abs().total_cmp(&b.z.abs())).copied()
        };
        motors.iter().map(largest).collect()
    };
    let mut limits = Vec::new();
    let mut put = |fault: Fault, onset: Onset, of: &[Hypothesis], z: f64| {
        let usual = (of.iter().map(|h| h.z * h.z).sum::<f64>() / n).sqrt();
        let mut seen: Vec<f64> = of.iter().map(|h| (z + SEEN * usual) * h.deviation).collect();
        seen.sort_by(f64::total_cmp);
        limits.push(Limit { fault, onset, z, seen: seen[seen.len() / 2] });
    };
    let student = |freedom: f64, share: f64| {
        StudentsT::new(0.0, 1.0, freedom).map_or(f64::INFINITY, |student| student.inverse_cdf(share))
    };
    let of_another = (1.0 + 1.0 / n).sqrt();
    for fault in Fault::ALL {
        let Some(of) = all_of(fault, Onset::Start) else { continue };
        let square = of.iter().map(|h| h.z * h.z).sum::<f64>() / n;
        put(fault, Onset::Start, &of, student(n - 1.0, 0.5 * (1.0 + holds)) * square.sqrt() * of_another);
    }
    let of_balances = |fault: &Fault| fault.own_row().is_none();
    let together: Vec<Fault> = Fault::ALL.into_iter().filter(of_balances).collect();
    let alone = Fault::ALL.into_iter().filter(|fault| !of_balances(fault)).map(|fault| vec![fault]);
    for group in std::iter::once(together).chain(alone) {
        let shown: Vec<(Fault, Vec<Hypothesis>)> =
            group.into_iter().filter_map(|fault| Some((fault, all_of(fault, Onset::During)?))).collect();
        let logarithms: Vec<Vec<f64>> =
            shown.iter().map(|(_, of)| of.iter().map(|h| h.z.abs().max(f64::MIN_POSITIVE).ln()).collect()).collect();
        let Some((deviation, freedom)) = pooled(&logarithms) else { continue };
        let beyond = student(freedom, holds) * deviation.max(LEAST_SPREAD) * of_another;
        for ((fault, of), logarithms) in shown.iter().zip(&logarithms) {
            put(*fault, Onset::During, of, (logarithms.iter().sum::<f64>() / n + beyond).exp());
        }
    }
    limits
}

/// Standard deviation pooled over samples of the same motors, and its degrees of freedom: a mean of correlated
/// variances (Satterthwaite).
fn pooled(samples: &[Vec<f64>]) -> Option<(f64, f64)> {
    let n = samples.first()?.len() as f64;
    let centred: Vec<DVector<f64>> = samples
        .iter()
        .map(|sample| {
            let sample = DVector::from_column_slice(sample);
            let mean = sample.mean();
            sample.add_scalar(-mean)
        })
        .collect();
    let covariance = |a: &DVector<f64>, b: &DVector<f64>| a.dot(b) / (n - 1.0);
    let trace: f64 = centred.iter().map(|a| covariance(a, a)).sum();
    let squares: f64 = centred.iter().flat_map(|a| centred.iter().map(move |b| covariance(a, b).powi(2))).sum();
    (n > 1.0 && trace > 0.0)
        .then(|| ((trace / centred.len() as f64).sqrt(), (n - 1.0) * (trace * trace / squares).max(1.0)))
}
