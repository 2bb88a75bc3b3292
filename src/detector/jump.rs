//! The abrupt change of a deviation: against its own recent past instead of against other motors.
//!
//! `j = d − b`, where the past b follows the deviation d with a time constant of [`PAST`] periods. What differs from
//! motor to motor is in both and drops out, so a step that would be lost among healthy motors stands out for about a
//! second.

/// Periods over which the past is averaged: a second at 50 Hz.
pub const PAST: f32 = 50.0;

/// A deviation's past.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Jump {
    past: Option<f32>,
}

impl Jump {
    /// Takes a period's deviation; gives its change against the past.
    pub fn process(&mut self, deviation: f32) -> f32 {
        let past = self.past.unwrap_or(deviation);
        self.past = Some(past + (deviation - past) / PAST);
        deviation - past
    }

    /// Forgets the past: after a gap in what could be judged.
    pub fn reset(&mut self) {
        self.past = None;
    }
}
