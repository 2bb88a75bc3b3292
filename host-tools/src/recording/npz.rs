//! NumPy .npy, and .npz: a ZIP archive of .npy arrays, stored or deflated (NumPy Enhancement Proposal 1; PKWARE APPNOTE
//! 6.3). The archive's checksums must hold. A structured array gives a column for each field.

use std::io::Read;
use std::path::Path;

use super::arrays::{Found, TOO_MANY};
use super::damage::{damaged, too_large};
use super::table::{MAX_VALUES, Table};
use crate::error::{Error, Result};

type Parsed<T> = std::result::Result<T, String>;

/// Reads an .npz file, or an .npy file, which is one array of such an archive.
///
/// # Errors
/// Damaged content, too many values.
pub fn read(path: &Path) -> Result<Table> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let alone = || {
        let (name, mut found) = (path.file_stem().unwrap_or_default().to_string_lossy(), Found::default());
        npy(&name, &bytes, &mut found).map(|()| found)
    };
    match if bytes.starts_with(MAGIC) { alone() } else { archive(&bytes) } {
        Ok(found) => Ok(found.table()),
        Err(reason) if reason == TOO_MANY => Err(too_large(path, TOO_MANY)),
        Err(reason) => Err(damaged(path, "NumPy", reason)),
    }
}

/// How an array begins.
const MAGIC: &[u8] = b"\x93NUMPY";

fn int<const N: usize>(bytes: &[u8], at: usize) -> Parsed<usize> {
    let part = at.checked_add(N).and_then(|end| bytes.get(at..end)).ok_or("it ends too early")?;
    let value = part.iter().rev().fold(0_u64, |v, &b| v << 8 | u64::from(b));
    usize::try_from(value).map_err(|_| "a length is out of range".to_owned())
}

fn archive(bytes: &[u8]) -> Parsed<Found> {
    // The directory is at the end, behind at most 64 kB of comment.
    let end = (0..bytes.len().saturating_sub(21)).rev().take(65_558).find(|&k| bytes[k..].starts_with(b"PK\x05\x06"));
    let end = end.ok_or("the directory of the archive is missing")?;
    let (entries, mut at) = (int::<2>(bytes, end + 10)?, int::<4>(bytes, end + 16)?);
    let mut found = Found::default();
    for _ in 0..entries {
        if bytes.get(at..at.saturating_add(4)) != Some(b"PK\x01\x02") {
            return Err("the directory of the archive is damaged".into());
        }
        let (method, packed) = (int::<2>(bytes, at + 10)?, int::<4>(bytes, at + 20)?);
        let stated = int::<4>(bytes, at + 16)?;
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
            _ => return Err("a compression is not known".into()),
        }
        if array.len() as u64 > limit {
            return Err(TOO_MANY.into());
        }
        let mut sum = flate2::Crc::new();
        sum.update(&array);
        if sum.sum() as usize != stated {
            return Err(format!("the checksum of '{name}' does not hold"));
        }
        npy(name, &array, &mut found)?;
    }
    Ok(found)
}

/// A type of numbers, as the header writes it.
#[derive(Debug, Clone, PartialEq)]
struct Kind {
    big: bool,
    /// Letter and bytes.
    code: (u8, usize),
    /// Seconds per count of a time.
    seconds: Option<f64>,
}

impl Kind {
    /// `<f8`, `>i2`, `|b1`, `<M8[us]`.
    fn parse(text: &str) -> Parsed<Self> {
        let big = text.starts_with('>');
        let bare = text.trim_start_matches(['<', '>', '|', '=']);
        let (bare, unit) = bare.split_once('[').map_or((bare, None), |(b, u)| (b, Some(u.trim_end_matches(']'))));
        let letter = *bare.as_bytes().first().ok_or("an array has no type")?;
        let size = bare.get(1..).and_then(|n| n.parse().ok()).unwrap_or(0);
        let seconds = unit.and_then(|unit| match unit {
            "s" => Some(1.0),
            "ms" => Some(1e-3),
            "us" => Some(1e-6),
            "ns" => Some(1e-9),
            _ => None,
        });
        // A letter of text has four bytes.
        let size = if letter == b'U' { 4 * size } else { size };
        Ok(Self { big, code: (letter, size), seconds })
    }

    fn size(&self) -> usize {
        self.code.1
    }

    /// How a value of this type is read, if it is a number.
    fn number(&self) -> Option<fn(&[u8]) -> f64> {
        macro_rules! read {
            ($t:ty, $convert:expr) => {
                |b: &[u8]| b.first_chunk().map_or(f64::NAN, |b| $convert(<$t>::from_le_bytes(*b)))
            };
        }
        Some(match self.code {
            (b'f', 2) => |b: &[u8]| b.first_chunk().map_or(f64::NAN, |b| half::f16::from_le_bytes(*b).to_f64()),
            (b'f', 4) => read!(f32, f64::from),
            (b'f', 8) => read!(f64, |x| x),
            (b'i', 1) => read!(i8, f64::from),
            (b'u' | b'b', 1) => read!(u8, f64::from),
            (b'i', 2) => read!(i16, f64::from),
            (b'u', 2) => read!(u16, f64::from),
            (b'i', 4) => read!(i32, f64::from),
            (b'u', 4) => read!(u32, f64::from),
            (b'i', 8) => read!(i64, |x| x as f64),
            (b'u', 8) => read!(u64, |x| x as f64),
            _ => return None,
        })
    }

