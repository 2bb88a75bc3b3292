//! What host and microcontroller say to each other.
//!
//! The encoding is postcard's; the order of fields and variants is part of it. A change that an older partner would
//! misread raises [`PROTOCOL`]; only new variants at the end of an enumeration do not.

use serde::{Deserialize, Serialize};

use crate::detector::{Period, Verdict};
use crate::faults::{Fault, TABLE};
use crate::incident::Incident;
use crate::sequence::State;

/// Version of the conversation.
pub const PROTOCOL: u16 = 3;

/// Most bytes of parameters in a message.
pub const CHUNK: usize = 256;

/// What the host asks for. Each may be repeated without harm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Request<'a> {
    /// Who is there?
    Hello,
    /// How is it?
    Status,
    /// Up to [`CHUNK`] bytes of the parameters in force, from an offset.
    ReadParameters {
        /// Offset into the payload, bytes.
        offset: u16,
    },
    /// Bytes of new parameters for the waiting room in RAM; flash is not touched.
    WriteParameters {
        /// Offset into the payload, bytes.
        offset: u16,
        /// At most [`CHUNK`] bytes.
        data: &'a [u8],
    },
    /// Check what is in the waiting room and write it to flash. It counts from the next start on.
    CommitParameters {
        /// [`FINGERPRINT`](crate::parameters::FINGERPRINT) of the host.
        fingerprint: u32,
        /// Length of the payload, bytes.
        length: u16,
        /// CRC-32 of the payload.
        crc: u32,
    },
    /// A report every so many samples, or one more where the modelled rotor is turned round with the last.
    StartTelemetry {
        /// 1 … 60,000 samples; less than 5, and less than 10 beside a capture, is more than the
        /// [line carries](crate::link::load) and refused.
        every: u16,
    },
    /// All samples from now on.
    StartCapture,
    /// No more telemetry and samples.
    Stop,
    /// Forget faults and counters.
    ClearFaults,
    /// Start again, with the parameters in flash.
    Restart,
    /// Begin the test of a motor: model, filters and detector as after a start, from the next sample on, and a message
    /// for each period of the mains until [`Request::Stop`]. The number of the test under way begins none, and only
    /// asks for the messages again.
    BeginTest {
        /// Number of the test, chosen by the host; after a start, test 0 is under way.
        test: u32,
    },
    /// The [block of the rig](crate::parameters::rig) in force.
    ReadRig,
    /// Check what is in the waiting room and write it to flash as the rig's block. It counts from the next start on.
    CommitRig {
        /// [`FINGERPRINT`](crate::parameters::FINGERPRINT) of the host.
        fingerprint: u32,
        /// Length of the payload, bytes.
        length: u16,
        /// CRC-32 of the payload.
        crc: u32,
    },
    /// What does the [sequence](crate::sequence) do? A firmware of before knows neither this nor the following.
    RunState,
    /// Begin the next run; the number of the one that is under way or was the last begins none.
    StartRun {
        /// Its number: one more than have [begun](Run::runs).
        run: u32,
    },
    /// Stop the run.
    AbortRun,
    /// What has stopped the station has been seen, or how the last run ended.
    Acknowledge,
}

/// A request with its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Asked<'a> {
    /// Chosen by the host; the reply has the same.
    pub number: u8,
    /// The request.
    #[serde(borrow)]
    pub request: Request<'a>,
}

/// What every version of the conversation answers to [`Request::Hello`] first; what follows may differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Greeting<'a> {
    /// [`PROTOCOL`] of the partner.
    pub protocol: u16,
    /// Its fingerprint of parameters.
    pub fingerprint: u32,
    /// Version of its firmware.
    pub firmware: &'a str,
}

impl<'a> Greeting<'a> {
    /// From a message that is whole but not one of this version.
    pub fn of_another_version(body: &'a [u8]) -> Option<Self> {
        // Message::Reply, the request's number, Reply::Identity.
        let ([0, _, 0], rest) = body.split_first_chunk()? else { return None };
        let (greeting, _) = postcard::take_from_bytes::<Self>(rest).ok()?;
        (greeting.protocol != PROTOCOL).then_some(greeting)
    }
}

/// Who the microcontroller is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Identity<'a> {
    /// [`PROTOCOL`]; this field comes first in every version.
    pub protocol: u16,
    /// [`FINGERPRINT`](crate::parameters::FINGERPRINT).
    pub fingerprint: u32,
    /// Version of the firmware.
    pub firmware: &'a str,
    /// Name of the board.
    pub board: &'a str,
    /// The chip's own number.
    pub chip: [u8; 12],
    /// Samples per second.
    pub sample_rate_hz: u32,
    /// How much later than the voltage current and speed are sampled, s.
    pub skew_s: [f32; 2],
    /// Which image of the firmware it is: the begin of the linker's digest of it.
    pub build: [u8; 8],
}

/// What the firmware does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// There are no parameters to run with: samples can be recorded, the model stands still.
    Safe,
    /// Model and filters run.
    Running,
}

/// The block in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct InForce {
    /// Slot, from 0.
    pub slot: u8,
    /// Sequence number.
    pub sequence: u32,
    /// Length of the payload, bytes.
    pub length: u16,
    /// CRC-32 of the payload.
    pub crc: u32,
}

