//! Frames: how a message survives a line.
//!
//! A frame is COBS (S. Cheshire, M. Baker: Consistent Overhead Byte Stuffing, 1999) of the message and its CRC-32, then
//! a zero. Zeros occur nowhere else, so that a receiver that has lost its place finds it at the next one. A sender that
//! does not know what the line has seen before begins with a zero, too; an empty frame counts as nothing.

use super::MAX_BODY;
use crate::parameters::block::CRC;

/// Length of the CRC, bytes.
const CHECK: usize = 4;
/// Longest message with its CRC.
const MAX_CHECKED: usize = MAX_BODY + CHECK;
/// Longest frame between zeros.
const MAX_STUFFED: usize = cobs::max_encoding_length(MAX_CHECKED);
/// Longest frame with the zero at its end.
pub const MAX_FRAME: usize = MAX_STUFFED + 1;

/// Why bytes were no frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameError {
    /// Longer than any frame.
    TooLong,
    /// Not what COBS makes.
    NotStuffed,
    /// The CRC is that of another message.
    Checksum,
}

/// Makes the frame of a message; gives its length.
///
/// # Errors
/// [`FrameError::TooLong`] for what does not fit.
pub fn encode(message: &impl serde::Serialize, frame: &mut [u8; MAX_FRAME]) -> Result<usize, FrameError> {
    let mut checked = [0; MAX_CHECKED];
    let body = checked.get_mut(..MAX_BODY).ok_or(FrameError::TooLong)?;
    let length = postcard::to_slice(message, body).map_err(|_| FrameError::TooLong)?.len();
    let (body, rest) = checked.split_at_mut_checked(length).ok_or(FrameError::TooLong)?;
    let check = CRC.checksum(body).to_le_bytes();
    rest.first_chunk_mut::<CHECK>().ok_or(FrameError::TooLong)?.copy_from_slice(&check);
    let checked = checked.get(..length + CHECK).ok_or(FrameError::TooLong)?;
    let stuffed = cobs::try_encode(checked, frame).map_err(|_| FrameError::TooLong)?;
    *frame.get_mut(stuffed).ok_or(FrameError::TooLong)? = 0;
    Ok(stuffed + 1)
}

/// Finds frames in a stream of any bytes.
#[derive(Debug, Clone)]
pub struct Receiver {
    stuffed: [u8; MAX_STUFFED],
    /// Bytes since the last zero; more than fit means that the frame is too long.
    count: usize,
    checked: [u8; MAX_STUFFED],
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}

impl Receiver {
    /// One that has seen nothing.
    pub const fn new() -> Self {
        Self { stuffed: [0; MAX_STUFFED], count: 0, checked: [0; MAX_STUFFED] }
    }

    /// Takes a byte. At the end of a frame gives its message, or why it was none.
    #[inline]
    pub fn push(&mut self, byte: u8) -> Option<Result<&[u8], FrameError>> {
        if byte != 0 {
            if let Some(place) = self.stuffed.get_mut(self.count) {
                *place = byte;
                self.count += 1;
            } else {
                self.count = MAX_STUFFED + 1;
            }
            return None;
        }
        match core::mem::replace(&mut self.count, 0) {
            0 => None,
            count => Some(self.finish(count)),
        }
    }

    fn finish(&mut self, count: usize) -> Result<&[u8], FrameError> {
        let stuffed = self.stuffed.get(..count).ok_or(FrameError::TooLong)?;
        let report = cobs::decode(stuffed, &mut self.checked).map_err(|_| FrameError::NotStuffed)?;
        let checked = self.checked.get(..report.frame_size()).ok_or(FrameError::NotStuffed)?;
        let (body, check) = checked.split_last_chunk::<CHECK>().ok_or(FrameError::NotStuffed)?;
        if CRC.checksum(body) == u32::from_le_bytes(*check) { Ok(body) } else { Err(FrameError::Checksum) }
    }
}
