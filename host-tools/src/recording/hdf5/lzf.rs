//! LZF, which h5py and PyTables offer beside deflate: runs of literals and references to what came before (M. Lehmann,
//! LibLZF 3.6).

use hdf5_reader::error::{Error, Result};
use hdf5_reader::messages::filter_pipeline::FilterDescription;

/// Its number among the filters registered at The HDF Group.
pub const FILTER: u16 = 32_000;

/// Longest run of literals; a longer one would be a reference.
const LITERALS: u8 = 32;
/// Place of the chunk's size among the parameters of the filter.
const CHUNK_SIZE: usize = 2;

/// Unpacks a chunk of at most `most` bytes.
pub fn unpack(filter: &FilterDescription, packed: &[u8], most: usize) -> Result<Vec<u8>> {
    let stated = filter.client_data.get(CHUNK_SIZE).map_or(most, |size| *size as usize);
    expand(packed, stated.min(most)).ok_or_else(|| Error::DecompressionError("LZF data are damaged".into()))
}

fn expand(packed: &[u8], most: usize) -> Option<Vec<u8>> {
    let mut out: Vec<u8> = Vec::new();
    let mut bytes = packed.iter().copied();
    while let Some(control) = bytes.next() {
        if control < LITERALS {
            for _ in 0..=control {
                out.push(bytes.next()?);
            }
        } else {
            // Three bits of length, all of them set where another byte adds to it; then a distance of 13 bits.
            let length = match usize::from(control >> 5) {
                7 => 7 + usize::from(bytes.next()?),
                length => length,
            } + 2;
            let distance = (usize::from(control & 0x1f) << 8 | usize::from(bytes.next()?)) + 1;
            let from = out.len().checked_sub(distance)?;
            for k in from..from + length {
                out.push(out[k]);
            }
        }
        if out.len() > most {
            return None;
        }
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_and_references() {
        // "abc" literally, then six bytes from three back: a reference may run into what it writes itself.
        assert_eq!(expand(&[2, b'a', b'b', b'c', 0x80, 2], 9).as_deref(), Some(&b"abcabcabc"[..]));
        // Length 7 + 10 + 2 from one back.
        assert_eq!(expand(&[0, b'x', 0xe0, 10, 0], 20), Some(vec![b'x'; 20]));
        for damaged in [&[2, b'a'][..], &[0, b'x', 0x80, 1], &[0, b'x', 0xe0, 200, 0], &[0x20]] {
            assert_eq!(expand(damaged, 20), None, "{damaged:?}");
        }
    }
}
