//! The fast detector: a feature above its limit for some periods in a row.
//!
//! Hysteresis: it calls when the feature has been above the limit for [`CONFIRM`] periods in a row, and is quiet again
//! when it has been below [`RELEASE`] of the limit for as many.

/// Periods in a row that call.
pub const CONFIRM: u8 = 3;
/// Share of the limit below which it is quiet again.
pub const RELEASE: f32 = 0.8;

/// A feature's watch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fast {
    limit: f32,
    run: u8,
    calls: bool,
}

impl Fast {
    /// With a limit, in the feature's unit; not finite or not positive: it never calls.
    pub fn new(limit: f32) -> Self {
        Self { limit, run: 0, calls: false }
    }

    /// Takes a period's feature; gives its ratio to the limit while it calls.
    pub fn process(&mut self, feature: f32) -> Option<f32> {
        let ratio = self.ratio(feature);
        let turns = if self.calls { ratio < RELEASE } else { ratio > 1.0 };
        self.run = if turns { self.run + 1 } else { 0 };
        if self.run >= CONFIRM {
            self.calls = !self.calls;
            self.run = 0;
        }
        self.calls.then_some(ratio)
    }

    /// Whether it calls.
    pub fn calls(&self) -> bool {
        self.calls
    }

    /// A feature over the limit; 0 without a limit.
    pub fn ratio(&self, feature: f32) -> f32 {
        if self.limit > 0.0 && self.limit.is_finite() { feature / self.limit } else { 0.0 }
    }
}
