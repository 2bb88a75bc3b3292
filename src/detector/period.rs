//! Periods of the mains, from the voltage itself: 50 Hz, 60 Hz, or direct voltage.
//!
//! A period ends where the voltage rises through zero, if it has been clearly negative since the last one. Without such
//! a crossing within [`LONGEST_S`] the supply counts as direct voltage, and a period is [`USUAL_S`].

/// Shortest period, s: 60 Hz less a tenth for a crossing that comes early.
pub const SHORTEST_S: f32 = 0.015;
/// Longest period, s: 50 Hz and a tenth.
pub const LONGEST_S: f32 = 0.022;
/// Period of direct voltage, s.
pub const USUAL_S: f32 = 0.02;

/// Tells where a period ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeriodClock {
    shortest: u32,
    longest: u32,
    usual: u32,
    /// Samples after which a period ends at the latest: `longest` on alternating voltage, `usual` on direct voltage.
    latest: u32,
    /// Voltage below which the next rise through zero counts, V (negative).
    arming: f32,
    armed: bool,
    count: u32,
}

impl PeriodClock {
    /// At a sampling rate (Hz), for a supply of a nominal voltage (V).
    pub fn new(sample_rate_hz: f32, nominal_voltage: f32) -> Self {
        let samples = |seconds: f32| (seconds * sample_rate_hz) as u32;
        Self {
            shortest: samples(SHORTEST_S),
            longest: samples(LONGEST_S),
            usual: samples(USUAL_S),
            latest: samples(USUAL_S),
            arming: -0.05 * nominal_voltage,
            armed: false,
            count: 0,
        }
    }

    /// Takes a voltage; gives the number of samples since the last crossing or end, if a period ends before this one.
    #[inline]
    pub fn process(&mut self, voltage: f32) -> Option<u32> {
        let mut crossing = false;
        if voltage >= 0.0 {
            crossing = core::mem::take(&mut self.armed);
        } else if voltage < self.arming {
            self.armed = true;
        }
        if crossing || self.count >= self.latest {
            self.end(crossing)
        } else {
            self.count += 1;
            None
        }
    }

    /// Begins to count anew, with a crossing or where none has come.
    fn end(&mut self, crossing: bool) -> Option<u32> {
        let length = core::mem::replace(&mut self.count, 1);
        self.latest = if crossing { self.longest } else { self.usual };
        // A crossing soon after a period of direct voltage is where counting begins.
        (!crossing || length >= self.shortest).then_some(length)
    }
}
