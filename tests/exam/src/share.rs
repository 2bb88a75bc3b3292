//! Shares with their intervals.

use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF};

/// So many of so many. It is printed with Wilson's interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Share {
    /// Cases that count.
    pub hits: usize,
    /// Of how many.
    pub cases: usize,
}

impl Share {
    /// Of the items for which something holds.
    pub fn of<'a, T: 'a>(items: impl IntoIterator<Item = &'a T>, holds: impl Fn(&T) -> bool) -> Self {
        items.into_iter().fold(Self { hits: 0, cases: 0 }, |s, item| Self {
            hits: s.hits + usize::from(holds(item)),
            cases: s.cases + 1,
        })
    }

    /// The share itself.
    pub fn value(&self) -> f64 {
        self.hits as f64 / self.cases.max(1) as f64
    }

    /// The interval that holds the true share in 95 % of cases on the average over shares.
    ///
    /// Source: E. B. Wilson: Probable inference, the law of succession, and statistical inference, J. Am. Stat. Assoc.
    /// 22 (1927) 209–212.
    pub fn wilson(&self) -> [f64; 2] {
        let (n, p, z) = (self.cases.max(1) as f64, self.value(), 1.96f64);
        let centre = p + z * z / (2.0 * n);
        let half = z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        [((centre - half) / (1.0 + z * z / n)).max(0.0), (centre + half) / (1.0 + z * z / n)]
    }

    /// The interval that holds the true share in at least 95 % of cases, whatever it is: quantiles of beta
    /// distributions.
    ///
    /// Source: C. J. Clopper, E. S. Pearson: The use of confidence or fiducial limits illustrated in the case of the
    /// binomial, Biometrika 26 (1934) 404–413.
    pub fn clopper_pearson(&self) -> [f64; 2] {
        let (k, n) = (self.hits as f64, self.cases as f64);
        let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(p));
        let low = if self.hits == 0 { 0.0 } else { quantile(k, n - k + 1.0, 0.025) };
        let high = if self.hits == self.cases { 1.0 } else { quantile(k + 1.0, n - k, 0.975) };
        [low, high]
    }

    /// In words, with the interval of Clopper and Pearson.
    pub fn exact(&self) -> String {
        let [low, high] = self.clopper_pearson();
        format!("{} of {} ({:.1} … {:.1} %)", self.hits, self.cases, 100.0 * low, 100.0 * high)
    }
}

impl std::fmt::Display for Share {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [low, high] = self.wilson();
        write!(
            f,
            "{:.1} % ({}/{}; {:.1} … {:.1} %)",
            100.0 * self.value(),
            self.hits,
            self.cases,
            100.0 * low,
            100.0 * high
        )
    }
}
