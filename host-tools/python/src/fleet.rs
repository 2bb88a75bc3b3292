//! Recordings of a store, asked wherever an engine has room.

use std::borrow::Cow;
use std::path::Path;

use greyrig_host::error::Result;
use greyrig_host::store::fleet::{self, Answered};
use greyrig_host::store::job::Task;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;

use crate::model::Model;
use crate::options::{choice, choice_if};
use crate::trouble::raised;
use crate::work::{Watch, work};

/// A Parquet file of recordings without rows, for its columns.
///
/// # Errors
/// None.
#[pyfunction]
pub fn no_recordings(py: Python<'_>) -> PyResult<Cow<'static, [u8]>> {
    raised(py, fleet::no_recordings()).map(Cow::Owned)
}

/// Rows of recordings to rows of results, both as Parquet files; and how many are of another motor type.
///
/// # Errors
/// As the library's.
#[pyfunction]
#[pyo3(signature = (batch, question, model, kind, watch))]
pub fn fleet_run(
    py: Python<'_>,
    batch: PyBackedBytes,
    question: String,
    model: Option<Py<Model>>,
    kind: Option<String>,
    watch: Watch,
) -> PyResult<(Cow<'static, [u8]>, usize)> {
    let task = || -> Result<Task> {
        let content = model.as_ref().map(|model| model.get().content()).transpose()?;
        let path = model.as_ref().map(|model| model.get().path.as_deref().unwrap_or(Path::new("the model")));
        Task::with(choice("question", &question)?, path.zip(content.as_deref()), choice_if("kind", kind.as_deref())?)
    };
    let task = raised(py, task())?;
    let Answered { results, other_type } = work(py, &watch, move |ctx| fleet::run(&batch, &task, ctx))?;
    Ok((Cow::Owned(results), other_type))
}
