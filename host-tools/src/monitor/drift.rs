//! Has the rig drifted? Control charts of what the golden motor shows, check by check.
//!
//! The first m checks teach mean x̄ and standard deviation s. A later check x_k is compared with them twice, k = 1, 2,
//! … counted from the first check after those:
//!
//! ```text
//! individuals   |x_k − x̄| > t s √(1 + 1/m)                                  catches a jump (Shewhart)
//! EWMA          z_k = λ x_k + (1 − λ) z_(k−1),  z_0 = x̄                     catches a slow drift
//!               |z_k − x̄| > t s √(λ/(2 − λ) (1 − q²) + (1 − q)²/m)          q = (1 − λ)^k
//! ```
//!
//! Both differences are normal, and s is independent of them, so with t the quantile 1 − α/2 of Student's distribution
//! of m − 1 degrees of freedom each rule calls a rig that has not drifted with probability α a check, exactly, for
//! normal figures and any m. α is [`FALSE_ALARMS`] shared among all figures and both rules, so that all of them
//! together call in at most that share of checks.
//!
//! Sources: W. A. Shewhart: Economic Control of Quality (1931); S. W. Roberts: Control chart tests based on geometric
//! moving averages, Technometrics 1 (1959) 239–250; limits with estimated parameters as prediction intervals: D. C.
//! Montgomery: Statistical Quality Control, 7th edition (2013), sections 6.4 and 9.2.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::tolerance::moments;

/// Share of checks of a rig that has not drifted in which an alarm is raised: that of 3 σ of a single chart, one in
/// 370.
pub const FALSE_ALARMS: f64 = 0.0027;
/// Fewest checks that can teach what is usual.
pub const FEWEST: usize = 5;
/// λ: weight of the newest check.
pub const WEIGHT: f64 = 0.2;

/// What is usual.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Baseline {
    /// x̄.
    pub mean: f64,
    /// s.
    pub deviation: f64,
    /// m.
    pub checks: usize,
    /// t.
    #[serde(skip)]
    quantile: f64,
}

/// A check against the baseline.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// (x_k − x̄) over its limit.
    pub individual: f64,
    /// (z_k − x̄) over its limit.
    pub average: f64,
}

impl Point {
    /// Whether either rule calls.
    pub fn calls(&self) -> bool {
        self.individual.abs() > 1.0 || self.average.abs() > 1.0
    }
}

impl Baseline {
    /// From the first checks, with α for each rule. `None` from fewer than [`FEWEST`], or where they are all the same.
    pub fn new(values: &[f64], false_alarms: f64) -> Option<Self> {
        let (mean, deviation) = moments(values);
        let student = StudentsT::new(0.0, 1.0, values.len() as f64 - 1.0).ok()?;
        let quantile = student.inverse_cdf(1.0 - 0.5 * false_alarms);
        (values.len() >= FEWEST && deviation > 0.0 && deviation.is_finite()).then_some(Self {
            mean,
            deviation,
            checks: values.len(),
            quantile,
        })
    }

    /// The checks that came after it, in order.
    pub fn judge(&self, later: &[f64]) -> Vec<Point> {
        let m = self.checks as f64;
        let unit = self.quantile * self.deviation;
        let (mut average, mut left) = (0.0, 1.0);
        later
            .iter()
            .map(|x| {
                let difference = x - self.mean;
                average += WEIGHT * (difference - average);
                left *= 1.0 - WEIGHT;
                let spread: f64 = WEIGHT / (2.0 - WEIGHT) * (1.0 - left * left) + (1.0 - left).powi(2) / m;
                Point {
                    individual: difference / (unit * (1.0 + 1.0 / m).sqrt()),
                    average: average / (unit * spread.sqrt()),
                }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By numpy and scipy.stats: six checks teach 10.1 ± 0.236 643, t of 5 degrees of freedom, 99.5 %, is 4.032 143 as
    /// in any table, and the formulas of the module's page give the shares of the limits.
    #[test]
    fn checks_are_compared_with_both_limits() {
        let baseline = Baseline::new(&[10.0, 10.4, 9.8, 10.2, 9.9, 10.3], 0.01).unwrap();
        assert!((baseline.mean - 10.1).abs() < 1e-12 && (baseline.deviation - 0.236_643_191).abs() < 1e-9);
        assert!((baseline.quantile - 4.032_142_984).abs() < 1e-6, "{}", baseline.quantile);
        assert_eq!(baseline.checks, 6);
        let points = baseline.judge(&[10.5, 9.0, 11.5, 10.1]);
        let expected = [
            (0.388_111_632, 0.388_111_632),
            (-1.067_306_987, -0.553_651_420),
            (1.358_390_711, 0.466_296_007),
            (0.0, 0.335_343_258),
        ];
        for (point, (individual, average)) in points.iter().zip(expected) {
            assert!((point.individual - individual).abs() < 1e-6, "{point:?}: {individual}");
            assert!((point.average - average).abs() < 1e-6, "{point:?}: {average}");
        }
        assert_eq!(points.iter().map(Point::calls).collect::<Vec<_>>(), [false, true, true, false]);
    }

    #[test]
    fn either_rule_calls_on_either_side_and_only_beyond_the_limit() {
        let calls = |individual, average| Point { individual, average }.calls();
        assert!(calls(1.01, 0.0) && calls(-1.01, 0.0) && calls(0.0, 1.01) && calls(0.0, -1.01));
        assert!(!calls(1.0, -1.0) && !calls(0.0, 0.0));
    }

    #[test]
    fn too_few_checks_or_none_that_differ_teach_nothing() {
        let values = [1.0, 2.0, 1.5, 1.2, 1.7];
        assert!(Baseline::new(&values, 0.01).is_some() && Baseline::new(&values[..4], 0.01).is_none());
        assert!(Baseline::new(&[1.0; 5], 0.01).is_none());
        assert!(Baseline::new(&[1.0, 2.0, f64::INFINITY, 1.0, 1.0], 0.01).is_none());
    }
}
