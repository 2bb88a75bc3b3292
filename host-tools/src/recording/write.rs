//! Recordings to files, under the names of the interface and in SI units.

use std::path::Path;

use super::names::Role;
#[cfg(feature = "parquet")]
use super::series::check;
use super::series::{Series, key_of};
use super::{Channel, Motion, Recording};
use crate::context::Context;
use crate::error::{Error, Place, Result};
use crate::output;

/// Writes a recording, as CSV or Parquet by the extension. Numbers get as many digits as bring back the same value.
///
/// # Errors
/// An extension without a writer, an existing file without `force`, whatever the system refuses; an interrupt.
pub fn write(recording: &Recording, path: &Path, force: bool, ctx: &Context) -> Result<()> {
    columns(recording).write(path, force, ctx)
}

/// The columns of a recording, and what it says of itself.
pub fn columns(recording: &Recording) -> Series {
    let n = recording.len();
    let mut series = Series::default();
    let time = (0..n).map(|k| recording.start_s() + k as f64 * recording.sample_time_s()).collect();
    series.numbers(Role::Time.column(), time, Some("s"));
    for channel in Channel::ALL {
        if let Some(values) = recording.measured(channel) {
            series.numbers(channel.column(), values, Some(channel.unit(recording.motion())));
        }
    }
    let recorded = recorded(recording);
    if recording.masked_rows().iter().any(|k| recorded[*k]) {
        let mut valid = vec![true; n];
        recording.masked_rows().iter().for_each(|&k| valid[k] = false);
        series.flags(Role::Valid.column(), &valid);
    }
    state_channels(recording, &mut series);
    for extra in recording.extras().iter().filter(|e| e.values.len() == n) {
        series.numbers(&extra.name, extra.values.clone(), None);
    }
    if !recording.gaps().is_empty() {
        series.retain(&recorded);
    }
    say_metadata(recording, &mut series);
    series
}

/// Adds the columns that say where the rotor is held and the supply is open.
pub(crate) fn state_channels(recording: &Recording, series: &mut Series) {
    for (role, mask) in [(Role::RotorLocked, recording.rotor_locked()), (Role::SupplyOpen, recording.supply_open())] {
        if mask.len() == recording.len() && !recording.is_empty() {
            series.flags(role.column(), mask);
        }
    }
}

/// Rows that somebody recorded: a gap stays one in the file.
pub(crate) fn recorded(recording: &Recording) -> Vec<bool> {
    let mut recorded = vec![true; recording.len()];
    recording.gaps().iter().for_each(|gap| recorded[gap.clone()].fill(false));
    recorded
}

/// Says the recording's own metadata, the exact sampling interval and the kind of motion.
pub(crate) fn say_metadata(recording: &Recording, series: &mut Series) {
    // Any other statement of the rate is superseded.
    let own = recording.metadata().iter().filter(|(key, _)| !super::time_axis::is_interval_key(&key_of(key)));
    own.for_each(|(key, value)| series.say(key, value));
    series.say("sample_time_s", format!("{}", recording.sample_time_s()));
    if recording.motion() == Motion::Linear {
        series.say("motion", "linear");
    }
}

impl Series {
    /// Writes them, as CSV or Parquet by the extension. Numbers get as many digits as bring back the same value.
    ///
    /// # Errors
    /// An extension without a writer, an existing file without `force`, whatever the system refuses; an interrupt.
    pub fn write(&self, path: &Path, force: bool, ctx: &Context) -> Result<()> {
        check_extension(path)?;
        let written = match extension(path).as_str() {
            #[cfg(feature = "parquet")]
            "parquet" | "pq" => {
                output::write_file(path, force, |out| super::parquet::write(self, out).and_then(|()| check(ctx)))
            }
            // A device such as /dev/stdout has no extension and gets text.
            _ => output::write_file(path, force, |out| self.csv(out, ctx)),
        };
        // The writing was given up, and nothing was put under the name.
        if written.is_err() {
            ctx.check()?;
        }
        written
    }
}

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Fails where there is no writer for a file's extension. Commands call this before long work, too.
///
/// # Errors
/// That.
pub fn check_extension(path: &Path) -> Result<()> {
    let extension = extension(path);
    match extension.as_str() {
        "csv" => Ok(()),
        #[cfg(feature = "parquet")]
        "parquet" | "pq" => Ok(()),
        #[cfg(not(feature = "parquet"))]
        "parquet" | "pq" => Err(super::read::not_built(path, "Parquet")),
        _ if !path.exists() || path.is_file() || path.is_dir() => Err(Error::input(
            Place::file(path),
            if extension.is_empty() {
                "the name has no extension".into()
            } else {
                format!("no writer for '.{extension}'")
            },
            "name the output .csv or .parquet",
        )),
        _ => Ok(()),
    }
}
