//! Virtual data sets: values that stand in other data sets, piece by piece (HDF5 File Format Specification 3.0, III.F
//! "Virtual Dataset Global Heap Block" and VIII.A "Selections"). Those of the same file are followed.

use std::ops::Range;

use hdf5_reader::global_heap::GlobalHeapCollection;
use hdf5_reader::io::Cursor;

use super::super::table::MAX_VALUES;

/// Elements of a data set.
#[derive(Debug, Clone, PartialEq)]
enum Selection {
    All,
    /// By dimension: start, stride, count, block.
    Regular(Vec<[u64; 4]>),
    /// Blocks, each of them by dimension.
    Blocks(Vec<Vec<Range<u64>>>),
}

/// Some elements that stand in another data set.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Path of the other data set.
    pub path: Vec<String>,
    source: Selection,
    target: Selection,
}

impl Piece {
    /// The places of its elements, there and here, from zero; none if they do not fit.
    pub fn places(&self, source: &[u64], target: &[u64]) -> Option<Vec<(usize, usize)>> {
        let (from, to) = (self.source.places(source)?, self.target.places(target)?);
        (from.len() == to.len()).then(|| from.into_iter().zip(to).collect())
    }
}

type Parsed<T> = std::result::Result<T, &'static str>;

const CUT: &str = "its description is cut off";

/// Flags of an entry: its file is that of another entry, its name is, its file is this one.
const FILE_OF_ANOTHER: u64 = 1;
const NAME_OF_ANOTHER: u64 = 2;
const SAME_FILE: u64 = 4;

/// The pieces that the layout message `body` tells of, in the bytes of a file.
pub fn pieces(bytes: &[u8], body: &[u8]) -> Parsed<Vec<Piece>> {
    let mut layout = Bytes(body.get(2..).ok_or(CUT)?);
    let (address, index) = (layout.number(8)?, layout.number(4)?);
    if address == u64::MAX {
        return Ok(Vec::new());
    }
    let heap = usize::try_from(address).ok().and_then(|at| bytes.get(at..)).ok_or(CUT)?;
    let heap = GlobalHeapCollection::parse(&mut Cursor::new(heap), 8, 8).map_err(|_| CUT)?;
    let block = u16::try_from(index).ok().and_then(|index| heap.get_object(index)).ok_or(CUT)?;
    let mut block = Bytes(&block.data);
    let version = block.number(1)?;
    if version > 1 {
        return Err("its description is of a newer kind");
    }
    let mut found: Vec<Piece> = Vec::new();
    for _ in 0..block.number(8)? {
        // Since version 1 a name may be that of an entry before, and the file the same.
        let flags = if version == 0 { 0 } else { block.number(1)? };
        if flags & (FILE_OF_ANOTHER | NAME_OF_ANOTHER) != 0 {
            return Err("its description is of a newer kind");
        }
        if flags & SAME_FILE == 0 && block.text()? != "." {
            return Err("it is put together of other files (virtual)");
        }
        let path = block.text()?;
        let path = path.split('/').filter(|part| !part.is_empty()).map(ToOwned::to_owned).collect();
        found.push(Piece { path, source: Selection::parse(&mut block)?, target: Selection::parse(&mut block)? });
    }
    Ok(found)
}

struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, n: usize) -> Parsed<&'a [u8]> {
        let (head, tail) = self.0.split_at_checked(n).ok_or(CUT)?;
        self.0 = tail;
        Ok(head)
    }

    fn number(&mut self, size: usize) -> Parsed<u64> {
        Ok(self.take(size)?.iter().rev().fold(0, |sum, b| sum << 8 | u64::from(*b)))
    }

    fn text(&mut self) -> Parsed<String> {
        let length = self.0.iter().position(|b| *b == 0).ok_or(CUT)?;
        let text = String::from_utf8_lossy(self.take(length)?).into_owned();
        self.take(1)?;
        Ok(text)
    }
}

