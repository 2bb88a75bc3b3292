//! Arrow IPC files and Feather version 2, decoded by the Arrow project's crates.

use std::io::Cursor;
use std::path::Path;

use arrow_array::cast::AsArray;
use arrow_array::types::{
    ArrowPrimitiveType, Decimal32Type, Decimal64Type, Decimal128Type, DurationMicrosecondType, DurationMillisecondType,
    DurationNanosecondType, DurationSecondType, Float16Type, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type,
    Int64Type, Time32MillisecondType, Time32SecondType, Time64MicrosecondType, Time64NanosecondType,
    TimestampMicrosecondType, TimestampMillisecondType, TimestampNanosecondType, TimestampSecondType, UInt8Type,
    UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_ipc::reader::FileReader;
use arrow_ipc::{root_as_footer, root_as_message};
use arrow_schema::{ArrowError, DataType, Schema, TimeUnit};

use super::damage::{damaged, too_large};
use super::table::{Column, MAX_VALUES, Table};
use super::time_axis;
use crate::error::{Error, Result};

/// Reads an Arrow IPC file.
///
/// # Errors
/// Damaged content, too many values.
pub fn read(path: &Path) -> Result<Table> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    refuse_bombs(&bytes).map_err(|reason| damaged(path, "Arrow", reason))?;
    let reader = FileReader::try_new(Cursor::new(&bytes), None).map_err(|e| damaged(path, "Arrow", e))?;
    table(path, &reader.schema(), reader)
}

/// The columns of record batches: of a file, or of another program's memory.
///
/// # Errors
/// A batch that cannot be had, too many values.
pub fn table(
    path: &Path,
    schema: &Schema,
    batches: impl Iterator<Item = std::result::Result<RecordBatch, ArrowError>>,
) -> Result<Table> {
    let mut table = Table { metadata: schema.metadata().clone().into_iter().collect(), ..Table::default() };
    table.metadata.remove("pandas");
    let mut columns: Vec<Option<Vec<f64>>> = vec![Some(Vec::new()); schema.fields().len()];
    let mut epochs: Vec<Option<i64>> = vec![None; columns.len()];
    let mut total = 0_usize;
    for batch in batches {
        let batch = batch.map_err(|e| damaged(path, "Arrow", e))?;
        total += batch.num_rows() * batch.num_columns();
        if total > MAX_VALUES {
            return Err(too_large(path, &format!("more than {total} numbers")));
        }
        for (k, array) in batch.columns().iter().enumerate() {
            columns[k] = match (columns[k].take(), numbers(array, &mut epochs[k])) {
                (Some(mut all), Some(values)) => {
                    all.extend(values);
                    Some(all)
                }
                _ => None,
            };
        }
    }
    for (k, (values, field)) in columns.into_iter().zip(schema.fields()).enumerate() {
        let name = field.name().clone();
        let Some(mut values) = values else {
            table.leave_out(name, "it holds no numbers");
            continue;
        };
        let kind = field.data_type();
        let seconds = match kind {
            DataType::Timestamp(unit, _)
            | DataType::Time32(unit)
            | DataType::Time64(unit)
            | DataType::Duration(unit) => Some(match unit {
                TimeUnit::Second => 1.0,
                TimeUnit::Millisecond => 1e-3,
                TimeUnit::Microsecond => 1e-6,
                TimeUnit::Nanosecond => 1e-9,
            }),
            _ => None,
        };
        if let Some(factor) = seconds {
            values.iter_mut().for_each(|t| *t *= factor);
        }
        if let DataType::Time32(_) | DataType::Time64(_) = kind {
            time_axis::over_midnight(&mut values);
        }
        let stated = ["unit", "units", "Unit"].iter().find_map(|key| field.metadata().get(key).cloned());
        let unit = if seconds.is_some() { Some("s".into()) } else { stated };
        let is_time = seconds.is_some() && !matches!(kind, DataType::Duration(_));
        table.columns.push(Column { unit, is_time, position: k + 1, ..Column::new(name, values) });
    }
    Ok(table)
}

/// Checks the unpacked sizes that compressed buffers claim: the decoder allocates them unseen, and a failed allocation
/// ends the program. The layout is that of the Arrow columnar format 1.5, "IPC File Format".
fn refuse_bombs(bytes: &[u8]) -> std::result::Result<(), &'static str> {
    const CUT: &str = "it ends too early";
    let tail = bytes.len().checked_sub(10).ok_or(CUT)?;
    let word = |at: usize| -> Option<usize> {
        let b = bytes.get(at..at.checked_add(4)?)?;
        usize::try_from(i32::from_le_bytes([b[0], b[1], b[2], b[3]])).ok()
    };
    let start = tail.checked_sub(word(tail).ok_or("the length of the footer is negative")?).ok_or(CUT)?;
    let footer = root_as_footer(&bytes[start..tail]).map_err(|_| "the footer is damaged")?;
    let blocks = [footer.recordBatches(), footer.dictionaries()];
    for block in blocks.iter().flatten().flatten() {
        let at = usize::try_from(block.offset()).map_err(|_| CUT)?;
        let body = usize::try_from(block.metaDataLength()).ok().and_then(|n| at.checked_add(n)).ok_or(CUT)?;
        // A mark of four bytes precedes the length, except in old files.
        let skip = if bytes.get(at..at.saturating_add(4)) == Some(&[0xff; 4][..]) { 8 } else { 4 };
        let message = at.checked_add(skip).and_then(|from| bytes.get(from..body)).ok_or(CUT)?;
        let message = root_as_message(message).map_err(|_| "a message is damaged")?;
        let batch = message.header_as_record_batch();
        let batch = batch.or_else(|| message.header_as_dictionary_batch().and_then(|d| d.data()));
        let Some(batch) = batch.filter(|b| b.compression().is_some()) else { continue };
        for buffer in batch.buffers().iter().flatten().filter(|b| b.length() > 0) {
            let from = usize::try_from(buffer.offset()).ok().and_then(|n| body.checked_add(n)).ok_or(CUT)?;
            let size = from.checked_add(8).and_then(|end| bytes.get(from..end)).ok_or(CUT)?;
            let size = i64::from_le_bytes(size.try_into().map_err(|_| CUT)?);
            // -1 stands for a buffer that was left unpacked.
            if !(-1..=8 * MAX_VALUES as i64).contains(&size) {
                return Err("a compressed buffer claims an impossible size");
            }
        }
    }
    Ok(())
}

