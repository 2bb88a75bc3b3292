//! Faults: a file each. Their parts are those of effects, with a time of onset.

mod bearing_friction;
mod fan_load;
mod resistance_up;
mod sensor_gain;
mod shorted_turns;
mod sparking;

use std::fmt;

use serde::Serialize;

use super::motor::Kind;
use super::parts::Assembly;
use super::{Error, Result, Sizes, number};

/// A fault: what it is, its sizes, and how it gets into the rig.
#[derive(Debug)]
pub struct Fault {
    /// Identifier in commands.
    pub id: &'static str,
    /// What is broken.
    pub what: &'static str,
    /// What its size means.
    pub size: &'static str,
    /// Unit of the size; empty: a ratio.
    pub unit: &'static str,
    /// Sizes for a universal motor; none: it cannot have this fault.
    pub universal: Option<Sizes>,
    /// Sizes for a magnet motor.
    pub pm_dc: Option<Sizes>,
    /// Adds the fault's parts: size, time of onset in seconds.
    pub install: fn(f64, f64, &mut Assembly),
}

/// All faults.
pub static FAULTS: &[Fault] = &[
    resistance_up::FAULT,
    sparking::FAULT,
    shorted_turns::FAULT,
    bearing_friction::FAULT,
    fan_load::FAULT,
    sensor_gain::CURRENT,
    sensor_gain::SPEED,
];

impl Fault {
    /// Its sizes for a kind of motor.
    pub const fn sizes(&self, kind: Kind) -> Option<Sizes> {
        match kind {
            Kind::Universal => self.universal,
            Kind::PmDc => self.pm_dc,
        }
    }
}

/// A fault with its size and its time of onset.
#[derive(Debug, Clone, Serialize)]
pub struct ChosenFault {
    /// Which one.
    #[serde(rename = "id", serialize_with = "only_id")]
    pub fault: &'static Fault,
    /// How large, in the fault's unit.
    pub size: f64,
    /// From when on, s.
    pub onset_s: f64,
}

impl PartialEq for ChosenFault {
    fn eq(&self, other: &Self) -> bool {
        self.fault.id == other.fault.id && self.size == other.size && self.onset_s == other.onset_s
    }
}

fn only_id<S: serde::Serializer>(fault: &&'static Fault, to: S) -> std::result::Result<S::Ok, S::Error> {
    to.serialize_str(fault.id)
}

impl ChosenFault {
    /// Reads `ID[=SIZE][@T]`.
    ///
    /// # Errors
    /// Unknown names, sizes out of range, a time before the run.
    pub fn parse(text: &str, kind: Kind) -> Result<Self> {
        let (rest, onset) = match text.split_once('@') {
            Some((rest, onset)) => (rest, Some(number(onset, text)?)),
            None => (text, None),
        };
        let (id, size) = match rest.split_once('=') {
            Some((id, size)) => (id, Some(number(size, text)?)),
            None => (rest, None),
        };
        let fault = FAULTS
            .iter()
            .find(|f| f.id == id)
            .ok_or_else(|| Error::unknown("fault", id, FAULTS.iter().map(|f| f.id), "known are"))?;
        let size = Sizes::choose(fault.sizes(kind), id, fault.unit, kind, size)?;
        let onset_s = onset.unwrap_or(0.0);
        if onset_s < 0.0 {
            return Err(super::Error::usage(
                format!("{text} would begin before the run"),
                "give the time of onset in seconds from the begin of the run, such as @5",
            ));
        }
        Ok(Self { fault, size, onset_s })
    }
}

impl fmt::Display for ChosenFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}@{}", self.fault.id, self.size, self.onset_s)
    }
}
