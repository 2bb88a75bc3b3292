//! WAV: audio interfaces used as data loggers. Channels are called `ch1`, `ch2` … and need `--map`.
//!
//! Integer samples are fractions of full scale, so the gain in `--map u_v=ch1*20` is the physical full scale: code / 32767
//! in 16 bits (in general 2^(bits-1) - 1), code / 2^(bits-1) in wider ones, as NumPy users and libsndfile write them. (The
//! other convention differs by one part in 32768, less than a code.) Floating-point samples are taken as they are.

use std::path::Path;

use hound::{SampleFormat, WavReader};

use super::damage::{damaged, too_large};
use super::table::{Column, MAX_VALUES, Table};
use crate::error::{Error, Place, Result};

/// Reads a WAV file.
///
/// # Errors
/// Whatever the decoder refuses, and a sampling rate of zero.
pub fn read(path: &Path) -> Result<Table> {
    let mut reader = WavReader::open(path).map_err(|e| damaged(path, "WAV", e))?;
    let spec = reader.spec();
    if spec.sample_rate == 0 || spec.channels == 0 || !(1..=32).contains(&spec.bits_per_sample) {
        return Err(Error::input(
            Place::file(path),
            "the header gives no sampling rate or no channels",
            "export the file anew",
        ));
    }
    if reader.len() as usize > MAX_VALUES {
        return Err(too_large(path, &format!("{} samples", reader.len())));
    }
    let half = 1_u32 << (spec.bits_per_sample - 1);
    let full_scale = f64::from(if spec.bits_per_sample <= 16 { half - 1 } else { half }).max(1.0);
    let samples: std::result::Result<Vec<f64>, hound::Error> = match spec.sample_format {
        SampleFormat::Float => reader.samples::<f32>().map(|s| s.map(f64::from)).collect(),
        SampleFormat::Int => reader.samples::<i32>().map(|s| s.map(|x| f64::from(x) / full_scale)).collect(),
    };
    let samples = samples.map_err(|e| damaged(path, "WAV", e))?;
    let channels = usize::from(spec.channels);
    let mut table = Table::default();
    for k in 0..channels {
        let values = samples.iter().skip(k).step_by(channels).copied().collect();
        let interval_s = Some(1.0 / f64::from(spec.sample_rate));
        table.columns.push(Column { interval_s, position: k + 1, ..Column::new(format!("ch{}", k + 1), values) });
    }
    Ok(table)
}
