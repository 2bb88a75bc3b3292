//! Apache Parquet, decoded and written by the Arrow project's crate without its Arrow part.
//!
//! Units: pyarrow and polars keep a field's metadata (`unit`) in an Arrow schema that is stored, in base64, among the
//! file's metadata; the few fields needed are read from it here. Files of greyrig hold `unit:COLUMN` entries as well.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{Compression, ConvertedType, LogicalType, Repetition, TimeUnit, Type as Physical, ZstdLevel};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{DataType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnDescriptor, Type};

use super::damage::{damaged, too_large};
use super::table::{Column, MAX_VALUES, Table};
use crate::error::{Error, Result};

const BATCH: usize = 65_536;

/// Reads a Parquet file.
///
/// # Errors
/// Damaged content, too many values.
pub fn read(path: &Path) -> Result<Table> {
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    let reader = SerializedFileReader::new(file).map_err(|e| damaged(path, "Parquet", e))?;
    let about = reader.metadata().file_metadata();
    let schema = about.schema_descr_ptr();
    let rows = usize::try_from(about.num_rows()).map_err(|_| damaged(path, "Parquet", "a negative number of rows"))?;
    if rows.saturating_mul(schema.num_columns()) > MAX_VALUES {
        return Err(too_large(path, &format!("{rows} rows of {} columns", schema.num_columns())));
    }
    let mut table = Table::default();
    let mut units = BTreeMap::new();
    for KeyValue { key, value } in about.key_value_metadata().into_iter().flatten() {
        let Some(value) = value else { continue };
        if key == "ARROW:schema" {
            let (fields, metadata) = arrow_schema::parse(value).unwrap_or_default();
            units.extend(fields);
            for (key, value) in metadata.into_iter().filter(|(k, _)| k != "pandas") {
                table.metadata.entry(key).or_insert(value);
            }
        } else if let Some(column) = key.strip_prefix("unit:") {
            units.insert(column.to_owned(), value.clone());
        } else if key != "pandas" {
            table.metadata.insert(key.clone(), value.clone());
        }
    }
    for (k, descriptor) in schema.columns().iter().enumerate() {
        let name = descriptor.path().string();
        if descriptor.max_rep_level() > 0 {
            table.warnings.push(format!("column '{name}' is left out: it holds lists"));
            continue;
        }
        if !matches!(
            descriptor.physical_type(),
            Physical::BOOLEAN | Physical::INT32 | Physical::INT64 | Physical::FLOAT | Physical::DOUBLE
        ) {
            table.warnings.push(format!("column '{name}' holds no numbers and is left out"));
            table.text_columns.push(name);
            continue;
        }
        let mut values = Vec::new();
        let epoch = Cell::new(None);
        for group in 0..reader.num_row_groups() {
            let column = reader.get_row_group(group).and_then(|g| g.get_column_reader(k));
            let column = column.map_err(|e| damaged(path, "Parquet", e))?;
            append(column, descriptor, rows, &epoch, &mut values).map_err(|e| damaged(path, "Parquet", e))?;
        }
        if values.len() != rows {
            return Err(damaged(path, "Parquet", format!("column {name} has {} of {rows} rows", values.len())));
        }
        let stamp = stamp_factor(descriptor);
        if let Some(factor) = stamp {
            values.iter_mut().for_each(|t| *t *= factor);
        }
        let unit = if stamp.is_some() { Some("s".into()) } else { units.get(&name).cloned() };
        table.columns.push(Column { unit, is_time: stamp.is_some(), position: k + 1, ..Column::new(name, values) });
    }
    Ok(table)
}

/// Seconds per count of a time stamp.
fn stamp_factor(descriptor: &ColumnDescriptor) -> Option<f64> {
    match (descriptor.logical_type_ref(), descriptor.converted_type()) {
        (Some(LogicalType::Timestamp(stamp)), _) => Some(match stamp.unit {
            TimeUnit::MILLIS => 1e-3,
            TimeUnit::MICROS => 1e-6,
            TimeUnit::NANOS => 1e-9,
        }),
        (_, ConvertedType::TIMESTAMP_MILLIS) => Some(1e-3),
        (_, ConvertedType::TIMESTAMP_MICROS) => Some(1e-6),
        _ => None,
    }
}

