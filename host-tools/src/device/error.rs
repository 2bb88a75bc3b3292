//! What can go wrong between the host and the microcontroller.

use std::io;
use std::path::PathBuf;

use greyrig::faults::{Description, TABLE};
use greyrig::link::message::{PROTOCOL, Refusal};
use greyrig::parameters::{self, FINGERPRINT};
use greyrig::units::CalibrationError;

use super::line;
use crate::context::Interrupted;
use crate::recording::InvalidRecording;

/// What can go wrong between the host and the microcontroller.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The port cannot be opened.
    #[error("the port {port} cannot be opened: {source}")]
    Closed {
        /// Its name.
        port: String,
        /// The system's own words.
        source: io::Error,
    },
    /// The system does not tell which ports there are.
    #[error("the system does not list its serial ports: {0}")]
    NoList(io::Error),
    /// The port was open, and is no longer.
    #[error("the link over {port} has broken: {source}")]
    Broken {
        /// Its name.
        port: String,
        /// The system's own words.
        source: io::Error,
    },
    /// Nobody answers on this port.
    #[error("nobody answers on {0}")]
    Silent(String),
    /// The firmware speaks another version of the link.
    #[error("the firmware {firmware} speaks version {protocol} of the link, this greyrig version {PROTOCOL}")]
    Protocol {
        /// Its own version.
        firmware: String,
        /// That of the link.
        protocol: u16,
    },
    /// The firmware lays parameters out differently.
    #[error(
        "the firmware {firmware} lays parameters out differently ({fingerprint:08x}, this greyrig {FINGERPRINT:08x})"
    )]
    Layout {
        /// Its version.
        firmware: String,
        /// Of its layout.
        fingerprint: u32,
    },
    /// An answer that fits no question.
    #[error("the answer belongs to another question")]
    OtherQuestion,
    /// The microcontroller refuses.
    #[error("{}", refused(*.0).0)]
    Refused(Refusal),
    /// A request does not fit into a frame.
    #[error("a request is longer than a frame")]
    TooLong,
    /// Another microcontroller has taken the place of the first one.
    #[error("another microcontroller answers on {port} ({now}, before {before})")]
    OtherChip {
        /// The port.
        port: String,
        /// Its number.
        now: String,
        /// That of the first one.
        before: String,
    },
    /// The microcontroller has lost what it did.
    #[error("the microcontroller has restarted during the {0}")]
    Restarted(Work),
    /// What was written is not what runs.
    #[error("the microcontroller does not run with the parameters that were written")]
    NotTaken,
    /// The rig's own block is of another kind.
    #[error("the rig's calibration cannot be read: {0}")]
    UnreadableRig(parameters::Error),
    /// A capture without samples.
    #[error("no samples come")]
    NoSamples,
    /// A test without a message.
    #[error("nothing comes")]
    NothingComes,
    /// A test without a period.
    #[error("no period of the mains has come")]
    NoPeriod,
    /// Somebody else has begun a test.
    #[error("another test has been begun meanwhile")]
    OtherTest,
    /// A calibration that cannot be.
    #[error("{0}")]
    Calibration(#[from] CalibrationError),
    /// Samples that make no recording.
    #[error(transparent)]
    NoRecording(#[from] InvalidRecording),
    /// A board's clock that cannot be read.
    #[error("the board's clock {}: {source}", .file.display())]
    NoClock {
        /// Its file.
        file: PathBuf,
        /// The system's own words.
        source: io::Error,
    },
    /// A board's clock that shows no time.
    #[error("the board's clock {}: it holds no number of microseconds", .0.display())]
    NoTime(PathBuf),
    /// A board's clock that does not move, for so many seconds.
    #[error("the board's clock {} has stood still for {seconds} s", .file.display())]
    Standstill {
        /// Its file.
        file: PathBuf,
        /// In real time, s.
        seconds: u64,
    },
    /// No debug probe is connected.
    #[error("no debug probe was found")]
    NoProbe,
    /// The debug probe's own words.
    #[error("{0}")]
    Probe(String),
    /// A run was asked for, and did not begin.
    #[error("the run did not begin")]
    NotStarted,
    /// Another run is under way, or the board has restarted.
    #[error("another run is under way, or the microcontroller has restarted")]
    OtherRun,
    /// The work is to stop.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

/// What a microcontroller does for a while.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Work {
    /// It sends its samples.
    Recording,
    /// It judges a motor.
    Test,
}

impl std::fmt::Display for Work {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Recording => "recording",
            Self::Test => "test",
        })
    }
}

