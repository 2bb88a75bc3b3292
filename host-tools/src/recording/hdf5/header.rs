//! Object headers, as far as one message can be taken out of them (HDF5 File Format Specification 3.0, IV.A).
//!
//! The decoder refuses a whole group where the header of one member holds what it does not know: an attribute whose
//! type is stored apart from it (a committed type), the layout of a virtual data set. In the bytes in memory such an
//! attribute becomes a message without meaning (type "NIL"), as a writer leaves where it deleted one; a virtual layout
//! becomes one that is empty; of anything else all messages of the object go, so that it is none any more.

use std::ops::Range;

use hdf5_reader::checksum::jenkins_lookup3;

/// Types of messages.
const NIL: u16 = 0x00;
const LAYOUT: u16 = 0x08;
const ATTRIBUTE: u16 = 0x0c;
const CONTINUATION: u16 = 0x10;

/// Headers go on in other places; damaged ones in circles.
const MOST_MESSAGES: usize = 1 << 16;

/// Takes the attributes of the object at `address` out whose type or size is stored apart: their names.
pub fn without_shared_attributes(bytes: &mut [u8], address: usize) -> Vec<String> {
    let Some(header) = Header::parse(bytes, address) else { return Vec::new() };
    let mut names = Vec::new();
    for message in header.messages.iter().filter(|message| message.kind == ATTRIBUTE) {
        if let Some(name) = shared_attribute(&bytes[message.body.clone()]) {
            header.erase(bytes, message);
            names.push(name);
        }
    }
    header.seal(bytes);
    names
}

/// Empties the layout of the virtual data set at `address`: what it was.
pub fn without_virtual_layout(bytes: &mut [u8], address: usize) -> Option<Vec<u8>> {
    /// Version and class of a virtual layout, of an empty one that stands in the header itself, and its size of zero.
    const VIRTUAL: [u8; 2] = [4, 3];
    const EMPTY: [u8; 4] = [4, 0, 0, 0];
    let header = Header::parse(bytes, address)?;
    let is_virtual = |message: &&Message| message.kind == LAYOUT && bytes[message.body.clone()].starts_with(&VIRTUAL);
    let body = header.messages.iter().find(is_virtual)?.body.clone();
    let layout = bytes[body.clone()].to_vec();
    bytes[body].get_mut(..EMPTY.len())?.copy_from_slice(&EMPTY);
    header.seal(bytes);
    Some(layout)
}

/// Takes all messages of the object at `address` out; whether there were any.
pub fn without_messages(bytes: &mut [u8], address: usize) -> bool {
    let Some(header) = Header::parse(bytes, address) else { return false };
    let known = header.messages.iter().filter(|message| ![NIL, CONTINUATION].contains(&message.kind));
    let count = known.map(|message| header.erase(bytes, message)).count();
    header.seal(bytes);
    count > 0
}

/// The name of an attribute whose type or size is stored apart.
fn shared_attribute(body: &[u8]) -> Option<String> {
    /// Bits of the flags: the type, the size.
    const APART: u8 = 0b11;
    let start = match body.first()? {
        2 => 8,
        // The encoding of the name comes before it.
        3 => 9,
        _ => return None,
    };
    if body.get(1)? & APART == 0 {
        return None;
    }
    let length = usize::from(u16::from_le_bytes(*body.get(2..)?.first_chunk()?));
    let name = String::from_utf8_lossy(body.get(start..start + length)?).into_owned();
    Some(name.trim_end_matches('\0').to_owned())
}

struct Message {
    /// Where its type stands.
    at: usize,
    kind: u16,
    body: Range<usize>,
}

struct Header {
    /// The older version has types of two bytes and no checksums.
    old: bool,
    messages: Vec<Message>,
    /// What the checksums are formed of, which follow it.
    chunks: Vec<Range<usize>>,
}

/// A little-endian number.
fn number(bytes: &[u8], at: usize, size: usize) -> Option<usize> {
    let part = bytes.get(at..at.checked_add(size)?)?;
    usize::try_from(part.iter().rev().fold(0_u64, |sum, b| sum << 8 | u64::from(*b))).ok()
}

impl Header {
    fn parse(bytes: &[u8], address: usize) -> Option<Self> {
        let old = !bytes.get(address..)?.starts_with(b"OHDR");
        // Bit 2 of the flags: messages are numbered by their creation.
        let (mut numbered, mut chunks) = (false, Vec::new());
        let first = if old {
            let from = address.checked_add(16)?;
            from..from.checked_add(number(bytes, address + 8, 4)?)?
        } else {
            let flags = *bytes.get(address + 5)?;
            numbered = flags & 0b100 != 0;
            let times = if flags & 0b10_0000 != 0 { 16 } else { 0 };
            let limits = if flags & 0b1_0000 != 0 { 4 } else { 0 };
            let size_of_size = 1 << (flags & 0b11);
            let at = address + 6 + times + limits;
            let from = at + size_of_size;
            let end = from.checked_add(number(bytes, at, size_of_size)?)?;
            chunks.push(address..end);
            from..end
        };
        let mut header = Self { old, messages: Vec::new(), chunks };
        let mut places = vec![first];
        while let Some(place) = places.pop() {
            header.block(bytes, place, numbered, &mut places)?;
        }
        Some(header)
    }

    /// The messages of one block; further ones are put to `places`.
    fn block(
        &mut self,
        bytes: &[u8],
        place: Range<usize>,
        numbered: bool,
        places: &mut Vec<Range<usize>>,
    ) -> Option<()> {
        let head = if self.old { 8 } else { 4 + if numbered { 2 } else { 0 } };
        let size_of_kind = if self.old { 2 } else { 1 };
        let mut at = place.start;
        while at + head <= place.end {
            let (kind, size) = (number(bytes, at, size_of_kind)? as u16, number(bytes, at + size_of_kind, 2)?);
            let body = at + head..at + head + size;
            if body.end > place.end.min(bytes.len()) || self.messages.len() >= MOST_MESSAGES {
                return None;
            }
            if kind == CONTINUATION {
                let (from, length) = (number(bytes, body.start, 8)?, number(bytes, body.start + 8, 8)?);
                let end = from.checked_add(length)?;
                if self.old {
                    places.push(from..end);
                } else {
                    // A signature before the messages, a checksum behind them.
                    let end = end.checked_sub(4)?;
                    self.chunks.push(from..end);
                    places.push(from.checked_add(4)?..end);
                }
            }
            at = body.end;
            self.messages.push(Message { at: body.start - head, kind, body });
        }
        Some(())
    }

    fn erase(&self, bytes: &mut [u8], message: &Message) {
        let size_of_kind = if self.old { 2 } else { 1 };
        bytes[message.at..message.at + size_of_kind].fill(0);
        // Flags behind type and size.
        bytes[message.at + size_of_kind + 2] = 0;
    }

    /// Forms the checksums anew.
    fn seal(&self, bytes: &mut [u8]) {
        for chunk in &self.chunks {
            let sum = bytes.get(chunk.clone()).map(jenkins_lookup3);
            if let (Some(sum), Some(place)) = (sum, bytes.get_mut(chunk.end..chunk.end + 4)) {
                place.copy_from_slice(&sum.to_le_bytes());
            }
        }
    }
}
