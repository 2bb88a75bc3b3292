//! Recordings: one run of one motor, uniformly sampled, in SI units.
//!
//! Each file format has a reader of its own below; all of them deliver a table of named columns, and one
//! path ([`load`]) turns a table into a [`Recording`]: names and units are recognised or mapped, time is checked,
//! invalid samples are masked.

pub mod clipping;
pub mod finding;
pub mod mapping;
pub mod names;
pub mod table;
pub mod time_axis;
pub mod units;

mod assemble;
mod read;
mod write;

#[cfg(feature = "arrow")]
mod arrow;
mod hdf5;
mod mat;
mod mdf;
mod npz;
#[cfg(feature = "parquet")]
mod parquet;
mod tdms;
mod text;
mod wav;

use std::collections::BTreeMap;
use std::path::PathBuf;

pub use mapping::{MapArgs, Mapping};
pub use read::{load, load_all};
pub use write::write;

use read::{looks_like, too_large};

/// A measured quantity that the models know. The discriminant is the order of the columns in files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    /// Supply voltage at the motor's terminals, V (`u_v`).
    Voltage,
    /// Current, A (`i_a`).
    Current,
    /// Speed, rad/s, or m/s of a linear drive (`omega_rad_s`).
    Speed,
    /// Position, rad or m (`angle_rad`); stands in for the speed.
    Angle,
    /// Torque, N m, or force, N (`torque_n_m`); stands in for K i.
    Torque,
}

impl Channel {
    /// All channels, in the order of the columns of a file.
    pub const ALL: [Self; 5] = [Self::Voltage, Self::Current, Self::Speed, Self::Angle, Self::Torque];

    /// The column name of the interface.
    pub const fn column(self) -> &'static str {
        match self {
            Self::Voltage => "u_v",
            Self::Current => "i_a",
            Self::Speed => "omega_rad_s",
            Self::Angle => "angle_rad",
            Self::Torque => "torque_n_m",
        }
    }

    /// The SI unit of its values.
    pub const fn unit(self, motion: Motion) -> &'static str {
        match (self, motion) {
            (Self::Voltage, _) => "V",
            (Self::Current, _) => "A",
            (Self::Speed, Motion::Rotary) => "rad/s",
            (Self::Speed, Motion::Linear) => "m/s",
            (Self::Angle, Motion::Rotary) => "rad",
            (Self::Angle, Motion::Linear) => "m",
            (Self::Torque, Motion::Rotary) => "N m",
            (Self::Torque, Motion::Linear) => "N",
        }
    }
}

/// Whether the drive turns or slides; decides on the units that are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Motion {
    /// rad, rad/s, N m, kg m².
    #[default]
    Rotary,
    /// m, m/s, N, kg.
    Linear,
}

/// A further column that is carried along, in the units of its file.
#[derive(Debug, Clone, PartialEq)]
pub struct Extra {
    /// Its name in the file.
    pub name: String,
    /// One value per sample.
    pub values: Vec<f64>,
}

/// One run of one motor. All columns have the same length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// Where it came from, as the user named it.
    pub path: PathBuf,
    /// SHA-256 of the file, in hexadecimal; empty for data that were never in a file.
    pub sha256: String,
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Sampling interval, s.
    pub sample_time_s: f64,
    /// The measured channels, in SI units.
    pub channels: BTreeMap<Channel, Vec<f64>>,
    /// Rotary or linear.
    pub motion: Motion,
    /// Samples that may be used (false: missing, clipped or marked invalid in the file).
    pub valid: Vec<bool>,
    /// Samples at which the rotor is held (speed imposed as zero); empty: never.
    pub rotor_locked: Vec<bool>,
    /// Samples at which the supply is open (current zero, the voltage is what the terminals show); empty: never.
    pub supply_open: Vec<bool>,
    /// Columns that the models do not use.
    pub extras: Vec<Extra>,
    /// `# key: value` lines and their like.
    pub metadata: BTreeMap<String, String>,
    /// What the user should know about these data (clipping, gaps …), in words.
    pub warnings: Vec<String>,
}

impl Recording {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.valid.len()
    }
    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.valid.is_empty()
    }
    /// A channel's samples, if the recording has it.
    pub fn channel(&self, channel: Channel) -> Option<&[f64]> {
        self.channels.get(&channel).map(Vec::as_slice)
    }
    /// A stretch of samples as a recording of its own.
    pub fn part(&self, range: std::ops::Range<usize>) -> Self {
        let flags = |flags: &Vec<bool>| if flags.is_empty() { Vec::new() } else { flags[range.clone()].to_vec() };
        Self {
            start_s: self.start_s + range.start as f64 * self.sample_time_s,
            channels: self.channels.iter().map(|(c, values)| (*c, values[range.clone()].to_vec())).collect(),
            valid: self.valid[range.clone()].to_vec(),
            rotor_locked: flags(&self.rotor_locked),
            supply_open: flags(&self.supply_open),
            extras: self
                .extras
                .iter()
                .map(|e| Extra { name: e.name.clone(), values: e.values[range.clone()].to_vec() })
                .collect(),
            path: self.path.clone(),
            sha256: self.sha256.clone(),
            sample_time_s: self.sample_time_s,
            motion: self.motion,
            metadata: self.metadata.clone(),
            warnings: self.warnings.clone(),
        }
    }
    /// Duration, s.
    pub fn duration_s(&self) -> f64 {
        self.len() as f64 * self.sample_time_s
    }
}
