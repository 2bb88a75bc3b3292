//! Switches and their wires, sample by sample.
//!
//! | switch | contact | an open wire means |
//! | --- | --- | --- |
//! | emergency stop (feedback), ABORT | normally closed | stop |
//! | START | normally open | nothing |

/// A stop is noticed when its contact has been open for so long, s. Judgement: longer than what a relay beside the
/// wires couples in, and far below the 5 ms that a stop may take in all.
pub const STOP_DEBOUNCE_S: f32 = 2e-3;
/// START counts when it has been pressed for so long, s, after it has been released for as long. Judgement: no contact
/// of a button bounces for longer, and no finger is quicker.
pub const START_DEBOUNCE_S: f32 = 20e-3;

/// What an open sample weighs, in closed ones: a contact that is open for more than a third of the time stops, too.
const OPEN_WEIGHT: u32 = 2;

/// A normally closed contact. It counts as open until it has been closed.
///
/// The level rises by two with an open sample and falls by one with a closed one; at its top the contact is open, at
/// zero closed.
#[derive(Debug, Clone)]
pub struct Contact {
    level: u32,
    top: u32,
    open: bool,
}

impl Contact {
    /// One that is open when it has been so for as many samples.
    pub const fn new(samples: u32) -> Self {
        let top = OPEN_WEIGHT * if samples == 0 { 1 } else { samples };
        Self { level: top, top, open: true }
    }

    /// With a further sample: whether it is open.
    #[inline]
    pub fn look(&mut self, closed: bool) -> bool {
        if closed {
            self.level = self.level.saturating_sub(1);
            self.open &= self.level > 0;
        } else {
            self.level = (self.level + OPEN_WEIGHT).min(self.top);
            self.open |= self.level == self.top;
        }
        self.open
    }
}

/// A normally open button. It counts as pressed until it has been released, so that one that hangs starts nothing.
#[derive(Debug, Clone)]
pub struct Button {
    samples: u32,
    count: u32,
    pressed: bool,
}

impl Button {
    /// One that changes when it has been otherwise for as many samples in a row.
    pub const fn new(samples: u32) -> Self {
        Self { samples, count: 0, pressed: true }
    }

    /// With a further sample: whether it has just been pressed.
    #[inline]
    pub fn look(&mut self, closed: bool) -> bool {
        if closed == self.pressed {
            self.count = 0;
            return false;
        }
        self.count += 1;
        if self.count < self.samples {
            return false;
        }
        (self.pressed, self.count) = (closed, 0);
        closed
    }
}
