//! The cumulative detector: a two-sided cumulative sum of what a deviation has beyond its tolerance.
//!
//! With x = (d − c)/t, d the deviation, c its mean over healthy motors and t the tolerance within which healthy motors
//! lie:
//!
//! ```text
//! S⁺ ← max(0, S⁺ + x − 1)      S⁻ ← max(0, S⁻ − x − 1)      it calls when S⁺ or S⁻ exceeds h
//! ```
//!
//! A deviation that exceeds the tolerance by a tenth calls after 10 h periods, one that exceeds it twice after h.
//!
//! Source: E. S. Page: Continuous inspection schemes, Biometrika 41 (1954) 100–115.

/// What a healthy motor's deviation is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// c, mean over healthy motors.
    pub centre: f32,
    /// t, half the width of what is healthy; not finite or not positive: it never calls.
    pub half_width: f32,
}

/// h, in tolerances times periods: half a second at twice the tolerance.
pub const THRESHOLD: f32 = 25.0;

/// A deviation's cumulative sums.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cumulative {
    tolerance: Tolerance,
    above: f32,
    below: f32,
}

impl Cumulative {
    /// With a tolerance.
    pub fn new(tolerance: Tolerance) -> Self {
        Self { tolerance, above: 0.0, below: 0.0 }
    }

    /// Takes a period's deviation; gives it in tolerances while the sum calls.
    pub fn process(&mut self, deviation: f32) -> Option<f32> {
        let x = self.in_tolerances(deviation);
        // Bounded, so that it comes back within a few seconds once the cause is gone.
        let most = 4.0 * THRESHOLD;
        self.above = (self.above + x - 1.0).clamp(0.0, most);
        self.below = (self.below - x - 1.0).clamp(0.0, most);
        (self.above > THRESHOLD || self.below > THRESHOLD).then_some(x)
    }

    /// A deviation in tolerances; 0 without a tolerance.
    pub fn in_tolerances(&self, deviation: f32) -> f32 {
        let t = self.tolerance;
        let usable = t.half_width > 0.0 && t.half_width.is_finite();
        if usable { (deviation - t.centre) / t.half_width } else { 0.0 }
    }
}
