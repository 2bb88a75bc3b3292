//! No motor passes by a measuring chain that cannot be right.
//!
//! What [`plausibility`](super::plausibility) and the sampling raise counts against the test under way: until the next
//! one begins, its verdict is none where it would be a pass. A motor that fails, fails.

use super::shared::Shared;
use crate::detector::Verdict;
use crate::faults::Fault;

/// The faults by which samples are missing or say what cannot be.
pub const FAULTS: [Fault; 7] = [
    Fault::TickOverrun,
    Fault::TimeBase,
    Fault::VoltageClipped,
    Fault::CurrentClipped,
    Fault::SpeedClipped,
    Fault::CurrentFrozen,
    Fault::SpeedJump,
];

/// Their places in the table: the sampling interrupt does not look for them.
const PLACES: [usize; FAULTS.len()] = {
    let mut places = [0; FAULTS.len()];
    let mut n = 0;
    while n < FAULTS.len() {
        places[n] = FAULTS[n].place();
        n += 1;
    }
    places
};

/// Whether the chain has been plausible in a test.
#[derive(Debug, Clone)]
pub struct Chain {
    /// Number of the test.
    test: u32,
    /// How often each of [`FAULTS`] had occurred when it was looked at last.
    counted: [u32; FAULTS.len()],
    plausible: bool,
}

impl Chain {
    /// Of test 0, since the start.
    pub const fn new() -> Self {
        Self { test: 0, counted: [0; FAULTS.len()], plausible: true }
    }

    /// A test begins. The fault of a sample before it that comes late counts against it: better no verdict than a
    /// wrong one.
    pub fn begin(&mut self, test: u32, shared: &Shared) {
        *self = Self { test, counted: Self::counted(shared), plausible: true };
    }

    /// Whether it is about a test.
    pub fn is_of(&self, test: u32) -> bool {
        self.test == test
    }

    /// The counters have been set to zero.
    pub fn cleared(&mut self) {
        self.counted = [0; FAULTS.len()];
    }

    /// Whether nothing has come up since the test has begun.
    pub fn is_plausible(&mut self, shared: &Shared) -> bool {
        // One by one: comparing both at once would be a function of the library, in flash.
        for (counted, place) in self.counted.iter_mut().zip(PLACES) {
            let now = shared.fault(place);
            self.plausible &= now == *counted;
            *counted = now;
        }
        self.plausible
    }

    /// A verdict on a test as it may be told.
    pub fn allow(&mut self, verdict: Verdict, test: u32, shared: &Shared) -> Verdict {
        let plausible = self.is_plausible(shared) && test == self.test;
        if verdict == Verdict::Pass && !plausible { Verdict::CannotJudge } else { verdict }
    }

    fn counted(shared: &Shared) -> [u32; FAULTS.len()] {
        PLACES.map(|place| shared.fault(place))
    }
}

impl Default for Chain {
    fn default() -> Self {
        Self::new()
    }
}
