//! Columns of nested values as Parquet keeps them: the leaves of the rows, each with two levels that tell where in the
//! row it stands.
//!
//! The *definition* level of a leaf counts how many of the optional and repeated fields on its path are there; the
//! *repetition* level tells which repeated field begins anew with it, zero for a new row. (Melnik et al., Dremel:
//! interactive analysis of web-scale datasets, VLDB 2010, section 4.1.)

use std::fs::File;
use std::sync::Arc;

use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use parquet::schema::types::{ColumnPath, SchemaDescriptor, Type};

/// Columns of counts: a signal's differences take half of the room of its distinct values.
const COUNTS: &str = "int16.list.element";

type Result<T> = std::result::Result<T, ParquetError>;

/// The values of one leaf, in the order of the rows.
#[derive(Debug, Default)]
pub struct Leaf<T> {
    values: Vec<T>,
    definition: Vec<i16>,
    repetition: Vec<i16>,
    /// Level at which a value is there.
    full: i16,
    /// Level at which the innermost list goes on.
    innermost: i16,
}

impl<T: Clone> Leaf<T> {
    /// A value; none: what is outside of it is there as far as a level.
    pub fn put(&mut self, repetition: i16, value: Option<T>, outside: i16) {
        self.repetition.push(repetition);
        self.definition.push(if value.is_some() { self.full } else { outside });
        self.values.extend(value);
    }

    /// An optional list of optional values, in something that is there as far as a level.
    pub fn put_list(&mut self, repetition: i16, values: Option<impl IntoIterator<Item = Option<T>>>, outside: i16) {
        let Some(values) = values else { return self.put(repetition, None, outside) };
        let mut repetition = Some(repetition);
        for value in values {
            self.put(repetition.take().unwrap_or(self.innermost), value, self.full - 1);
        }
        if let Some(repetition) = repetition {
            self.put(repetition, None, outside + 1);
        }
    }

    fn definition(&self) -> Option<&[i16]> {
        (self.full > 0).then_some(&self.definition)
    }

    fn repetition(&self) -> Option<&[i16]> {
        (self.innermost > 0).then_some(&self.repetition)
    }

    fn cells(&self) -> Cells<'_, T> {
        Cells { values: &self.values, definition: &self.definition, repetition: &self.repetition, full: self.full }
    }
}

/// What stands in a part of a leaf: a row, or an element of a list.
#[derive(Debug)]
pub struct Cells<'a, T> {
    values: &'a [T],
    definition: &'a [i16],
    repetition: &'a [i16],
    full: i16,
}

impl<T> Clone for Cells<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Cells<'_, T> {}

impl<'a, T: Clone> Cells<'a, T> {
    /// The parts that begin with a repetition level of at most this.
    pub fn parts(self, level: i16) -> Parts<'a, T> {
        Parts { rest: self, level }
    }

    /// Whether what encloses it is there as far as a level.
    pub fn is_there(&self, level: i16) -> bool {
        self.definition.first().is_some_and(|d| *d >= level)
    }

    /// The one value.
    pub fn value(&self) -> Option<&'a T> {
        self.values.first()
    }

    /// A list in something that is there as far as a level.
    pub fn list(&self, outside: i16) -> Option<Vec<Option<T>>> {
        if !self.is_there(outside + 1) {
            return None;
        }
        if !self.is_there(outside + 2) {
            return Some(Vec::new());
        }
        let mut values = self.values.iter().cloned();
        Some(self.definition.iter().map(|d| if *d == self.full { values.next() } else { None }).collect())
    }
}

/// The parts of a leaf, one after the other.
#[derive(Debug)]
pub struct Parts<'a, T> {
    rest: Cells<'a, T>,
    level: i16,
}

impl<'a, T> Iterator for Parts<'a, T> {
    type Item = Cells<'a, T>;

    fn next(&mut self) -> Option<Cells<'a, T>> {
        let Cells { values, definition, repetition, full } = self.rest;
        let further = repetition.get(1..)?;
        let length = further.iter().position(|r| *r <= self.level).map_or(definition.len(), |n| n + 1);
        let (definition, later) = definition.split_at(length);
        let (repetition, after) = repetition.split_at(length);
        let there = definition.iter().filter(|d| **d == full).count();
        let (values, others) = values.split_at(there.min(values.len()));
        self.rest = Cells { values: others, definition: later, repetition: after, full };
        Some(Cells { values, definition, repetition, full })
    }
}

