//! Limits of speed and time. A speed that is not a number is too fast, does not turn, and is never at rest.

use crate::scalar::Scalar;

/// Overspeed is noticed after so long, s: a single sample that is disturbed stops nothing. Judgement: a rotor of 30,000
/// rpm that accelerates from rest within a second gains 0.1 % of its speed meanwhile.
pub const OVERSPEED_S: f32 = 1e-3;
/// So long the last periods are given to be judged, s: two of 45 Hz, and the judgement.
pub const JUDGING_S: f32 = 50e-3;

/// The limits, in samples and in what is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Speed that must not be exceeded, rad/s.
    pub overspeed: f32,
    /// Samples for which it may be.
    pub overspeed_samples: u32,
    /// Below this speed a rotor that has voltage is stuck, rad/s.
    pub turning: f32,
    /// From this command on it has voltage, as a fraction.
    pub from: f32,
    /// Samples for which it may be stuck.
    pub stuck_samples: u32,
    /// Below this speed the rotor is at rest, rad/s.
    pub rest: f32,
    /// Samples that a run may take, from its start to the rotor's rest.
    pub time_out: u32,
    /// Samples for the judgement of the last periods.
    pub judging: u32,
}

/// Watches the speed.
#[derive(Debug, Clone)]
pub struct Guard {
    limits: Limits,
    fast: u32,
    stuck: u32,
}

impl Guard {
    /// With limits.
    pub const fn new(limits: Limits) -> Self {
        Self { limits, fast: 0, stuck: 0 }
    }

    /// A run begins.
    #[inline]
    pub fn begin(&mut self) {
        self.stuck = 0;
    }

    /// With a further speed, rad/s: whether it is too high.
    #[inline]
    pub fn is_too_fast(&mut self, speed: f32) -> bool {
        let within = Scalar::abs(speed) <= self.limits.overspeed;
        self.fast = if within { 0 } else { self.fast.saturating_add(1) };
        self.fast >= self.limits.overspeed_samples
    }

    /// With a further speed, rad/s, under a command: whether the rotor is stuck.
    #[inline]
    pub fn is_stuck(&mut self, speed: f32, fraction: f32) -> bool {
        let turns = Scalar::abs(speed) >= self.limits.turning;
        self.stuck = if turns || fraction < self.limits.from { 0 } else { self.stuck.saturating_add(1) };
        self.stuck >= self.limits.stuck_samples
    }

    /// Whether a run takes too long.
    #[inline]
    pub fn is_late(&self, elapsed: u32) -> bool {
        elapsed > self.limits.time_out
    }

    /// Whether the last periods are judged and the rotor is at rest, so long after the end of the profile.
    #[inline]
    pub fn has_settled(&self, since: u32, speed: f32) -> bool {
        since >= self.limits.judging && Scalar::abs(speed) < self.limits.rest
    }
}