/// The numbers of an array; instants are counted from the first one, `epoch`, since nanoseconds since 1970 do not fit a
/// double.
fn numbers(array: &ArrayRef, epoch: &mut Option<i64>) -> Option<Vec<f64>> {
    fn each<T: ArrowPrimitiveType>(array: &ArrayRef, convert: impl Fn(T::Native) -> f64) -> Option<Vec<f64>> {
        let array = array.as_primitive_opt::<T>()?;
        Some(array.iter().map(|x| x.map_or(f64::NAN, &convert)).collect())
    }
    fn since<T: ArrowPrimitiveType<Native = i64>>(array: &ArrayRef, epoch: &mut Option<i64>) -> Option<Vec<f64>> {
        let array = array.as_primitive_opt::<T>()?;
        let counted = array.iter().map(|x| x.map_or(f64::NAN, |x| x.saturating_sub(*epoch.get_or_insert(x)) as f64));
        Some(counted.collect())
    }
    let decimal = |scale: i8| move |x: f64| x / 10_f64.powi(i32::from(scale));
    match array.data_type() {
        DataType::Float64 => each::<Float64Type>(array, |x| x),
        DataType::Float32 => each::<Float32Type>(array, f64::from),
        DataType::Float16 => each::<Float16Type>(array, f64::from),
        DataType::Int8 => each::<Int8Type>(array, f64::from),
        DataType::Int16 => each::<Int16Type>(array, f64::from),
        DataType::Int32 => each::<Int32Type>(array, f64::from),
        DataType::Int64 => each::<Int64Type>(array, |x| x as f64),
        DataType::UInt8 => each::<UInt8Type>(array, f64::from),
        DataType::UInt16 => each::<UInt16Type>(array, f64::from),
        DataType::UInt32 => each::<UInt32Type>(array, f64::from),
        DataType::UInt64 => each::<UInt64Type>(array, |x| x as f64),
        DataType::Decimal32(_, scale) => each::<Decimal32Type>(array, |x| decimal(*scale)(f64::from(x))),
        DataType::Decimal64(_, scale) => each::<Decimal64Type>(array, |x| decimal(*scale)(x as f64)),
        DataType::Decimal128(_, scale) => each::<Decimal128Type>(array, |x| decimal(*scale)(x as f64)),
        DataType::Timestamp(TimeUnit::Second, _) => since::<TimestampSecondType>(array, epoch),
        DataType::Timestamp(TimeUnit::Millisecond, _) => since::<TimestampMillisecondType>(array, epoch),
        DataType::Timestamp(TimeUnit::Microsecond, _) => since::<TimestampMicrosecondType>(array, epoch),
        DataType::Timestamp(TimeUnit::Nanosecond, _) => since::<TimestampNanosecondType>(array, epoch),
        DataType::Time32(TimeUnit::Second) => each::<Time32SecondType>(array, f64::from),
        DataType::Time32(_) => each::<Time32MillisecondType>(array, f64::from),
        DataType::Time64(TimeUnit::Microsecond) => each::<Time64MicrosecondType>(array, |x| x as f64),
        DataType::Time64(_) => each::<Time64NanosecondType>(array, |x| x as f64),
        DataType::Duration(TimeUnit::Second) => each::<DurationSecondType>(array, |x| x as f64),
        DataType::Duration(TimeUnit::Millisecond) => each::<DurationMillisecondType>(array, |x| x as f64),
        DataType::Duration(TimeUnit::Microsecond) => each::<DurationMicrosecondType>(array, |x| x as f64),
        DataType::Duration(TimeUnit::Nanosecond) => each::<DurationNanosecondType>(array, |x| x as f64),
        DataType::Boolean => {
            let array = array.as_boolean_opt()?;
            Some(
                (0..array.len())
                    .map(|k| if array.is_null(k) { f64::NAN } else { f64::from(u8::from(array.value(k))) })
                    .collect(),
            )
        }
        DataType::Dictionary(..) => {
            let array = array.as_any_dictionary_opt()?;
            let values = numbers(array.values(), epoch)?;
            let keys = array.normalized_keys();
            let at =
                |k: usize| if array.is_null(k) { f64::NAN } else { values.get(keys[k]).copied().unwrap_or(f64::NAN) };
            Some((0..keys.len()).map(at).collect())
        }
        _ => None,
    }
}
