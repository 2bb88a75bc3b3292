//! Kind of motor and friction terms of the base model.

use std::fmt;

use greyrig::motor::{BaseParameter, FluxLaw};
use serde::{Deserialize, Serialize};

use crate::recording::Recording;

/// Kind of motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Series motor for AC and DC: flux proportional to the current.
    #[default]
    Universal,
    /// Permanent-magnet DC motor: constant flux.
    PmDc,
}

impl Kind {
    /// The name used in commands and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Universal => "universal",
            Self::PmDc => "pm-dc",
        }
    }

    /// The kind of motor that was given, or else that which the recordings tell as their `motor`, or else the usual
    /// one.
    pub fn of(given: Option<Self>, recordings: &[Recording]) -> Self {
        let told = |r: &Recording| <Self as clap::ValueEnum>::from_str(r.metadata().get("motor")?, false).ok();
        given.or_else(|| recordings.iter().find_map(told)).unwrap_or_default()
    }

    /// The core's flux law.
    pub fn flux_law(self) -> FluxLaw {
        match self {
            Self::Universal => FluxLaw::Series,
            Self::PmDc => FluxLaw::PermanentMagnet,
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Which friction terms the base model has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Base {
    /// Dry, viscous and turbulent friction: mu0, mu1, mu2.
    Full,
    /// Dry and viscous friction: mu0, mu1.
    DryViscous,
    /// Viscous friction alone: mu1.
    Viscous,
    /// Dry friction alone: mu0.
    Dry,
    /// No friction.
    Frictionless,
}

impl Base {
    /// The base that a kind of motor starts from: a fan's motor needs the turbulent term, a servo motor has no fan.
    pub fn usual(kind: Kind) -> Self {
        match kind {
            Kind::Universal => Self::Full,
            Kind::PmDc => Self::DryViscous,
        }
    }

    /// Whether the base has a friction term; all other parameters are always there.
    pub fn has(self, parameter: BaseParameter) -> bool {
        match parameter {
            BaseParameter::Mu0 => matches!(self, Self::Full | Self::DryViscous | Self::Dry),
            BaseParameter::Mu1 => matches!(self, Self::Full | Self::DryViscous | Self::Viscous),
            BaseParameter::Mu2 => matches!(self, Self::Full),
            _ => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::recording::Channel;

    #[test]
    fn a_recording_may_tell_its_kind_of_motor() {
        let of = |motor: &str| {
            let metadata = BTreeMap::from([("motor".to_owned(), motor.to_owned())]);
            [Recording::builder(1e-3).channel(Channel::Voltage, vec![0.0, 1.0]).metadata(metadata).build().unwrap()]
        };
        assert_eq!(Kind::of(None, &of("pm-dc")), Kind::PmDc);
        assert_eq!(Kind::of(Some(Kind::Universal), &of("pm-dc")), Kind::Universal);
        assert_eq!(Kind::of(None, &of("VR-200")), Kind::Universal);
    }
}
