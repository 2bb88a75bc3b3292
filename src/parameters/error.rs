//! What can be wrong with parameters.

use core::fmt;

use super::tag::Tag;
use crate::anfis;
use crate::butterworth::SettingsError;
use crate::detector;
use crate::effects::EffectId;
use crate::motor::ParameterError;
use crate::sequence;
use crate::term::TermError;
use crate::units::CalibrationError;

/// Why settings cannot be used or a payload not be read; the first reason found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Error {
    /// More than a block may hold.
    TooLong,
    /// The payload ends within a section.
    Truncated,
    /// A section of this tag and version is not known here.
    Unsupported {
        /// The tag's number.
        tag: u8,
        /// Version of the section.
        version: u8,
    },
    /// The bytes of a section are not what its version says.
    Malformed(Tag),
    /// A section is there twice.
    Repeated(Tag),
    /// A section that every block has is not there.
    Missing(Tag),
    /// A section that belongs into a block of the other kind, of a motor's parameters or of the rig.
    Elsewhere(Tag),
    /// A name holds control characters.
    Text(&'static str),
    /// An effect that this program's catalogue does not have, by its place in the block.
    UnknownEffect(usize),
    /// Calibration.
    Calibration(CalibrationError),
    /// Filter and detector are for two sampling rates.
    SampleRate,
    /// Filter.
    Filter(SettingsError),
    /// Base model.
    Motor(ParameterError),
    /// An effect, by its name.
    Effect(EffectId, ParameterError),
    /// A term, by its place in the block.
    Term(usize, TermError),
    /// Learned correction.
    Correction(anfis::SettingsError),
    /// Detector.
    Detector(detector::SettingsError),
    /// A constant of a term is not a finite number.
    Unknowns,
    /// The station's sequence, or the rig's supply.
    Sequence(sequence::SettingsError),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooLong => write!(f, "the parameters are longer than {} bytes", super::block::MAX_PAYLOAD),
            Self::Truncated => write!(f, "the parameters end within a section"),
            Self::Unsupported { tag, version } => {
                write!(f, "section {tag:#04x} in version {version} is not known to this version of greyrig")
            }
            Self::Malformed(tag) => write!(f, "the section {} is not as its version says", tag.name()),
            Self::Repeated(tag) => write!(f, "the section {} is there twice", tag.name()),
            Self::Missing(tag) => write!(f, "the section {} is missing", tag.name()),
            Self::Elsewhere(tag) => write!(f, "the section {} belongs to another block", tag.name()),
            Self::Text(name) => write!(f, "the name of the {name} holds control characters"),
            Self::UnknownEffect(index) => write!(f, "effect {} is not in the catalogue", index + 1),
            Self::Calibration(error) => error.fmt(f),
            Self::SampleRate => write!(f, "filter and detector are for two sampling rates"),
            Self::Filter(error) => write!(f, "filter: {error}"),
            Self::Motor(error) => error.fmt(f),
            Self::Effect(id, error) => write!(f, "effect {id}: {error}"),
            Self::Term(index, error) => write!(f, "term {}: {error}", index + 1),
            Self::Correction(error) => write!(f, "correction: {error}"),
            Self::Detector(error) => write!(f, "detector: {error}"),
            Self::Sequence(error) => write!(f, "sequence: {error}"),
            Self::Unknowns => write!(f, "a constant of a term is not a finite number"),
        }
    }
}

impl core::error::Error for Error {}
