//! What the line carries unasked, and what it cannot.
//!
//! At ten bits a byte, [`BAUD`] carries 92,160 bytes a second. What is sent unasked may take
//! [`MOST`] of them; the rest is for answers, so that the host is heard whatever it has asked for.

use super::BAUD;
use super::packing::{self, SAMPLES};

/// Bytes of the line a second: eight bits with a start and a stop bit each.
pub const LINE: u32 = BAUD / 10;
/// Most bytes a second that are sent unasked: nine tenths. Judgement: the longest answer, 400 bytes, then takes less
/// than half a tenth of a second, a fifth of what the host waits for it.
pub const MOST: u32 = LINE / 10 * 9;
/// Longest frame of a report, bytes.
pub const REPORT: u32 = 35;
/// Longest frame of a judged period, bytes.
pub const JUDGED: u32 = 96;
/// Longest frame of samples, bytes.
pub const CAPTURED: u32 = packing::BYTES as u32 + 18;
/// Most periods of the mains in a second.
const PERIODS_HZ: u32 = 60;

/// What is sent unasked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Load {
    /// Samples in a report; zero: no reports.
    pub every: u32,
    /// Raw samples.
    pub capture: bool,
    /// Judged periods.
    pub follow: bool,
}

impl Load {
    /// Bytes that it takes in a second.
    pub fn bytes_per_second(&self, sample_rate_hz: u32) -> u32 {
        let reports = sample_rate_hz.saturating_mul(REPORT).checked_div(self.every).unwrap_or(0);
        let samples = if self.capture { sample_rate_hz.saturating_mul(CAPTURED).div_ceil(SAMPLES as u32) } else { 0 };
        let periods = if self.follow { PERIODS_HZ * JUDGED } else { 0 };
        reports.saturating_add(samples).saturating_add(periods)
    }

    /// Whether the line carries it.
    pub fn fits(&self, sample_rate_hz: u32) -> bool {
        self.bytes_per_second(sample_rate_hz) <= MOST
    }
}
