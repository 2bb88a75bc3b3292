//! The model file: what was identified, in TOML that an engineer can read and edit.
//!
//! ```toml
//! schema = 1
//! kind = "universal"
//! base = "full"
//!
//! [parameters.R]
//! value = 2.2
//! unit = "ohm"
//! ci95 = [2.19, 2.21]
//! ```

mod assignment;
pub mod catalogue;
mod file;
mod fitted;
mod kind;
pub mod lot;
mod units;

use std::collections::BTreeMap;
use std::path::Path;

use greyrig::anfis::{Anfis3x3, Settings3x3};
use greyrig::effects::{Effect, EffectId};
use greyrig::motor::{BaseParameter, Motor, ParameterError, Parameters};
use serde::{Deserialize, Serialize};

use crate::error::{Error, Place, Result};
use crate::network;
use crate::recording::{Motion, Recording};
use crate::speed_sensor::Chain;
use crate::term::Formula;

pub use crate::filtering::Filter;
pub use assignment::Assignment;
pub use fitted::{Fitted, Range, Scatter, Uncertainty, name_in_term};
pub use kind::{Base, Kind};
pub use units::unit;

/// Version of the file's layout.
pub const SCHEMA: u32 = 1;

/// How a value came to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// Estimated from the recordings.
    Identified,
    /// Given by the user.
    #[default]
    Fixed,
    /// The recordings say nothing about it; the value is an assumption.
    NotIdentifiable,
}

/// A parameter's value and how well it is known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// In SI units.
    pub value: f64,
    /// The unit, as a reminder and a check.
    pub unit: String,
    /// 95 % interval.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ci95: Option<[f64; 2]>,
    /// How it came to be.
    #[serde(default)]
    pub status: Status,
}

/// An effect beyond the base model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectEntry {
    /// Its name in the catalogue.
    pub id: EffectId,
    /// Its parameters by name.
    pub parameters: BTreeMap<String, Parameter>,
}

/// A term of the user's own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TermEntry {
    /// The formula, such as `k*i*abs(i)`.
    pub formula: Formula,
    /// Its unknown constants by name.
    #[serde(default)]
    pub parameters: BTreeMap<String, Parameter>,
}

/// A recording that the parameters came from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Origin {
    /// File, as it was named.
    pub file: String,
    /// Its SHA-256.
    pub sha256: String,
    /// Number of samples.
    pub samples: usize,
    /// Sampling interval, s.
    pub sample_time_s: f64,
}

impl From<&Recording> for Origin {
    fn from(r: &Recording) -> Self {
        Self {
            file: r.path().display().to_string(),
            sha256: r.sha256().to_owned(),
            samples: r.len(),
            sample_time_s: r.sample_time_s(),
        }
    }
}

/// Thresholds of the detector, learnt from healthy motors.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectorEntry {
    /// Nominal voltage, RMS, V.
    pub nominal_voltage: f64,
    /// Least voltage that is judged, as a share of the nominal one.
    pub least_voltage: f64,
    /// Highest voltage that is judged, likewise.
    pub most_voltage: f64,
    /// Least speed that is judged, rad/s.
    pub least_speed: f64,
    /// Time after the start that is not judged, s.
    pub blanking_s: f64,
    /// Periods of the mains that have to be judged for a verdict.
    pub fewest_periods: u32,
    /// Largest error of the current, 1.
    pub current: f64,
    /// Largest error of the speed, 1.
    pub speed: f64,
    /// Largest current above 1 kHz, A.
    pub sparking: f64,
    /// Largest abrupt change of the current's deviation, 1.
    pub current_jump: f64,
    /// Largest abrupt change of the speed's deviation, 1.
    pub speed_jump: f64,
    /// Mean and half-width of the current's deviation, 1.
    pub current_deviation: [f64; 2],
    /// Mean and half-width of the speed's deviation, 1.
    pub speed_deviation: [f64; 2],
    /// Healthy runs that they come from.
    pub runs: usize,
    /// Motors that these runs are of; 0 in files from before it was told.
    #[serde(default)]
    pub motors: usize,
    /// Share of healthy motors that all limits are to hold, and the confidence in that.
    pub holds: [f64; 2],
    /// Temperatures at which they were learnt, °C, if the runs told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<[f64; 2]>,
    /// Highest voltage of each run, RMS, V: least and largest of all runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mains_v: Option<[f64; 2]>,
    /// Density of the air, kg/m³: least and largest of all runs, if they told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub air_kg_m3: Option<[f64; 2]>,
    /// Logarithm of the ratio of a healthy motor's own parameters to the model's, by name: mean and half-width.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, [f64; 2]>,
    /// What is usual in the lot, block by block of the test.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lot: Option<lot::Population>,
}

/// Where the model comes from.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// Version of greyrig that wrote the file.
    pub greyrig: String,
    /// Method of the last estimation step.
    pub method: String,
    /// Error-to-signal ratio on the recordings below, by signal.
    #[serde(default)]
    pub esr: BTreeMap<String, f64>,
    /// The recordings.
    #[serde(default)]
    pub recordings: Vec<Origin>,
}

