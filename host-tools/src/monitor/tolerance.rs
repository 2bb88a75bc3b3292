//! Limits that hold a share of all healthy motors, from a few of them.
//!
//! The largest of ten motors is exceeded by one motor in eleven. A normal tolerance limit `m + k s` holds the share p of the
//! population with confidence γ; with z the normal quantile and n motors
//!
//! ```text
//! k = (z_p + √(z_p² − a b))/a      a = 1 − z_γ²/(2 (n − 1))      b = z_p² − z_γ²/n
//! ```
//!
//! Source: M. G. Natrella: Experimental Statistics, NBS Handbook 91 (1963), A-7.

use statrs::distribution::{ContinuousCDF, Normal};

/// Fewest motors from which such a limit can be had.
pub const FEWEST: usize = 4;

/// The one-sided factor k for n values, a share p and a confidence γ. `None` with too few values.
pub fn factor(n: usize, share: f64, confidence: f64) -> Option<f64> {
    let normal = Normal::new(0.0, 1.0).ok()?;
    let (zp, zg) = (normal.inverse_cdf(share), normal.inverse_cdf(confidence));
    let count = n as f64;
    let a = 1.0 - zg * zg / (2.0 * (count - 1.0));
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

/// The upper limit of values that are normal, or lognormal where `logarithmic`.
pub fn upper(values: &[f64], logarithmic: bool, share: f64, confidence: f64) -> Option<f64> {
    let k = factor(values.len(), share, confidence)?;
    if logarithmic {
        let logs: Vec<f64> = values.iter().map(|x| x.max(1e-12).ln()).collect();
        let (mean, deviation) = moments(&logs);
        Some((mean + k * deviation).exp())
    } else {
        let (mean, deviation) = moments(values);
        Some(mean + k * deviation)
    }
}
