//! The footer without what no reader needs.
//!
//! Forks of the format gave fields a number and a type before the format itself gave that number another meaning; the
//! decoder stumbles over them. (Apache Parquet format 2.11, `parquet.thrift`; Apache Thrift, compact protocol.)

/// Where in the footer a structure stands.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    File,
    RowGroup,
    ColumnChunk,
    ColumnMetaData,
}

/// Last field of a column's metadata that reading needs: where its dictionary is.
const LAST_NEEDED: i64 = 11;

/// Types of the protocol.
const TRUE: u8 = 1;
const FALSE: u8 = 2;
const BYTE: u8 = 3;
const DOUBLE: u8 = 7;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const SET: u8 = 10;
const STRUCT: u8 = 12;

/// Values nest; damaged ones nest without end.
const DEEPEST: usize = 32;

/// The footer, without the fields of its columns that are not needed; none if it cannot be taken apart.
pub fn without_extensions(footer: &[u8]) -> Option<Vec<u8>> {
    let (mut footer, mut out) = (Bytes(footer), Vec::new());
    structure(&mut footer, Some(Place::File), &mut out, 0)?;
    Some(out)
}

struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (head, tail) = self.0.split_at_checked(n)?;
        self.0 = tail;
        Some(head)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take(1).map(|b| b[0])
    }

    /// Seven bits a byte, the lowest first.
    fn number(&mut self) -> Option<u64> {
        let mut sum = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            sum |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(sum);
            }
        }
        None
    }
}

fn put(mut number: u64, out: &mut Vec<u8>) {
    while number >= 0x80 {
        out.push(number as u8 | 0x80);
        number >>= 7;
    }
    out.push(number as u8);
}

fn structure(bytes: &mut Bytes<'_>, place: Option<Place>, out: &mut Vec<u8>, depth: usize) -> Option<()> {
    let (mut id, mut last) = (0_i64, 0_i64);
    loop {
        let head = bytes.byte()?;
        if head == 0 {
            out.push(0);
            return Some(());
        }
        let kind = head & 0x0f;
        // A step of up to 15 from the field before, or the number itself with its sign in the lowest bit.
        id = match head >> 4 {
            0 => bytes.number().map(|n| (n >> 1) as i64 ^ -((n & 1) as i64))?,
            step => id + i64::from(step),
        };
        let mut content = Vec::new();
        value(bytes, kind, inner(place, id), &mut content, depth + 1)?;
        if place == Some(Place::ColumnMetaData) && id > LAST_NEEDED {
            continue;
        }
        match id - last {
            step @ 1..=15 => out.push((step as u8) << 4 | kind),
            _ => {
                out.push(kind);
                put((id << 1 ^ id >> 63) as u64, out);
            }
        }
        out.append(&mut content);
        last = id;
    }
}

/// The structure that a field holds.
fn inner(place: Option<Place>, field: i64) -> Option<Place> {
    match (place?, field) {
        (Place::File, 4) => Some(Place::RowGroup),
        (Place::RowGroup, 1) => Some(Place::ColumnChunk),
        (Place::ColumnChunk, 3) => Some(Place::ColumnMetaData),
        _ => None,
    }
}

fn value(bytes: &mut Bytes<'_>, kind: u8, place: Option<Place>, out: &mut Vec<u8>, depth: usize) -> Option<()> {
    if depth > DEEPEST {
        return None;
    }
    match kind {
        TRUE | FALSE => {}
        BYTE => out.push(bytes.byte()?),
        4..=6 => put(bytes.number()?, out),
        DOUBLE => out.extend_from_slice(bytes.take(8)?),
        BINARY => {
            let length = bytes.number()?;
            put(length, out);
            out.extend_from_slice(bytes.take(usize::try_from(length).ok()?)?);
        }
        LIST | SET => {
            let head = bytes.byte()?;
            out.push(head);
            let count = match head >> 4 {
                15 => {
                    let count = bytes.number()?;
                    put(count, out);
                    count
                }
                count => u64::from(count),
            };
            for _ in 0..count {
                match head & 0x0f {
                    // In a list a truth value takes a byte.
                    TRUE | FALSE => out.push(bytes.byte()?),
                    kind => value(bytes, kind, place, out, depth + 1)?,
                }
            }
        }
        STRUCT => structure(bytes, place, out, depth)?,
        _ => return None,
    }
    Some(())
}
