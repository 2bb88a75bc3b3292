//! Options from Python, understood as the command line understands them.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use greyrig_host::error::{Error, Result};
use greyrig_host::model::{Assignment, Model};
use greyrig_host::output;
use greyrig_host::term::Formula;
use pyo3::prelude::*;

use crate::trouble::raised;

/// Where an answer goes beside the interpreter.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Destination {
    /// A file; none: nowhere.
    pub out: Option<PathBuf>,
    /// Whether an existing file is replaced.
    pub force: bool,
}

impl Destination {
    /// Looks whether the file may be written, before long work.
    ///
    /// # Errors
    /// An existing file that is not to be replaced.
    pub fn check(&self) -> Result<()> {
        self.out.as_deref().map_or(Ok(()), |path| output::refuse_overwrite(path, self.force))
    }

    /// Writes a model, if it is to be written, and says where.
    ///
    /// # Errors
    /// An existing file that is not to be replaced, or what the system refuses.
    pub fn save(&self, model: &Model) -> Result<Option<&Path>> {
        let path = self.out.as_deref();
        path.map_or(Ok(()), |path| model.save(path, self.force)).map(|()| path)
    }
}

/// Writes a text, such as a report, whole or not at all.
///
/// # Errors
/// An existing file without `force`, or what the system refuses.
#[pyfunction]
pub fn write_text(py: Python<'_>, path: PathBuf, text: String, force: bool) -> PyResult<()> {
    raised(py, py.detach(|| output::write_file(&path, force, |out| out.write_all(text.as_bytes()))))
}

/// One of some words.
///
/// # Errors
/// Another word.
pub fn choice<T: ValueEnum>(option: &str, word: &str) -> Result<T> {
    T::from_str(word, false).map_err(|_| {
        let words: Vec<String> = T::value_variants()
            .iter()
            .filter_map(|value| Some(value.to_possible_value()?.get_name().to_owned()))
            .collect();
        Error::usage(format!("{option} {word:?} is not known"), format!("choose one of {}", words.join(", ")))
    })
}

/// The same where nothing may be said.
///
/// # Errors
/// As [`choice`].
pub fn choice_if<T: ValueEnum>(option: &str, word: Option<&str>) -> Result<Option<T>> {
    word.map(|word| choice(option, word)).transpose()
}

/// Names with values.
///
/// # Errors
/// A value that is not finite.
pub fn assignments(values: Vec<(String, f64)>) -> Result<Vec<Assignment>> {
    let assigned = |(name, value): (String, f64)| match value.is_finite() {
        true => Ok(Assignment { name, value }),
        false => Err(Error::usage(format!("{name} = {value} is not finite"), "give a number in SI units")),
    };
    values.into_iter().map(assigned).collect()
}

/// Formulas.
///
/// # Errors
/// One that is none.
pub fn formulas(texts: &[String]) -> Result<Vec<Formula>> {
    texts.iter().map(|text| Formula::parse(text)).collect()
}
