//! How many samples went by while nobody looked, by two timers.
//!
//! The converter is started by a timer with the processor's own clock, so that samples lie on a grid of CYCLES which
//! never drifts; an interrupt may come late, never early. The flag that says "a sample has come" cannot count. A second
//! timer, which the first one's trigger clocks, can: `triggers · CYCLES + phase` is the time since sampling began, in
//! cycles. The processor's own cycle counter would not do: it stands still while the processor sleeps, unless a
//! debugger has asked for the contrary and has not taken it back.

/// When samples came.
#[derive(Debug, Clone, Default)]
pub struct Grid<const CYCLES: u32> {
    last: Option<u32>,
}

impl<const CYCLES: u32> Grid<CYCLES> {
    /// The first interrupt may have come so much later than others do: a fiftieth of the interval, 2 µs of 100 µs.
    const SLACK: u32 = {
        assert!(CYCLES >= 50);
        CYCLES / 50
    };

    /// One that has seen no sample.
    pub const fn new() -> Self {
        Self { last: None }
    }

    /// The time, in cycles, wrapping, from the first timer's count, `phase`, and from what the second one has counted
    /// `before` and `after` that was read. It counts some cycles after the first one has begun anew: where the phase is
    /// low, this may have happened between the readings, and the second reading is the one that has it.
    #[inline(always)]
    pub fn time(before: u32, phase: u32, after: u32) -> u32 {
        let triggers = if phase < CYCLES / 2 { after } else { before };
        triggers.wrapping_mul(CYCLES).wrapping_add(phase)
    }

    /// At an interrupt, with the [time](Grid::time), which may wrap: how many samples have come since the last call besides
    /// the one that has just been read; none if it is the same one again.
    #[inline(always)]
    pub fn skipped(&mut self, now: u32) -> Option<u32> {
        let Some(last) = self.last else {
            self.last = Some(now);
            return Some(0);
        };
        let came = now.wrapping_sub(last).wrapping_add(Self::SLACK) / CYCLES;
        self.last = Some(last.wrapping_add(came * CYCLES));
        came.checked_sub(1)
    }
}
