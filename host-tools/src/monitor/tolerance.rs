//! Limits that hold a share of all healthy motors, from a few of them.
//!
//! The largest of ten motors is exceeded by one motor in eleven. A normal tolerance limit `m + k s` holds the share p
//! of the population with confidence γ; with z the normal quantile and n motors
//!
//! ```text
//! k = (z_p + √(z_p² − a b))/a      a = 1 − z_γ²/(2 (n − 1))      b = z_p² − z_γ²/n
//! ```
//!
//! Where several runs come of a motor, they are not as many motors. With n runs each of g motors, MS_b and MS_w the
//! mean squares between and within motors, and n_0 runs of a motor (n itself, if all have as many),
//!
//! ```text
//! s² = MS_b/n_0 + (1 − 1/n_0) MS_w      ν = s⁴/((MS_b/n_0)²/(g − 1) + ((1 − 1/n_0) MS_w)²/(N − g))
//! ```
//!
//! is the variance of a run of any motor and its degrees of freedom, which stand for n − 1 above; g stands for n.
//!
//! Sources: M. G. Natrella: Experimental Statistics, NBS Handbook 91 (1963), A-7; F. E. Satterthwaite: An approximate
//! distribution of estimates of variance components, Biometrics Bulletin 2 (1946) 110–114.

use statrs::distribution::{ContinuousCDF, Normal};

/// Fewest motors from which such a limit can be had.
pub const FEWEST: usize = 4;

/// The one-sided factor k for n values, a share p and a confidence γ. `None` with too few values.
pub fn factor(n: usize, share: f64, confidence: f64) -> Option<f64> {
    factor_of(n, n as f64 - 1.0, share, confidence)
}

/// The same for a mean of n motors and a standard deviation of ν degrees of freedom.
fn factor_of(n: usize, freedom: f64, share: f64, confidence: f64) -> Option<f64> {
    let normal = Normal::new(0.0, 1.0).ok()?;
    let (zp, zg) = (normal.inverse_cdf(share), normal.inverse_cdf(confidence));
    let count = n as f64;
    let a = 1.0 - zg * zg / (2.0 * freedom);
    let b = zp * zp - zg * zg / count;
    (n >= FEWEST && a > 0.0).then(|| (zp + (zp * zp - a * b).max(0.0).sqrt()) / a)
}

/// Mean and standard deviation.
pub fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    (mean, square.sqrt())
}

/// Mean and standard deviation of a run of any motor, and the latter's degrees of freedom, from the runs of each motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Mean over motors.
    pub mean: f64,
    /// s.
    pub deviation: f64,
    /// ν.
    pub freedom: f64,
    /// Motors.
    pub motors: usize,
    /// Standard deviation within the runs of a motor, where there are several.
    pub within: Option<f64>,
}

/// From the runs of each motor.
pub fn spread(motors: &[Vec<f64>]) -> Spread {
    let runs: usize = motors.iter().map(Vec::len).sum();
    let g = motors.len();
    let means: Vec<f64> = motors.iter().map(|m| moments(m).0).collect();
    let (mean, between) = moments(&means);
    if runs <= g {
        let freedom = (g.max(2) - 1) as f64;
        return Spread { mean, deviation: between, freedom, motors: g, within: None };
    }
    let within: f64 =
        motors.iter().zip(&means).flat_map(|(m, mean)| m.iter().map(move |x| (x - mean).powi(2))).sum::<f64>()
            / (runs - g) as f64;
    // Of unequal numbers of runs the harmonic mean: what the variance of a motor's mean goes by.
    let n = g as f64 / motors.iter().map(|m| 1.0 / m.len().max(1) as f64).sum::<f64>();
    let (a, b) = (between * between, (1.0 - 1.0 / n) * within);
    let freedom = (a + b).powi(2) / (a * a / (g.max(2) - 1) as f64 + b * b / (runs - g) as f64);
    Spread {
        mean,
        deviation: (a + b).sqrt(),
        freedom: if freedom.is_finite() { freedom } else { (runs - 1) as f64 },
        motors: g,
        within: Some(within.sqrt()),
    }
}

/// The upper limit of values that are normal, or lognormal where `logarithmic`, from the runs of each motor.
pub fn upper(motors: &[Vec<f64>], logarithmic: bool, share: f64, confidence: f64) -> Option<f64> {
    let log = |x: &f64| if logarithmic { x.max(1e-12).ln() } else { *x };
    let scaled: Vec<Vec<f64>> = motors.iter().map(|m| m.iter().map(log).collect()).collect();
    let s = spread(&scaled);
    let limit = s.mean + factor_of(s.motors, s.freedom, share, confidence)? * s.deviation;
    Some(if logarithmic { limit.exp() } else { limit })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unequal numbers of runs, one motor with a single one.
    fn motors() -> Vec<Vec<f64>> {
        vec![vec![1.0, 1.4, 1.2], vec![2.0, 2.6], vec![0.5, 0.9, 0.7, 0.3], vec![1.7], vec![2.9, 2.5, 3.3]]
    }

    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-8 * expected.abs(), "{found} against {expected}");
    }

    /// The formula by scipy.stats.norm. That is Natrella's approximation: by the non-central t distribution, which is
    /// exact, the three are 3.981, 2.396 and 2.134.
    #[test]
    fn factors_are_those_of_the_formula_by_another_program() {
        close(factor(10, 0.99, 0.95).unwrap(), 3.940_000_959);
        close(factor(20, 0.95, 0.95).unwrap(), 2.378_348_312);
        close(factor(FEWEST, 0.9, 0.75).unwrap(), 1.905_217_868);
        assert_eq!(factor(3, 0.9, 0.75), None, "too few");
        // With z of 95 %, a is 1 − 2.7055/(2 · 1) of a single degree of freedom.
        assert_eq!(factor_of(10, 1.0, 0.9, 0.95), None, "no such limit");
    }

    /// numpy and scipy.stats.hmean: the mean of five means, their scatter, and n₀ = 2.069 runs a motor.
    #[test]
    fn unequal_numbers_of_runs_have_a_harmonic_mean() {
        let s = spread(&motors());
        close(s.mean, 1.74);
        close(s.deviation, 0.929_179_745_8);
        close(s.freedom, 4.502_409_060_7);
        close(s.within.unwrap(), 0.312_249_899_9);
        assert_eq!(s.motors, 5);
    }

    #[test]
    fn limits_are_of_the_values_or_of_their_logarithms() {
        close(upper(&motors(), false, 0.95, 0.9).unwrap(), 4.601_362_365);
        close(upper(&motors(), true, 0.95, 0.9).unwrap(), 11.421_869_337);
    }

    /// Motors that are all alike: nothing has a scatter, and ν is that of all runs.
    #[test]
    fn without_scatter_the_limit_is_the_mean() {
        let s = spread(&vec![vec![2.0, 2.0]; 4]);
        assert_eq!((s.mean, s.deviation, s.freedom, s.within), (2.0, 0.0, 7.0, Some(0.0)));
        assert_eq!(upper(&vec![vec![2.0, 2.0]; 4], false, 0.95, 0.9), Some(2.0));
        // By hand: two values have the variance (1 − 2)² + (3 − 2)²; one value has none.
        assert_eq!(moments(&[1.0, 3.0]), (2.0, 2f64.sqrt()));
        assert_eq!(moments(&[3.0]), (3.0, 0.0));
        let one = spread(&[vec![3.0]]);
        assert_eq!((one.mean, one.deviation, one.freedom), (3.0, 0.0, 1.0));
    }
}