/// A leaf of whatever kind.
#[derive(Debug)]
pub enum Column {
    /// Truth values.
    Flag(Leaf<bool>),
    /// Whole numbers of up to 32 bits.
    Int(Leaf<i32>),
    /// Whole numbers of 64 bits.
    Long(Leaf<i64>),
    /// Floats of 32 bits.
    Float(Leaf<f32>),
    /// Floats of 64 bits.
    Double(Leaf<f64>),
    /// Text.
    Text(Leaf<ByteArray>),
}

/// Values that columns are of.
pub trait Value: Sized + Clone {
    /// A column's leaf, if it is of these.
    fn leaf(column: &Column) -> Option<&Leaf<Self>>;
    /// The same, to be written to.
    fn leaf_mut(column: &mut Column) -> Option<&mut Leaf<Self>>;
}

macro_rules! value {
    ($kind:ty, $variant:ident) => {
        impl Value for $kind {
            fn leaf(column: &Column) -> Option<&Leaf<Self>> {
                if let Column::$variant(leaf) = column { Some(leaf) } else { None }
            }
            fn leaf_mut(column: &mut Column) -> Option<&mut Leaf<Self>> {
                if let Column::$variant(leaf) = column { Some(leaf) } else { None }
            }
        }
    };
}
value!(bool, Flag);
value!(i32, Int);
value!(i64, Long);
value!(f32, Float);
value!(f64, Double);
value!(ByteArray, Text);

/// Rows of a table, column by column.
#[derive(Debug)]
pub struct Columns {
    schema: Arc<Type>,
    paths: Vec<String>,
    columns: Vec<Column>,
}

impl Columns {
    /// No rows of a table.
    ///
    /// # Errors
    /// A schema that cannot be.
    pub fn of(schema: &str) -> Result<Self> {
        let schema = Arc::new(parse_message_type(schema)?);
        let about = SchemaDescriptor::new(schema.clone());
        let mut columns = Vec::new();
        for leaf in about.columns() {
            use parquet::basic::Type as Physical;
            let (full, innermost) = (leaf.max_def_level(), leaf.max_rep_level());
            columns.push(match leaf.physical_type() {
                Physical::BOOLEAN => Column::Flag(empty(full, innermost)),
                Physical::INT32 => Column::Int(empty(full, innermost)),
                Physical::INT64 => Column::Long(empty(full, innermost)),
                Physical::FLOAT => Column::Float(empty(full, innermost)),
                Physical::DOUBLE => Column::Double(empty(full, innermost)),
                Physical::BYTE_ARRAY => Column::Text(empty(full, innermost)),
                other => return Err(ParquetError::NYI(format!("columns of {other}"))),
            });
        }
        let paths = about.columns().iter().map(|leaf| leaf.path().string()).collect();
        Ok(Self { schema, paths, columns })
    }

    /// A column, to be written to.
    ///
    /// # Errors
    /// There is none of this name and kind.
    pub fn leaf_mut<T: Value>(&mut self, path: &str) -> Result<&mut Leaf<T>> {
        let n = self.paths.iter().position(|p| p == path);
        n.and_then(|n| T::leaf_mut(&mut self.columns[n])).ok_or_else(|| lacking(path))
    }

