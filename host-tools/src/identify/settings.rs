//! What the user chooses, and the parameters that this leaves free.

use greyrig::effects::EffectId;
use greyrig::motor::MAX_TERMS;

use super::space::{Freedom, Space};
use crate::between::Course;
use crate::error::{Error, Result};
use crate::model::{Assignment, Base, EffectEntry, Filter, Kind, Model, Parameter, Status};
use crate::speed_sensor::Chain;
use crate::term::Formula;

/// How far the estimation goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Method {
    /// Least squares, then output error: the best free run.
    #[default]
    OutputError,
    /// Linear least squares in continuous time alone, as Rakar & Juričić did.
    LeastSquares,
}

/// What the user chooses.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// How far the estimation goes.
    pub method: Method,
    /// Kind of motor.
    pub kind: Kind,
    /// Friction terms of the base model.
    pub base: Base,
    /// Effects that the model has besides.
    pub effects: Vec<EffectId>,
    /// Terms of the user's own that the model has besides.
    pub terms: Vec<Formula>,
    /// Parameters with known values.
    pub fixed: Vec<Assignment>,
    /// Values that a model has: fits begin from there, too.
    pub known: Vec<Assignment>,
    /// Parameters with bounds: name, least, greatest.
    pub bounds: Vec<(String, f64, f64)>,
    /// Filter of the comparison; the cut-off may be left to the data on the mechanical side alone.
    pub filter: Filter,
    /// Whether the user chose the cut-off.
    pub cutoff_given: bool,
    /// The measuring chain, where recordings do not tell it.
    pub chain: Chain,
    /// What the voltage does between its samples, if the user knows it.
    pub course: Option<Course>,
}

impl Settings {
    /// The usual base and filter for a kind of motor.
    pub fn new(kind: Kind) -> Self {
        Self {
            method: Method::default(),
            kind,
            base: Base::usual(kind),
            effects: Vec::new(),
            terms: Vec::new(),
            fixed: Vec::new(),
            known: Vec::new(),
            bounds: Vec::new(),
            filter: Filter::default(),
            cutoff_given: false,
            chain: Chain::default(),
            course: None,
        }
    }

    /// The settings that identify a model again, from its own values, too; what the user fixed stays fixed.
    pub fn of_model(model: &Model) -> Self {
        let effects = model.effects.iter().flat_map(|e: &EffectEntry| &e.parameters);
        let terms = model.terms.iter().flat_map(|t| &t.parameters);
        let has: Vec<(&String, &Parameter)> = model.parameters.iter().chain(effects).chain(terms).collect();
        let assigned = |(name, p): &(&String, &Parameter)| Assignment { name: (*name).clone(), value: p.value };
        Self {
            base: model.base,
            effects: model.effects.iter().map(|e| e.id).collect(),
            terms: model.terms.iter().map(|t| t.formula.clone()).collect(),
            fixed: has.iter().filter(|(_, p)| p.status == Status::Fixed).map(assigned).collect(),
            known: has.iter().filter(|(_, p)| p.status != Status::NotIdentifiable).map(assigned).collect(),
            filter: model.filter,
            chain: model.chain,
            cutoff_given: true,
            ..Self::new(model.kind)
        }
    }
}

/// The parameters that settings ask for.
///
/// # Errors
/// A parameter that there is not, or an impossible value.
pub fn build_space(settings: &Settings) -> Result<Space> {
    if settings.terms.len() > MAX_TERMS {
        return Err(Error::usage(
            format!("{} terms are too many", settings.terms.len()),
            format!("a model takes {MAX_TERMS} at most; write them as one sum"),
        ));
    }
    let mut space = Space::new(settings.kind, settings.base, &settings.effects).with_terms(&settings.terms);
    for (k, entry) in space.entries.iter().enumerate() {
        if space.entries[..k].iter().any(|e| e.name == entry.name) {
            return Err(Error::usage(
                format!("the name {} stands for two parameters", entry.name),
                "give the unknown of the term another name",
            ));
        }
    }
    let names: Vec<String> = space.entries.iter().map(|e| e.name.to_string()).collect();
    let unknown = |name: &str| Error::unknown("parameter", name, names.iter().map(String::as_str), "the model has");
    for fix in &settings.fixed {
        let entry = space.named_mut(&fix.name).ok_or_else(|| unknown(&fix.name))?;
        if entry.positive && fix.value <= 0.0 {
            return Err(Error::usage(format!("{} = {} is impossible", fix.name, fix.value), "give a positive value"));
        }
        entry.value = fix.value;
        entry.freedom = Freedom::Fixed;
    }
    for (name, low, high) in &settings.bounds {
        let entry = space.named_mut(name).ok_or_else(|| unknown(name))?;
        if low >= high || (entry.positive && *low <= 0.0) {
            return Err(Error::usage(
                format!("{low} to {high} is no range for {name}"),
                "give the smaller number first; R, L, K and J are positive",
            ));
        }
        entry.value = 0.5 * (low + high);
        entry.freedom = Freedom::Free(Some((*low, *high)));
    }
    Ok(space)
}