/// How the microcontroller is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Status {
    /// What it does.
    pub mode: Mode,
    /// The block that it runs with.
    pub in_force: Option<InForce>,
    /// Samples since the start; wraps after five days.
    pub samples: u32,
    /// How often each fault has occurred, in the order of [`TABLE`].
    pub faults: [u32; TABLE.len()],
    /// Cycles of the last tick and of the longest; zero where the processor cannot count them.
    pub cycles: [u32; 2],
    /// Number of the test under way; 0 after a start.
    pub test: u32,
    /// The verdict on it so far: the detector's, but no pass where the measuring chain was not plausible; without
    /// limits it cannot judge.
    pub verdict: Verdict,
    /// Whether the [measuring chain](crate::app::chain) has been plausible since it began.
    pub plausible: bool,
    /// The most that the stack has taken since the start, bytes.
    pub deepest_stack: u32,
    /// The rig's own block.
    pub rig: Option<InForce>,
    /// How the program came to an end last, since power came.
    pub incident: Option<Incident>,
}

/// What the station's sequence does and sees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Its state.
    pub state: State,
    /// Runs that have begun since the start.
    pub runs: u32,
    /// Number of the test under way, which the last run has begun.
    pub test: u32,
    /// Samples since the last run began, until it ended.
    pub elapsed: u32,
    /// Samples of the profile.
    pub length: u32,
    /// The supply's command, 0 to 1.
    pub command: f32,
    /// START is pressed.
    pub start: bool,
    /// The contact of ABORT is closed.
    pub abort_closed: bool,
    /// That of the emergency stop is.
    pub emergency_closed: bool,
    /// The hardware has cut the supply.
    pub tripped: bool,
}

/// A report of a stretch of samples.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Report {
    /// Number of its last sample.
    pub sample: u32,
    /// Samples in it.
    pub count: u16,
    /// RMS of the voltage, V. This and the following RMS values are for display: off by up to 0.2 %.
    pub voltage_rms: f32,
    /// RMS of the measured and filtered current, A.
    pub current_rms: f32,
    /// Mean of the measured and filtered speed, rad/s.
    pub speed: f32,
    /// RMS of the residual of the current, A.
    pub residual_current_rms: f32,
    /// RMS of the residual of the speed, rad/s.
    pub residual_speed_rms: f32,
}

/// What a period of the mains has brought in a test.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    /// Number of the test.
    pub test: u32,
    /// Number of the test's first sample.
    pub first: u32,
    /// Periods before it in the test; a gap to the message before is the number of messages lost.
    pub index: u32,
    /// Number of the sample with which it was judged, [`STEPS`](crate::detector::STEPS) after the first one that
    /// follows it, or up to [`MOST_WAITS`](crate::detector::MOST_WAITS) more.
    pub sample: u32,
    /// What it has brought.
    pub period: Period,
    /// The verdict on the test so far, as in [`Status::verdict`].
    pub verdict: Verdict,
}

/// Consecutive samples of a raw capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Samples<'a> {
    /// Number of the first; a gap to the frame before is the number of samples lost.
    pub first: u32,
    /// How many.
    pub count: u8,
    /// As [`packing`](super::packing) packs them.
    pub packed: &'a [u8],
}

/// Why a request is not granted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// An offset or a length beyond the end.
    Range,
    /// The waiting room holds other bytes than the host thinks.
    OtherBytes,
    /// Another layout of parameters.
    OtherLayout,
    /// A value that cannot be; `greyrig flash` finds the same one.
    Parameters,
    /// Not during a capture.
    Capturing,
    /// Not without parameters.
    NotConfigured,
    /// A fault prevented it.
    Fault(Fault),
    /// Not without the detector's limits.
    NoLimits,
    /// More than the [line carries](crate::link::load).
    Line,
    /// Not without a sequence that the rig can do.
    NoSequence,
    /// Not during a run.
    Running,
    /// Not while the station is stopped: first it has to be acknowledged.
    Stopped,
}

/// What the microcontroller answers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Reply<'a> {
    /// To [`Request::Hello`].
    #[serde(borrow)]
    Identity(Identity<'a>),
    /// To [`Request::Status`].
    Status(Status),
    /// To [`Request::ReadParameters`], empty at the end, and to [`Request::ReadRig`], empty without a block.
    Parameters(&'a [u8]),
    /// To [`Request::CommitParameters`] and [`Request::CommitRig`]: what counts from the next start on.
    Committed(InForce),
    /// To the other requests.
    Done,
    /// It will not be.
    Refused(Refusal),
    /// To [`Request::RunState`].
    Run(Run),
}

/// What comes from the microcontroller.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Message<'a> {
    /// The answer to the request of that number.
    Reply {
        /// The request's number.
        number: u8,
        /// The answer.
        #[serde(borrow)]
        reply: Reply<'a>,
    },
    /// Unasked, after [`Request::StartCapture`].
    #[serde(borrow)]
    Samples(Samples<'a>),
    /// Unasked, after [`Request::StartTelemetry`].
    Report(Report),
    /// Unasked, after [`Request::BeginTest`].
    Judged(Judged),
}
