//! Apache Parquet, decoded and written by the Arrow project's crate without its Arrow part.
//!
//! Units: pyarrow and polars keep a field's metadata (`unit`) in an Arrow schema that is stored, in base64, among the
//! file's metadata; the few fields needed are read from it here. Files of greyrig hold `unit:COLUMN` entries as well.

mod footer;

use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{Compression, ConvertedType, LogicalType, Repetition, TimeUnit, Type as Physical, ZstdLevel};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl, get_column_reader};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::metadata::{ColumnChunkMetaData, KeyValue, ParquetMetaData, ParquetMetaDataReader};
use parquet::file::properties::WriterProperties;
use parquet::file::serialized_reader::SerializedPageReader;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnDescriptor, Type};

use super::damage::{damaged, too_large};
use super::series::{Series, SeriesColumn, Values};
use super::table::{Column, MAX_VALUES, Table};
use super::time_axis;
use crate::error::{Error, Result};

const BATCH: usize = 65_536;

/// What the numbers of a column mean.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Meaning {
    /// Numbers, times a factor.
    Number(f64),
    /// Instants in seconds times a factor, counted from the first one: nanoseconds since 1970 do not fit a double.
    Instant(f64),
    /// Seconds since midnight, times a factor.
    TimeOfDay(f64),
    /// A time span, in seconds times a factor.
    Span(f64),
    /// Big-endian integers, times a factor.
    Decimal(f64),
    /// Floats of 16 bits.
    Half,
}

impl Meaning {
    /// Of a column, or why it has none.
    fn of(descriptor: &ColumnDescriptor, span: Option<f64>) -> std::result::Result<Self, &'static str> {
        let seconds = |unit: TimeUnit| match unit {
            TimeUnit::MILLIS => 1e-3,
            TimeUnit::MICROS => 1e-6,
            TimeUnit::NANOS => 1e-9,
        };
        let (logical, converted) = (descriptor.logical_type_ref(), descriptor.converted_type());
        let scale = match logical {
            Some(LogicalType::Decimal(decimal)) => Some(decimal.scale),
            _ => (converted == ConvertedType::DECIMAL).then(|| descriptor.type_scale()),
        };
        let meaning = match (logical, converted) {
            (Some(LogicalType::Timestamp(stamp)), _) => Self::Instant(seconds(stamp.unit)),
            (_, ConvertedType::TIMESTAMP_MILLIS) => Self::Instant(1e-3),
            (_, ConvertedType::TIMESTAMP_MICROS) => Self::Instant(1e-6),
            (Some(LogicalType::Time(time)), _) => Self::TimeOfDay(seconds(time.unit)),
            (_, ConvertedType::TIME_MILLIS) => Self::TimeOfDay(1e-3),
            (_, ConvertedType::TIME_MICROS) => Self::TimeOfDay(1e-6),
            (Some(LogicalType::Float16), _) => Self::Half,
            (Some(LogicalType::Date), _) | (_, ConvertedType::DATE) => return Err("it holds dates"),
            (_, ConvertedType::INTERVAL) => return Err("it holds intervals of the calendar"),
            _ => span.map_or(Self::Number(1.0), Self::Span),
        };
        match (descriptor.physical_type(), scale) {
            (Physical::INT96, _) => Ok(Self::Instant(1e-9)),
            (Physical::BYTE_ARRAY | Physical::FIXED_LEN_BYTE_ARRAY, Some(scale)) => {
                Ok(Self::Decimal(10_f64.powi(-scale)))
            }
            (Physical::INT32 | Physical::INT64, Some(scale)) => Ok(Self::Number(10_f64.powi(-scale))),
            (Physical::FIXED_LEN_BYTE_ARRAY, None) if meaning == Self::Half => Ok(meaning),
            (Physical::BYTE_ARRAY | Physical::FIXED_LEN_BYTE_ARRAY, None) => Err("it holds no numbers"),
            _ => Ok(meaning),
        }
    }

    const fn is_time(self) -> bool {
        matches!(self, Self::Instant(_) | Self::TimeOfDay(_))
    }

    const fn in_seconds(self) -> bool {
        self.is_time() || matches!(self, Self::Span(_))
    }
}

