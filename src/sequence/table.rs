//! The table of states and events, which docs/sequence.md shows; a test compares both.

/// Why a run has been stopped, or why none may begin. Numbers are never used again for anything else.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum Stop {
    /// The processor has started.
    Power = 0,
    /// The emergency stop is open, or its wire.
    EmergencyStop = 1,
    /// The hardware has cut the supply because the current left its limits.
    OverCurrent = 2,
    /// The rotor is faster than allowed.
    OverSpeed = 3,
    /// Samples were missing: nobody has watched the motor meanwhile.
    Sampling = 4,
    /// ABORT is open, or its wire, or the host has asked for it.
    Abort = 5,
    /// There is voltage and the rotor does not turn, or its speed is not measured.
    StuckRotor = 6,
    /// The run has not come to its end in time.
    TimeOut = 7,
}

impl Stop {
    /// All of them, by their numbers; where several come with one sample, the one that stands first counts.
    pub const ALL: [Self; 8] = [
        Self::Power,
        Self::EmergencyStop,
        Self::OverCurrent,
        Self::OverSpeed,
        Self::Sampling,
        Self::Abort,
        Self::StuckRotor,
        Self::TimeOut,
    ];

    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Power => "the processor has started",
            Self::EmergencyStop => "the emergency stop is open",
            Self::OverCurrent => "over-current",
            Self::OverSpeed => "overspeed",
            Self::Sampling => "samples were missing",
            Self::Abort => "aborted",
            Self::StuckRotor => "the rotor does not turn",
            Self::TimeOut => "time-out",
        }
    }
}

/// What the station does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum State {
    /// The supply is off and stays so until this is acknowledged.
    Stopped(Stop),
    /// The supply is off; a run may begin.
    Idle,
    /// The profile runs.
    Running,
    /// The supply is off; the last periods are judged, and the rotor comes to rest.
    Settling,
    /// The supply is off; the motor has passed.
    Passed,
    /// The supply is off; the motor has failed.
    Failed,
    /// The supply is off; there is no verdict.
    Unjudged,
}

impl State {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::Stopped(Stop::Power),
        Self::Stopped(Stop::EmergencyStop),
        Self::Stopped(Stop::OverCurrent),
        Self::Stopped(Stop::OverSpeed),
        Self::Stopped(Stop::Sampling),
        Self::Stopped(Stop::Abort),
        Self::Stopped(Stop::StuckRotor),
        Self::Stopped(Stop::TimeOut),
        Self::Idle,
        Self::Running,
        Self::Settling,
        Self::Passed,
        Self::Failed,
        Self::Unjudged,
    ];

    /// In one word.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stopped(_) => "stopped",
            Self::Idle => "idle",
            Self::Running => "running",
            Self::Settling => "settling",
            Self::Passed => "passed",
            Self::Failed => "failed",
            Self::Unjudged => "unjudged",
        }
    }

    /// Whether a run is under way.
    #[inline]
    pub const fn is_busy(self) -> bool {
        matches!(self, Self::Running | Self::Settling)
    }

    /// As a number.
    #[inline]
    pub const fn code(self) -> u8 {
        match self {
            Self::Stopped(stop) => stop as u8,
            Self::Idle => 8,
            Self::Running => 9,
            Self::Settling => 10,
            Self::Passed => 11,
            Self::Failed => 12,
            Self::Unjudged => 13,
        }
    }

    /// From a number; one that is none is a station that has just started.
    pub fn from_code(code: u8) -> Self {
        Self::ALL.get(usize::from(code)).copied().unwrap_or(Self::Stopped(Stop::Power))
    }
}

/// What happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// Something is wrong.
    Stop(Stop),
    /// Somebody has seen why the station stands, or how the run ended.
    Acknowledge,
    /// A run is asked for.
    Start,
    /// The profile is over.
    ProfileEnded,
    /// The rotor is at rest, and the motor passes.
    Passes,
    /// The rotor is at rest, and the motor fails.
    Fails,
    /// The rotor is at rest, and there is no verdict.
    CannotJudge,
}

impl Event {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::Stop(Stop::Power),
        Self::Stop(Stop::EmergencyStop),
        Self::Stop(Stop::OverCurrent),
        Self::Stop(Stop::OverSpeed),
        Self::Stop(Stop::Sampling),
        Self::Stop(Stop::Abort),
        Self::Stop(Stop::StuckRotor),
        Self::Stop(Stop::TimeOut),
        Self::Acknowledge,
        Self::Start,
        Self::ProfileEnded,
        Self::Passes,
        Self::Fails,
        Self::CannotJudge,
    ];

    /// As the table in docs/sequence.md calls it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stop(_) => "stop",
            Self::Acknowledge => "acknowledge",
            Self::Start => "start",
            Self::ProfileEnded => "profile ended",
            Self::Passes => "passes",
            Self::Fails => "fails",
            Self::CannotJudge => "cannot judge",
        }
    }
}

/// The table: the state after an event. What stopped the station first stays the reason.
#[inline]
pub const fn next(state: State, event: Event) -> State {
    match (state, event) {
        (State::Stopped(first), Event::Stop(_)) => State::Stopped(first),
        (_, Event::Stop(stop)) => State::Stopped(stop),
        (State::Stopped(_) | State::Passed | State::Failed | State::Unjudged, Event::Acknowledge) => State::Idle,
        (State::Idle | State::Passed | State::Failed | State::Unjudged, Event::Start) => State::Running,
        (State::Running, Event::ProfileEnded) => State::Settling,
        (State::Settling, Event::Passes) => State::Passed,
        (State::Settling, Event::Fails) => State::Failed,
        (State::Settling, Event::CannotJudge) => State::Unjudged,
        (state, _) => state,
    }
}