fn append(
    column: ColumnReader,
    descriptor: &ColumnDescriptor,
    limit: usize,
    epoch: &Cell<Option<i64>>,
    out: &mut Vec<f64>,
) -> std::result::Result<(), ParquetError> {
    // Nanoseconds since 1970 do not fit a double: time stamps are counted from the first one.
    let since_first = |x: &i64| {
        let first = epoch.get().unwrap_or(*x);
        epoch.set(Some(first));
        x.saturating_sub(first) as f64
    };
    let nullable = descriptor.max_def_level();
    let unsigned = matches!(descriptor.converted_type(), ConvertedType::UINT_32);
    let unsigned_64 = matches!(descriptor.converted_type(), ConvertedType::UINT_64);
    match column {
        ColumnReader::BoolColumnReader(r) => typed(r, nullable, limit, out, |x| f64::from(u8::from(*x))),
        ColumnReader::Int32ColumnReader(r) if unsigned => typed(r, nullable, limit, out, |x| f64::from(*x as u32)),
        ColumnReader::Int32ColumnReader(r) => typed(r, nullable, limit, out, |x| f64::from(*x)),
        ColumnReader::Int64ColumnReader(r) if stamp_factor(descriptor).is_some() => {
            typed(r, nullable, limit, out, since_first)
        }
        ColumnReader::Int64ColumnReader(r) if unsigned_64 => typed(r, nullable, limit, out, |x| *x as u64 as f64),
        ColumnReader::Int64ColumnReader(r) => typed(r, nullable, limit, out, |x| *x as f64),
        ColumnReader::FloatColumnReader(r) => typed(r, nullable, limit, out, |x| f64::from(*x)),
        ColumnReader::DoubleColumnReader(r) => typed(r, nullable, limit, out, |x| *x),
        _ => Ok(()),
    }
}

fn typed<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    nullable: i16,
    limit: usize,
    out: &mut Vec<f64>,
    convert: impl Fn(&T::T) -> f64,
) -> std::result::Result<(), ParquetError> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    loop {
        values.clear();
        levels.clear();
        let (rows, ..) = reader.read_records(BATCH, (nullable > 0).then_some(&mut levels), None, &mut values)?;
        if rows == 0 {
            return Ok(());
        }
        if out.len() + rows > limit {
            return Err(ParquetError::General("a column has more rows than the file".into()));
        }
        if nullable == 0 {
            out.extend(values.iter().map(&convert));
        } else {
            let mut present = values.iter();
            out.extend(
                levels
                    .iter()
                    .map(|&l| if l == nullable { present.next().map_or(f64::NAN, &convert) } else { f64::NAN }),
            );
        }
    }
}

/// Writes columns as required doubles, zstd-compressed.
pub(super) fn write(
    columns: &[(String, Vec<f64>, Option<&str>)],
    metadata: &BTreeMap<String, String>,
    out: &mut dyn Write,
) -> std::io::Result<()> {
    let bytes = encode(columns, metadata).map_err(std::io::Error::other)?;
    out.write_all(&bytes)
}

fn encode(
    columns: &[(String, Vec<f64>, Option<&str>)],
    metadata: &BTreeMap<String, String>,
) -> std::result::Result<Vec<u8>, ParquetError> {
    let field = |name: &str| -> std::result::Result<_, ParquetError> {
        let kind = Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(Repetition::REQUIRED);
        Ok(Arc::new(kind.build()?))
    };
    let fields = columns.iter().map(|(name, ..)| field(name)).collect::<std::result::Result<Vec<_>, _>>()?;
    let schema = Arc::new(Type::group_type_builder("recording").with_fields(fields).build()?);
    let units = columns.iter().filter_map(|(name, _, unit)| Some((format!("unit:{name}"), (*unit)?.to_owned())));
    let own = metadata.iter().map(|(k, v)| (k.clone(), v.clone()));
    let entries = own.chain(units).map(|(key, value)| KeyValue { key, value: Some(value) }).collect();
    let properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::default()))
        .set_key_value_metadata(Some(entries))
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for (_, values, _) in columns {
        let Some(mut column) = group.next_column()? else { break };
        column.typed::<DoubleType>().write_batch(values, None, None)?;
        column.close()?;
    }
    group.close()?;
    writer.into_inner()
}

