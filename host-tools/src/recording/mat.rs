//! MATLAB .mat, levels 4 and 5; level 7.3 is HDF5.
//!
//! Own reader after MathWorks' "MAT-File Format" (2023), because structs, which is how colleagues send recordings, and
//! level 4 are needed. Vectors become columns, matrices one column per channel, scalars and texts metadata. A struct
//! `rec` with the fields `t`, `u`, `i` gives columns of these names; texts in its field `unit` (`unit.u = 'V'`) are
//! units.

use std::io::Read;
use std::path::Path;

use super::arrays::{Found, TOO_MANY};
use super::damage::{damaged, too_large};
use super::table::{MAX_VALUES, Table};
use crate::error::{Error, Result};

type Parsed<T> = std::result::Result<T, &'static str>;

/// Structs nest; damaged files nest without end.
const DEEPEST: usize = 16;

/// Reads a .mat file.
///
/// # Errors
/// Damaged content, too many values.
pub fn read(path: &Path) -> Result<Table> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let mut found = Found::default();
    let parsed = if bytes.get(126..128).is_some_and(|e| e == b"IM" || e == b"MI") {
        level_5(&bytes, &mut found)
    } else {
        level_4(&bytes, &mut found)
    };
    match parsed {
        Err(TOO_MANY) => return Err(too_large(path, TOO_MANY)),
        Err(reason) => return Err(damaged(path, "MATLAB", reason)),
        Ok(()) => {}
    }
    Ok(found.table())
}

struct Cursor<'a> {
    bytes: &'a [u8],
    big: bool,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, n: usize) -> Parsed<&'a [u8]> {
        let (head, tail) = self.bytes.split_at_checked(n).ok_or("it ends within an array")?;
        self.bytes = tail;
        Ok(head)
    }
    fn u32(&mut self) -> Parsed<u32> {
        let b = self.take(4)?;
        let b = [b[0], b[1], b[2], b[3]];
        Ok(if self.big { u32::from_be_bytes(b) } else { u32::from_le_bytes(b) })
    }
}

/// Numbers of a level 5 data type.
fn numbers(kind: u32, bytes: &[u8], big: bool) -> Parsed<Vec<f64>> {
    fn each<const N: usize>(bytes: &[u8], big: bool, convert: fn([u8; N]) -> f64) -> Vec<f64> {
        let chunk = |c: &[u8]| {
            let mut b = [0; N];
            b.copy_from_slice(c);
            if big {
                b.reverse();
            }
            convert(b)
        };
        bytes.chunks_exact(N).map(chunk).collect()
    }
    Ok(match kind {
        1 => each::<1>(bytes, big, |b| f64::from(b[0] as i8)),
        2 | 16 => each::<1>(bytes, big, |b| f64::from(b[0])),
        3 => each::<2>(bytes, big, |b| f64::from(i16::from_le_bytes(b))),
        4 | 17 => each::<2>(bytes, big, |b| f64::from(u16::from_le_bytes(b))),
        5 => each::<4>(bytes, big, |b| f64::from(i32::from_le_bytes(b))),
        6 => each::<4>(bytes, big, |b| f64::from(u32::from_le_bytes(b))),
        7 => each::<4>(bytes, big, |b| f64::from(f32::from_le_bytes(b))),
        9 => each::<8>(bytes, big, f64::from_le_bytes),
        12 => each::<8>(bytes, big, |b| i64::from_le_bytes(b) as f64),
        13 => each::<8>(bytes, big, |b| u64::from_le_bytes(b) as f64),
        _ => return Err("a data type is not known"),
    })
}

