//! A recording, from files and from memory.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use arrow_array::RecordBatchReader;
use greyrig_host::answers::next::Files;
use greyrig_host::recording::table::{Column, Table as Columns};
use greyrig_host::recording::{self, Mapping, columns};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyCapsule;

use crate::table::{Table, batches};
use crate::trouble::raised;
use crate::work::{Watch, work};

/// One run of one motor.
#[pyclass(frozen, module = "greyrig._native")]
pub struct Recording {
    /// The recording.
    pub recording: Arc<recording::Recording>,
    /// Pieces of `--map`, if it comes from a file.
    from_file: Option<Vec<String>>,
    /// Its columns, made when they are first asked for.
    table: OnceLock<Py<Table>>,
}

impl Recording {
    /// A recording that is in no file.
    pub fn of(recording: recording::Recording) -> Self {
        Self { recording: Arc::new(recording), from_file: None, table: OnceLock::new() }
    }
}

/// The recordings themselves.
pub fn those(recordings: &[Py<Recording>]) -> Vec<recording::Recording> {
    recordings.iter().map(|r| r.get().recording.as_ref().clone()).collect()
}

/// Where recordings come from, if all of them come from files and are read in one way.
pub fn files(recordings: &[Py<Recording>]) -> Option<Files> {
    let map = recordings.first()?.get().from_file.clone()?;
    let alike = recordings.iter().all(|r| r.get().from_file.as_ref() == Some(&map));
    let recordings = recordings.iter().map(|r| r.get().recording.path().to_owned()).collect();
    alike.then_some(Files { recordings, map })
}

#[pymethods]
impl Recording {
    /// Reads a file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, map: Vec<String>, watch: Watch) -> PyResult<Self> {
        let mapping = raised(py, Mapping::parse(&map))?;
        let recording = work(py, &watch, move |ctx| recording::load(&path, &mapping, ctx))?;
        Ok(Self { from_file: Some(map), ..Self::of(recording) })
    }

    /// Takes the stream of another library: its numbers are read where they are, and copied once, into the recording.
    #[staticmethod]
    fn from_stream(
        py: Python<'_>,
        stream: &Bound<'_, PyCapsule>,
        name: PathBuf,
        map: Vec<String>,
        metadata: BTreeMap<String, String>,
    ) -> PyResult<Self> {
        let mapping = raised(py, Mapping::parse(&map))?;
        let reader = batches(stream)?;
        let mut schema = reader.schema().as_ref().clone();
        schema.metadata.extend(metadata);
        let taken = py.detach(|| recording::take_batches(name, &schema, reader, &mapping));
        raised(py, taken).map(Self::of)
    }

    /// Takes columns of 64-bit numbers, each as its bytes in the order of this machine.
    #[staticmethod]
    fn from_columns(
        py: Python<'_>,
        columns: Vec<(String, PyBackedBytes)>,
        name: PathBuf,
        map: Vec<String>,
        metadata: BTreeMap<String, String>,
    ) -> PyResult<Self> {
        const SIZE: usize = size_of::<f64>();
        let mapping = raised(py, Mapping::parse(&map))?;
        if let Some((column, _)) = columns.iter().find(|(_, bytes)| bytes.len() % SIZE != 0) {
            return Err(PyValueError::new_err(format!("{column}: this is no column of 64-bit numbers")));
        }
        let taken = py.detach(|| {
            let numbers = |bytes: &[u8]| -> Vec<f64> {
                bytes.as_chunks::<SIZE>().0.iter().map(|number| f64::from_ne_bytes(*number)).collect()
            };
            let columns = columns
                .into_iter()
                .enumerate()
                .map(|(k, (column, bytes))| Column { position: k + 1, ..Column::new(column, numbers(&bytes)) });
            recording::take(name, Columns { columns: columns.collect(), metadata, ..Columns::default() }, &mapping)
        });
        raised(py, taken).map(Self::of)
    }

    /// Its name: the file as the user named it, where there is one.
    #[getter]
    fn name(&self) -> String {
        self.recording.name()
    }

    /// The file that it comes from.
    #[getter]
    fn path(&self) -> Option<PathBuf> {
        self.from_file.as_ref().map(|_| self.recording.path().to_owned())
    }

    /// SHA-256 of the file; empty without one.
    #[getter]
    fn sha256(&self) -> &str {
        self.recording.sha256()
    }

    /// Sampling interval, s.
    #[getter]
    fn sample_time_s(&self) -> f64 {
        self.recording.sample_time_s()
    }

    /// Time of the first sample, s.
    #[getter]
    fn start_s(&self) -> f64 {
        self.recording.start_s()
    }

    /// Length, s.
    #[getter]
    fn duration_s(&self) -> f64 {
        self.recording.duration_s()
    }

    /// What it says of itself.
    #[getter]
    fn metadata(&self) -> BTreeMap<String, String> {
        self.recording.metadata().clone()
    }

    /// What its reader had to leave out or assume.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.recording.warnings().to_vec()
    }

    /// Its columns, as `greyrig convert` writes them: copied once, when they are first asked for.
    #[getter]
    fn table(&self, py: Python<'_>) -> PyResult<Py<Table>> {
        if let Some(table) = self.table.get() {
            return Ok(table.clone_ref(py));
        }
        let table = Py::new(py, Table::of(py.detach(|| columns(&self.recording)))?)?;
        Ok(self.table.get_or_init(|| table).clone_ref(py))
    }

    /// Writes it, as CSV or Parquet by the extension.
    fn save(&self, py: Python<'_>, path: PathBuf, force: bool, watch: Watch) -> PyResult<()> {
        let recording = Arc::clone(&self.recording);
        work(py, &watch, move |ctx| recording::write(&recording, &path, force, ctx))
    }

    fn __len__(&self) -> usize {
        self.recording.len()
    }
}
