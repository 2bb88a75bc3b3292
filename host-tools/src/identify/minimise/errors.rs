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
    /// Of which block and group the others tell the model so little that it extrapolates.
    pub beyond: Vec<[bool; 2]>,
}

impl HeldOut {
    /// Of blocks that the others tell of.
    pub fn new(squares: Vec<[f64; 2]>, rows: Vec<[f64; 2]>) -> Self {
        let beyond = vec![[false; 2]; squares.len()];
        Self { squares, rows, beyond }
    }

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

    /// By how much the logarithm of the error is smaller in another model, over the blocks of which the others tell at
    /// least one of the two: where both extrapolate, the right law may well end farther off than a wrong one.
    pub fn fall_to(&self, after: &Self) -> f64 {
        let is_told = |b: usize, g: usize| !(self.beyond[b][g] && after.beyond[b][g]);
        let fall = |g: usize| {
            let told = (0..self.squares.len()).filter(|b| is_told(*b, g));
            let [before, after] = told.fold([0.0; 2], |[x, y], b| [x + self.squares[b][g], y + after.squares[b][g]]);
            if before > 0.0 && after > 0.0 { 0.5 * (before / after).ln() } else { 0.0 }
        };
        (0..2).map(fall).sum()
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
        let held_out = HeldOut::new(vec![[0.0, 9.0], [0.0, 27.0]], vec![[0.0, 1.0], [0.0, 3.0]]);
        assert_eq!(held_out.log_error(), 3f64.ln());
    }

    #[test]
    fn a_block_that_both_models_extrapolate_to_does_not_count() {
        let of = |beyond: bool, squares: [f64; 2]| HeldOut {
            beyond: vec![[beyond, false], [false; 2]],
            ..HeldOut::new(squares.map(|s| [s, 0.0]).to_vec(), vec![[1.0, 0.0]; 2])
        };
        // An inrush, of which nothing else tells, and a block that the second model halves the error of.
        assert!((of(true, [100.0, 4.0]).fall_to(&of(true, [900.0, 1.0])) - 2f64.ln()).abs() < 1e-15);
        // If the other one knows the inrush from elsewhere, that is to its credit, and against it if it does not.
        assert!((of(true, [100.0, 4.0]).fall_to(&of(false, [3.0, 1.0])) - 26f64.ln() / 2.0).abs() < 1e-15);
        assert!((of(false, [3.0, 1.0]).fall_to(&of(true, [100.0, 4.0])) + 26f64.ln() / 2.0).abs() < 1e-15);
        // A group without rows says nothing.
        assert_eq!(of(true, [100.0, 4.0]).fall_to(&of(true, [900.0, 4.0])), 0.0);
    }
}
