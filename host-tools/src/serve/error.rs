//! Why a page's wish is not fulfilled.

use axum::http::StatusCode;
use greyrig::effects::EffectId;

/// Why a page's wish is not fulfilled.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A task is under way: its name.
    #[error("{0} has not ended; wait until it has")]
    Busy(String),
    /// Nothing is under way.
    #[error("there is nothing to stop; it has ended")]
    NothingToStop,
    /// There is no recording to work on.
    #[error("there is no recording; add one")]
    NoRecording,
    /// What was found about a recording makes every answer meaningless: its name, and what was found.
    #[error("{0}: the recording: {1}")]
    Stopped(String, String),
    /// There is no model to work on.
    #[error("there is no model; identify one first")]
    NoModel,
    /// There is no recording at this place.
    #[error("there is no recording {0}; reload the page")]
    NoRecordingAt(usize),
    /// There is no version of this number.
    #[error("there is no version {0}; reload the page")]
    NoVersion(usize),
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
    /// A request with this in the place of a number.
    #[error("{0:?} is no number; reload the page")]
    NoNumber(String),
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
            Self::Busy(_) | Self::NothingToStop => StatusCode::CONFLICT,
            Self::NoVersion(_) | Self::NoRecordingAt(_) => StatusCode::NOT_FOUND,
            Self::Panicked => StatusCode::INTERNAL_SERVER_ERROR,
            _ => StatusCode::BAD_REQUEST,
        }
    }
}
