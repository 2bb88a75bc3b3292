//! Why a page's wish is not fulfilled.

use axum::http::StatusCode;
use greyrig::effects::EffectId;

/// Why a page's wish is not fulfilled.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A task is under way: its name.
    #[error("{0} has not ended; wait until it has, or stop it")]
    Busy(String),
    /// Nothing is under way.
    #[error("there is nothing to stop; it has ended")]
    NothingToStop,
    /// There is no recording to work on.
    #[error("there is no recording to work on; add one, or give one a role")]
    NoRecording,
    /// What was found about a recording makes every answer meaningless: its name, and what was found.
    #[error("{0}: the recording: {1}")]
    Stopped(String, String),
    /// There is no model to work on.
    #[error("there is no model; identify one first")]
    NoModel,
    /// There is nothing to judge motors by.
    #[error("there are no limits to judge by; open a station file, or learn them from recordings of healthy motors")]
    NoStation,
    /// Nothing has been judged.
    #[error("no motor has been judged yet")]
    NotJudged,
    /// The version has no plan.
    #[error("there is no plan for version {0}; make one first")]
    NoPlan(u32),
    /// The version has learnt nothing.
    #[error("version {0} has learnt nothing here; train one")]
    NothingLearnt(u32),
    /// There is no recording of this number.
    #[error("there is no recording {0}; reload the page")]
    NoRecordingAt(u32),
    /// A project that has recordings already.
    #[error("the project has recordings; begin another one for the built-in motor")]
    NotEmpty,
    /// There is no version of this number.
    #[error("there is no version {0}; reload the page")]
    NoVersion(u32),
    /// A version that others were made from.
    #[error("other versions were made from this one; remove those first")]
    HasFollowers,
    /// The candidate has not been simulated.
    #[error("the model with {0} has not been computed yet")]
    NotYet(EffectId),
    /// The catalogue has no effect of this name.
    #[error("{0:?} is no effect; see greyrig effects")]
    NoEffect(String),
    /// The model has the effect already.
    #[error("the model has {0} already; add another effect")]
    HasAlready(EffectId),
    /// A recording was sent without a name.
    #[error("the file has no name; give it one")]
    NoName,
    /// A request without this value.
    #[error("{0} is missing; reload the page")]
    Missing(&'static str),
    /// A request with this in the place of something else.
    #[error("{0:?} cannot be used here; reload the page")]
    Unknown(String),
    /// A change that does not say what it rests on.
    #[error("a change needs the revision that it rests on; send If-Match")]
    NoRevision,
    /// A change that rests on what is no longer so.
    #[error("the project has changed meanwhile; the page shows it as it is now: try again")]
    Behind,
    /// A file beyond the limit, in bytes.
    #[error("the file is larger than {0} bytes; give its path to greyrig serve instead")]
    TooLarge(u64),
    /// A sender who does not go on.
    #[error("the file did not go on arriving; send it again")]
    TooSlow,
    /// This recording does not hold the signal.
    #[error("this recording does not hold that signal")]
    NoSignal,
    /// A stretch of time that holds too few samples for a spectrum.
    #[error("too few samples, or none but gaps; show a longer stretch of time")]
    TooShort,
    /// A rotor that stands has no orders.
    #[error("the rotor does not turn there; show another stretch of time")]
    NeverTurns,
    /// The work has panicked.
    #[error("this has failed within greyrig; report it as a bug")]
    Panicked,
    /// The work has failed.
    #[error(transparent)]
    Work(#[from] crate::error::Error),
}

/// A result with that.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// How HTTP names it.
    pub fn status(&self) -> StatusCode {
        match self {
            Self::Busy(_) | Self::NothingToStop | Self::HasFollowers => StatusCode::CONFLICT,
            Self::NoVersion(_)
            | Self::NoRecordingAt(_)
            | Self::NotYet(_)
            | Self::NoSignal
            | Self::NotJudged
            | Self::NoPlan(_)
            | Self::NothingLearnt(_) => StatusCode::NOT_FOUND,
            Self::NoRevision => StatusCode::PRECONDITION_REQUIRED,
            Self::Behind => StatusCode::PRECONDITION_FAILED,
            Self::TooLarge(_) => StatusCode::PAYLOAD_TOO_LARGE,
            Self::TooSlow => StatusCode::REQUEST_TIMEOUT,
            Self::Panicked => StatusCode::INTERNAL_SERVER_ERROR,
            _ => StatusCode::BAD_REQUEST,
        }
    }
}
