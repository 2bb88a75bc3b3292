//! How the processor came to an end, kept in memory that a reset leaves as it is, and told at the next start.
//!
//! ```text
//! panic, hard fault, unreadable program ─► Kept { Ended, incident } ─ reset ─┐
//! watchdog, dip of the supply ──────── Kept { Running } ─ reset, its flag ───┼─► next start: incident, one more
//! reset button, request, debugger ──── Kept { Running } ─ reset ─────────────┴─► next start: none in a row
//! power off and on ─────────────────── arbitrary words ──────────────────────► next start: nothing is known
//! ```
//! After [`IN_A_ROW`] starts that ended so, with no more than [`SETTLED_S`] of running between, the next one is into
//! safe mode: whatever of the parameters may be the cause is not run, and the host is heard. A program whose own words
//! cannot be read is not started again then; it stands, with its pins safe.

use serde::{Deserialize, Serialize};

use crate::parameters::block::CRC;

/// So many ends in a row, and the next start is into safe mode. Judgement: one may be chance, two a coincidence.
pub const IN_A_ROW: u8 = 3;
/// After running for so long a start counts as a good one, s. Judgement.
pub const SETTLED_S: u32 = 10;
/// Words that are kept.
pub const WORDS: usize = 14;
/// Longest name of a place in the program, bytes; the end of longer ones.
pub const MAX_PLACE: usize = 24;

/// "GREY", and a version.
const MAGIC: u32 = u32::from_le_bytes(*b"GRE1");

/// Why the processor came to an end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Cause {
    /// The program found itself in a state that cannot be; `at` is the line of the source.
    Panic = 1,
    /// An access or an instruction that cannot be, or the end of the stack; `at` is the instruction.
    HardFault = 2,
    /// No sample was processed for half a second.
    Watchdog = 3,
    /// The supply fell short, for so short a time that memory was kept.
    SupplyDip = 4,
    /// A word of the program itself cannot be read; `at` is its offset.
    Program = 5,
    /// A non-maskable interrupt that is not the flash's: clock, or parity of the memory.
    Hardware = 6,
}

impl Cause {
    const ALL: [Self; 6] =
        [Self::Panic, Self::HardFault, Self::Watchdog, Self::SupplyDip, Self::Program, Self::Hardware];
}

/// A place in the program's source.
pub type Place = heapless::String<MAX_PLACE>;

/// An end.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Incident {
    /// Why.
    pub cause: Cause,
    /// Where: an address, or a line.
    pub at: u32,
    /// The link register at a hard fault: who called.
    pub from: u32,
    /// CFSR and HFSR at a hard fault; ECCR at an unreadable word.
    pub status: [u32; 2],
    /// Samples since the start.
    pub samples: u32,
    /// File of the source at a panic, its end.
    pub place: Place,
}

impl Incident {
    /// One of which nothing more is known.
    pub const fn new(cause: Cause, samples: u32) -> Self {
        Self { cause, at: 0, from: 0, status: [0; 2], samples, place: Place::new() }
    }

    /// The same at a place in the source.
    #[must_use]
    pub fn at_line(self, file: &str, line: u32) -> Self {
        let mut place = Place::new();
        // Names of source files are short of characters beyond ASCII.
        let skipped = file.len().saturating_sub(MAX_PLACE);
        file.chars().skip(skipped).filter(char::is_ascii).for_each(|letter| {
            let _ = place.push(letter);
        });
        Self { at: line, place, ..self }
    }
}

/// What the program was doing when it was kept last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Phase {
    /// It ran.
    #[default]
    Running,
    /// It has come to an end by itself.
    Ended,
}

/// What of a start tells it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Reset {
    /// The watchdog has bitten.
    pub watchdog: bool,
    /// The supply was below what the processor needs.
    pub brown_out: bool,
}

/// What is kept over a reset.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Kept {
    /// What the program was doing.
    pub phase: Phase,
    /// Ends in a row, without a good start between.
    pub in_a_row: u8,
    /// The last end since power came.
    pub incident: Option<Incident>,
}

impl Kept {
    /// At a start: what is to be kept from now on. `before` is what was kept, if anything was, and `samples` what the
    /// program had counted.
    #[must_use]
    pub fn next(before: Option<Self>, reset: Reset, samples: u32) -> Self {
        let Some(Self { phase, in_a_row, incident }) = before else { return Self::default() };
        let happened = match phase {
            Phase::Ended => incident.clone(),
            Phase::Running if reset.watchdog => Some(Incident::new(Cause::Watchdog, samples)),
            Phase::Running if reset.brown_out => Some(Incident::new(Cause::SupplyDip, samples)),
            Phase::Running => None,
        };
        let in_a_row = if happened.is_some() { in_a_row.saturating_add(1) } else { 0 };
        Self { phase: Phase::Running, in_a_row, incident: happened.or(incident) }
    }

    /// The program comes to an end.
    #[must_use]
    pub fn ended(self, incident: Incident) -> Self {
        Self { phase: Phase::Ended, incident: Some(incident), ..self }
    }

    /// Whether too many ends in a row have gone before.
    pub fn holds_back(&self) -> bool {
        self.in_a_row >= IN_A_ROW
    }

    /// As words with a check.
    pub fn to_words(&self) -> [u32; WORDS] {
        let phase = match self.phase {
            Phase::Running => 0,
            Phase::Ended => 1,
        };
        let none = Incident { cause: Cause::Panic, ..Incident::new(Cause::Panic, 0) };
        let incident = self.incident.as_ref().unwrap_or(&none);
        let cause = self.incident.as_ref().map_or(0, |incident| incident.cause as u32);
        let mut place = [0; MAX_PLACE];
        place.iter_mut().zip(incident.place.bytes()).for_each(|(to, from)| *to = from);
        let [a, b, c, d, e, f] = words(place);
        let [status, more] = incident.status;
        let head = phase | u32::from(self.in_a_row) << 8 | cause << 16;
        let mut words = [MAGIC, head, incident.at, incident.from, status, more, incident.samples, a, b, c, d, e, f, 0];
        let check = check(&words);
        if let Some(last) = words.last_mut() {
            *last = check;
        }
        words
    }

    /// From words, unless they are arbitrary.
    pub fn from_words(words: [u32; WORDS]) -> Option<Self> {
        let [magic, head, at, from, status, more, samples, a, b, c, d, e, f, sum] = words;
        if magic != MAGIC || sum != check(&words) {
            return None;
        }
        let mut place = Place::new();
        let letters = [a, b, c, d, e, f].into_iter().flat_map(u32::to_le_bytes);
        letters.take_while(|&byte| byte != 0).for_each(|byte| {
            let _ = place.push(byte.into());
        });
        let cause = Cause::ALL.into_iter().find(|&cause| cause as u32 == head >> 16);
        let incident = cause.map(|cause| Incident { cause, at, from, status: [status, more], samples, place });
        let phase = if head & 0xFF == 0 { Phase::Running } else { Phase::Ended };
        Some(Self { phase, in_a_row: (head >> 8) as u8, incident })
    }
}

fn words(bytes: [u8; MAX_PLACE]) -> [u32; MAX_PLACE / 4] {
    let mut words = [0; MAX_PLACE / 4];
    words.iter_mut().zip(bytes.as_chunks().0).for_each(|(word, bytes)| *word = u32::from_le_bytes(*bytes));
    words
}

/// Of all but the last.
fn check(words: &[u32; WORDS]) -> u32 {
    let mut digest = CRC.digest();
    words.iter().take(WORDS - 1).for_each(|word| digest.update(&word.to_le_bytes()));
    digest.finalize()
}