    /// A column's cells, row by row.
    ///
    /// # Errors
    /// There is none of this name and kind.
    pub fn rows<T: Value>(&self, path: &str) -> Result<Parts<'_, T>> {
        let n = self.paths.iter().position(|p| p == path);
        let leaf = n.and_then(|n| T::leaf(&self.columns[n])).ok_or_else(|| lacking(path))?;
        Ok(leaf.cells().parts(0))
    }

    /// Writes the rows as a file of one row group.
    ///
    /// # Errors
    /// Columns of different length.
    pub fn encode(&self, metadata: &[(&str, String)]) -> Result<Vec<u8>> {
        let entries = metadata.iter().map(|(key, value)| KeyValue::new((*key).to_owned(), value.clone())).collect();
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_key_value_metadata(Some(entries));
        for path in self.paths.iter().filter(|path| path.ends_with(COUNTS)) {
            let path = ColumnPath::new(path.split('.').map(str::to_owned).collect());
            properties = properties
                .set_column_dictionary_enabled(path.clone(), false)
                .set_column_encoding(path, Encoding::DELTA_BINARY_PACKED);
        }
        let properties = properties.build();
        let mut writer = SerializedFileWriter::new(Vec::new(), self.schema.clone(), Arc::new(properties))?;
        let mut group = writer.next_row_group()?;
        for column in &self.columns {
            let Some(mut out) = group.next_column()? else { break };
            match (out.untyped(), column) {
                (ColumnWriter::BoolColumnWriter(out), Column::Flag(leaf)) => {
                    out.write_batch(&leaf.values, leaf.definition(), leaf.repetition())?
                }
                (ColumnWriter::Int32ColumnWriter(out), Column::Int(leaf)) => {
                    out.write_batch(&leaf.values, leaf.definition(), leaf.repetition())?
                }
                (ColumnWriter::Int64ColumnWriter(out), Column::Long(leaf)) => {
                    out.write_batch(&leaf.values, leaf.definition(), leaf.repetition())?
                }
                (ColumnWriter::FloatColumnWriter(out), Column::Float(leaf)) => {
                    out.write_batch(&leaf.values, leaf.definition(), leaf.repetition())?
                }
                (ColumnWriter::DoubleColumnWriter(out), Column::Double(leaf)) => {
                    out.write_batch(&leaf.values, leaf.definition(), leaf.repetition())?
                }
                (ColumnWriter::ByteArrayColumnWriter(out), Column::Text(leaf)) => {
                    out.write_batch(&leaf.values, leaf.definition(), leaf.repetition())?
                }
                _ => return Err(ParquetError::General("a column of another kind".into())),
            };
            out.close()?;
        }
        group.close()?;
        writer.into_inner()
    }

    /// Reads a row group of a file; of the columns only those that are wanted.
    ///
    /// # Errors
    /// A damaged file, or one of other columns.
    pub fn read(
        file: &SerializedFileReader<File>,
        group: usize,
        schema: &str,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Self> {
        let mut columns = Self::of(schema)?;
        let group = file.get_row_group(group)?;
        let about = group.metadata();
        let rows =
            usize::try_from(about.num_rows()).map_err(|_| ParquetError::General("a negative number of rows".into()))?;
        for (path, column) in columns.paths.iter().zip(&mut columns.columns).filter(|(path, _)| wanted(path)) {
            let place = (0..about.num_columns()).find(|k| about.column(*k).column_path().string() == *path);
            let place = place.ok_or_else(|| lacking(path))?;
            match (group.get_column_reader(place)?, column) {
                (ColumnReader::BoolColumnReader(from), Column::Flag(leaf)) => leaf.fill(from, rows)?,
                (ColumnReader::Int32ColumnReader(from), Column::Int(leaf)) => leaf.fill(from, rows)?,
                (ColumnReader::Int64ColumnReader(from), Column::Long(leaf)) => leaf.fill(from, rows)?,
                (ColumnReader::FloatColumnReader(from), Column::Float(leaf)) => leaf.fill(from, rows)?,
                (ColumnReader::DoubleColumnReader(from), Column::Double(leaf)) => leaf.fill(from, rows)?,
                (ColumnReader::ByteArrayColumnReader(from), Column::Text(leaf)) => leaf.fill(from, rows)?,
                _ => return Err(lacking(path)),
            }
        }
        Ok(columns)
    }
}

impl<T: Clone> Leaf<T> {
    fn fill<D: DataType<T = T>>(&mut self, mut from: ColumnReaderImpl<D>, rows: usize) -> Result<()> {
        let mut read = 0;
        while read < rows {
            let (more, ..) = from.read_records(
                rows - read,
                Some(&mut self.definition),
                Some(&mut self.repetition),
                &mut self.values,
            )?;
            if more == 0 {
                return Err(ParquetError::EOF(format!("{read} of {rows} rows")));
            }
            read += more;
        }
        // Levels that cannot but be zero are not stored.
        let length = [self.definition.len(), self.repetition.len(), self.values.len()].into_iter().max().unwrap_or(0);
        if self.full == 0 {
            self.definition.resize(length, 0);
        }
        if self.innermost == 0 {
            self.repetition.resize(length, 0);
        }
        let there = self.definition.iter().filter(|d| **d == self.full).count();
        if self.definition.len() != self.repetition.len() || there != self.values.len() {
            return Err(ParquetError::General("levels that do not fit the values".into()));
        }
        Ok(())
    }
}

const fn empty<T>(full: i16, innermost: i16) -> Leaf<T> {
    Leaf { values: Vec::new(), definition: Vec::new(), repetition: Vec::new(), full, innermost }
}

fn lacking(path: &str) -> ParquetError {
    ParquetError::General(format!("there is no such column {path}"))
}
