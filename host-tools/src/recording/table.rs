//! What every reader delivers: named columns of numbers, before names, units and time are interpreted.

use std::collections::BTreeMap;

/// Readers refuse more than this many numbers (samples times columns) in one file: 400 MB of memory, or 28 minutes of
/// three channels at 10 kHz. A longer run is cut into several recordings.
pub const MAX_VALUES: usize = 50_000_000;

/// A column of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Column {
    /// Its full name, unique in the file (`Measurement/u`); what `--map` refers to.
    pub name: String,
    /// The last part of the name as it stands in the file (`u [V]`); what is recognised.
    pub label: String,
    /// The unit, where the file states it apart from the name.
    pub unit: Option<String>,
    /// The values; NaN where one is missing.
    pub values: Vec<f64>,
    /// Columns of one raster were sampled together and have the same length.
    pub raster: usize,
    /// Sampling interval of its raster, s, where the format stores one.
    pub interval_s: Option<f64>,
    /// Time of the first sample of its raster, s.
    pub start_s: f64,
    /// The format declares this column to be the time of its raster.
    pub is_time: bool,
    /// Position among the columns of the file, from one; zero where the format has no such order.
    pub position: usize,
}

impl Column {
    /// A column with a name, in the first raster.
    pub fn new(name: impl Into<String>, values: Vec<f64>) -> Self {
        let name = name.into();
        Self { label: name.clone(), name, values, ..Self::default() }
    }
}

/// A column that a reader does not deliver.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftOut {
    /// Its name.
    pub name: String,
    /// Why.
    pub reason: String,
}

/// The content of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// All numeric columns.
    pub columns: Vec<Column>,
    /// Whatever the file says about itself.
    pub metadata: BTreeMap<String, String>,
    /// Columns that are not delivered; a mapping may ask for one.
    pub left_out: Vec<LeftOut>,
    /// For text files, the line of each row, from one; else empty.
    pub lines: Vec<u32>,
    /// What the reader had to leave out or assume.
    pub warnings: Vec<String>,
}

impl Table {
    /// The line of a row in a text file; zero where there are no lines.
    pub fn line(&self, row: usize) -> usize {
        self.lines.get(row).map_or(0, |&l| l as usize)
    }

    /// Leaves a column out, and says so.
    pub fn leave_out(&mut self, name: impl Into<String>, reason: impl std::fmt::Display) {
        let (name, reason) = (name.into(), reason.to_string().split_whitespace().collect::<Vec<_>>().join(" "));
        self.warnings.push(format!("column '{name}' is left out: {reason}"));
        self.left_out.push(LeftOut { name, reason });
    }

    /// Gives columns of the same name in different groups their full path, so that each can be named.
    pub fn make_names_unique(&mut self, paths: &[String]) {
        let mut seen: BTreeMap<String, usize> = BTreeMap::new();
        for column in &self.columns {
            *seen.entry(column.name.clone()).or_default() += 1;
        }
        for (column, path) in self.columns.iter_mut().zip(paths) {
            if seen.get(&column.name).is_some_and(|&n| n > 1) {
                column.name.clone_from(path);
            }
        }
    }
}
