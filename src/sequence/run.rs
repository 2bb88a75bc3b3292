//! The sequence at work, once a sample.

use super::contact::{Button, Contact};
use super::guard::{Guard, Limits};
use super::profile::Profile;
use super::table::{Event, State, Stop, next};
use crate::detector::Verdict;

/// Samples that may be missing at once: 1 ms, half of the debounce of a stop. Judgement.
pub const MOST_SKIPPED: u32 = 10;

/// What the contacts of the station show; raw, sample by sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Contacts {
    /// START is pressed: its contact is closed.
    pub start: bool,
    /// ABORT is not pressed: its contact is closed.
    pub abort_closed: bool,
    /// The emergency stop is not pressed: its feedback is closed.
    pub emergency_closed: bool,
}

/// What the host wishes for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wishes {
    /// A run.
    pub start: bool,
    /// No run.
    pub abort: bool,
    /// To go on after a stop.
    pub acknowledge: bool,
}

/// What is seen with a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Samples since the last one: 1, or more where some were not taken.
    pub samples: u32,
    /// The contacts.
    pub contacts: Contacts,
    /// The hardware has cut the supply, and not been armed since.
    pub tripped: bool,
    /// Sampling has stood still meanwhile, as another clock says.
    pub stood_still: bool,
    /// The measured speed, rad/s.
    pub speed: f32,
    /// What the host wishes for, once.
    pub wishes: Wishes,
    /// The verdict so far on the test that the run has begun; no pass where the test was another, or its chain not
    /// plausible.
    pub verdict: Verdict,
}

/// What is to be done.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Command {
    /// The contactor.
    pub closed: bool,
    /// The supply's voltage, as a fraction of what it gives, 0 to 1.
    pub fraction: f32,
    /// Arm the hardware's trip anew: with this sample a stop has been acknowledged.
    pub arm: bool,
    /// Begin the test of a motor: with this sample its run begins.
    pub begin: bool,
}

/// What a sequence is made of.
pub(super) struct Parts {
    pub profile: Profile,
    pub limits: Limits,
    pub trip: [u16; 2],
    pub stop_samples: u32,
    pub start_samples: u32,
}

/// A sequence at work.
#[derive(Debug, Clone)]
pub struct Sequence {
    state: State,
    /// Samples since the run began.
    elapsed: u32,
    /// The command of the sample before.
    fraction: f32,
    emergency: Contact,
    abort: Contact,
    start: Button,
    guard: Guard,
    profile: Profile,
    trip: [u16; 2],
}

impl Sequence {
    pub(super) fn new(parts: Parts) -> Self {
        Self {
            state: State::Stopped(Stop::Power),
            elapsed: 0,
            fraction: 0.0,
            emergency: Contact::new(parts.stop_samples),
            abort: Contact::new(parts.stop_samples),
            start: Button::new(parts.start_samples),
            guard: Guard::new(parts.limits),
            profile: parts.profile,
            trip: parts.trip,
        }
    }

    /// What it does.
    #[inline]
    pub fn state(&self) -> State {
        self.state
    }

    /// Samples since the last run began, until it has ended.
    #[inline]
    pub fn elapsed(&self) -> u32 {
        self.elapsed
    }

    /// Length of the profile in samples.
    pub fn samples(&self) -> u32 {
        self.profile.samples()
    }

    /// The counts between which the hardware allows the current, the lower first.
    pub fn trip(&self) -> [u16; 2] {
        self.trip
    }

    /// Takes what is seen with a sample, and gives what is to be done until the next one.
    ///
    /// By itself, so that it can stand apart from what is run in every tick (`src/bin/hot.x`).
    #[inline(never)]
    pub fn step(&mut self, seen: &Seen) -> Command {
        if self.state.is_busy() {
            self.elapsed = self.elapsed.saturating_add(seen.samples);
        }
        let before = self.state;
        if let Some(event) = self.event(seen) {
            self.state = next(before, event);
        }
        let changed = self.state != before;
        let begin = changed && self.state == State::Running;
        if begin {
            self.elapsed = 0;
            self.profile.rewind();
            self.guard.begin();
        }
        let (fraction, closed) = match self.state {
            State::Running => self.profile.at(self.elapsed).unwrap_or_default(),
            _ => (0.0, false),
        };
        self.fraction = fraction;
        let arm = changed && matches!(before, State::Stopped(_));
        Command { closed, fraction, arm, begin }
    }

    /// What happens with a sample: one thing, and what is wrong before anything else. What is wished for meanwhile is
    /// not done later.
    #[inline(always)]
    fn event(&mut self, seen: &Seen) -> Option<Event> {
        // All of them look at each sample.
        let pressed = self.start.look(seen.contacts.start);
        if let Some(stop) = self.stop(seen) {
            return Some(Event::Stop(stop));
        }
        let stopped = matches!(self.state, State::Stopped(_));
        if seen.wishes.acknowledge || (pressed && stopped) {
            return Some(Event::Acknowledge);
        }
        if seen.wishes.start || pressed {
            return Some(Event::Start);
        }
        match self.state {
            State::Running if self.elapsed >= self.profile.samples() => Some(Event::ProfileEnded),
            State::Settling => {
                let since = self.elapsed.saturating_sub(self.profile.samples());
                self.guard.has_settled(since, seen.speed).then_some(match seen.verdict {
                    Verdict::Pass => Event::Passes,
                    Verdict::Fail => Event::Fails,
                    Verdict::CannotJudge => Event::CannotJudge,
                })
            }
            _ => None,
        }
    }

    /// What is wrong, in the order of [`Stop::ALL`]. The hardware's latch does not hold the station: acknowledging arms
    /// it, and it trips anew with the next sample where its cause lasts.
    #[inline(always)]
    fn stop(&mut self, seen: &Seen) -> Option<Stop> {
        let busy = self.state.is_busy();
        let emergency = self.emergency.look(seen.contacts.emergency_closed);
        let abort = self.abort.look(seen.contacts.abort_closed);
        let fast = self.guard.is_too_fast(seen.speed);
        let stuck = self.state == State::Running && self.guard.is_stuck(seen.speed, self.fraction);
        if emergency {
            Some(Stop::EmergencyStop)
        } else if seen.tripped && !matches!(self.state, State::Stopped(_)) {
            Some(Stop::OverCurrent)
        } else if fast {
            Some(Stop::OverSpeed)
        } else if busy && (seen.stood_still || seen.samples > MOST_SKIPPED) {
            Some(Stop::Sampling)
        } else if abort || seen.wishes.abort {
            Some(Stop::Abort)
        } else if stuck {
            Some(Stop::StuckRotor)
        } else if busy && self.guard.is_late(self.elapsed) {
            Some(Stop::TimeOut)
        } else {
            None
        }
    }
}
