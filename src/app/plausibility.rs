//! Does the measuring chain tell what a rig can do?
//!
//! | check | rule | fault |
//! | --- | --- | --- |
//! | clipping | counts at an end of the converter's range where the quantity is not zero | 20, 21, 22 |
//! | frozen current | current within ±1 count for 0.2 s in which the voltage has spanned a tenth of the range | 23 |
//! | jump of the speed | by more than a tenth of the range between two samples | 24 |
//!
//! The lower end of a channel that begins at zero (a speed without a sign) is standstill, not clipping.

use crate::faults::Fault;
use crate::units::{Calibration, Counts, FULL_SCALE};

/// Samples after which a current that has not moved is frozen: ten periods of the mains at 50 Hz.
pub const FROZEN_SAMPLES: u16 = 2_000;
/// A tenth of the range, counts.
pub const TENTH: u16 = FULL_SCALE / 10;
/// An end of the range stands for zero if the quantity there is less than so many counts.
const ZERO_COUNTS: f32 = 8.0;

/// What has to be remembered between samples.
#[derive(Debug, Clone)]
pub struct Watch {
    /// Of voltage, current and speed: the counts that do not mean clipping.
    unclipped: [Range; 3],
    last_speed: Option<u16>,
    rest: Rest,
}

/// Counts from the lowest on, as many as the span is wide.
#[derive(Debug, Clone, Copy)]
struct Range {
    lowest: u16,
    span: u16,
}

impl Range {
    /// Without the ends of the converter's range that mean clipping.
    fn between([lower_clips, upper_clips]: [bool; 2]) -> Self {
        let lowest = u16::from(lower_clips);
        let highest = if upper_clips { FULL_SCALE - 1 } else { u16::MAX };
        Self { lowest, span: highest - lowest }
    }

    /// By one comparison: what lies below the lowest wraps around.
    #[inline(always)]
    fn contains(self, count: u16) -> bool {
        count.wrapping_sub(self.lowest) <= self.span
    }
}

/// A stretch in which the current has not moved.
#[derive(Debug, Clone, Copy)]
struct Rest {
    current: u16,
    lowest_voltage: u16,
    highest_voltage: u16,
    samples: u16,
}

impl Rest {
    fn new(counts: Counts) -> Self {
        Self { current: counts.current, lowest_voltage: counts.voltage, highest_voltage: counts.voltage, samples: 0 }
    }
}

impl Watch {
    /// For channels of this calibration; without one, both ends of every channel but the lower one of the speed clip.
    pub fn new(calibration: Option<&Calibration>) -> Self {
        let usual = [[true; 2], [true; 2], [false, true]];
        let clips = calibration.map_or(usual, |calibration| {
            calibration.scales().map(|scale| {
                [0, FULL_SCALE].map(|end| {
                    let counts_from_zero = f32::from(end) - scale.zero;
                    !(-ZERO_COUNTS..=ZERO_COUNTS).contains(&counts_from_zero)
                })
            })
        });
        Self { unclipped: clips.map(Range::between), last_speed: None, rest: Rest::new(Counts::default()) }
    }

    /// Looks at a sample and gives what is wrong to `raise`.
    #[inline]
    pub fn look(&mut self, counts: Counts, mut raise: impl FnMut(Fault)) {
        let channels = [
            (counts.voltage, Fault::VoltageClipped),
            (counts.current, Fault::CurrentClipped),
            (counts.speed, Fault::SpeedClipped),
        ];
        for ((count, fault), unclipped) in channels.into_iter().zip(self.unclipped) {
            if !unclipped.contains(count) {
                raise(fault);
            }
        }
        if self.last_speed.replace(counts.speed).is_some_and(|last| last.abs_diff(counts.speed) > TENTH) {
            raise(Fault::SpeedJump);
        }
        if counts.current.abs_diff(self.rest.current) > 1 {
            self.rest = Rest::new(counts);
        }
        let rest = &mut self.rest;
        rest.lowest_voltage = rest.lowest_voltage.min(counts.voltage);
        rest.highest_voltage = rest.highest_voltage.max(counts.voltage);
        rest.samples += 1;
        if rest.samples >= FROZEN_SAMPLES {
            if rest.highest_voltage - rest.lowest_voltage > TENTH {
                raise(Fault::CurrentFrozen);
            }
            *rest = Rest::new(counts);
        }
    }
}
