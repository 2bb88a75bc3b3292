//! The station's sequence in the sampling interrupt: what it sees, and what it does to the rig.
//!
//! After the tick, because the speed that it guards is the filtered one, and because the tick's own length is
//! nobody else's business.

use super::board::Switchgear;
use super::chain::Chain;
use super::shared::Shared;
use crate::detector::Verdict;
use crate::sequence::{Seen, Sequence, State};
use crate::tick::Output;

/// The sequence with the rig's switches.
pub struct Station<'a, S> {
    shared: &'a Shared,
    switchgear: S,
    sequence: Option<Sequence>,
    /// Number of the test that the run has begun.
    test: u32,
    /// Its chain since then.
    chain: Chain,
}

impl<'a, S: Switchgear> Station<'a, S> {
    /// With what is to be run; without it, and in safe mode, the supply stays off.
    pub fn new(sequence: Option<Sequence>, mut switchgear: S, shared: &'a Shared) -> Self {
        switchgear.supply(false, 0.0);
        if let Some(sequence) = &sequence {
            switchgear.trip_outside(sequence.trip());
        }
        Self { shared, switchgear, sequence, test: 0, chain: Chain::new() }
    }

    /// After the tick of a sample: what the tick has given, and how many samples before it nobody took.
    #[inline(never)]
    pub fn sample(&mut self, output: &Option<Output>, skipped: u32) {
        let Self { shared, switchgear, sequence, .. } = self;
        let (Some(sequence), Some(output)) = (sequence, output) else { return };
        let settling = sequence.state() == State::Settling;
        let seen = Seen {
            samples: skipped.saturating_add(1),
            contacts: switchgear.contacts(),
            tripped: switchgear.has_tripped(),
            stood_still: shared.take_stood_still(),
            speed: output.measured.speed,
            wishes: shared.take_wishes(),
            verdict: if settling {
                self.chain.allow(shared.verdict(), shared.test(), shared)
            } else {
                Verdict::CannotJudge
            },
        };
        let command = sequence.step(&seen);
        switchgear.supply(command.closed, command.fraction);
        if command.arm {
            switchgear.arm();
        }
        shared.note_run(sequence.state(), sequence.elapsed(), command.fraction, &seen);
        if command.begin {
            self.test = shared.begin_run();
            self.chain.begin(self.test, shared);
        }
    }

    /// The rig's switches.
    pub fn switchgear(&mut self) -> &mut S {
        &mut self.switchgear
    }
}
