//! A model of a motor type.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use greyrig_host::error::{Error, Result};
use greyrig_host::model;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::trouble::raised;

/// A model, and the file that it comes from if it comes from one.
#[pyclass(frozen, module = "greyrig._native")]
pub struct Model {
    /// The model.
    pub model: Arc<model::Model>,
    /// Its file.
    pub path: Option<PathBuf>,
    /// The text of that file, by whose digest results are known.
    text: Option<Arc<str>>,
}

impl Model {
    /// A model that an answer holds, and where it was written.
    pub fn of(model: &model::Model, path: Option<&Path>) -> Self {
        Self { model: Arc::new(model.clone()), path: path.map(Path::to_owned), text: None }
    }

    /// The text of its file, as it was read or would be written.
    ///
    /// # Errors
    /// A number that a file cannot hold.
    pub fn content(&self) -> Result<String> {
        self.text.as_deref().map_or_else(|| self.model.text(), |text| Ok(text.to_owned()))
    }
}

#[pymethods]
impl Model {
    /// Reads a model file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let text = std::fs::read_to_string(&path).map_err(|e| Error::io(&path, e));
        Self::parse(py, raised(py, text)?, Some(path))
    }

    /// Reads the text of a model file.
    #[staticmethod]
    #[pyo3(signature = (text, path))]
    fn parse(py: Python<'_>, text: String, path: Option<PathBuf>) -> PyResult<Self> {
        let named = path.as_deref().unwrap_or(Path::new("the model"));
        let model = raised(py, py.detach(|| model::Model::parse(&text, named)))?;
        Ok(Self { model: Arc::new(model), path, text: Some(text.into()) })
    }

    /// Writes it; the model with its file.
    fn save(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<Self> {
        raised(py, py.detach(|| self.model.save(&path, force)))?;
        Ok(Self { model: Arc::clone(&self.model), path: Some(path), text: None })
    }

    /// The file that it comes from.
    #[getter]
    fn path(&self) -> Option<PathBuf> {
        self.path.clone()
    }

    /// The text of its file.
    fn text(&self, py: Python<'_>) -> PyResult<String> {
        raised(py, self.content())
    }

    /// What it consists of, as JSON.
    fn json(&self) -> PyResult<String> {
        serde_json::to_string(&*self.model).map_err(|e| PyValueError::new_err(e.to_string()))
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.model == other.model
    }
}
