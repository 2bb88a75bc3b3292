//! The station's sequence: what runs a motor through a profile of volts over seconds, stops it when something is wrong,
//! and says whether it has passed. A state machine without pins and timers: what is seen goes in, a command of the
//! supply comes out, once a sample, and time is counted in samples.
//!
//! ```text
//! Settings, Supply ─ build ─► Sequence
//! Seen (contacts, trip, speed, wishes, verdict) ─► events ─► table ─► State ─► Command (closed, fraction)
//! ```
//! [`table`] is the machine's table of states and events, and as a page docs/sequence.md. [`contact`] watches switches,
//! [`profile`] is the voltage, [`guard`] the limits of speed and time, [`Sequence`] all of it together.
//!
//! # What holds
//! - The command is zero and the contactor open but in [`State::Running`].
//! - Every [`Stop`] leads to [`State::Stopped`] out of every state, with the sample in which it is noticed, and stays
//!   until it is acknowledged; it cannot be while its cause lasts.
//! - [`State::Passed`] comes only after a whole profile, a rotor at rest, and a verdict that is a pass.
//! - After power comes nothing moves until somebody has acknowledged that.
//!
//! # What it is not
//! A safety device. The emergency stop opens the supply by itself, the over-current trip is hardware, and both act
//! while the program hangs; here they are only heard of.

pub mod contact;
pub mod guard;
pub mod profile;
mod run;
mod settings;
pub mod table;

pub use profile::{MAX_SEGMENTS, Segment, Supplied, Wave};
pub use run::{Command, Contacts, Seen, Sequence, Wishes};
pub use settings::{Settings, SettingsError, Stuck, Supply};
pub use table::{Event, State, Stop};
