//! Columns of samples on their way to a file, as CSV or Parquet: recordings, and whatever else goes sample by sample.

use std::collections::BTreeMap;
use std::io::Write;

use crate::context::Context;

/// Rows after which it is looked whether the work is to stop.
const LOOK_EVERY: usize = 4096;

/// What a column holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Numbers; NaN where there is none.
    Numbers(Vec<f64>),
    /// One of some words in each row.
    Words {
        /// Which one.
        rows: Vec<usize>,
        /// The words.
        words: Vec<String>,
    },
}

impl Values {
    fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Words { rows, .. } => rows.len(),
        }
    }
}

/// A column.
#[derive(Debug, Clone, PartialEq)]
pub struct SeriesColumn {
    /// Its name, which no other one has.
    pub name: String,
    /// What it holds.
    pub values: Values,
    /// The SI unit of its numbers.
    pub unit: Option<&'static str>,
}

/// Columns of the same length, and what is to be said of them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    columns: Vec<SeriesColumn>,
    metadata: BTreeMap<String, String>,
}

impl Series {
    /// Adds a column of numbers, with a unit if they have one. A name that is taken gets a `_2`.
    pub fn numbers(&mut self, name: impl AsRef<str>, values: Vec<f64>, unit: Option<&'static str>) {
        self.push(name.as_ref(), Values::Numbers(values), unit);
    }

    /// Adds a column of flags, 0 or 1.
    pub fn flags(&mut self, name: impl AsRef<str>, flags: &[bool]) {
        self.numbers(name, flags.iter().map(|flag| f64::from(u8::from(*flag))).collect(), None);
    }

    /// Adds a column of words.
    pub fn words(&mut self, name: impl AsRef<str>, rows: Vec<usize>, words: Vec<String>) {
        let words = words.iter().map(|word| one_line(word)).collect();
        self.push(name.as_ref(), Values::Words { rows, words }, None);
    }

    fn push(&mut self, name: &str, values: Values, unit: Option<&'static str>) {
        let mut name = one_line(name);
        while self.columns.iter().any(|c| c.name == name) {
            name.push_str("_2");
        }
        self.columns.push(SeriesColumn { name, values, unit });
    }

    /// Says something of the whole.
    pub fn say(&mut self, key: impl AsRef<str>, value: impl AsRef<str>) {
        let key = key_of(key.as_ref());
        if !key.is_empty() {
            self.metadata.insert(key, one_line(value.as_ref()));
        }
    }

    /// Takes back what is said under a key.
    pub fn unsay(&mut self, key: &str) -> Option<String> {
        self.metadata.remove(key)
    }

    /// Keeps some of the rows.
    pub fn retain(&mut self, kept: &[bool]) {
        fn those<T>(values: &mut Vec<T>, kept: &[bool]) {
            let mut kept = kept.iter();
            values.retain(|_| kept.next().is_none_or(|kept| *kept));
        }
        for column in &mut self.columns {
            match &mut column.values {
                Values::Numbers(values) => those(values, kept),
                Values::Words { rows, .. } => those(rows, kept),
            }
        }
    }

    /// The columns.
    pub fn columns(&self) -> &[SeriesColumn] {
        &self.columns
    }

    /// The columns, to go on with them without a copy.
    pub fn into_columns(self) -> Vec<SeriesColumn> {
        self.columns
    }

    /// What is said of the whole.
    pub fn metadata(&self) -> &BTreeMap<String, String> {
        &self.metadata
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// Writes them as CSV.
    ///
    /// # Errors
    /// Whatever the system refuses; an interrupt.
    pub(super) fn csv(&self, out: &mut dyn Write, ctx: &Context) -> std::io::Result<()> {
        for (key, value) in &self.metadata {
            writeln!(out, "# {key}: {value}")?;
        }
        let header: Vec<String> = self.columns.iter().map(|column| quoted(&column.name)).collect();
        writeln!(out, "{}", header.join(","))?;
        let mut line = String::new();
        for row in 0..self.rows() {
            line.clear();
            if row.is_multiple_of(LOOK_EVERY) {
                check(ctx)?;
            }
            for (k, column) in self.columns.iter().enumerate() {
                if k > 0 {
                    line.push(',');
                }
                match &column.values {
                    Values::Numbers(values) => number(&mut line, values[row]).map_err(std::io::Error::other)?,
                    Values::Words { rows, words } => line.push_str(&quoted(&words[rows[row]])),
                }
            }
            line.push('\n');
            out.write_all(line.as_bytes())?;
        }
        check(ctx)
    }
}

/// The shortest digits that read back as the same number.
fn number(line: &mut String, x: f64) -> std::fmt::Result {
    use std::fmt::Write as _;
    if x.is_nan() {
        Ok(())
    } else if x != 0.0 && (x.abs() < 1e-5 || x.abs() >= 1e16) {
        write!(line, "{x:e}")
    } else {
        write!(line, "{x}")
    }
}

/// Gives a file up whose writing is to stop.
pub(super) fn check(ctx: &Context) -> std::io::Result<()> {
    ctx.check().map_err(std::io::Error::other)
}

/// Names and values of binary files may hold anything; a text file with it in would be none.
fn one_line(text: &str) -> String {
    let words = text.split(|c: char| c.is_whitespace() || c.is_control());
    words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join(" ")
}

/// A key must not hold what ends a key.
pub(super) fn key_of(text: &str) -> String {
    one_line(&text.replace([':', '=', '#'], " "))
}

fn quoted(name: &str) -> String {
    if name.contains([',', '"', ';', '\t']) || name.starts_with(['#', '%']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}
