//! A block: the header and the payload of a slot. All numbers are little-endian.
//!
//! | bytes | what |
//! | --- | --- |
//! | 0 … 1 | layout version of the header, [`LAYOUT`] |
//! | 2 … 3 | length of the payload |
//! | 4 … 7 | sequence number: the valid block with the higher one counts |
//! | 8 … 11 | CRC-32 (ISO-HDLC) of the bytes 0 … 7 and the payload |
//! | 12 … 15 | [`MAGIC`] |
//! | 16 … | payload: [`section`](super::section)s, then erased flash |
//!
//! The second half of the header makes a block valid; it is written last.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

/// Longest block, bytes: every slot has room for it, however large the pages of the flash are.
pub const MAX_BLOCK: usize = 2048;
/// Number of slots.
pub const SLOTS: usize = 2;
/// What is written at once: half a header, bytes. Flash that is written in smaller words will do.
pub const WRITE_SIZE: usize = 8;
/// Length of the header, bytes.
pub const HEADER: usize = 16;
/// Longest payload, bytes.
pub const MAX_PAYLOAD: usize = MAX_BLOCK - HEADER;
/// Version of the header.
pub const LAYOUT: u16 = 1;
/// "GRIG".
pub const MAGIC: [u8; 4] = *b"GRIG";

/// CRC-32 of blocks and frames. Without a table: 2 KiB take a millisecond, once.
pub(crate) const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// What a header says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Length of the payload, bytes.
    pub length: u16,
    /// The valid block with the higher number counts; it may wrap.
    pub sequence: u32,
    /// CRC-32 of what precedes it and the payload.
    pub crc: u32,
}

/// Why a slot holds no block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoBlock {
    /// Nothing was written.
    Erased,
    /// It could not be read: a word was not completely written.
    Unreadable,
    /// Something else, or a block that was not completely written.
    Damaged,
    /// A header of another version.
    OtherLayout(u16),
}

impl Header {
    /// The header for a payload of at most [`MAX_PAYLOAD`] bytes.
    pub fn seal(sequence: u32, payload: &[u8]) -> Self {
        let length = payload.len() as u16;
        Self { length, sequence, crc: checksum(length, sequence, payload) }
    }

    /// As it stands in flash.
    pub fn to_bytes(self) -> [u8; HEADER] {
        let [a, b] = LAYOUT.to_le_bytes();
        let [c, d] = self.length.to_le_bytes();
        let [e, f, g, h] = self.sequence.to_le_bytes();
        let [i, j, k, l] = self.crc.to_le_bytes();
        let [m, n, o, p] = MAGIC;
        [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p]
    }

    /// From what stands in flash.
    ///
    /// # Errors
    /// Anything but a header of this version.
    pub fn from_bytes(bytes: [u8; HEADER]) -> Result<Self, NoBlock> {
        let [a, b, c, d, e, f, g, h, i, j, k, l, magic @ ..] = bytes;
        if bytes == [0xFF; HEADER] {
            return Err(NoBlock::Erased);
        }
        if magic != MAGIC {
            return Err(NoBlock::Damaged);
        }
        let layout = u16::from_le_bytes([a, b]);
        if layout != LAYOUT {
            return Err(NoBlock::OtherLayout(layout));
        }
        let length = u16::from_le_bytes([c, d]);
        if usize::from(length) > MAX_PAYLOAD {
            return Err(NoBlock::Damaged);
        }
        Ok(Self { length, sequence: u32::from_le_bytes([e, f, g, h]), crc: u32::from_le_bytes([i, j, k, l]) })
    }

    /// Whether the payload is the one that the header was made for.
    ///
    /// # Errors
    /// [`NoBlock::Damaged`] if it is not.
    pub fn check(&self, payload: &[u8]) -> Result<(), NoBlock> {
        let fits = payload.len() == usize::from(self.length);
        let right = fits && checksum(self.length, self.sequence, payload) == self.crc;
        if right { Ok(()) } else { Err(NoBlock::Damaged) }
    }
}

/// A payload's own CRC-32, by which host and microcontroller speak of it.
pub fn payload_crc(payload: &[u8]) -> u32 {
    CRC.checksum(payload)
}

fn checksum(length: u16, sequence: u32, payload: &[u8]) -> u32 {
    let mut digest = CRC.digest();
    digest.update(&LAYOUT.to_le_bytes());
    digest.update(&length.to_le_bytes());
    digest.update(&sequence.to_le_bytes());
    digest.update(payload);
    digest.finalize()
}