/// The few fields needed of an Arrow schema message: names, `unit` entries, metadata (Arrow columnar format 1.5, Schema.fbs;
/// FlatBuffers internals).
mod arrow_schema {
    use std::collections::BTreeMap;

    type Pairs = BTreeMap<String, String>;

    struct Buffer(Vec<u8>);

    impl Buffer {
        fn u16(&self, at: usize) -> Option<usize> {
            let b = self.0.get(at..at.checked_add(2)?)?;
            Some(usize::from(u16::from_le_bytes([b[0], b[1]])))
        }
        fn u32(&self, at: usize) -> Option<usize> {
            let b = self.0.get(at..at.checked_add(4)?)?;
            Some(u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
        }
        fn follow(&self, at: usize) -> Option<usize> {
            at.checked_add(self.u32(at)?)
        }
        /// Where field `k` of a table is, if present.
        fn field(&self, table: usize, k: usize) -> Option<usize> {
            let back = self.u32(table)? as u32 as i32;
            let vtable = usize::try_from(table as i64 - i64::from(back)).ok()?;
            let slot = 4 + 2 * k;
            if slot >= self.u16(vtable)? {
                return None;
            }
            match self.u16(vtable + slot)? {
                0 => None,
                offset => table.checked_add(offset),
            }
        }
        fn string(&self, at: usize) -> Option<String> {
            let at = self.follow(at)?;
            let bytes = self.0.get(at + 4..at.checked_add(4)?.checked_add(self.u32(at)?)?)?;
            Some(String::from_utf8_lossy(bytes).into_owned())
        }
        fn vector(&self, at: usize) -> Option<Vec<usize>> {
            let at = self.follow(at)?;
            let n = self.u32(at)?;
            (n <= self.0.len() / 4).then(|| (0..n).filter_map(|k| self.follow(at + 4 + 4 * k)).collect())
        }
        fn pairs(&self, at: Option<usize>) -> Pairs {
            let tables = at.and_then(|at| self.vector(at)).unwrap_or_default();
            let pair = |&t: &usize| Some((self.string(self.field(t, 0)?)?, self.string(self.field(t, 1)?)?));
            tables.iter().filter_map(pair).collect()
        }
    }

    /// Units by field, and the metadata of the schema.
    pub fn parse(base64: &str) -> Option<(Pairs, Pairs)> {
        let mut bytes = decode(base64)?;
        // A continuation mark and the length come before the message; old files lack the mark.
        let skip = if bytes.starts_with(&[0xff; 4]) { 8 } else { 4 };
        let buffer = Buffer(bytes.split_off(skip.min(bytes.len())));
        let message = buffer.follow(0)?;
        let schema = buffer.follow(buffer.field(message, 2)?)?;
        let mut units = Pairs::new();
        for field in buffer.vector(buffer.field(schema, 1)?)? {
            let name = buffer.field(field, 0).and_then(|at| buffer.string(at));
            let pairs = buffer.pairs(buffer.field(field, 6));
            let unit = ["unit", "units", "Unit"].iter().find_map(|key| pairs.get(*key));
            if let (Some(name), Some(unit)) = (name, unit) {
                units.insert(name, unit.clone());
            }
        }
        Some((units, buffer.pairs(buffer.field(schema, 2))))
    }

    fn decode(text: &str) -> Option<Vec<u8>> {
        let mut out = Vec::with_capacity(text.len() / 4 * 3);
        let (mut word, mut bits) = (0_u32, 0);
        for b in text.bytes().filter(|b| *b != b'=') {
            let digit = match b {
                b'A'..=b'Z' => b - b'A',
                b'a'..=b'z' => b - b'a' + 26,
                b'0'..=b'9' => b - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                _ => return None,
            };
            word = word << 6 | u32::from(digit);
            bits += 6;
            if bits >= 8 {
                bits -= 8;
                out.push((word >> bits) as u8);
                word &= (1 << bits) - 1;
            }
        }
        Some(out)
    }
}
