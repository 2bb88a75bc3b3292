//! What an identification yields, from the space that was fitted.

use std::collections::BTreeMap;

use greyrig::effects::EffectId;
use greyrig::motor::BaseParameter;
use serde::Serialize;

use super::flux::FluxAtPeak;
use super::identifiability::Weakness;
use super::intervals::Covariance;
use super::intervals::of_fit::interval;
use super::settings::{Method, Settings};
use super::space::{Entry, Freedom, Key, Space};
use crate::model::{
    EffectEntry, Filter, Kind, Model, Origin, Parameter, Provenance, SCHEMA, Status, TermEntry, Uncertainty,
    name_in_term,
};
use crate::recording::{Motion, Recording};
use crate::term::Formula;

/// One estimated parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// Which parameter.
    #[serde(skip)]
    pub key: Key,
    /// Name.
    pub name: String,
    /// Value, SI; `None` when the recordings say nothing about it and nobody gave it.
    pub value: Option<f64>,
    /// Unit.
    pub unit: String,
    /// 95 % interval, for what was estimated.
    pub ci95: Option<[f64; 2]>,
    /// Whether the recordings determine it.
    pub identifiable: bool,
    /// How it came to be.
    pub status: Status,
}

/// What an identification yields.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification {
    /// The model.
    pub model: Model,
    /// Its parameters, in the order of the equations.
    pub parameters: Vec<Estimate>,
    /// Linkage at the largest current, of a series motor.
    pub flux: Option<FluxAtPeak>,
    /// Condition number of the problem with parameters scaled to equal effect.
    pub condition: Option<f64>,
    /// What the user should know, in words.
    pub notes: Vec<String>,
}

/// A fitted space with what is known about its uncertainty.
pub struct Outcome {
    /// The parameters, with the values of the fit.
    pub space: Space,
    /// Covariance of its coordinates, where the data tell it.
    pub covariance: Option<Covariance>,
    /// What the data do not tell.
    pub weaknesses: Vec<Weakness>,
    /// How it was fitted, in words.
    pub method: &'static str,
    /// Error-to-signal ratio of each signal.
    pub esr: BTreeMap<String, f64>,
    /// Parameters to which fits from several starts gave several values.
    pub ambiguous: Vec<String>,
}

/// Largest factor, either way, of an interval that says anything of R, L, K or J: an order of magnitude.
const WIDEST: f64 = 10.0;

/// Whether an interval is so wide that nothing is known: of more than the decades of [`WIDEST`], or no number at all;
/// of friction, of more than the largest torque either way, which is ten times the typical friction, and of more than
/// the decades of its own value.
fn says_nothing(entry: &Entry, [low, high]: [f64; 2]) -> bool {
    if !low.is_finite() || !high.is_finite() {
        return true;
    }
    if entry.of_effect() {
        return false;
    }
    if entry.positive {
        !(high <= WIDEST * entry.value && low * WIDEST >= entry.value)
    } else {
        high - low > 2.0 * 10.0 * entry.scale && high - low > 2.0 * WIDEST * entry.value.abs()
    }
}

impl Outcome {
    /// Of a free-run simulation or of its least-squares start.
    pub fn of_simulation(
        space: Space,
        covariance: Option<Covariance>,
        weaknesses: Vec<Weakness>,
        method: Method,
    ) -> Self {
        let method = match method {
            Method::OutputError => "output error",
            Method::LeastSquares => "least squares in continuous time",
        };
        Self { space, covariance, weaknesses, method, esr: BTreeMap::new(), ambiguous: Vec::new() }
    }

    /// Estimates that no motor can have, as a sign of missing physics.
    pub fn implausible(&self, kind: Kind) -> Vec<String> {
        let mut notes = Vec::new();
        for (k, entry) in self.space.free().enumerate() {
            let Some(covariance) = &self.covariance else { break };
            let half = covariance.half_width_95_of(k) * entry.scale;
            let is_friction = entry.key.base().is_some_and(BaseParameter::is_friction);
            if !entry.positive && is_friction && entry.value + half < 0.0 {
                notes.push(format!(
                    "{} is negative, which no friction can be: the fit makes up for physics that the model lacks{}",
                    entry.name,
                    if kind == Kind::Universal { ", most often saturation of the flux" } else { "" }
                ));
            }
        }
        notes
    }

