//! Are there as many samples as the time says?
//!
//! Samples are numbered by what the hardware has counted ([`grid`](super::grid)); the time driver of the board counts
//! by itself. Over a stretch of [`STRETCH_US`] of its time, `|samples − rate · time| ≤ SLACK`, or one of the two has
//! stood still or runs at another rate: a trigger that did not come, a timer that was stopped, a wrong divider.

/// Length of the stretch after which both are compared, µs. Judgement: a second is short against a test.
pub const STRETCH_US: u64 = 1_000_000;
/// Samples by which they may differ. The two are read one after the other, with up to one interrupt between them, and
/// each has begun up to one sample before it was counted, at both ends of the stretch: four.
pub const SLACK: u64 = 4;

/// Compares them.
#[derive(Debug, Clone)]
pub struct TimeBase {
    sample_rate_hz: u64,
    /// Samples and time, µs, at the begin of the stretch.
    begin: Option<(u32, u64)>,
}

impl TimeBase {
    /// For a sampling rate.
    pub const fn new(sample_rate_hz: u32) -> Self {
        Self { sample_rate_hz: sample_rate_hz as u64, begin: None }
    }

    /// With the number of samples, which may wrap, and the time, µs: whether they disagree at the end of a stretch.
    pub fn disagrees(&mut self, samples: u32, micros: u64) -> bool {
        let (first, since) = *self.begin.get_or_insert((samples, micros));
        let time = micros.wrapping_sub(since);
        if time < STRETCH_US {
            return false;
        }
        self.begin = Some((samples, micros));
        let expected = time.saturating_mul(self.sample_rate_hz) / 1_000_000;
        u64::from(samples.wrapping_sub(first)).abs_diff(expected) > SLACK
    }
}
