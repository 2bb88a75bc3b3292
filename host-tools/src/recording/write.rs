//! Recordings to files, under the names of the interface and in SI units.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use super::names::Role;
use super::{Channel, Motion, Recording};
use crate::context::Context;
use crate::error::{Error, Place, Result};
use crate::output;

/// Rows after which it is looked whether the work is to stop.
const LOOK_EVERY: usize = 4096;

type Columns = Vec<(String, Vec<f64>, Option<&'static str>)>;

/// Writes a recording, as CSV or Parquet by the extension. Numbers get as many digits as bring back the same value.
///
/// # Errors
/// An extension without a writer, an existing file without `force`, whatever the system refuses; an interrupt.
pub fn write(recording: &Recording, path: &Path, force: bool, ctx: &Context) -> Result<()> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let (columns, metadata) = (columns(recording), metadata(recording));
    let written = match extension.as_str() {
        "csv" => output::write_file(path, force, |out| csv(&columns, &metadata, out, ctx)),
        #[cfg(feature = "parquet")]
        "parquet" | "pq" => output::write_file(path, force, |out| {
            super::parquet::write(&columns, &metadata, out).and_then(|()| check(ctx))
        }),
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
        // A device such as /dev/stdout has no extension and gets text.
        _ => output::write_file(path, force, |out| csv(&columns, &metadata, out, ctx)),
    };
    // The writing was given up, and nothing was put under the name.
    if written.is_err() {
        ctx.check()?;
    }
    written
}

/// Gives a file up whose writing is to stop.
fn check(ctx: &Context) -> std::io::Result<()> {
    ctx.check().map_err(std::io::Error::other)
}

fn columns(recording: &Recording) -> Columns {
    let n = recording.len();
    let time = (0..n).map(|k| recording.start_s() + k as f64 * recording.sample_time_s()).collect();
    let mut columns: Columns = vec![(Role::Time.column().into(), time, Some("s"))];
    for channel in Channel::ALL {
        if let Some(values) = recording.channel(channel) {
            let mut values = values.to_vec();
            recording.masked_alone(channel).iter().for_each(|&k| values[k] = f64::NAN);
            columns.push((channel.column().into(), values, Some(channel.unit(recording.motion()))));
        }
    }
    let flags = |mask: &[bool]| mask.iter().map(|&b| f64::from(u8::from(b))).collect::<Vec<_>>();
    let recorded = recorded(recording);
    if recording.masked_rows().iter().any(|k| recorded[*k]) {
        let mut valid = vec![1.0; n];
        recording.masked_rows().iter().for_each(|&k| valid[k] = 0.0);
        columns.push((Role::Valid.column().into(), valid, None));
    }
    for (role, mask) in [(Role::RotorLocked, recording.rotor_locked()), (Role::SupplyOpen, recording.supply_open())] {
        if mask.len() == n && n > 0 {
            columns.push((role.column().into(), flags(mask), None));
        }
    }
    for extra in recording.extras().iter().filter(|e| e.values.len() == n) {
        let mut name = one_line(&extra.name);
        while columns.iter().any(|c| c.0 == name) {
            name.push_str("_2");
        }
        columns.push((name, extra.values.clone(), None));
    }
    if !recording.gaps().is_empty() {
        for (_, values, _) in &mut columns {
            let mut recorded = recorded.iter();
            values.retain(|_| recorded.next().is_some_and(|recorded| *recorded));
        }
    }
    columns
}

/// Rows that somebody recorded: a gap stays one in the file.
fn recorded(recording: &Recording) -> Vec<bool> {
    let mut recorded = vec![true; recording.len()];
    recording.gaps().iter().for_each(|gap| recorded[gap.clone()].fill(false));
    recorded
}

/// The metadata that go into the file: the recording's own, the exact sampling interval and the kind of motion.
fn metadata(recording: &Recording) -> BTreeMap<String, String> {
    let own = recording.metadata().iter().map(|(k, v)| (key(k), one_line(v)));
    let mut metadata: BTreeMap<String, String> = own.filter(|(k, _)| !k.is_empty()).collect();
    // Any other statement of the rate is superseded.
    metadata.retain(|k, _| !super::time_axis::is_interval_key(k));
    metadata.insert("sample_time_s".into(), format!("{}", recording.sample_time_s()));
    if recording.motion() == Motion::Linear {
        metadata.insert("motion".into(), "linear".into());
    }
    metadata
}

/// Names and values of binary files may hold anything; a text file with it in would be none.
fn one_line(text: &str) -> String {
    let words = text.split(|c: char| c.is_whitespace() || c.is_control());
    words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join(" ")
}

/// A key must not hold what ends a key.
fn key(text: &str) -> String {
    one_line(&text.replace([':', '=', '#'], " "))
}

fn csv(
    columns: &Columns,
    metadata: &BTreeMap<String, String>,
    out: &mut dyn Write,
    ctx: &Context,
) -> std::io::Result<()> {
    for (key, value) in metadata {
        writeln!(out, "# {key}: {value}")?;
    }
    let header: Vec<String> = columns.iter().map(|(name, ..)| quoted(name)).collect();
    writeln!(out, "{}", header.join(","))?;
    let rows = columns.first().map_or(0, |c| c.1.len());
    let mut line = String::new();
    for row in 0..rows {
        line.clear();
        if row.is_multiple_of(LOOK_EVERY) {
            check(ctx)?;
        }
        for (k, (_, values, _)) in columns.iter().enumerate() {
            use std::fmt::Write as _;
            if k > 0 {
                line.push(',');
            }
            // The shortest digits that read back as the same number.
            let x = values[row];
            if x.is_nan() {
                continue;
            }
            let written = if x != 0.0 && (x.abs() < 1e-5 || x.abs() >= 1e16) {
                write!(line, "{x:e}")
            } else {
                write!(line, "{x}")
            };
            written.map_err(std::io::Error::other)?;
        }
        line.push('\n');
        out.write_all(line.as_bytes())?;
    }
    check(ctx)
}

fn quoted(name: &str) -> String {
    if name.contains([',', '"', ';', '\t']) || name.starts_with(['#', '%']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}
