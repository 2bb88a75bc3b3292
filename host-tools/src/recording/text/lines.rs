//! The lines of a file, unpacked and decoded.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::Path;

use crate::error::{Error, Place, Result};
use crate::recording::damage::looks_like;

/// A longer line is no table.
const LONGEST_LINE: u64 = 1 << 20;
/// Texts in UTF-16 are converted in memory.
const LONGEST_UTF16: u64 = 512 << 20;

fn decode_utf16(path: &Path, mut reader: Box<dyn BufRead>) -> Result<Box<dyn BufRead>> {
    let head = reader.fill_buf().map_err(|e| unreadable(path, &e))?;
    let big = match head {
        [0xff, 0xfe, ..] => false,
        [0xfe, 0xff, ..] => true,
        [0xef, 0xbb, 0xbf, ..] => {
            reader.consume(3);
            return Ok(reader);
        }
        _ => return Ok(reader),
    };
    let mut bytes = Vec::new();
    reader.take(LONGEST_UTF16 + 1).read_to_end(&mut bytes).map_err(|e| unreadable(path, &e))?;
    if bytes.len() as u64 > LONGEST_UTF16 {
        return Err(Error::input(Place::file(path), "the UTF-16 text is larger than 512 MB", "save it as UTF-8"));
    }
    let units = bytes[2..]
        .chunks_exact(2)
        .map(|b| if big { u16::from_be_bytes([b[0], b[1]]) } else { u16::from_le_bytes([b[0], b[1]]) });
    let text: String = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
    Ok(Box::new(Cursor::new(text.into_bytes())))
}

fn unreadable(path: &Path, error: &std::io::Error) -> Error {
    use std::io::ErrorKind as K;
    match error.kind() {
        K::InvalidInput | K::InvalidData | K::UnexpectedEof => Error::input(
            Place::file(path),
            format!("the compressed data are damaged or cut off ({error})"),
            "copy the file again from its source",
        ),
        _ => Error::io(path, std::io::Error::new(error.kind(), error.to_string())),
    }
}

/// Reads line by line.
pub struct Lines<'a> {
    path: &'a Path,
    reader: Box<dyn BufRead>,
    number: u32,
    gzip: bool,
    /// The last line that was read has an end.
    ended: bool,
}

impl<'a> Lines<'a> {
    /// Opens a file, which may be packed.
    ///
    /// # Errors
    /// What the system says, damaged data, a text in UTF-16 that is too large.
    pub fn open(path: &'a Path, gzip: bool) -> Result<Self> {
        let file = File::open(path).map_err(|e| Error::io(path, e))?;
        let mut reader: Box<dyn BufRead> = Box::new(BufReader::with_capacity(1 << 16, file));
        if gzip {
            reader = Box::new(BufReader::with_capacity(1 << 16, flate2::bufread::MultiGzDecoder::new(reader)));
        }
        Ok(Self { path, reader: decode_utf16(path, reader)?, number: 0, gzip, ended: true })
    }

    /// Whether the line that was read last has an end; the last one of a file that was cut off has none.
    pub const fn ended(&self) -> bool {
        self.ended
    }

    /// The next line without its end, with its number.
    ///
    /// # Errors
    /// What cannot be read, or is no text.
    pub fn next(&mut self) -> Result<Option<(u32, String)>> {
        let mut bytes = Vec::new();
        let read = (&mut self.reader).take(LONGEST_LINE).read_until(b'\n', &mut bytes);
        let read = read.map_err(|e| unreadable(self.path, &e))?;
        if read == 0 {
            return Ok(None);
        }
        self.number += 1;
        self.ended = bytes.last() == Some(&b'\n');
        if bytes.contains(&0) || (read as u64 == LONGEST_LINE && bytes.last() != Some(&b'\n')) {
            let what = if self.gzip { "the unpacked content is not text" } else { "the content is not text" };
            return Err(Error::input(
                Place::at(self.path, self.number as usize, 0),
                what,
                looks_like(&bytes).map_or_else(
                    || "give the file the extension of its format".into(),
                    |format| format!("it looks like {format}: give it that extension"),
                ),
            ));
        }
        while matches!(bytes.last(), Some(b'\n' | b'\r')) {
            bytes.pop();
        }
        let text = match String::from_utf8(bytes) {
            Ok(text) => text,
            // Windows programs write "°" and "µ" as single bytes; Latin-1 maps every byte to the character of its
            // number.
            Err(e) => e.into_bytes().iter().map(|&b| char::from(b)).collect(),
        };
        Ok(Some((self.number, text)))
    }
}
