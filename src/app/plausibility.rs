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
use crate::hardware::Hardware;
use crate::units::{Calibration, Counts};

/// In this part of a second, 0.2 s, a current that has not moved is frozen: ten periods of the mains at 50 Hz.
const FROZEN_PART: u32 = 5;
/// An end of the range stands for zero if the quantity there is less than so many counts.
const ZERO_COUNTS: f32 = 8.0;

/// What has to be remembered between samples.
#[derive(Debug, Clone)]
pub struct Watch {
    /// Of voltage, current and speed: the counts that do not mean clipping.
    unclipped: [Range; 3],
    /// Where the next speed is no jump.
    near: Range,
    rest: Rest,
    /// A tenth of the range, counts.
    tenth: u32,
    /// Samples after which a current that has not moved is frozen.
    frozen: u32,
}

/// Counts from the lowest on, as many as the span is wide. (In words: halves would have to be cut off again and again.)
#[derive(Debug, Clone, Copy)]
struct Range {
    lowest: u32,
    span: u32,
}

impl Range {
    /// Without the ends of the converter's range that mean clipping.
    fn between([lower_clips, upper_clips]: [bool; 2], full_scale: u16) -> Self {
        let lowest = u32::from(lower_clips);
        let highest = if upper_clips { full_scale - 1 } else { u16::MAX };
        Self { lowest, span: u32::from(highest) - lowest }
    }

    /// Not further from a count than so many.
    #[inline(always)]
    fn around(count: u16, reach: u32) -> Self {
        Self { lowest: u32::from(count).wrapping_sub(reach), span: 2 * reach }
    }

    /// By one comparison: what lies below the lowest wraps around.
    #[inline(always)]
    fn contains(self, count: u16) -> bool {
        u32::from(count).wrapping_sub(self.lowest) <= self.span
    }
}

/// A stretch in which the current has not moved.
#[derive(Debug, Clone, Copy)]
struct Rest {
    current: u32,
    lowest_voltage: u32,
    highest_voltage: u32,
    samples: u32,
}

impl Rest {
    #[inline(always)]
    fn new(counts: Counts) -> Self {
        let voltage = counts.voltage.into();
        Self { current: counts.current.into(), lowest_voltage: voltage, highest_voltage: voltage, samples: 1 }
    }
}

impl Watch {
    /// For channels of this calibration; without one, both ends of every channel but the lower one of the speed clip.
    pub fn new(calibration: Option<&Calibration>, hardware: &Hardware) -> Self {
        let full_scale = hardware.full_scale;
        let usual = [[true; 2], [true; 2], [false, true]];
        let clips = calibration.map_or(usual, |calibration| {
            calibration.scales().map(|scale| {
                [0, full_scale].map(|end| {
                    let counts_from_zero = f32::from(end) - scale.zero;
                    !(-ZERO_COUNTS..=ZERO_COUNTS).contains(&counts_from_zero)
                })
            })
        });
        Self {
            unclipped: clips.map(|clips| Range::between(clips, full_scale)),
            near: Range { lowest: 0, span: u32::MAX },
            rest: Rest::new(Counts::default()),
            tenth: u32::from(full_scale / 10),
            frozen: hardware.sample_rate_hz / FROZEN_PART,
        }
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
        if !self.near.contains(counts.speed) {
            raise(Fault::SpeedJump);
        }
        self.near = Range::around(counts.speed, self.tenth);
        // One either way.
        if u32::from(counts.current).wrapping_add(1).wrapping_sub(self.rest.current) > 2 {
            self.rest = Rest::new(counts);
            return;
        }
        let rest = &mut self.rest;
        rest.lowest_voltage = rest.lowest_voltage.min(counts.voltage.into());
        rest.highest_voltage = rest.highest_voltage.max(counts.voltage.into());
        rest.samples += 1;
        if rest.samples >= self.frozen {
            if rest.highest_voltage - rest.lowest_voltage > self.tenth {
                raise(Fault::CurrentFrozen);
            }
            *rest = Rest { samples: 0, ..Rest::new(counts) };
        }
    }
}