impl Selection {
    fn parse(bytes: &mut Bytes<'_>) -> Parsed<Self> {
        const ALL: u64 = 3;
        const HYPERSLAB: u64 = 2;
        /// Data sets have at most so many dimensions.
        const MOST_DIMENSIONS: u64 = 32;
        let (kind, version) = (bytes.number(4)?, bytes.number(4)?);
        if kind == ALL {
            bytes.take(8)?;
            return Ok(Self::All);
        }
        if kind != HYPERSLAB {
            return Err("it selects single points (virtual)");
        }
        // Later versions say whether the blocks are regular, and the size of their numbers.
        let (regular, size) = match version {
            1 => {
                bytes.take(8)?;
                (false, 4)
            }
            2 => {
                let flags = bytes.number(1)?;
                bytes.take(4)?;
                (flags & 1 != 0, 8)
            }
            3 => (bytes.number(1)? & 1 != 0, bytes.number(1)? as usize),
            _ => return Err("its description is of a newer kind"),
        };
        let dimensions = bytes.number(4)?;
        if dimensions > MOST_DIMENSIONS || ![2, 4, 8].contains(&size) {
            return Err("its description is damaged");
        }
        if regular {
            // All bits set: as many as there are.
            let unlimited = u64::MAX >> (64 - 8 * size);
            let mut number = || bytes.number(size).map(|n| if n == unlimited { u64::MAX } else { n });
            let mut each = || Ok([number()?, number()?, number()?, number()?]);
            return Ok(Self::Regular((0..dimensions).map(|_| each()).collect::<Parsed<_>>()?));
        }
        let mut blocks = Vec::new();
        for _ in 0..bytes.number(size)? {
            let corner =
                |bytes: &mut Bytes<'_>| (0..dimensions).map(|_| bytes.number(size)).collect::<Parsed<Vec<_>>>();
            let (first, last) = (corner(bytes)?, corner(bytes)?);
            blocks.push(first.into_iter().zip(last).map(|(a, b)| a..b.saturating_add(1)).collect());
        }
        Ok(Self::Blocks(blocks))
    }

    /// The places of the elements in a data set of a shape, row by row.
    fn places(&self, shape: &[u64]) -> Option<Vec<usize>> {
        let blocks: Vec<Vec<Vec<u64>>> = match self {
            Self::All => vec![shape.iter().map(|&n| (0..n).collect()).collect()],
            Self::Regular(dimensions) if dimensions.len() == shape.len() => {
                vec![dimensions.iter().zip(shape).map(|(slab, &n)| coordinates(*slab, n)).collect()]
            }
            Self::Blocks(blocks) if blocks.iter().all(|block| block.len() == shape.len()) => {
                let inside = |(range, &n): (&Range<u64>, &u64)| (range.start..range.end.min(n)).collect();
                blocks.iter().map(|block| block.iter().zip(shape).map(inside).collect()).collect()
            }
            _ => return None,
        };
        let count = |block: &Vec<Vec<u64>>| block.iter().try_fold(1_usize, |n, axis| n.checked_mul(axis.len()));
        let total = blocks.iter().try_fold(0_usize, |n, block| n.checked_add(count(block)?))?;
        if total > MAX_VALUES {
            return None;
        }
        let mut places = Vec::with_capacity(total);
        for block in &blocks {
            let mut rows = vec![0_u64];
            for (axis, &n) in block.iter().zip(shape) {
                rows = rows
                    .iter()
                    .flat_map(|row| axis.iter().map(move |k| row.wrapping_mul(n).wrapping_add(*k)))
                    .collect();
            }
            places.extend(rows.into_iter().map(|place| place as usize));
        }
        // Blocks beside each other are taken row by row, not one after the other.
        places.sort_unstable();
        Some(places)
    }
}

/// The coordinates of one dimension, `n` long.
fn coordinates([start, stride, count, block]: [u64; 4], n: u64) -> Vec<u64> {
    let begins = (0..count).map_while(|k| start.checked_add(k.checked_mul(stride.max(1))?)).take_while(|at| *at < n);
    begins.flat_map(|at| at..at.saturating_add(block).min(n)).take(MAX_VALUES + 1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_of_selections() {
        let regular = |slabs: &[[u64; 4]]| Selection::Regular(slabs.to_vec());
        assert_eq!(Selection::All.places(&[2, 2]), Some(vec![0, 1, 2, 3]));
        assert_eq!(regular(&[[1, 3, 2, 2]]).places(&[6]), Some(vec![1, 2, 4, 5]));
        assert_eq!(regular(&[[1, 1, 1, 1], [0, 2, u64::MAX, 1]]).places(&[2, 5]), Some(vec![5, 7, 9]));
        let blocks = Selection::Blocks(vec![vec![0..2, 1..2], vec![0..2, 0..1]]);
        assert_eq!(blocks.places(&[2, 3]), Some(vec![0, 1, 3, 4]));
        assert_eq!(regular(&[[0, 1, 1, 1]]).places(&[2, 3]), None);
    }
}
