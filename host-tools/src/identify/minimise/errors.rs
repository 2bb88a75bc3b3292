//! The error of a fit, as one number and on blocks of time held out.

/// Logarithm of an error: Σ ln RMS over the groups that have rows. Where both have n rows and noises of unknown size,
/// the log-likelihood is −n times that, up to a constant.
pub fn log_error(rms: [f64; 2], has: [bool; 2]) -> f64 {
    (0..2).filter(|g| has[*g]).map(|g| rms[g].ln()).sum()
}

/// Whether the two groups have rows.
pub fn have_rows(groups: &[u8]) -> [bool; 2] {
    [0u8, 1].map(|g| groups.contains(&g))
}

/// Squared errors of the two groups in each block, on data held out, and the numbers of rows.
#[derive(Debug, Clone)]
pub struct HeldOut {
    /// Sums of squares by block, in the units of the residuals.
    pub squares: Vec<[f64; 2]>,
    /// Rows by block.
    pub rows: Vec<[f64; 2]>,
}

impl HeldOut {
    /// RMS of the two groups over all blocks.
    pub fn rms(&self) -> [f64; 2] {
        [0, 1].map(|g| {
            let n: f64 = self.rows.iter().map(|r| r[g]).sum();
            let s: f64 = self.squares.iter().map(|s| s[g]).sum();
            if n > 0.0 { (s / n).sqrt() } else { f64::NAN }
        })
    }

    /// The logarithm of the error on data held out: [`log_error`].
    pub fn log_error(&self) -> f64 {
        let rms = self.rms();
        log_error(rms, rms.map(f64::is_finite))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_is_that_of_the_groups_that_there_are() {
        // ln 2 + ln 3, and ln 3 alone.
        assert!((log_error([2.0, 3.0], [true, true]) - 6f64.ln()).abs() < 1e-15);
        assert_eq!(log_error([f64::NAN, 3.0], have_rows(&[1, 1])), 3f64.ln());
        let held_out = HeldOut { squares: vec![[0.0, 9.0], [0.0, 27.0]], rows: vec![[0.0, 1.0], [0.0, 3.0]] };
        assert_eq!(held_out.log_error(), 3f64.ln());
    }
}
