//! How sections follow one another in a payload, whatever is in them.

use serde::{Deserialize, Serialize};

use super::tag::Tag;
use super::{Error, Text};

/// Length of what stands before a section's body, bytes.
const HEAD: usize = 4;

/// The sections of a payload, one after another.
pub(super) struct Sections<'a> {
    rest: &'a [u8],
    /// Which tags have come, in the order of [`Tag::ALL`].
    pub(super) seen: [bool; Tag::ALL.len()],
}

impl<'a> Sections<'a> {
    pub(super) fn new(payload: &'a [u8]) -> Self {
        Self { rest: payload, seen: [false; Tag::ALL.len()] }
    }

    /// The next one's tag and body; none at the end.
    ///
    /// # Errors
    /// One that is not known here, is cut off, or has come before.
    pub(super) fn next(&mut self) -> Result<Option<(Tag, &'a [u8])>, Error> {
        let Some((&[number, version, low, high], after)) = self.rest.split_first_chunk::<HEAD>() else {
            return if self.rest.is_empty() { Ok(None) } else { Err(Error::Truncated) };
        };
        let tag = Tag::known(number, version).ok_or(Error::Unsupported { tag: number, version })?;
        let length = usize::from(u16::from_le_bytes([low, high]));
        let (body, next) = after.split_at_checked(length).ok_or(Error::Truncated)?;
        self.rest = next;
        let place = Tag::ALL.iter().position(|(t, _)| *t == tag).and_then(|place| self.seen.get_mut(place));
        if place.is_none_or(|seen| core::mem::replace(seen, true)) {
            return Err(Error::Repeated(tag));
        }
        Ok(Some((tag, body)))
    }
}

/// A body that is one value and nothing else.
pub(super) fn whole<'a, T: Deserialize<'a>>(tag: Tag, body: &'a [u8]) -> Result<T, Error> {
    match postcard::take_from_bytes(body) {
        Ok((value, [])) => Ok(value),
        _ => Err(Error::Malformed(tag)),
    }
}

pub(super) fn text(tag: Tag, text: &str) -> Result<Text, Error> {
    Text::try_from(text).map_err(|_| Error::Malformed(tag))
}

/// Writes sections one behind the other.
pub(super) struct Writer<'b> {
    payload: &'b mut [u8],
    used: usize,
}

impl<'b> Writer<'b> {
    pub(super) fn new(payload: &'b mut [u8]) -> Self {
        Self { payload, used: 0 }
    }

    /// What has been written.
    pub(super) fn used(self) -> Result<&'b [u8], Error> {
        let Self { payload, used } = self;
        payload.get(..used).ok_or(Error::TooLong)
    }

    pub(super) fn section(&mut self, tag: Tag, value: &impl Serialize) -> Result<(), Error> {
        let free = self.payload.get_mut(self.used..).ok_or(Error::TooLong)?;
        let (head, body) = free.split_first_chunk_mut::<HEAD>().ok_or(Error::TooLong)?;
        let length = postcard::to_slice(value, body).map_err(|_| Error::TooLong)?.len();
        let [low, high] = u16::try_from(length).map_err(|_| Error::TooLong)?.to_le_bytes();
        *head = [tag as u8, tag.version(), low, high];
        self.used += HEAD + length;
        Ok(())
    }
}
