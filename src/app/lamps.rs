//! How a verdict is shown on pins.
//!
//! | pin | pass | fail | cannot judge | reset, hung, unplugged |
//! | --- | --- | --- | --- | --- |
//! | pass | square wave of [`PULSES_HZ`] | low | low | still |
//! | alarm | low | high | low | still |
//! | status | off | off | on | still |
//!
//! **The motor passes only while the pass pulses.** A level says nothing: a pin keeps it while a program hangs, and
//! floats while the processor is in reset. The pulses are made of the number of samples, by the thread: they stand
//! still if sampling does, or the thread.

use crate::detector::Verdict;
use crate::hardware::Hardware;

/// Pulses of the pass a second. Judgement: slow enough for the input of any controller and for the pauses of 44 ms
/// while flash is erased, quick enough to be missed within a quarter of a second.
pub const PULSES_HZ: u32 = 10;

/// What the pins show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Lamps {
    /// The pass, of which only the change counts.
    pub pass: bool,
    /// The motor fails.
    pub alarm: bool,
    /// There is no verdict.
    pub status: bool,
}

impl Lamps {
    /// A verdict at a number of samples.
    pub fn of(verdict: Verdict, samples: u32, hardware: &Hardware) -> Self {
        let half = (hardware.sample_rate_hz / (2 * PULSES_HZ)).max(1);
        Self {
            pass: verdict == Verdict::Pass && (samples / half).is_multiple_of(2),
            alarm: verdict == Verdict::Fail,
            status: verdict == Verdict::CannotJudge,
        }
    }
}
