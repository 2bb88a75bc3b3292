//! WAV: audio interfaces used as data loggers. Channels are called `ch1`, `ch2` … and need `--map`.
//!
//! Integer samples are fractions of full scale, so the gain in `--map u_v=ch1*20` is the physical full scale: code /
//! 32767 in 16 bits (in general 2^(bits-1) - 1), code / 2^(bits-1) in wider ones, as NumPy users and libsndfile write
//! them. (The other convention differs by one part in 32768, less than a code.) Floating-point samples are taken as
//! they are.
//!
//! Own reader after EBU Tech 3306 (2009) and Microsoft's "Multiple Channel Audio Data and WAVE Files" (2007), because a
//! recorder also writes floats of 64 bits, the large kind RF64 and big-endian RIFX, and is switched off before its file
//! ends: then the whole frames are read, with a warning.

use std::path::Path;

use super::damage::{damaged, too_large};
use super::table::{Column, MAX_VALUES, Table};
use crate::error::{Error, Place, Result};

/// What the chunks of a file say.
struct Sound<'a> {
    channels: usize,
    rate_hz: u32,
    /// Bits and bytes of a sample, and whether it is a float.
    bits: u16,
    size: usize,
    float: bool,
    /// The most significant byte comes first.
    big: bool,
    data: &'a [u8],
    /// The file ends before its data do.
    cut: bool,
}

/// Code of the format whose real code follows in its extension.
const EXTENSIBLE: u16 = 0xfffe;
/// Length of a chunk that stands in the chunk "ds64".
const ELSEWHERE: u32 = u32::MAX;

type Parsed<T> = std::result::Result<T, &'static str>;

/// Takes the chunks apart.
fn parse(bytes: &[u8]) -> Parsed<Sound<'_>> {
    let big = bytes.starts_with(b"RIFX");
    let word = |at: usize| -> Option<u32> {
        let bytes = bytes.get(at..)?.first_chunk()?;
        Some(if big { u32::from_be_bytes(*bytes) } else { u32::from_le_bytes(*bytes) })
    };
    let short = |at: usize| -> Option<u16> {
        let bytes = bytes.get(at..)?.first_chunk()?;
        Some(if big { u16::from_be_bytes(*bytes) } else { u16::from_le_bytes(*bytes) })
    };
    let long = |at: usize| -> Option<u64> { bytes.get(at..)?.first_chunk().map(|b| u64::from_le_bytes(*b)) };
    let large = match bytes.get(..4) {
        Some(b"RIFF" | b"RIFX") => false,
        Some(b"RF64" | b"BW64") => true,
        _ => return Err("no RIFF at its start"),
    };
    if bytes.get(8..12) != Some(b"WAVE") {
        return Err("it holds no sound");
    }
    let (mut at, mut data_length, mut format) = (12_usize, None, None);
    while let (Some(id), Some(length)) = (bytes.get(at..at + 4), word(at + 4)) {
        let body = at + 8;
        match id {
            b"ds64" if large => data_length = long(body + 8),
            b"fmt " => {
                let field = |k: usize| short(body + k).ok_or("the header is cut off");
                let (code, channels, bits) = (field(0)?, field(2)?, field(14)?);
                let frame = usize::from(field(12)?);
                let rate_hz = word(body + 4).ok_or("the header is cut off")?;
                let extended = || word(body + 24).ok_or("the header is cut off");
                let float = match if code == EXTENSIBLE { extended()? } else { code.into() } {
                    1 => false,
                    3 => true,
                    2 | 17 => return Err("its samples are compressed (ADPCM)"),
                    6 => return Err("its samples are compressed (A-law)"),
                    7 => return Err("its samples are compressed (mu-law)"),
                    _ => return Err("its samples are compressed"),
                };
                let channels = usize::from(channels);
                let size = frame.checked_div(channels).ok_or("its header tells of no channels")?;
                if size * channels != frame || size < usize::from(bits.div_ceil(8)) {
                    return Err("its header contradicts itself: bits of a sample and bytes of a frame");
                }
                // Writers do not agree on whether they are the upper or the lower ones.
                if size > usize::from(bits.div_ceil(8)) {
                    return Err("its samples have fewer bytes than they take");
                }
                format = Some((channels, rate_hz, bits, size, float));
            }
            b"data" => {
                let (channels, rate_hz, bits, size, float) = format.ok_or("the data come before their format")?;
                // A recorder that was switched off has written neither this length nor that of the whole.
                let unfinished = length == 0 && word(4).is_some_and(|whole| (whole as usize).saturating_add(8) <= body);
                let length = match length {
                    ELSEWHERE => data_length,
                    length => Some(u64::from(length)).filter(|_| !unfinished),
                };
                let available = bytes.len() - body;
                let stated = length.map_or(usize::MAX, |n| usize::try_from(n).unwrap_or(usize::MAX));
                let data = &bytes[body..body + stated.min(available)];
                let cut = unfinished || (length.is_some() && stated > available);
                return Ok(Sound { channels, rate_hz, bits, size, float, big, data, cut });
            }
            _ => {}
        }
        // Chunks are padded to an even length.
        at = body.saturating_add(length as usize).saturating_add(length as usize % 2);
    }
    Err("it holds no samples")
}

