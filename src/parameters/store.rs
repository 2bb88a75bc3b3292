//! Two slots in flash, written in turn.
//!
//! The block is written to the slot that does not hold the current one: erase, payload, first half of the header,
//! second half. Only the last write, of one word, makes it valid, and the other slot is not touched. **Whenever the
//! power fails, the next start finds the old block or the new one, whole.** `tests/core/store.rs` cuts at every write
//! and erase.
//!
//! # Flash with check bits
//! The STM32G4 stores 8 check bits with every 64 (RM0440, section 3.3.2). A word that is written twice, or whose
//! writing was cut, may not be readable: the processor then gets a non-maskable interrupt instead of an error. The
//! board's handler clears the flag and returns, the bytes read are arbitrary, and the CRC rejects them; or, as on the
//! test's model, the read fails and the slot counts as unreadable. No word is ever written twice between erasures.

use core::fmt;

use embedded_storage::nor_flash::NorFlash;

use super::block::{HEADER, Header, MAX_PAYLOAD, NoBlock, SLOTS, WRITE_SIZE};

/// The slots in a flash, from `base` on.
#[derive(Debug)]
pub struct Store<F> {
    flash: F,
    base: u32,
    slot_size: u32,
}

/// Which slot, from 0.
pub type Slot = usize;

/// Why a block was not written. The one that was valid before still is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WriteError {
    /// Longer than [`MAX_PAYLOAD`].
    TooLong,
    /// The flash reported an error.
    Flash,
    /// What was read back is not what was written.
    ReadBack,
}

impl fmt::Display for WriteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooLong => write!(f, "the parameters are longer than {MAX_PAYLOAD} bytes"),
            Self::Flash => write!(f, "the flash reported an error"),
            Self::ReadBack => write!(f, "the flash does not hold what was written to it"),
        }
    }
}

impl core::error::Error for WriteError {}

impl<F: NorFlash> Store<F> {
    /// The two slots that begin `base` bytes into a flash. Their size is that of
    /// [`Slots`](crate::hardware::Slots::size): room for [`MAX_BLOCK`](super::block::MAX_BLOCK) and a multiple of the
    /// erase size, or nothing can be written.
    pub fn new(flash: F, base: u32, slot_size: usize) -> Self {
        const { assert!(WRITE_SIZE.is_multiple_of(F::WRITE_SIZE)) }
        Self { flash, base, slot_size: slot_size as u32 }
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// What a slot holds; its payload goes into `payload`.
    ///
    /// # Errors
    /// Why it holds no block.
    pub fn read(&mut self, slot: Slot, payload: &mut [u8; MAX_PAYLOAD]) -> Result<Header, NoBlock> {
        let mut header = [0; HEADER];
        self.flash.read(self.address(slot), &mut header).map_err(|_| NoBlock::Unreadable)?;
        let header = Header::from_bytes(header)?;
        // Whole words, which all kinds of flash can read.
        let length = usize::from(header.length).next_multiple_of(WRITE_SIZE);
        let words = payload.get_mut(..length).ok_or(NoBlock::Damaged)?;
        self.flash.read(self.address(slot) + HEADER as u32, words).map_err(|_| NoBlock::Unreadable)?;
        header.check(words.get(..usize::from(header.length)).ok_or(NoBlock::Damaged)?)?;
        Ok(header)
    }

    /// The block that counts, with its slot; its payload goes into `payload`.
    pub fn load(&mut self, payload: &mut [u8; MAX_PAYLOAD]) -> Option<(Slot, Header)> {
        let current = self.current(payload)?;
        // The other slot may have been read after it.
        self.read(current.0, payload).ok()?;
        Some(current)
    }

    /// Writes a block to the slot that does not hold the current one, and reads it back. `scratch` is overwritten.
    ///
    /// # Errors
    /// The current block then stays the current one.
    pub fn write(&mut self, payload: &[u8], scratch: &mut [u8; MAX_PAYLOAD]) -> Result<(Slot, Header), WriteError> {
        if payload.len() > MAX_PAYLOAD {
            return Err(WriteError::TooLong);
        }
        let (slot, sequence) = match self.current(scratch) {
            Some((slot, header)) => ((slot + 1) % SLOTS, header.sequence.wrapping_add(1)),
            None => (0, 1),
        };
        let header = Header::seal(sequence, payload);
        let start = self.address(slot);
        self.flash.erase(start, start + self.slot_size).map_err(|_| WriteError::Flash)?;
        for (n, chunk) in payload.chunks(WRITE_SIZE).enumerate() {
            let mut word = [0xFF; WRITE_SIZE];
            word.iter_mut().zip(chunk).for_each(|(to, from)| *to = *from);
            self.program(start, HEADER + n * WRITE_SIZE, &word)?;
        }
        let bytes = header.to_bytes();
        for at in [0, WRITE_SIZE] {
            let word = bytes.get(at..at + WRITE_SIZE).ok_or(WriteError::Flash)?;
            self.program(start, at, word)?;
        }
        let same = self.read(slot, scratch) == Ok(header) && scratch.starts_with(payload);
        if same { Ok((slot, header)) } else { Err(WriteError::ReadBack) }
    }

    fn current(&mut self, payload: &mut [u8; MAX_PAYLOAD]) -> Option<(Slot, Header)> {
        let mut current: Option<(Slot, Header)> = None;
        for slot in 0..SLOTS {
            if let Ok(header) = self.read(slot, payload)
                && current.is_none_or(|(_, other)| newer(header.sequence, other.sequence))
            {
                current = Some((slot, header));
            }
        }
        current
    }

    fn program(&mut self, start: u32, at: usize, word: &[u8]) -> Result<(), WriteError> {
        self.flash.write(start + at as u32, word).map_err(|_| WriteError::Flash)
    }

    fn address(&self, slot: Slot) -> u32 {
        self.base + slot as u32 * self.slot_size
    }
}

/// Whether a sequence number comes after another, when they may wrap.
fn newer(one: u32, other: u32) -> bool {
    one.wrapping_sub(other).cast_signed() > 0
}