/// Reads a Parquet file.
///
/// # Errors
/// Damaged content, among it a page whose checksum does not hold, and too many values.
pub fn read(path: &Path) -> Result<Table> {
    let file = Arc::new(File::open(path).map_err(|e| Error::io(path, e))?);
    let content = content(&file).map_err(|e| damaged(path, "Parquet", e))?;
    let about = content.file_metadata();
    let schema = about.schema_descr_ptr();
    let rows = usize::try_from(about.num_rows()).map_err(|_| damaged(path, "Parquet", "a negative number of rows"))?;
    if rows.saturating_mul(schema.num_columns()) > MAX_VALUES {
        return Err(too_large(path, &format!("{rows} rows of {} columns", schema.num_columns())));
    }
    let mut table = Table::default();
    let (mut units, mut spans) = (BTreeMap::new(), BTreeMap::new());
    for KeyValue { key, value } in about.key_value_metadata().into_iter().flatten() {
        let Some(value) = value else { continue };
        if key == "ARROW:schema" {
            let stored = arrow_schema::parse(value).unwrap_or_default();
            units.extend(stored.units);
            spans.extend(stored.spans_s);
            for (key, value) in stored.metadata.into_iter().filter(|(k, _)| k != "pandas") {
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
            table.leave_out(name, "it holds lists");
            continue;
        }
        let meaning = match Meaning::of(descriptor, spans.get(&name).copied()) {
            Ok(meaning) => meaning,
            Err(reason) => {
                table.leave_out(name, reason);
                continue;
            }
        };
        let mut values = Vec::with_capacity(rows);
        let epoch = Cell::new(None);
        for group in content.row_groups() {
            let pages = pages(&file, group.column(k), group.num_rows()).map_err(|e| damaged(path, "Parquet", e))?;
            let column = get_column_reader(descriptor.clone(), Box::new(pages));
            append(column, descriptor, meaning, rows, &epoch, &mut values).map_err(|e| damaged(path, "Parquet", e))?;
        }
        if values.len() != rows {
            return Err(damaged(path, "Parquet", format!("column {name} has {} of {rows} rows", values.len())));
        }
        if let Meaning::TimeOfDay(_) = meaning {
            time_axis::over_midnight(&mut values);
        }
        let unit = if meaning.in_seconds() { Some("s".into()) } else { units.get(&name).cloned() };
        table.columns.push(Column { unit, is_time: meaning.is_time(), position: k + 1, ..Column::new(name, values) });
    }
    Ok(table)
}

/// What the footer says, without what is not needed where the decoder does not understand that.
fn content(file: &Arc<File>) -> std::result::Result<ParquetMetaData, ParquetError> {
    let told = ParquetMetaDataReader::new().parse_and_finish(&**file);
    told.or_else(|error| {
        let bare = || {
            let mut file = &**file;
            // Its length and the magic number are the last eight bytes.
            let (mut tail, end) = ([0; 8], file.seek(SeekFrom::End(-8)).ok()?);
            file.read_exact(&mut tail).ok()?;
            let length = u64::from(u32::from_le_bytes(*tail.first_chunk()?));
            file.seek(SeekFrom::Start(end.checked_sub(length)?)).ok()?;
            let mut footer = Vec::new();
            file.take(length).read_to_end(&mut footer).ok()?;
            ParquetMetaDataReader::decode_metadata(&footer::without_extensions(&footer)?).ok()
        };
        bare().ok_or(error)
    })
}

/// The pages of a column. Some writers state a dictionary at the begin of the file, where none can be, for "none".
fn pages(
    file: &Arc<File>,
    column: &ColumnChunkMetaData,
    rows: i64,
) -> std::result::Result<SerializedPageReader<File>, ParquetError> {
    let rows = usize::try_from(rows).map_err(|_| ParquetError::General("a negative number of rows".into()))?;
    let stated = column.dictionary_page_offset();
    let column = match stated {
        Some(offset) if offset <= 0 => column.clone().into_builder().set_dictionary_page_offset(None).build()?,
        _ => column.clone(),
    };
    SerializedPageReader::new(file.clone(), &column, rows, None)
}

fn append(
    column: ColumnReader,
    descriptor: &ColumnDescriptor,
    meaning: Meaning,
    limit: usize,
    epoch: &Cell<Option<i64>>,
    out: &mut Vec<f64>,
) -> std::result::Result<(), ParquetError> {
    let since_first = |x: i64| {
        let first = epoch.get().unwrap_or(x);
        epoch.set(Some(first));
        x.saturating_sub(first) as f64
    };
    let factor = match meaning {
        Meaning::Number(f) | Meaning::Instant(f) | Meaning::TimeOfDay(f) | Meaning::Span(f) | Meaning::Decimal(f) => f,
        Meaning::Half => 1.0,
    };
    let signed = match (descriptor.logical_type_ref(), descriptor.converted_type()) {
        (Some(LogicalType::Integer(integer)), _) => integer.is_signed,
        (_, kind) => !matches!(
            kind,
            ConvertedType::UINT_8 | ConvertedType::UINT_16 | ConvertedType::UINT_32 | ConvertedType::UINT_64
        ),
    };
    let nullable = descriptor.max_def_level();
    let instant = matches!(meaning, Meaning::Instant(_));
    let bytes = |bytes: &[u8]| match meaning {
        Meaning::Half => bytes.first_chunk().map_or(f64::NAN, |b| half::f16::from_le_bytes(*b).to_f64()),
        _ => scaled(two_s_complement(bytes), factor),
    };
    match column {
        ColumnReader::BoolColumnReader(r) => typed(r, nullable, limit, out, |x| f64::from(u8::from(*x))),
        ColumnReader::Int32ColumnReader(r) if !signed => typed(r, nullable, limit, out, |x| f64::from(*x as u32)),
        ColumnReader::Int32ColumnReader(r) => typed(r, nullable, limit, out, |x| scaled(f64::from(*x), factor)),
        ColumnReader::Int64ColumnReader(r) if instant => typed(r, nullable, limit, out, |x| since_first(*x) * factor),
        ColumnReader::Int64ColumnReader(r) if !signed => typed(r, nullable, limit, out, |x| *x as u64 as f64),
        ColumnReader::Int64ColumnReader(r) => typed(r, nullable, limit, out, |x| scaled(*x as f64, factor)),
        ColumnReader::Int96ColumnReader(r) => typed(r, nullable, limit, out, |x| since_first(x.to_nanos()) * factor),
        ColumnReader::FloatColumnReader(r) => typed(r, nullable, limit, out, |x| f64::from(*x)),
        ColumnReader::DoubleColumnReader(r) => typed(r, nullable, limit, out, |x| *x),
        ColumnReader::ByteArrayColumnReader(r) => typed(r, nullable, limit, out, |x| bytes(x.data())),
        ColumnReader::FixedLenByteArrayColumnReader(r) => typed(r, nullable, limit, out, |x| bytes(x.data())),
    }
}

/// A power of ten below one is a divisor, so that decimals come out as they are written.
fn scaled(x: f64, factor: f64) -> f64 {
    if factor < 1.0 { x / (1.0 / factor).round() } else { x * factor }
}

/// A big-endian integer of any length.
fn two_s_complement(bytes: &[u8]) -> f64 {
    let negative = bytes.first().is_some_and(|b| b & 0x80 != 0);
    let digit = |b: &u8| if negative { !b } else { *b };
    let magnitude = bytes.iter().fold(0.0, |sum, b| sum * 256.0 + f64::from(digit(b)));
    if negative { -magnitude - 1.0 } else { magnitude }
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

/// Writes columns as required doubles and strings, zstd-compressed.
pub(super) fn write(series: &Series, out: &mut dyn Write) -> std::io::Result<()> {
    let bytes = encode(series).map_err(std::io::Error::other)?;
    out.write_all(&bytes)
}

fn encode(series: &Series) -> std::result::Result<Vec<u8>, ParquetError> {
    let field = |column: &SeriesColumn| -> std::result::Result<_, ParquetError> {
        let kind = match column.values {
            Values::Numbers(_) => Type::primitive_type_builder(&column.name, Physical::DOUBLE),
            Values::Words { .. } => Type::primitive_type_builder(&column.name, Physical::BYTE_ARRAY)
                .with_logical_type(Some(LogicalType::String)),
        };
        Ok(Arc::new(kind.with_repetition(Repetition::REQUIRED).build()?))
    };
    let fields = series.columns().iter().map(field).collect::<std::result::Result<Vec<_>, _>>()?;
    let schema = Arc::new(Type::group_type_builder("recording").with_fields(fields).build()?);
    let units = series.columns().iter().filter_map(|column| Some((format!("unit:{}", column.name), column.unit?)));
    let units = units.map(|(key, unit)| (key, unit.to_owned()));
    let own = series.metadata().iter().map(|(k, v)| (k.clone(), v.clone()));
    let entries = own.chain(units).map(|(key, value)| KeyValue { key, value: Some(value) }).collect();
    let properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::default()))
        .set_key_value_metadata(Some(entries))
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for SeriesColumn { values, .. } in series.columns() {
        let Some(mut column) = group.next_column()? else { break };
        match values {
            Values::Numbers(values) => {
                column.typed::<DoubleType>().write_batch(values, None, None)?;
            }
            Values::Words { rows, words } => {
                let words: Vec<ByteArray> = words.iter().map(|word| ByteArray::from(word.as_str())).collect();
                let rows: Vec<ByteArray> = rows.iter().map(|row| words[*row].clone()).collect();
                column.typed::<ByteArrayType>().write_batch(&rows, None, None)?;
            }
        }
        column.close()?;
    }
    group.close()?;
    writer.into_inner()
}

