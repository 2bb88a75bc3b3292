//! The parameters: what the microcontroller needs beside its program, as a block in flash for the motor type, and one
//! for the [rig].
//!
//! ```text
//! model.toml ─► Settings ─ encode ─► payload ─ header ─► block ─► slot A or B of the flash
//!                  ▲                                                      │
//!                  └─────────────── decode, every value checked ◄─────────┘
//! Settings ─ build ─► Active: what the tick runs with, unchecked from there on
//! ```
//!
//! One block, not a store of keys: the values belong together, and a rig that ran half of one model and half of another
//! would be worse than one that stands still. [`block`] says what a block looks like, [`section`] what is in it,
//! [`store`] how it is replaced so that a power cut leaves the old one or the new one.
//!
//! # What is stored
//! The settings of the filter rather than its coefficients: host and microcontroller compute the same bits from them,
//! and settings can be checked against ranges, which coefficients cannot.
//!
//! # Extending
//! A further part of the computation (a learned correction, the thresholds of a detector) is a further section: a tag
//! in [`Tag`], a serialisable type, and an `Option` in [`Settings`]. A program that does not know a section refuses the
//! block, because leaving out a part of the computation silently would change its result.

pub mod block;
mod encoding;
mod error;
pub mod fingerprint;
pub mod rig;
pub mod section;
pub mod store;
mod tag;

pub use error::Error;
pub use fingerprint::FINGERPRINT;
pub use rig::Rig;
pub use tag::Tag;

use crate::anfis::Settings3x3;
use crate::butterworth;
use crate::detector::{self, Detector};
use crate::effects::{Effect, MAX_EFFECTS};
use crate::hardware::Hardware;
use crate::motor::{MAX_TERMS, Motor, Parameters, Stepper};
use crate::sequence::{self, Sequence};
use crate::term::Term;
use crate::tick::Tick;
use crate::units::Calibration;

/// Longest name of a motor type or serial number, bytes of UTF-8.
pub const MAX_TEXT: usize = 32;

/// A name of a motor type or a serial number.
pub type Text = heapless::String<MAX_TEXT>;

/// Everything that is set for a motor type, as the user gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The motor type that the model is of.
    pub motor_type: Text,
    /// The rig that it was written for, in blocks of before. Now a rig has a [block of its own](rig), and here is none.
    pub rig: Option<Rig>,
    /// The filter behind measurement and model. Its sampling rate is that of all the rest.
    pub filter: butterworth::Settings,
    /// The base model.
    pub motor: Parameters<f32>,
    /// Its effects.
    pub effects: heapless::Vec<Effect<f32>, MAX_EFFECTS>,
    /// Its terms of the user's own.
    pub terms: heapless::Vec<Term<f32>, MAX_TERMS>,
    /// Learned correction of the current.
    pub correction: Option<Settings3x3>,
    /// Thresholds of the detector.
    pub detector: Option<detector::Settings>,
    /// Profile and limits of the station's sequence.
    pub sequence: Option<sequence::Settings>,
    /// Who has written the block; none in those of before.
    pub origin: Option<Origin>,
}

/// Who has written a block.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Origin {
    /// Version of greyrig.
    pub greyrig: Text,
    /// The image of the firmware that it was written to; zeros where nobody was asked.
    pub build: [u8; 8],
}

impl Default for Settings {
    /// No name, the usual filter, and a motor that [`Settings::build`] refuses.
    fn default() -> Self {
        Self {
            motor_type: Text::new(),
            rig: None,
            filter: butterworth::Settings::default(),
            motor: Parameters::default(),
            effects: heapless::Vec::new(),
            terms: heapless::Vec::new(),
            correction: None,
            detector: None,
            sequence: None,
            origin: None,
        }
    }
}

/// What the sampling interrupt runs with. In this order, as in [`Tick`].
#[derive(Debug, Clone)]
#[repr(C)]
pub struct Active {
    /// What judges the motor, if it has limits.
    pub detector: Option<Detector>,
    /// Counts to SI units.
    pub calibration: Calibration,
    /// Model and filters, at rest.
    pub tick: Tick,
}

impl Settings {
    /// Whether they are for the sampling rate of a rig.
    pub fn suits(&self, hardware: &Hardware) -> bool {
        self.filter.sample_rate_hz == f64::from(hardware.sample_rate_hz)
    }

    /// Checks every value, by the same rules as the host tool, and makes from them what runs; with the usual
    /// calibration where no rig is given.
    ///
    /// # Errors
    /// The first value that cannot be.
    pub fn build(&self) -> Result<Active, Error> {
        let version = self.origin.as_ref().map_or("", |origin| origin.greyrig.as_str());
        for (name, text) in [("motor type", self.motor_type.as_str()), ("version", version)] {
            if text.chars().any(char::is_control) {
                return Err(Error::Text(name));
            }
        }
        if let Some(sequence) = &self.sequence {
            sequence.validate().map_err(Error::Sequence)?;
        }
        let usual = Rig::default();
        let rig = self.rig.as_ref().unwrap_or(&usual);
        rig.validate()?;
        let calibration = rig.calibration.build().map_err(Error::Calibration)?;
        let filter = self.filter.build().map_err(Error::Filter)?;
        self.motor.validate().map_err(Error::Motor)?;
        for effect in &self.effects {
            effect.validate().map_err(|error| Error::Effect(effect.id(), error))?;
        }
        if self.terms.iter().flat_map(Term::unknowns).any(|value| !value.is_finite()) {
            return Err(Error::Unknowns);
        }
        let motor = Motor::build(self.motor, &self.effects).map_err(Error::Motor)?;
        let motor = motor.with_terms(&self.terms).map_err(Error::Motor)?;
        let sample_rate_hz = self.filter.sample_rate_hz as f32;
        let stepper = Stepper::build(motor, 1.0 / sample_rate_hz).map_err(Error::Motor)?;
        let correction = self.correction.as_ref().map(Settings3x3::build).transpose().map_err(Error::Correction)?;
        if self.detector.is_some_and(|d| d.sample_rate_hz != sample_rate_hz) {
            return Err(Error::SampleRate);
        }
        let detector = self.detector.map(detector::Settings::build).transpose().map_err(Error::Detector)?;
        Ok(Active { calibration, tick: Tick::new(stepper, filter).with_correction(correction), detector })
    }

    /// What runs the station; none without a sequence, or where the rig has no supply that could be commanded.
    ///
    /// # Errors
    /// What the rig cannot do.
    pub fn sequence(&self, hardware: &Hardware) -> Result<Option<Sequence>, Error> {
        let supply = self.rig.as_ref().and_then(|rig| rig.supply);
        let (Some(sequence), Some(rig), Some(supply)) = (&self.sequence, &self.rig, supply) else { return Ok(None) };
        let calibration = rig.calibration.build().map_err(Error::Calibration)?;
        sequence.build(&supply, &calibration, hardware).map(Some).map_err(Error::Sequence)
    }
}
