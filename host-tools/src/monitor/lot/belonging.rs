//! Which of a set of motors, of which a few may be bad, are of one lot.
//!
//! One bad motor of ten widens every scatter and hides itself and its like. So those that look most alike say what is
//! usual, at least three quarters; each motor is judged by them, those beyond their limits leave, all others join,
//! until the set stays the same. At first a motor is as unlike the others as its most unusual hypothesis:
//!
//! ```text
//! max |x − median|/(1.4826 MAD)      x = Z from the start, ln |Z| during the test
//! ```
//! The median of absolute deviations from the median (MAD), times 1.4826, is the standard deviation of normal values,
//! and no quarter of bad ones moves it far.
//!
//! Source: the reweighted minimum covariance determinant, P. J. Rousseeuw, K. Van Driessen, A fast algorithm for the
//! minimum covariance determinant estimator, Technometrics 41 (1999) 212–223.

use super::likelihood::{Hypothesis, limits};
use super::{GROUPS, Lot, beyond};
use crate::context::Context;
use crate::error::Result;
use crate::model::lot::{Fault, Onset};

/// Part of the motors that may be bad: a core of three quarters stays.
const MOST_BAD: usize = 4;
/// Rounds after which a set that still changes is taken as it is.
const ROUNDS: usize = 6;
/// Normal standard deviation over the median of absolute deviations.
const OF_MAD: f64 = 1.4826;

/// The motors that belong together, in their order. `None` if no three quarters of them do.
pub fn members(lot: &Lot<'_>, false_alarms: f64, ctx: &Context) -> Result<Option<Vec<usize>>> {
    let all: Vec<usize> = (0..lot.motors.len()).collect();
    let core = all.len() - all.len() / MOST_BAD;
    // A fault that several have would be a shape by which motors differ.
    let plain = Lot { with_shapes: false, ..*lot };
    let unlike = unlike(&plain.by_the_others(&all, ctx)?);
    let mut members = all.clone();
    members.sort_by(|a, b| unlike[*a].total_cmp(&unlike[*b]));
    members.truncate(core);
    members.sort_unstable();
    for _ in 0..ROUNDS {
        let shown = lot.by_the_others(&members, ctx)?;
        let usual = lot.usual(&members);
        let holds = 1.0 - false_alarms / (GROUPS * all.len() as f64);
        let of_members = limits(&shown, holds);
        let is_one = |motor: &usize| match members.binary_search(motor) {
            Ok(place) => {
                let others: Vec<_> = (0..shown.len()).filter(|k| *k != place).map(|k| shown[k].clone()).collect();
                beyond(&limits(&others, holds), &shown[place]).is_none()
            }
            Err(_) => beyond(&of_members, &lot.judged_by(&usual, *motor)).is_none(),
        };
        let next: Vec<usize> = all.iter().copied().filter(is_one).collect();
        if next.len() < core {
            return Ok(None);
        }
        let is_same = next == members;
        members = next;
        if is_same {
            break;
        }
    }
    Ok(Some(members))
}

/// How unlike the others each motor is.
fn unlike(shown: &[Vec<Vec<Hypothesis>>]) -> Vec<f64> {
    let mut most = vec![0.0f64; shown.len()];
    for (fault, onset) in Fault::ALL.into_iter().flat_map(|fault| [Onset::Start, Onset::During].map(|o| (fault, o))) {
        let of_motor = |runs: &Vec<Vec<Hypothesis>>| {
            let of_fault = runs.iter().flatten().filter(|h| h.fault == fault && h.onset == onset);
            let h = of_fault.max_by(|a, b| a.z.abs().total_cmp(&b.z.abs()))?;
            Some(if onset == Onset::Start { h.z } else { h.z.abs().max(f64::MIN_POSITIVE).ln() })
        };
        let Some(values) = shown.iter().map(of_motor).collect::<Option<Vec<f64>>>() else { continue };
        let middle = median(values.clone());
        let deviation = OF_MAD * median(values.iter().map(|x| (x - middle).abs()).collect());
        for (most, x) in most.iter_mut().zip(&values) {
            // During the test a |Z| that is small is none that is unusual.
            let off = if onset == Onset::Start { (x - middle).abs() } else { x - middle };
            *most = most.max(off / deviation.max(f64::MIN_POSITIVE));
        }
    }
    most
}

/// Of several values; of an even number the mean of the two in the middle.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let (low, high) = (values.len().saturating_sub(1) / 2, values.len() / 2);
    0.5 * (values.get(low).copied().unwrap_or(0.0) + values.get(high).copied().unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motor(z: f64) -> Vec<Vec<Hypothesis>> {
        let h = |onset| Hypothesis {
            fault: Fault::Resistance,
            onset,
            begin: 0.0,
            z,
            size: z,
            deviation: 1.0,
            explains: 0.0,
        };
        vec![vec![h(Onset::Start)]]
    }

    /// By hand: −2 … 2 have the median 0 and a MAD of 1, with a 30 beside them 0.5 and 1.5.
    #[test]
    fn one_that_is_far_off_is_unlike_and_makes_no_other_so() {
        let shown: Vec<_> = [-2.0, -1.0, 0.0, 1.0, 2.0, 30.0].map(motor).to_vec();
        let unlike = unlike(&shown);
        assert!((unlike[5] - 29.5 / (1.4826 * 1.5)).abs() < 1e-12, "{unlike:?}");
        assert!((unlike[0] - 2.5 / (1.4826 * 1.5)).abs() < 1e-12, "{unlike:?}");
    }
}