/// A model of a motor type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// Layout version of the file.
    pub schema: u32,
    /// Kind of motor.
    pub kind: Kind,
    /// Friction terms of the base model.
    pub base: Base,
    /// Rotary or linear.
    #[serde(default)]
    pub motion: Motion,
    /// Name of the motor type, if the recordings told it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motor: Option<String>,
    /// `false`: what was added last did not lower the error on data that the fit had not seen. Absent where nothing was
    /// judged, or all is well.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepted: Option<bool>,
    /// Filter of the comparison.
    #[serde(default)]
    pub filter: Filter,
    /// What the measuring chain does, where recordings do not tell it.
    #[serde(default, skip_serializing_if = "Chain::is_default")]
    pub chain: Chain,
    /// Base parameters by name (R, L, K, J, mu0, mu1, mu2).
    pub parameters: BTreeMap<String, Parameter>,
    /// Effects, in the order in which they act.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<EffectEntry>,
    /// Terms of the user's own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub terms: Vec<TermEntry>,
    /// Learned correction of the current.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correction: Option<network::File>,
    /// Thresholds of the detector.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detector: Option<DetectorEntry>,
    /// What the fit has seen and left over; absent in files from before it was remembered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fitted: Option<Fitted>,
    /// Where it all comes from.
    #[serde(default)]
    pub provenance: Provenance,
}

impl Model {
    /// Marks a model by what the data held out say of what was added last.
    pub fn judged(&mut self, accepted: bool) {
        self.accepted = (!accepted).then_some(false);
    }

    /// Fails where the data held out said that what was added last does not belong to the model; `path` is where it
    /// comes from.
    ///
    /// # Errors
    /// A model that was not accepted.
    pub fn require_accepted(&self, path: &Path) -> Result<()> {
        if self.accepted != Some(false) {
            return Ok(());
        }
        Err(Error::input(
            Place::file(path),
            "this model was not accepted: what was added last does not lower the error on data that the fit has not seen",
            "take the model from before, or give --unaccepted",
        ))
    }

    /// The detector's limits; `path` is where the model comes from.
    ///
    /// # Errors
    /// A model without.
    pub fn limits(&self, path: &Path) -> Result<&DetectorEntry> {
        self.detector.as_ref().ok_or_else(|| {
            Error::usage(
                format!("{} holds no limits of the detector", path.display()),
                "learn them from healthy motors: greyrig calibrate RUN… --model MODEL --out MODEL2",
            )
        })
    }

    /// A base parameter, if the model has it.
    pub fn base_parameter(&self, parameter: BaseParameter) -> Option<&Parameter> {
        self.parameters.get(parameter.name())
    }

    /// The same, to change it.
    pub fn base_parameter_mut(&mut self, parameter: BaseParameter) -> Option<&mut Parameter> {
        self.parameters.get_mut(parameter.name())
    }

    /// The value of a base parameter; one for R, L, K and J that a model lacks, because nothing in its recordings needs
    /// them, and zero for a friction term.
    pub fn value(&self, parameter: BaseParameter) -> f64 {
        let lacking = if parameter.is_friction() { 0.0 } else { 1.0 };
        self.base_parameter(parameter).map_or(lacking, |p| p.value)
    }

    /// The effects with their values, in the core's number type.
    pub fn effects<S: greyrig::scalar::Scalar<Base = S>>(&self) -> Vec<Effect<S>> {
        self.effects
            .iter()
            .map(|entry| {
                let parameters = entry.id.description().parameters;
                let values: Vec<S> = parameters
                    .iter()
                    .map(|p| S::constant(entry.parameters.get(p.name).map_or(p.start, |v| v.value)))
                    .collect();
                Effect::new(entry.id, &values)
            })
            .collect()
    }

    /// The learned correction as the microcontroller gets it, in single precision.
    ///
    /// # Errors
    /// A network that is not the rig's: three inputs with three membership functions each.
    pub fn correction_settings(&self) -> Result<Option<Settings3x3>> {
        let Some(file) = &self.correction else { return Ok(None) };
        let net = file.net(Path::new("the model's correction"))?;
        let ranges: Vec<(f64, f64)> = file.input.iter().map(|i| (i.range[0], i.range[1])).collect();
        let Ok(inputs) = <[(f64, f64); 3]>::try_from(ranges) else {
            return Err(Error::usage("the model's correction does not have three inputs", "train it again"));
        };
        let settings: Settings3x3 = net.to_core(inputs, (file.output[0], file.output[1]), file.margin)?;
        Ok(Some(settings.in_single_precision()))
    }

    /// The learned correction in the core's form.
    ///
    /// # Errors
    /// As [`Model::correction_settings`].
    pub fn correction(&self) -> Result<Option<Anfis3x3>> {
        let built = self.correction_settings()?.map(|settings| settings.build::<f32>()).transpose();
        built.map_err(|e| Error::usage(format!("the model's correction: {e}"), "train it again"))
    }

    /// The motor of the core, in `f32` as on the microcontroller or in `f64` for fits.
    ///
    /// # Errors
    /// A value that no motor can have.
    pub fn motor<S: greyrig::scalar::Scalar<Base = S>>(&self) -> std::result::Result<Motor<S>, ParameterError> {
        let values = BaseParameter::ALL.map(|parameter| S::constant(self.value(parameter)));
        let terms: Vec<_> = self
            .terms
            .iter()
            .map(|entry| {
                let value = |name: &String| entry.parameters.get(name).map_or(0.0, |p| p.value);
                entry.formula.term(&entry.formula.unknowns().iter().map(value).collect::<Vec<_>>())
            })
            .collect();
        Motor::build(Parameters::from_values(self.kind.flux_law(), values), &self.effects::<S>())?.with_terms(&terms)
    }
}