/// The few fields needed of an Arrow schema message: names, `unit` entries, units of time spans, metadata (Arrow
/// columnar format 1.5, Schema.fbs; FlatBuffers internals).
mod arrow_schema {
    use std::collections::BTreeMap;

    type Pairs = BTreeMap<String, String>;

    /// What a schema says.
    #[derive(Default)]
    pub struct Stored {
        /// Units by field.
        pub units: Pairs,
        /// Seconds per count of the fields that are time spans, which Parquet has no type for.
        pub spans_s: BTreeMap<String, f64>,
        /// Metadata of the whole.
        pub metadata: Pairs,
    }

    /// Number of the type "Duration" in the union of types.
    const DURATION: u8 = 18;

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

    /// Takes a schema apart.
    pub fn parse(base64: &str) -> Option<Stored> {
        let mut bytes = decode(base64)?;
        // A continuation mark and the length come before the message; old files lack the mark.
        let skip = if bytes.starts_with(&[0xff; 4]) { 8 } else { 4 };
        let buffer = Buffer(bytes.split_off(skip.min(bytes.len())));
        let message = buffer.follow(0)?;
        let schema = buffer.follow(buffer.field(message, 2)?)?;
        let mut stored = Stored::default();
        for field in buffer.vector(buffer.field(schema, 1)?)? {
            let Some(name) = buffer.field(field, 0).and_then(|at| buffer.string(at)) else { continue };
            let pairs = buffer.pairs(buffer.field(field, 6));
            if let Some(unit) = ["unit", "units", "Unit"].iter().find_map(|key| pairs.get(*key)) {
                stored.units.insert(name.clone(), unit.clone());
            }
            let kind = buffer.field(field, 2).and_then(|at| buffer.0.get(at).copied());
            if kind == Some(DURATION)
                && let Some(span) = buffer.field(field, 3).and_then(|at| buffer.follow(at))
            {
                // Milliseconds are the default, which is not stored.
                let unit = buffer.field(span, 0).and_then(|at| buffer.u16(at)).unwrap_or(1);
                stored.spans_s.insert(name, [1.0, 1e-3, 1e-6, 1e-9][unit.min(3)]);
            }
        }
        stored.metadata = buffer.pairs(buffer.field(schema, 2));
        Some(stored)
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
