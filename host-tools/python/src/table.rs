//! Columns in memory that numpy and Arrow read where they are.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::ffi::{FFI_ArrowArray, FFI_ArrowSchema};
use arrow_array::ffi_stream::{FFI_ArrowArrayStream, RecordBatchStreamReader};
use arrow_array::types::Float64Type;
use arrow_array::{Array, ArrayRef, Float64Array, RecordBatch, RecordBatchIterator, StringArray, StructArray};
use arrow_schema::{ArrowError, DataType, Field, Schema};
use greyrig_host::recording::series::{Series, Values};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyCapsuleMethods, PyDict, PyTuple};

/// Columns of the same length: numbers of 64 bits, or words.
#[pyclass(frozen, module = "greyrig._native")]
pub struct Table {
    batch: RecordBatch,
}

impl Table {
    /// The columns, which are moved and not copied.
    ///
    /// # Errors
    /// None of a series, whose columns have one length.
    pub fn of(series: Series) -> PyResult<Self> {
        let metadata: HashMap<_, _> = series.metadata().clone().into_iter().collect();
        let (mut fields, mut arrays) = (Vec::new(), Vec::<ArrayRef>::new());
        for column in series.into_columns() {
            let (kind, array): (_, ArrayRef) = match column.values {
                Values::Numbers(values) => (DataType::Float64, Arc::new(Float64Array::from(values))),
                Values::Words { rows, words } => {
                    let words = StringArray::from_iter_values(rows.iter().map(|row| words[*row].as_str()));
                    (DataType::Utf8, Arc::new(words))
                }
            };
            let unit = column.unit.map(|unit| ("unit".to_owned(), unit.to_owned()));
            let unit: HashMap<_, _> = unit.into_iter().collect();
            fields.push(Field::new(column.name, kind, false).with_metadata(unit));
            arrays.push(array);
        }
        let schema = Arc::new(Schema::new_with_metadata(fields, metadata));
        Ok(Self { batch: RecordBatch::try_new(schema, arrays).map_err(refused)? })
    }
}

#[pymethods]
impl Table {
    /// Names of the columns.
    #[getter]
    fn columns(&self) -> Vec<String> {
        self.batch.schema().fields().iter().map(|field| field.name().clone()).collect()
    }

    /// Names of the columns that hold words and no numbers.
    #[getter]
    fn texts(&self) -> Vec<String> {
        let schema = self.batch.schema();
        let texts = schema.fields().iter().filter(|field| *field.data_type() == DataType::Utf8);
        texts.map(|field| field.name().clone()).collect()
    }

    /// SI units of the columns that have one.
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let units = PyDict::new(py);
        for field in self.batch.schema().fields() {
            if let Some(unit) = field.metadata().get("unit") {
                units.set_item(field.name(), unit)?;
            }
        }
        Ok(units)
    }

    fn __len__(&self) -> usize {
        self.batch.num_rows()
    }

    /// A column of numbers as numpy reads it, without a copy.
    fn numbers(&self, name: &str) -> PyResult<Column> {
        let array = self.batch.column_by_name(name).ok_or_else(|| PyKeyError::new_err(name.to_owned()))?;
        let array = array.as_primitive_opt::<Float64Type>();
        Ok(Column { array: array.ok_or_else(|| PyValueError::new_err(format!("{name} holds words")))?.clone() })
    }

    /// A column of words.
    fn words(&self, name: &str) -> PyResult<Vec<String>> {
        let array = self.batch.column_by_name(name).ok_or_else(|| PyKeyError::new_err(name.to_owned()))?;
        let words =
            array.as_string_opt::<i32>().ok_or_else(|| PyValueError::new_err(format!("{name} holds numbers")))?;
        Ok(words.iter().flatten().map(str::to_owned).collect())
    }

    /// The Arrow PyCapsule interface: the type.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(self.batch.schema().as_ref()).map_err(refused)?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema")
    }

    /// The Arrow PyCapsule interface: one array, without a copy.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_array__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        // A wish that need not be met.
        let _ = requested_schema;
        let array = FFI_ArrowArray::new(&StructArray::from(self.batch.clone()).to_data());
        let array = PyCapsule::new_with_value(py, array, c"arrow_array")?;
        PyTuple::new(py, [self.__arrow_c_schema__(py)?, array])
    }

    /// The Arrow PyCapsule interface: a stream of one batch, without a copy.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        let batches = RecordBatchIterator::new([Ok(self.batch.clone())], self.batch.schema());
        PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(Box::new(batches)), c"arrow_array_stream")
    }
}

/// A column of numbers, whose memory numpy reads: `numpy.asarray(column)`.
#[pyclass(frozen, module = "greyrig._native")]
pub struct Column {
    array: Float64Array,
}

#[pymethods]
impl Column {
    /// The array interface of numpy, version 3. What it points to lives as long as this object, which the array that
    /// numpy makes of it holds; nobody writes to it.
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("typestr", if cfg!(target_endian = "big") { ">f8" } else { "<f8" })?;
        interface.set_item("shape", (self.array.len(),))?;
        interface.set_item("data", (self.array.values().as_ptr() as usize, true))?;
        Ok(interface)
    }

    fn __len__(&self) -> usize {
        self.array.len()
    }
}

/// The batches of a stream of another library, which are read where they are.
///
/// # Errors
/// What is no capsule of a stream, or one that was read before.
pub fn batches(capsule: &Bound<'_, PyCapsule>) -> PyResult<RecordBatchStreamReader> {
    let pointer = capsule.pointer_checked(Some(c"arrow_array_stream"))?.cast::<FFI_ArrowArrayStream>();
    // SAFETY: a capsule of this name holds a pointer to an `ArrowArrayStream` of the C data interface, as its checked
    // name promises. It is moved out, and what is left is marked as released, so that the capsule does not release it
    // again; the lock of the interpreter keeps others from it meanwhile.
    let stream = unsafe { FFI_ArrowArrayStream::from_raw(pointer.as_ptr()) };
    RecordBatchStreamReader::try_new(stream).map_err(refused)
}

fn refused(error: ArrowError) -> PyErr {
    PyValueError::new_err(error.to_string())
}
