//! What belongs to a rig and not to a motor type: a block of its own, written by its own command, which whoever writes
//! a motor's parameters leaves as it is.
//!
//! It stands in two slots of its own ([`Hardware::rig`](crate::hardware::Hardware::rig)), with the same
//! [header](super::block) and the same kind of [sections](super::section). Blocks of a motor type as they were before
//! hold a calibration and a name of the rig, too; they count where the rig has no block of its own.

use serde::{Deserialize, Serialize};

use super::encoding::{Sections, Writer, text, whole};
use super::tag::Tag;
use super::{Error, Text};
use crate::sequence::Supply;
use crate::units::CalibrationSettings;

/// Longest payload of a rig's block, bytes: that of a message of the link.
pub const MAX_RIG: usize = 256;

/// What belongs to a rig. By default no name and the usual ranges.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Rig {
    /// Its serial number or name.
    pub name: Text,
    /// Straight lines from counts to V, A and rad/s.
    pub calibration: CalibrationSettings,
    /// The supply that it commands; none where somebody else switches the motor.
    pub supply: Option<Supply>,
}

#[derive(Serialize, Deserialize)]
struct Entry<'a> {
    name: &'a str,
}

impl Rig {
    /// Checks name, calibration and supply.
    ///
    /// # Errors
    /// A control character in the name, a scale or a supply that no rig has.
    pub fn validate(&self) -> Result<(), Error> {
        if self.name.chars().any(char::is_control) {
            return Err(Error::Text("rig"));
        }
        if let Some(supply) = &self.supply {
            supply.validate().map_err(Error::Sequence)?;
        }
        self.calibration.build().map(|_| ()).map_err(Error::Calibration)
    }

    /// Writes the payload, and gives the used part.
    ///
    /// # Errors
    /// None that a rig could cause: the longest one fits.
    pub fn encode<'b>(&self, payload: &'b mut [u8; MAX_RIG]) -> Result<&'b [u8], Error> {
        let mut out = Writer::new(payload);
        out.section(Tag::Rig, &Entry { name: &self.name })?;
        out.section(Tag::Calibration, &self.calibration)?;
        if let Some(supply) = &self.supply {
            out.section(Tag::Supply, supply)?;
        }
        out.used()
    }

    /// Reads a payload and checks every value.
    ///
    /// # Errors
    /// The first section or value that cannot be used.
    pub fn decode(payload: &[u8]) -> Result<Self, Error> {
        let (mut name, mut calibration, mut supply) = (None, None, None);
        let mut sections = Sections::new(payload);
        while let Some((tag, body)) = sections.next()? {
            match tag {
                Tag::Rig => name = Some(text(tag, whole::<Entry>(tag, body)?.name)?),
                Tag::Calibration => calibration = Some(whole(tag, body)?),
                Tag::Supply => supply = Some(whole(tag, body)?),
                other => return Err(Error::Elsewhere(other)),
            }
        }
        let rig = Self {
            name: name.ok_or(Error::Missing(Tag::Rig))?,
            calibration: calibration.ok_or(Error::Missing(Tag::Calibration))?,
            supply,
        };
        rig.validate()?;
        Ok(rig)
    }
}
