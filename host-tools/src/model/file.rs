//! The model file: read, checked, written.

use std::path::Path;

use greyrig::butterworth;
use greyrig::motor::BaseParameter;

use super::lot::Population;
use super::{Model, Parameter, SCHEMA, unit};
use crate::error::{Error, Place, Result};
use crate::output;
use crate::spelling;

/// Where a key stands in the file.
type At<'a> = &'a dyn Fn(&str) -> Place;

impl Model {
    /// Reads a model file.
    ///
    /// # Errors
    /// A file that cannot be read, is not TOML, has unknown or missing keys (with line and column), or holds values
    /// that no motor can have.
    pub fn load(path: &Path) -> Result<Self> {
        Self::parse(&std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?, path)
    }

    /// Reads the text of a model file; `path` is where it comes from.
    ///
    /// # Errors
    /// As [`Model::load`].
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let model: Self = toml::from_str(text).map_err(|e| {
            let (line, column) = e.span().map_or((0, 0), |span| line_and_column(text, span.start));
            let what = e.message().lines().next().unwrap_or("not a model file").to_owned();
            Error::input(Place::at(path, line, column), what, "correct the file or identify the model again")
        })?;
        model.check(&|key| {
            let (line, column) = line_and_column(text, text.find(key).unwrap_or(0));
            Place::at(path, line, column)
        })?;
        Ok(model)
    }

    fn check(&self, at: At<'_>) -> Result<()> {
        if self.schema != SCHEMA {
            return Err(Error::input(
                at("schema"),
                format!("this is layout {} of the model file, and this greyrig reads layout {SCHEMA}", self.schema),
                "identify the model again, or use the greyrig that wrote it",
            ));
        }
        if let Some(lot) = self.detector.as_ref().and_then(|d| d.lot.as_ref())
            && lot.layout != Population::LAYOUT
        {
            return Err(Error::input(
                at("[detector.lot]"),
                format!("this is layout {} of a lot, and this greyrig reads layout {}", lot.layout, Population::LAYOUT),
                "learn the lot again with greyrig calibrate, from the model without it",
            ));
        }
        self.check_parameters(at)?;
        self.check_filter(at)?;
        self.check_effects(at)?;
        self.check_terms(at)?;
        self.fitted.as_ref().map_or(Ok(()), |fitted| fitted.check(self, at))?;
        self.motor::<f64>().map(|_| ()).map_err(|e| {
            Error::input(at("[parameters"), e.to_string(), "correct the value; see the interval for what is plausible")
        })
    }

    /// Names and units of the base parameters.
    fn check_parameters(&self, at: At<'_>) -> Result<()> {
        for (name, parameter) in &self.parameters {
            let place = || at(&format!("[parameters.{name}]"));
            let Some(base) = BaseParameter::of_name(name) else {
                return Err(Error::input(
                    place(),
                    format!("there is no parameter {name}"),
                    spelling::advice(name, BaseParameter::ALL.map(BaseParameter::name), "the base model has"),
                ));
            };
            let expected = unit(base.unit(self.kind.flux_law()), self.motion);
            if parameter.unit != expected {
                return Err(Error::input(
                    place(),
                    format!("{name} is in {:?}, not in {expected:?}", parameter.unit),
                    format!("convert the value and write unit = {expected:?}"),
                ));
            }
        }
        Ok(())
    }

    /// Order and cut-off.
    fn check_filter(&self, at: At<'_>) -> Result<()> {
        if self.filter.order == 0
            || self.filter.order > butterworth::MAX_ORDER
            || self.filter.cutoff_hz.is_nan()
            || self.filter.cutoff_hz <= 0.0
        {
            return Err(Error::input(
                at("[filter]"),
                format!(
                    "a Butterworth filter of order {} at {} Hz does not exist",
                    self.filter.order, self.filter.cutoff_hz
                ),
                format!("choose an order from 1 to {} and a positive cut-off", butterworth::MAX_ORDER),
            ));
        }
        Ok(())
    }

    /// A value for each parameter.
    fn check_effects(&self, at: At<'_>) -> Result<()> {
        for entry in &self.effects {
            let place = || at(&format!("id = {:?}", entry.id.id()));
            let names: Vec<_> = entry.id.description().parameters.iter().map(|p| p.name).collect();
            if let Some(missing) = names.iter().find(|n| !entry.parameters.contains_key(**n)) {
                return Err(Error::input(
                    place(),
                    format!("the effect {} has no value for {missing}", entry.id),
                    format!("it has {}", names.join(", ")),
                ));
            }
            if let Some(stranger) = entry.parameters.keys().find(|k| !names.contains(&k.as_str())) {
                return Err(Error::input(
                    place(),
                    format!("the effect {} has no parameter {stranger}", entry.id),
                    format!("it has {}", names.join(", ")),
                ));
            }
        }
        Ok(())
    }

    /// A value for each unknown.
    fn check_terms(&self, at: At<'_>) -> Result<()> {
        for entry in &self.terms {
            let names = entry.formula.unknowns();
            let place = || at(entry.formula.text());
            if let Some(missing) = names.iter().find(|n| !entry.parameters.contains_key(*n)) {
                return Err(Error::input(
                    place(),
                    format!("the term {} has no value for {missing}", entry.formula.text()),
                    format!("add it as [terms.parameters.{missing}]"),
                ));
            }
            if let Some(stranger) = entry.parameters.keys().find(|k| !names.contains(k)) {
                return Err(Error::input(
                    place(),
                    format!("the term {} has no unknown {stranger}", entry.formula.text()),
                    "remove the parameter or correct its name",
                ));
            }
        }
        Ok(())
    }

    /// The text of the model file.
    ///
    /// # Errors
    /// A number that TOML cannot hold.
    pub fn text(&self) -> Result<String> {
        let effects = self.effects.iter().flat_map(|e| &e.parameters);
        let terms = self.terms.iter().flat_map(|t| &t.parameters);
        let unusable = |p: &Parameter| !p.value.is_finite() || p.ci95.iter().flatten().any(|x| !x.is_finite());
        if let Some((name, _)) = self.parameters.iter().chain(effects).chain(terms).find(|(_, p)| unusable(p)) {
            return Err(Error::usage(
                format!("{name} has come to no number, so that there is no model to write"),
                "leave out what was added last, or record more excitation",
            ));
        }
        toml::to_string_pretty(self)
            .map_err(|e| Error::usage(format!("the model cannot be written as TOML: {e}"), "report this as a bug"))
    }

    /// Writes the model file, whole or not at all.
    ///
    /// # Errors
    /// An existing file without `force`, or what the system refuses.
    pub fn save(&self, path: &Path, force: bool) -> Result<()> {
        let text = self.text()?;
        output::write_file(path, force, |out| out.write_all(text.as_bytes()))
    }
}

/// Line and column, from one, of an offset in bytes.
fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let before = &text[..offset.min(text.len())];
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
    (line, column)
}
