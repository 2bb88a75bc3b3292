//! The rows that a network is trained on: in memory, or in a temporary file when they are many.

use std::borrow::Cow;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::sync::{Mutex, PoisonError};

use crate::error::{Error, Result};

/// Rows whose sums one thread forms. Sums of chunks are added in the order of the rows, so the result does not
/// depend on the number of threads.
pub const CHUNK: usize = 4096;

/// Numbers that are kept in memory: 128 MB. The rest goes to a temporary file.
const IN_MEMORY: usize = 16 << 20;

/// Rows of inputs with a target each.
///
/// Within a chunk the columns stand one after the other: x1 of all its rows, x2, …, y.
#[derive(Debug)]
pub struct Table {
    inputs: usize,
    rows: usize,
    ranges: Vec<(f64, f64)>,
    memory: Vec<f64>,
    /// Chunks beyond those in memory.
    file: Option<Mutex<File>>,
    /// Numbers in memory at most.
    limit: usize,
}

impl Table {
    /// From pairs of inputs and target.
    ///
    /// # Errors
    /// As [`Builder::push`].
    pub fn collect<X: AsRef<[f64]>>(inputs: usize, rows: impl IntoIterator<Item = (X, f64)>) -> Result<Self> {
        let mut builder = Builder::new(inputs);
        for (x, y) in rows {
            builder.push(x.as_ref(), y)?;
        }
        builder.finish()
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Smallest and largest value of an input.
    pub fn input_range(&self, input: usize) -> (f64, f64) {
        self.ranges[input]
    }

    /// Smallest and largest target.
    pub fn target_range(&self) -> (f64, f64) {
        self.ranges[self.inputs]
    }

    /// Number of chunks.
    pub(super) fn chunks(&self) -> usize {
        self.rows.div_ceil(CHUNK)
    }

    /// A chunk's columns one after the other.
    pub(super) fn chunk(&self, index: usize) -> Result<Cow<'_, [f64]>> {
        let width = self.inputs + 1;
        let start = index * CHUNK * width;
        let values = (self.rows - index * CHUNK).min(CHUNK) * width;
        if let Some(slice) = self.memory.get(start..start + values) {
            return Ok(Cow::Borrowed(slice));
        }
        let mut bytes = vec![0; values * 8];
        let Some(file) = &self.file else { return Err(lost(std::io::ErrorKind::UnexpectedEof.into())) };
        {
            // Whoever has panicked with it has moved the place at most, which is set before each use.
            let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
            file.seek(SeekFrom::Start(8 * (start - self.memory.len()) as u64)).map_err(lost)?;
            file.read_exact(&mut bytes).map_err(lost)?;
        }
        Ok(Cow::Owned(bytes.as_chunks().0.iter().map(|b| f64::from_ne_bytes(*b)).collect()))
    }
}

fn lost(error: std::io::Error) -> Error {
    Error::io("the temporary file with the rows", error)
}

/// Takes rows one by one.
#[derive(Debug)]
pub struct Builder {
    table: Table,
    /// The chunk in the making, row by row.
    pending: Vec<f64>,
}

impl Builder {
    /// For rows of so many inputs.
    pub fn new(inputs: usize) -> Self {
        Self::with_memory(inputs, IN_MEMORY)
    }

    /// The same with at most so many numbers in memory.
    pub fn with_memory(inputs: usize, limit: usize) -> Self {
        let ranges = vec![(f64::INFINITY, f64::NEG_INFINITY); inputs + 1];
        Self { table: Table { inputs, rows: 0, ranges, memory: Vec::new(), file: None, limit }, pending: Vec::new() }
    }

    /// Adds a row.
    ///
    /// # Errors
    /// A wrong number of inputs, a value that is not finite, or a full disk.
    pub fn push(&mut self, inputs: &[f64], target: f64) -> Result<()> {
        let row = self.table.rows + 1;
        if inputs.len() != self.table.inputs {
            return Err(Error::usage(
                format!("row {row} has {} inputs instead of {}", inputs.len(), self.table.inputs),
                "give every row the same inputs",
            ));
        }
        for (value, range) in inputs.iter().chain([&target]).zip(&mut self.table.ranges) {
            if !value.is_finite() {
                return Err(Error::usage(
                    format!("row {row} holds {value}, which is no finite number"),
                    "leave the row out",
                ));
            }
            *range = (range.0.min(*value), range.1.max(*value));
        }
        self.pending.extend_from_slice(inputs);
        self.pending.push(target);
        self.table.rows += 1;
        if self.table.rows.is_multiple_of(CHUNK) { self.flush() } else { Ok(()) }
    }

    /// The table.
    ///
    /// # Errors
    /// No rows, or a full disk.
    pub fn finish(mut self) -> Result<Table> {
        if self.table.rows == 0 {
            return Err(Error::usage("there are no rows to train on", "give at least one row of numbers"));
        }
        self.flush()?;
        Ok(self.table)
    }

    fn flush(&mut self) -> Result<()> {
        let width = self.table.inputs + 1;
        let columns = (0..width).flat_map(|k| self.pending.iter().skip(k).step_by(width).copied());
        if self.table.file.is_none() && self.table.memory.len() + self.pending.len() <= self.table.limit {
            self.table.memory.extend(columns);
        } else {
            let bytes: Vec<u8> = columns.flat_map(f64::to_ne_bytes).collect();
            let file = match &mut self.table.file {
                Some(file) => file,
                none => none.insert(Mutex::new(tempfile::tempfile().map_err(lost)?)),
            };
            // Nobody else has it yet, so that nobody can have panicked with it.
            file.get_mut().unwrap_or_else(PoisonError::into_inner).write_all(&bytes).map_err(lost)?;
        }
        self.pending.clear();
        Ok(())
    }
}
