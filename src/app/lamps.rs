//! How a verdict is shown on pins.
//!
//! Where somebody else switches the motor, the verdict is that of the test under way:
//!
//! | pin | pass | fail | cannot judge | reset, hung, unplugged |
//! | --- | --- | --- | --- | --- |
//! | pass | square wave of [`PULSES_HZ`] | low | low | still |
//! | alarm | low | high | low | still |
//! | status | off | off | on | still |
//!
//! With a [sequence](crate::sequence) it is that of the last run, until the next one begins or it is acknowledged:
//!
//! | pin | passed | failed | running, settling | stopped | idle, unjudged |
//! | --- | --- | --- | --- | --- | --- |
//! | pass | square wave | low | low | low | low |
//! | alarm | low | high | low | low | low |
//! | busy | low | low | square wave | low | low |
//! | status | off | off | off | square wave | on |
//!
//! **The motor passes only while the pass pulses.** A level says nothing: a pin keeps it while a program hangs, and
//! floats while the processor is in reset. The pulses are made of the number of samples, by the thread: they stand
//! still if sampling does, or the thread.

use crate::detector::Verdict;
use crate::hardware::Hardware;
use crate::sequence::State;

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
    /// A run is under way, of which only the change counts.
    pub busy: bool,
    /// There is no verdict.
    pub status: bool,
}

impl Lamps {
    /// A verdict at a number of samples.
    pub fn of(verdict: Verdict, samples: u32, hardware: &Hardware) -> Self {
        Self {
            pass: verdict == Verdict::Pass && pulse(samples, hardware),
            alarm: verdict == Verdict::Fail,
            busy: false,
            status: verdict == Verdict::CannotJudge,
        }
    }

    /// A station at a number of samples.
    pub fn of_run(state: State, samples: u32, hardware: &Hardware) -> Self {
        let pulse = pulse(samples, hardware);
        match state {
            State::Passed => Self { pass: pulse, ..Self::default() },
            State::Failed => Self { alarm: true, ..Self::default() },
            State::Running | State::Settling => Self { busy: pulse, ..Self::default() },
            State::Stopped(_) => Self { status: pulse, ..Self::default() },
            State::Idle | State::Unjudged => Self { status: true, ..Self::default() },
        }
    }
}

/// A square wave, made of the number of samples.
fn pulse(samples: u32, hardware: &Hardware) -> bool {
    let half = (hardware.sample_rate_hz / (2 * PULSES_HZ)).max(1);
    (samples / half).is_multiple_of(2)
}