/// A sample of at most eight bytes, the least significant first: floats as they are, integers as fractions of full
/// scale.
fn sample(bytes: &[u8], float: bool, bits: u16) -> f64 {
    match (float, bytes) {
        (true, _) if bytes.len() == 4 => bytes.first_chunk().map_or(f64::NAN, |b| f64::from(f32::from_le_bytes(*b))),
        (true, _) => bytes.first_chunk().map_or(f64::NAN, |b| f64::from_le_bytes(*b)),
        // Eight bits are counted from the middle.
        (false, [code]) => (f64::from(*code) - 128.0) / 127.0,
        (false, bytes) => {
            let mut code = [0; 8];
            code[8 - bytes.len()..].copy_from_slice(bytes);
            // Fewer bits than the bytes have stand at the upper end.
            let code = i64::from_le_bytes(code) >> (64 - 8 * bytes.len());
            let half = 2_f64.powi(8 * bytes.len() as i32 - 1);
            let full_scale = if bits <= 16 { half - 1.0 } else { half };
            code as f64 / full_scale
        }
    }
}

/// Reads a WAV file.
///
/// # Errors
/// Damaged content, compressed samples, a sampling rate of zero, too many samples.
pub fn read(path: &Path) -> Result<Table> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let sound = parse(&bytes).map_err(|reason| damaged(path, "WAV", reason))?;
    let size = sound.size;
    let known = if sound.float { matches!(size, 4 | 8) } else { (1..=8).contains(&size) };
    if sound.rate_hz == 0 || !known {
        return Err(Error::input(
            Place::file(path),
            "the header gives no sampling rate, or samples of another size than 8 to 64 bits (floats: 32, 64)",
            "export the file anew",
        ));
    }
    let frame = size * sound.channels;
    let frames = sound.data.len() / frame;
    if frames.saturating_mul(sound.channels) > MAX_VALUES {
        return Err(too_large(path, &format!("{frames} samples of {} channels", sound.channels)));
    }
    let mut table = Table::default();
    if sound.cut || !sound.data.len().is_multiple_of(frame) {
        table.warnings.push(format!("the file is cut off: its data end after {frames} samples"));
    }
    for k in 0..sound.channels {
        let at = k * size..(k + 1) * size;
        let value = |frame: &[u8]| {
            let mut bytes = [0; 8];
            bytes[..size].copy_from_slice(&frame[at.clone()]);
            if sound.big {
                bytes[..size].reverse();
            }
            sample(&bytes[..size], sound.float, sound.bits)
        };
        let values = sound.data.chunks_exact(frame).map(value).collect();
        let interval_s = Some(1.0 / f64::from(sound.rate_hz));
        table.columns.push(Column { interval_s, position: k + 1, ..Column::new(format!("ch{}", k + 1), values) });
    }
    Ok(table)
}
