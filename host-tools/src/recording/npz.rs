//! NumPy .npz: a ZIP archive of .npy arrays, stored or deflated (NumPy Enhancement Proposal 1; PKWARE APPNOTE 6.3).

use std::io::Read;
use std::path::Path;

use super::arrays::Found;
use super::damage::{damaged, too_large};
use super::table::{MAX_VALUES, Table};
use crate::error::{Error, Result};

type Parsed<T> = std::result::Result<T, &'static str>;

/// Reads an .npz file.
///
/// # Errors
/// Damaged content, too many values.
pub fn read(path: &Path) -> Result<Table> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    match archive(&bytes) {
        Ok(found) => Ok(found.table()),
        Err("too many values") => Err(too_large(path, "too many values")),
        Err(reason) => Err(damaged(path, "NumPy", reason)),
    }
}

fn int<const N: usize>(bytes: &[u8], at: usize) -> Parsed<usize> {
    let part = at.checked_add(N).and_then(|end| bytes.get(at..end)).ok_or("it ends too early")?;
    let value = part.iter().rev().fold(0_u64, |v, &b| v << 8 | u64::from(b));
    usize::try_from(value).map_err(|_| "a length is out of range")
}

fn archive(bytes: &[u8]) -> Parsed<Found> {
    // The directory is at the end, behind at most 64 kB of comment.
    let end = (0..bytes.len().saturating_sub(21)).rev().take(65_558).find(|&k| bytes[k..].starts_with(b"PK\x05\x06"));
    let end = end.ok_or("the directory of the archive is missing")?;
    let (entries, mut at) = (int::<2>(bytes, end + 10)?, int::<4>(bytes, end + 16)?);
    let mut found = Found::default();
    for _ in 0..entries {
        if bytes.get(at..at.saturating_add(4)) != Some(b"PK\x01\x02") {
            return Err("the directory of the archive is damaged");
        }
        let (method, packed) = (int::<2>(bytes, at + 10)?, int::<4>(bytes, at + 20)?);
        let (name_len, extra, remark) =
            (int::<2>(bytes, at + 28)?, int::<2>(bytes, at + 30)?, int::<2>(bytes, at + 32)?);
        let local = int::<4>(bytes, at + 42)?;
        let name = bytes.get(at + 46..at + 46 + name_len).ok_or("it ends too early")?;
        let name = String::from_utf8_lossy(name).into_owned();
        at += 46 + name_len + extra + remark;
        let Some(name) = name.strip_suffix(".npy") else { continue };
        let data = local + 30 + int::<2>(bytes, local + 26)? + int::<2>(bytes, local + 28)?;
        let body = data.checked_add(packed).and_then(|end| bytes.get(data..end)).ok_or("an array is cut off")?;
        let limit = MAX_VALUES as u64 * 8 + 65_536;
        let mut array = Vec::new();
        match method {
            0 => array.extend_from_slice(body),
            8 => {
                let read = flate2::read::DeflateDecoder::new(body).take(limit + 1).read_to_end(&mut array);
                read.map_err(|_| "a compressed array is damaged")?;
            }
            _ => return Err("a compression is not known"),
        }
        if array.len() as u64 > limit {
            return Err("too many values");
        }
        npy(name, &array, &mut found)?;
    }
    Ok(found)
}

fn npy(name: &str, bytes: &[u8], found: &mut Found) -> Parsed<()> {
    if !bytes.starts_with(b"\x93NUMPY") {
        return Err("an array has no NumPy header");
    }
    let (length, start) =
        if bytes.get(6) == Some(&1) { (int::<2>(bytes, 8)?, 10_usize) } else { (int::<4>(bytes, 8)?, 12) };
    let header = start.checked_add(length).and_then(|end| bytes.get(start..end)).ok_or("it ends too early")?;
    let header = String::from_utf8_lossy(header);
    let field = |key: &str| header.split_once(&format!("'{key}':")).map(|(_, rest)| rest.trim_start());
    let kind = field("descr").and_then(|r| r.split('\'').nth(1)).ok_or("an array has no type")?;
    let fortran = field("fortran_order").is_some_and(|r| r.starts_with("True"));
    let shape = field("shape")
        .and_then(|r| r.split_once('('))
        .and_then(|(_, r)| r.split_once(')'))
        .ok_or("an array has no size")?
        .0;
    let shape: Vec<usize> = shape.split(',').filter_map(|d| d.trim().parse().ok()).collect();
    let body = &bytes[start + length..];
    let big = kind.starts_with('>');
    macro_rules! each {
        ($t:ty) => {{
            const N: usize = std::mem::size_of::<$t>();
            let convert = |c: &[u8]| {
                let mut b = [0; N];
                b.copy_from_slice(c);
                (if big { <$t>::from_be_bytes(b) } else { <$t>::from_le_bytes(b) }) as f64
            };
            body.chunks_exact(N).map(convert).collect()
        }};
    }
    let values: Vec<f64> = match kind.trim_start_matches(['<', '>', '|', '=']) {
        "f4" => each!(f32),
        "f8" => each!(f64),
        "i1" => each!(i8),
        "u1" | "b1" => each!(u8),
        "i2" => each!(i16),
        "u2" => each!(u16),
        "i4" => each!(i32),
        "u4" => each!(u32),
        "i8" => each!(i64),
        "u8" => each!(u64),
        // Text, objects, dates: no samples.
        _ => return Ok(()),
    };
    let elements = shape.iter().try_fold(1_usize, |a, &b| a.checked_mul(b)).ok_or("a size is out of range")?;
    if values.len() != elements {
        return Err("an array is shorter than its size");
    }
    let (rows, columns) = match shape[..] {
        [] => (1, 1),
        [n] => (n, 1),
        [a, b] if fortran => (a, b),
        [a, b] => (b, a),
        _ => return Ok(()),
    };
    found.matrix(&[name.to_owned()], rows, columns, values)
}
