//! How many samples went by while nobody looked, from the processor's cycle counter.
//!
//! The converter is started by a timer with the processor's own clock, so that samples lie on a grid of CYCLES which
//! never drifts; an interrupt may come late, never early. The flag that says "a sample has come" cannot count; this
//! can.

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

    /// At an interrupt, with the cycle counter, which may wrap: how many samples have come since the last call besides
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