    /// The values of this type that stand `stride` bytes apart, and whether they are times.
    fn values(&self, bytes: &[u8], from: usize, stride: usize) -> Option<Vec<f64>> {
        let size = self.size();
        let each = bytes.chunks_exact(stride).map(|row| {
            let mut value = [0; 16];
            let value = &mut value[..size];
            value.copy_from_slice(&row[from..from + size]);
            if self.big {
                value.reverse();
            }
            let mut wide = [0; 8];
            wide[..size.min(8)].copy_from_slice(&value[..size.min(8)]);
            wide
        });
        if let (b'M' | b'm', 8) = self.code {
            let counts: Vec<i64> = each.map(i64::from_le_bytes).collect();
            let seconds = self.seconds?;
            // The smallest number stands for "no time"; instants are counted from the first one.
            let first = if self.code.0 == b'M' { counts.iter().copied().find(|c| *c != i64::MIN)? } else { 0 };
            let time = |c: i64| if c == i64::MIN { f64::NAN } else { c.saturating_sub(first) as f64 * seconds };
            return Some(counts.into_iter().map(time).collect());
        }
        let number = self.number()?;
        Some(each.map(|wide| number(&wide[..size.min(8)])).collect())
    }
}

/// A field of a structured type: its name, its kind where that can be read, and its size in bytes.
type Field = (Option<String>, Option<Kind>, usize);

/// The fields of a structured type: `[('t', '<f8'), ('u', '<f4', (3,))]`; one without a name for a plain type.
fn fields(descr: &str) -> Parsed<Vec<Field>> {
    if let Some(kind) = descr.strip_prefix('\'') {
        let kind = Kind::parse(kind.split('\'').next().unwrap_or(""))?;
        return Ok(vec![(None, Some(kind.clone()), kind.size())]);
    }
    let list = descr.strip_prefix('[').ok_or("an array has no type")?;
    let mut found = Vec::new();
    let mut rest = list.trim_start();
    while let Some(field) = rest.strip_prefix('(') {
        let mut parts = field.splitn(5, '\'');
        let (Some(_), Some(name), Some(_), Some(kind), Some(tail)) =
            (parts.next(), parts.next(), parts.next(), parts.next(), parts.next())
        else {
            return Err("a structured array has a field that is none".into());
        };
        let kind = Kind::parse(kind)?;
        let tail = tail.trim_start();
        // A field that is itself an array is passed over.
        let (shape, after) = match tail.strip_prefix(',').map(str::trim_start).and_then(|t| t.strip_prefix('(')) {
            Some(shape) => shape.split_once(')').ok_or("a structured array has a field without a size")?,
            None => ("", tail),
        };
        let count =
            shape.split(',').filter_map(|d| d.trim().parse::<usize>().ok()).try_fold(1_usize, |a, d| a.checked_mul(d));
        let count = count.ok_or("a size is out of range")?;
        let size = kind.size().checked_mul(count).ok_or("a size is out of range")?;
        found.push((Some(name.to_owned()), (count == 1).then_some(kind), size));
        rest = after.split_once(')').ok_or("a structured array has a field that is none")?.1;
        rest = rest.trim_start_matches([',', ' ']);
    }
    if found.is_empty() || !rest.starts_with(']') {
        return Err("the type of a structured array is not understood".into());
    }
    Ok(found)
}

fn npy(name: &str, bytes: &[u8], found: &mut Found) -> Parsed<()> {
    if !bytes.starts_with(MAGIC) {
        return Err("an array has no NumPy header".into());
    }
    let (length, start) =
        if bytes.get(6) == Some(&1) { (int::<2>(bytes, 8)?, 10_usize) } else { (int::<4>(bytes, 8)?, 12) };
    let header = start.checked_add(length).and_then(|end| bytes.get(start..end)).ok_or("it ends too early")?;
    let header = String::from_utf8_lossy(header);
    let entry = |key: &str| header.split_once(&format!("'{key}':")).map(|(_, rest)| rest.trim_start());
    let fortran = entry("fortran_order").is_some_and(|r| r.starts_with("True"));
    let shape = entry("shape")
        .and_then(|r| r.split_once('('))
        .and_then(|(_, r)| r.split_once(')'))
        .ok_or("an array has no size")?
        .0;
    let shape: Vec<usize> = shape.split(',').filter_map(|d| d.trim().parse().ok()).collect();
    let body = &bytes[start + length..];
    let path = [name.to_owned()];
    let fields = match fields(entry("descr").ok_or("an array has no type")?) {
        Ok(fields) => fields,
        Err(reason) => {
            found.leave_out(&path, &reason);
            return Ok(());
        }
    };
    let stride: usize = fields.iter().map(|f| f.2).sum();
    let elements = shape.iter().try_fold(1_usize, |a, &b| a.checked_mul(b)).ok_or("a size is out of range")?;
    if stride == 0 {
        found.leave_out(&path, "it holds no numbers");
        return Ok(());
    }
    if elements.checked_mul(stride) != Some(body.len()) {
        return Err("an array is shorter than its size".into());
    }
    let (rows, columns) = match shape[..] {
        [] => (1, 1),
        [n] => (n, 1),
        [a, b] if fortran => (a, b),
        [a, b] => (b, a),
        _ => {
            found.leave_out(&path, "it has more than two dimensions");
            return Ok(());
        }
    };
    let mut from = 0;
    for (field, kind, size) in fields {
        let mut path = path.to_vec();
        path.extend(field);
        match kind.as_ref().and_then(|kind| kind.values(body, from, stride)) {
            Some(values) => {
                if kind.is_some_and(|kind| kind.seconds.is_some()) {
                    found.units.insert(path.clone(), "s".into());
                }
                found.matrix(&path, rows, columns, values)?;
            }
            // What only fills a row up to its size.
            None if path.len() > 1 && path[1].is_empty() => {}
            None => found.leave_out(&path, "it holds no real numbers"),
        }
        from += size;
    }
    Ok(())
}
