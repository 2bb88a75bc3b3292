//! What interrupt and thread share: counters and queues from one, wishes from the other. No locks; each value is whole
//! by itself.

use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering::Relaxed};

use super::judged::WORDS;
use super::ring::Ring;
use super::{JUDGED_QUEUE, RAW_QUEUE, REPORT_QUEUE, Raw, Window};
use crate::detector::Verdict;
use crate::faults::{Fault, TABLE};
use crate::link::message::{Judged, Run};
use crate::sequence::{Contacts, Seen, State, Stop, Wishes};

const CANNOT_JUDGE: u8 = 0;
const PASS: u8 = 1;
const FAIL: u8 = 2;

/// Places of the contacts and the trip in their byte.
const START: u8 = 1;
const ABORT_CLOSED: u8 = 2;
const EMERGENCY_CLOSED: u8 = 4;
const TRIPPED: u8 = 8;

/// Places of the wishes in theirs.
const WISH_START: u8 = 1;
const WISH_ABORT: u8 = 2;
const WISH_ACKNOWLEDGE: u8 = 4;

/// Counters, queues and wishes. One writer each, but for the faults, which only ever rise or are cleared.
#[derive(Debug)]
pub struct Shared {
    samples: AtomicU32,
    faults: [AtomicU32; TABLE.len()],
    last_cycles: AtomicU32,
    most_cycles: AtomicU32,
    capture: AtomicBool,
    report_every: AtomicU32,
    verdict: AtomicU8,
    test: AtomicU32,
    follow: AtomicBool,
    /// What the host wishes of the sequence; taken by the interrupt.
    wishes: AtomicU8,
    /// Whether the thread has seen the samples stand still; taken by the interrupt.
    stood_still: AtomicBool,
    /// Runs since the start.
    runs: AtomicU32,
    /// State, contacts, samples and command of the sequence.
    state: AtomicU8,
    contacts: AtomicU8,
    elapsed: AtomicU32,
    command: AtomicU32,
    /// Raw samples that wait for the link.
    pub raw: Ring<Raw, 3, RAW_QUEUE>,
    /// Reports that wait for it.
    pub reports: Ring<Window, 7, REPORT_QUEUE>,
    /// Periods that wait for it.
    pub judged: Ring<Judged, WORDS, JUDGED_QUEUE>,
}

impl Default for Shared {
    fn default() -> Self {
        Self::new()
    }
}

impl Shared {
    /// Nothing has happened, nothing is wished for.
    pub const fn new() -> Self {
        Self {
            samples: AtomicU32::new(0),
            faults: [const { AtomicU32::new(0) }; TABLE.len()],
            last_cycles: AtomicU32::new(0),
            most_cycles: AtomicU32::new(0),
            capture: AtomicBool::new(false),
            report_every: AtomicU32::new(0),
            verdict: AtomicU8::new(CANNOT_JUDGE),
            test: AtomicU32::new(0),
            follow: AtomicBool::new(false),
            wishes: AtomicU8::new(0),
            stood_still: AtomicBool::new(false),
            runs: AtomicU32::new(0),
            state: AtomicU8::new(State::Stopped(Stop::Power).code()),
            contacts: AtomicU8::new(0),
            elapsed: AtomicU32::new(0),
            command: AtomicU32::new(0),
            raw: Ring::new(),
            reports: Ring::new(),
            judged: Ring::new(),
        }
    }

    /// Counts a fault.
    #[inline]
    pub fn raise(&self, fault: Fault) {
        if let Some(count) = self.faults.get(fault.place()) {
            // Not fetch_add, which would wrap: a counter that says "never" after four billion faults would lie. An
            // interrupt between the two may be counted once for twice.
            if let Some(more) = count.load(Relaxed).checked_add(1) {
                count.store(more, Relaxed);
            }
        }
    }

    /// How often each fault has occurred, in the order of [`TABLE`].
    pub fn faults(&self) -> [u32; TABLE.len()] {
        self.faults.each_ref().map(|count| count.load(Relaxed))
    }

    /// How often the fault at a place of the table has occurred.
    #[inline]
    pub(super) fn fault(&self, place: usize) -> u32 {
        self.faults.get(place).map_or(0, |count| count.load(Relaxed))
    }

    /// Forgets faults and the longest tick.
    pub fn clear(&self) {
        self.faults.iter().for_each(|count| count.store(0, Relaxed));
        self.most_cycles.store(0, Relaxed);
    }

    /// Samples since the start.
    pub fn samples(&self) -> u32 {
        self.samples.load(Relaxed)
    }

    /// Notes how long a tick took, in cycles of the processor.
    #[inline]
    pub fn note_cycles(&self, cycles: u32) {
        self.last_cycles.store(cycles, Relaxed);
        if cycles > self.most_cycles.load(Relaxed) {
            self.most_cycles.store(cycles, Relaxed);
        }
    }

    /// Cycles of the last tick and of the longest.
    pub fn cycles(&self) -> [u32; 2] {
        [self.last_cycles.load(Relaxed), self.most_cycles.load(Relaxed)]
    }