/// A result with that.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// What the user can do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Closed { port, source } | Self::Broken { port, source } => line::remedy(port, source),
            Self::NoList(_) => "name the port with --port",
            Self::Silent(_) => {
                "check that the board has power and runs greyrig's firmware, and that no other program uses the port"
            }
            Self::Protocol { .. } => {
                "flash the firmware of this version (`cargo fw-run`), or use the greyrig that belongs to the one on board"
            }
            Self::Layout { .. } => FIRMWARE,
            Self::OtherQuestion => "use the greyrig that belongs to the firmware",
            Self::Refused(why) => refused(*why).1,
            Self::TooLong => "report this as a bug",
            Self::OtherChip { .. } => "connect the first one again",
            Self::Restarted(Work::Recording) => "check its supply, and record again",
            Self::Restarted(Work::Test) => "check its supply, and test the motor again",
            Self::NotTaken => "write them again; if that fails, the flash is worn or protected",
            Self::UnreadableRig(_) => "write it again: greyrig rig --port PORT --name NAME --calibration RIG.toml",
            Self::NoSamples | Self::NothingComes => "check that the sampling runs: its fault counters say more",
            Self::NoPeriod => "check that the sampling runs",
            Self::OtherTest => "connect one program only to the port",
            Self::Calibration(_) => "write the parameters again",
            Self::NoRecording(_) => "check the supply and the wiring, and record again",
            Self::NoClock { .. } | Self::NoTime(_) => {
                "check that the board runs, and that it was started with the same --clock"
            }
            Self::Standstill { .. } => "check that the board still runs",
            Self::NotStarted => "see what the station does: greyrig run --state",
            Self::OtherRun => "see what the station does: greyrig run --state; connect one program only to the port",
            Self::NoProbe => "connect one, and check that you may use it (udev rules on Linux)",
            Self::Probe(_) => "check the probe, the cable and the name of the chip",
            Self::Interrupted(_) => "",
        }
    }
}

impl From<Error> for crate::error::Error {
    fn from(error: Error) -> Self {
        match error {
            Error::Interrupted(_) => Self::Interrupted,
            error => Self::link(error.to_string(), error.remedy()),
        }
    }
}

const FIRMWARE: &str = "flash the firmware of this version (`cargo fw-run`)";

/// Why the microcontroller refuses, and what to do about it.
fn refused(why: Refusal) -> (&'static str, &'static str) {
    let known = |d: &Description| (d.what, d.remedy);
    match why {
        Refusal::Range | Refusal::OtherBytes => ("the parameters did not arrive as they were sent", "try again"),
        Refusal::OtherLayout => ("the firmware lays parameters out differently", FIRMWARE),
        Refusal::Parameters => ("the firmware does not accept the parameters", FIRMWARE),
        Refusal::Capturing => ("the microcontroller is recording", "end the other recording first"),
        Refusal::NotConfigured => ("the microcontroller has no parameters", "write them with `greyrig flash`"),
        Refusal::NoLimits => (
            "the microcontroller's parameters hold no limits of the detector",
            "write a model that has some: greyrig calibrate, then greyrig flash",
        ),
        Refusal::Line => {
            ("the line carries less than what was asked for", "ask for fewer reports, or for no samples beside them")
        }
        Refusal::NoSequence => (
            "the microcontroller has no sequence that its rig can do",
            "greyrig rig --supply says what the rig gives, greyrig flash --sequence what is to be run",
        ),
        Refusal::Running => ("a run is under way", "wait for its end, or abort it: greyrig run --abort"),
        Refusal::Stopped => ("the station is stopped", "look at the rig; then greyrig run --acknowledge"),
        Refusal::Fault(fault) => {
            TABLE.iter().find(|d| d.fault == fault).map_or(("a fault", "see docs/firmware.md"), known)
        }
    }
}