    /// The parameters in the order of the equations.
    fn estimates(&self, motion: Motion) -> Vec<Estimate> {
        let theta = self.space.coordinates();
        let mut coordinates = theta.iter().enumerate();
        let present = self.space.entries.iter().filter(|entry| entry.freedom != Freedom::Absent);
        let estimate = |entry: &Entry| {
            let (value, ci95, status) = match entry.freedom {
                Freedom::Free(_) => {
                    let ci95 = coordinates.next().zip(self.covariance.as_ref());
                    let ci95 = ci95.map(|((k, theta), c)| interval(entry, *theta, c.half_width_95_of(k)));
                    if self.ambiguous.contains(&entry.name) || ci95.is_some_and(|ci95| says_nothing(entry, ci95)) {
                        (Some(entry.value), None, Status::NotIdentifiable)
                    } else {
                        (Some(entry.value), ci95, Status::Identified)
                    }
                }
                Freedom::Fixed => (Some(entry.value), None, Status::Fixed),
                // What is held has a value that the others were fitted with.
                Freedom::Pinned => (Some(entry.value), None, Status::NotIdentifiable),
                // A friction term held at zero and the usual shape of an effect are usable values; an R, L, K or J that
                // nothing tells is not.
                Freedom::Untold | Freedom::Absent => {
                    let usable = !entry.positive || entry.of_effect();
                    (usable.then_some(entry.value), None, Status::NotIdentifiable)
                }
            };
            Estimate {
                key: entry.key,
                name: entry.name.clone(),
                value,
                unit: self.space.unit(entry.key, motion),
                ci95,
                identifiable: ci95.is_some(),
                status,
            }
        };
        present.map(estimate).collect()
    }

    /// How well the free parameters are known together.
    pub fn uncertainty(&self) -> Option<Uncertainty> {
        let covariance = self.covariance.as_ref()?;
        let free: Vec<&Entry> = self.space.free().collect();
        let matrix = &covariance.matrix;
        if matrix.nrows() != free.len() {
            return None;
        }
        let slopes: Vec<f64> = free.iter().zip(self.space.coordinates()).map(|(e, theta)| e.slope(theta)).collect();
        let deviation = |k: usize| matrix[(k, k)].max(0.0).sqrt();
        let correlation = |r: usize, c: usize| {
            let sizes = deviation(r) * deviation(c);
            if r == c {
                1.0
            } else if sizes > 0.0 {
                (matrix[(r, c)] / sizes).clamp(-1.0, 1.0)
            } else {
                0.0
            }
        };
        let name = |entry: &&Entry| match entry.key {
            Key::Term(place, _) => name_in_term(place, &entry.name),
            Key::Base(_) | Key::Effect(..) => entry.name.clone(),
        };
        Some(Uncertainty {
            names: free.iter().map(name).collect(),
            deviations: slopes.iter().enumerate().map(|(k, slope)| slope.abs() * deviation(k)).collect(),
            correlations: (0..free.len()).map(|r| (0..=r).map(|c| correlation(r, c)).collect()).collect(),
            freedom: covariance.freedom(),
        })
    }

    /// The model and what is to be said of it.
    pub fn into_identification(
        self,
        recordings: &[Recording],
        settings: &Settings,
        filter: Filter,
        flux: Option<FluxAtPeak>,
        mut notes: Vec<String>,
    ) -> Identification {
        let motion = recordings[0].motion();
        let parameters = self.estimates(motion);
        notes.extend(self.weaknesses.into_iter().map(|w| w.text));
        let of_effect = |id: &EffectId| EffectEntry {
            id: *id,
            parameters: stored(&parameters, |key| matches!(key, Key::Effect(other, _) if other == *id)),
        };
        let of_term = |(place, formula): (usize, &Formula)| TermEntry {
            formula: formula.clone(),
            parameters: stored(&parameters, |key| matches!(key, Key::Term(other, _) if other == place)),
        };
        let model = Model {
            schema: SCHEMA,
            kind: settings.kind,
            base: settings.base,
            motion,
            motor: recordings.iter().find_map(|r| r.metadata().get("motor").cloned()),
            filter,
            chain: settings.chain,
            parameters: stored(&parameters, |key| key.base().is_some()),
            effects: settings.effects.iter().map(of_effect).collect(),
            terms: settings.terms.iter().enumerate().map(of_term).collect(),
            correction: None,
            detector: None,
            accepted: None,
            fitted: None,
            provenance: Provenance {
                greyrig: env!("CARGO_PKG_VERSION").to_owned(),
                method: self.method.to_owned(),
                esr: self.esr,
                recordings: recordings.iter().map(Origin::from).collect(),
            },
        };
        Identification { model, parameters, flux, condition: self.covariance.map(|c| c.condition), notes }
    }
}

/// What a model file keeps of some parameters, by name.
fn stored(parameters: &[Estimate], wanted: impl Fn(Key) -> bool) -> BTreeMap<String, Parameter> {
    let parameter = |e: &Estimate| {
        let parameter = Parameter { value: e.value?, unit: e.unit.clone(), ci95: e.ci95, status: e.status };
        Some((e.name.clone(), parameter))
    };
    parameters.iter().filter(|e| wanted(e.key)).filter_map(parameter).collect()
}