fn level_5(bytes: &[u8], found: &mut Found) -> Parsed<()> {
    let big = bytes[126] == b'M';
    let mut cursor = Cursor { bytes: &bytes[128..], big };
    while cursor.bytes.len() >= 8 {
        let (kind, body) = element(&mut cursor)?;
        match kind {
            14 => matrix_5(body, big, &[], found, 0)?,
            15 => {
                // The limit on numbers bounds what a small file may unpack to.
                let mut unpacked = Vec::new();
                let limit = (MAX_VALUES as u64) * 8;
                let read = flate2::read::ZlibDecoder::new(body).take(limit + 1).read_to_end(&mut unpacked);
                read.map_err(|_| "a compressed array is damaged")?;
                if unpacked.len() as u64 > limit {
                    return Err(TOO_MANY);
                }
                let mut inner = Cursor { bytes: &unpacked, big };
                let (kind, body) = element(&mut inner)?;
                if kind == 14 {
                    matrix_5(body, big, &[], found, 0)?;
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// A tagged element: its type and its bytes; padding to eight bytes is skipped.
fn element<'a>(cursor: &mut Cursor<'a>) -> Parsed<(u32, &'a [u8])> {
    let tag = cursor.u32()?;
    if tag >> 16 != 0 {
        // The small form: length and type in one word, the data in the next.
        let (size, data) = ((tag >> 16) as usize, cursor.take(4)?);
        return Ok((tag & 0xffff, data.get(..size).ok_or("a small element is too long")?));
    }
    let size = cursor.u32()? as usize;
    let data = cursor.take(size)?;
    // Compressed elements are not padded, and the last one need not be.
    let padding = if tag == 15 { 0 } else { size.next_multiple_of(8) - size };
    cursor.take(padding.min(cursor.bytes.len()))?;
    Ok((tag, data))
}

/// Bit of the flags that tells of an imaginary part.
const COMPLEX: u32 = 0x0800;
/// What is said of one.
const IS_COMPLEX: &str = "it is complex: give real samples";

fn matrix_5(bytes: &[u8], big: bool, path: &[String], found: &mut Found, depth: usize) -> Parsed<()> {
    if bytes.is_empty() || depth > DEEPEST {
        return Ok(());
    }
    let mut cursor = Cursor { bytes, big };
    let (_, flags) = element(&mut cursor)?;
    let flags = Cursor { bytes: flags, big }.u32()?;
    let class = flags & 0xff;
    let named = |name: &[u8]| {
        let name = String::from_utf8_lossy(name).trim_end_matches('\0').to_owned();
        let mut path = path.to_vec();
        if !name.is_empty() {
            path.push(name);
        }
        path
    };
    if class == OPAQUE {
        let (_, name) = element(&mut cursor)?;
        let path = named(name);
        // The type system comes before the class.
        element(&mut cursor)?;
        let (_, class) = element(&mut cursor)?;
        let class = String::from_utf8_lossy(class).trim_end_matches('\0').to_owned();
        found.leave_out(&path, &format!("it is a MATLAB object ({class}): save its time and data as arrays"));
        return Ok(());
    }
    let (kind, dimensions) = element(&mut cursor)?;
    let dimensions: Vec<usize> = numbers(kind, dimensions, big)?.iter().map(|&d| d.max(0.0) as usize).collect();
    let (_, name) = element(&mut cursor)?;
    let path = named(name);
    if path.is_empty() {
        // MATLAB's own storage of objects.
        return Ok(());
    }
    let (rows, columns) = match dimensions[..] {
        [r, c] => (r, c),
        [r, ref rest @ ..] => {
            (r, rest.iter().try_fold(1_usize, |a, &b| a.checked_mul(b)).ok_or("a size is out of range")?)
        }
        [] => return Err("an array has no size"),
    };
    let elements = rows.checked_mul(columns).ok_or("a size is out of range")?;
    match class {
        // Struct, and object behind its class name.
        2 | 3 => {
            if class == 3 {
                element(&mut cursor)?;
            }
            let (kind, length) = element(&mut cursor)?;
            let length = numbers(kind, length, big)?.first().map_or(0, |&n| n.max(0.0) as usize);
            let (_, fields) = element(&mut cursor)?;
            if length == 0 || elements == 0 {
                return Ok(());
            }
            let fields: Vec<String> = fields
                .chunks(length)
                .map(|field| String::from_utf8_lossy(field.split(|&b| b == 0).next().unwrap_or(field)).into_owned())
                .collect();
            let labelled = ["label", "values"].iter().all(|known| fields.iter().any(|field| field == known));
            if labelled && elements <= MOST_SIGNALS {
                return signals(&mut cursor, &fields, elements, &path, found, depth);
            }
            if elements > 1 {
                found.leave_out(&path, "it is an array of structs");
                return Ok(());
            }
            for field in fields {
                let mut inner = path.clone();
                inner.push(field);
                let (kind, body) = element(&mut cursor)?;
                if kind == 14 {
                    matrix_5(body, big, &inner, found, depth + 1)?;
                }
            }
            Ok(())
        }
        4 => {
            let (kind, body) = element(&mut cursor)?;
            let codes = numbers(kind, body, big)?;
            if rows <= 1 && codes.len() < 4096 {
                found.text(&path, codes.iter().filter_map(|&c| char::from_u32(c as u32)).collect());
            }
            Ok(())
        }
        5 => {
            found.leave_out(&path, "it is a sparse matrix");
            Ok(())
        }
        6..=15 => {
            let (kind, body) = element(&mut cursor)?;
            let values = numbers(kind, body, big)?;
            if values.len() != elements {
                return Err("an array is shorter than its size");
            }
            if flags & COMPLEX != 0 {
                let (kind, body) = element(&mut cursor)?;
                if numbers(kind, body, big)?.iter().any(|imaginary| *imaginary != 0.0) {
                    found.leave_out(&path, IS_COMPLEX);
                    return Ok(());
                }
            }
            found.matrix(&path, rows, columns, values)
        }
        // Cells, function handles.
        _ => Ok(()),
    }
}

/// Class of what only MATLAB itself can take apart: strings, tables, time series, data sets of Simulink.
const OPAQUE: u32 = 17;
/// More signals than this are no recording.
const MOST_SIGNALS: usize = 1024;

/// Simulink's "structure with time": signals with their values and their label, or else the block that they come from.
fn signals(
    cursor: &mut Cursor<'_>,
    fields: &[String],
    elements: usize,
    path: &[String],
    found: &mut Found,
    depth: usize,
) -> Parsed<()> {
    for k in 0..elements {
        let mut signal = Found::default();
        for field in fields {
            let (kind, body) = element(cursor)?;
            if kind == 14 && ["label", "blockName", "values"].contains(&field.as_str()) {
                matrix_5(body, cursor.big, std::slice::from_ref(field), &mut signal, depth + 1)?;
            }
        }
        let told = |field: &str| {
            let text = signal.texts.iter().find(|(path, text)| path[0] == field && !text.is_empty())?;
            text.1.rsplit('/').next().map(ToOwned::to_owned)
        };
        let label = told("label").or_else(|| told("blockName")).unwrap_or_else(|| format!("signal{}", k + 1));
        for (name, values) in signal.arrays {
            let mut inner = path.to_vec();
            // A signal of several dimensions has numbered columns.
            inner.push(name[0].replacen("values", &label, 1));
            let rows = values.len();
            found.matrix(&inner, rows, 1, values)?;
        }
    }
    Ok(())
}

fn level_4(bytes: &[u8], found: &mut Found) -> Parsed<()> {
    let first = bytes.get(..4).ok_or("it is too short")?;
    // The type word is at most 4052 in the machine's own order.
    let little = u32::from_le_bytes([first[0], first[1], first[2], first[3]]);
    let big = little > 5000;
    let mut cursor = Cursor { bytes, big };
    while !cursor.bytes.is_empty() {
        let kind = cursor.u32()?;
        let (rows, columns) = (cursor.u32()? as usize, cursor.u32()? as usize);
        let (complex, name) = (cursor.u32()?, cursor.u32()? as usize);
        let (order, precision, class) = (kind / 1000, kind / 10 % 10, kind % 10);
        if order > 1 || kind / 100 % 10 != 0 || complex > 1 || class > 2 || name > 256 {
            return Err("it is neither level 4 nor level 5");
        }
        let name = String::from_utf8_lossy(cursor.take(name)?).trim_end_matches('\0').to_owned();
        let (kind, size) = match precision {
            0 => (9, 8),
            1 => (7, 4),
            2 => (5, 4),
            3 => (3, 2),
            4 => (4, 2),
            5 => (2, 1),
            _ => return Err("a data type is not known"),
        };
        let total = rows.checked_mul(columns).and_then(|n| n.checked_mul(size)).ok_or("a size is out of range")?;
        let body = cursor.take(total)?;
        let values = numbers(kind, body, big)?;
        if complex == 1 && numbers(kind, cursor.take(total)?, big)?.iter().any(|imaginary| *imaginary != 0.0) {
            found.leave_out(&[name], IS_COMPLEX);
            continue;
        }
        match class {
            0 => found.matrix(&[name], rows, columns, values)?,
            1 if rows == 1 => found.text(&[name], values.iter().filter_map(|&c| char::from_u32(c as u32)).collect()),
            _ => {}
        }
    }
    Ok(())
}
