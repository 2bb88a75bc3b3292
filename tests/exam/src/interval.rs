//! Exact intervals of shares.

use std::fmt;

use statrs::distribution::{Beta, ContinuousCDF};

/// k of n with the 95 % interval of C. J. Clopper and E. S. Pearson, Biometrika 26 (1934) 404–413, which holds the true share
/// in at least 95 % of cases, whatever it is: quantiles of beta distributions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Counted {
    /// How many.
    pub k: usize,
    /// Of how many.
    pub n: usize,
}

impl Counted {
    /// Those of all for which something holds.
    pub fn of<T>(all: &[T], holds: impl Fn(&T) -> bool) -> Self {
        Self { k: all.iter().filter(|x| holds(x)).count(), n: all.len() }
    }

    /// k/n.
    pub fn share(&self) -> f64 {
        self.k as f64 / self.n.max(1) as f64
    }

    /// The ends of the interval.
    pub fn interval(&self) -> [f64; 2] {
        let (k, n) = (self.k as f64, self.n as f64);
        let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(p));
        let low = if self.k == 0 { 0.0 } else { quantile(k, n - k + 1.0, 0.025) };
        let high = if self.k == self.n { 1.0 } else { quantile(k + 1.0, n - k, 0.975) };
        [low, high]
    }
}

impl fmt::Display for Counted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = self.interval();
        write!(f, "{} of {} ({:.1} … {:.1} %)", self.k, self.n, 100.0 * low, 100.0 * high)
    }
}