    /// The detector's verdict so far.
    pub fn verdict(&self) -> Verdict {
        match self.verdict.load(Relaxed) {
            PASS => Verdict::Pass,
            FAIL => Verdict::Fail,
            _ => Verdict::CannotJudge,
        }
    }

    #[inline]
    pub(super) fn judge(&self, verdict: Verdict) {
        let code = match verdict {
            Verdict::Pass => PASS,
            Verdict::Fail => FAIL,
            Verdict::CannotJudge => CANNOT_JUDGE,
        };
        self.verdict.store(code, Relaxed);
    }

    /// Number of the test that is wished for, and under way from the next sample on.
    #[inline]
    pub fn test(&self) -> u32 {
        self.test.load(Relaxed)
    }

    /// Begins a test, unless it is under way.
    pub fn begin_test(&self, test: u32) {
        if self.test.swap(test, Relaxed) != test {
            // The interrupt does the same once it has begun; until then the verdict of the test before must not be
            // read.
            self.judge(Verdict::CannotJudge);
        }
    }

    #[inline]
    pub(super) fn following(&self) -> bool {
        self.follow.load(Relaxed)
    }

    /// Says whether every period of a test goes into the queue.
    pub fn follow(&self, wanted: bool) {
        self.follow.store(wanted, Relaxed);
    }

    #[inline]
    pub(super) fn count_sample(&self, number: u32) {
        self.samples.store(number, Relaxed);
    }

    #[inline]
    pub(super) fn capturing(&self) -> bool {
        self.capture.load(Relaxed)
    }

    /// Says whether every raw sample goes into the queue.
    pub fn capture(&self, wanted: bool) {
        self.capture.store(wanted, Relaxed);
    }

    /// Samples in a report; zero: no reports.
    #[inline]
    pub(super) fn report_every(&self) -> u32 {
        self.report_every.load(Relaxed)
    }

    /// Says how many samples a report is about; zero: no reports.
    pub fn report(&self, every: u32) {
        self.report_every.store(every, Relaxed);
    }

    /// The sequence is to do something with the next sample.
    pub fn wish(&self, wishes: Wishes) {
        let Wishes { start, abort, acknowledge } = wishes;
        let bits = [(start, WISH_START), (abort, WISH_ABORT), (acknowledge, WISH_ACKNOWLEDGE)];
        let bits = bits.into_iter().fold(0, |all, (wished, bit)| if wished { all | bit } else { all });
        self.wishes.fetch_or(bits, Relaxed);
    }

    /// What is wished for, once. The interrupt's: the thread does not come between reading and writing.
    #[inline]
    pub(super) fn take_wishes(&self) -> Wishes {
        let bits = self.wishes.load(Relaxed);
        if bits != 0 {
            self.wishes.store(0, Relaxed);
        }
        let has = |bit| bits & bit != 0;
        Wishes { start: has(WISH_START), abort: has(WISH_ABORT), acknowledge: has(WISH_ACKNOWLEDGE) }
    }

    /// Samples have stood still.
    pub fn stand_still(&self) {
        self.stood_still.store(true, Relaxed);
    }

    /// Whether they have, once; as [`Shared::take_wishes`].
    #[inline]
    pub(super) fn take_stood_still(&self) -> bool {
        let stood_still = self.stood_still.load(Relaxed);
        if stood_still {
            self.stood_still.store(false, Relaxed);
        }
        stood_still
    }

    /// A run begins, and the test of a motor with it; gives the test's number.
    #[inline]
    pub(super) fn begin_run(&self) -> u32 {
        self.runs.store(self.runs().wrapping_add(1), Relaxed);
        let test = self.test().wrapping_add(1).max(1);
        self.begin_test(test);
        test
    }

    /// Notes what the sequence does and sees.
    #[inline]
    pub(super) fn note_run(&self, state: State, elapsed: u32, command: f32, seen: &Seen) {
        let Contacts { start, abort_closed, emergency_closed } = seen.contacts;
        let bit = |is: bool, place: u8| if is { place } else { 0 };
        let contacts = bit(start, START)
            | bit(abort_closed, ABORT_CLOSED)
            | bit(emergency_closed, EMERGENCY_CLOSED)
            | bit(seen.tripped, TRIPPED);
        self.state.store(state.code(), Relaxed);
        self.contacts.store(contacts, Relaxed);
        self.elapsed.store(elapsed, Relaxed);
        self.command.store(command.to_bits(), Relaxed);
    }

    /// What the sequence does.
    pub fn state(&self) -> State {
        State::from_code(self.state.load(Relaxed))
    }

    /// Runs that have begun since the start.
    pub fn runs(&self) -> u32 {
        self.runs.load(Relaxed)
    }

    /// What the sequence does and sees, for the host; its profile has so many samples.
    pub fn run(&self, length: u32) -> Run {
        let contacts = self.contacts.load(Relaxed);
        let has = |bit| contacts & bit != 0;
        Run {
            state: self.state(),
            runs: self.runs(),
            test: self.test(),
            elapsed: self.elapsed.load(Relaxed),
            length,
            command: f32::from_bits(self.command.load(Relaxed)),
            start: has(START),
            abort_closed: has(ABORT_CLOSED),
            emergency_closed: has(EMERGENCY_CLOSED),
            tripped: has(TRIPPED),
        }
    }
}
