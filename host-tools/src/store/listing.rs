//! What a store holds, and single recordings out of it.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use serde::Serialize;

use super::Store;
use super::columns::{Cells, Columns};
use super::entry::{Content, Entry};
use super::files::{self, DataFile};
use super::filter::Filter;
use super::partition::Partition;
use super::recordings::{Recordings, is_about};
use super::results::Results;
use super::table::{contents, text};
use crate::context::Context;
use crate::error::{Error, Place, Result};

/// A recording of the store, without its samples.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct About {
    /// SHA-256 of what it holds.
    pub sha256: String,
    /// Serial number.
    pub serial: Option<String>,
    /// Where it lies.
    #[serde(flatten)]
    pub partition: Partition,
    /// Time on the clock, as text.
    pub time: Option<String>,
    /// Sampling interval, s.
    pub sample_time_s: f64,
    /// Number of samples.
    pub samples: usize,
    /// Mean temperature of the motor, °C.
    pub temperature_c: Option<f64>,
    /// Pressure of the air, hPa.
    pub pressure_hpa: Option<f64>,
    /// The file of the store.
    #[serde(skip)]
    pub path: PathBuf,
}

/// What a folder of the store holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Share {
    /// The folder.
    #[serde(flatten)]
    pub partition: Partition,
    /// Recordings.
    pub recordings: usize,
    /// Their duration, s.
    pub seconds: f64,
    /// Files.
    pub files: usize,
    /// Bytes of the files.
    pub bytes: u64,
}

/// The files in which recordings can be that are meant.
///
/// # Errors
/// Whatever the system refuses.
pub fn files(store: &Store, filter: &Filter) -> Result<Vec<(Partition, DataFile)>> {
    let files = files::find::<Recordings>(store.root())?.files;
    let placed = files.into_iter().filter_map(|file| Some((Partition::of(&file.folder)?, file)));
    Ok(placed.filter(|(partition, _)| filter.admits(partition)).collect())
}

/// Times that a folder is read anew whose files are put together meanwhile.
const AGAIN: usize = 10;

/// Calls for each recording that is meant. `told` hears of files that cannot be used.
///
/// # Errors
/// Whatever the system refuses; an interrupt.
pub fn each(
    store: &Store,
    filter: &Filter,
    ctx: &Context,
    told: &dyn Fn(&Path, &Error),
    take: &mut dyn FnMut(About),
) -> Result<()> {
    let mut folders: BTreeMap<PathBuf, Partition> = BTreeMap::new();
    folders.extend(files(store, filter)?.into_iter().map(|(partition, file)| (file.folder, partition)));
    let steps = ctx.steps("folders", folders.len() as u64);
    for (folder, partition) in folders {
        let mut again = 0;
        let rows = loop {
            match in_folder(store, &folder, &partition, ctx, told) {
                Err(Error::Io { source, .. }) if source.kind() == ErrorKind::NotFound && again < AGAIN => again += 1,
                other => break other?,
            }
        };
        rows.into_iter().filter(|row| filter.admits_serial(row.serial.as_deref())).for_each(&mut *take);
        steps.next();
    }
    Ok(())
}

/// The recordings of one folder, each once: while files are put together a row may be in two.
fn in_folder(
    store: &Store,
    folder: &Path,
    partition: &Partition,
    ctx: &Context,
    told: &dyn Fn(&Path, &Error),
) -> Result<Vec<About>> {
    let mut rows = BTreeMap::new();
    for path in files::in_folder::<Recordings>(store.root(), folder)? {
        ctx.check()?;
        match files::about::<Recordings, _>(&path, &is_about, &|columns| abouts(columns, partition, &path)) {
            Ok(some) => rows.extend(some.into_iter().map(|about| (about.sha256.clone(), about))),
            Err(Error::Io { path, source, remedy }) if source.kind() == ErrorKind::NotFound => {
                return Err(Error::Io { path, source, remedy });
            }
            Err(error) => told(&path, &error),
        }
    }
    Ok(rows.into_values().collect())
}

/// What the store holds of recordings that are meant, folder by folder.
///
/// # Errors
/// As [`each`].
pub fn shares(store: &Store, filter: &Filter, ctx: &Context, told: &dyn Fn(&Path, &Error)) -> Result<Vec<Share>> {
    let mut shares: BTreeMap<Partition, Share> = BTreeMap::new();
    let none =
        |partition: &Partition| Share { partition: partition.clone(), recordings: 0, seconds: 0.0, files: 0, bytes: 0 };
    for (partition, file) in files(store, filter)? {
        let share = shares.entry(partition.clone()).or_insert_with(|| none(&partition));
        share.files += 1;
        share.bytes += std::fs::metadata(&file.path).map_or(0, |about| about.len());
    }
    each(store, filter, ctx, told, &mut |about| {
        let share = shares.entry(about.partition.clone()).or_insert_with(|| none(&about.partition));
        share.recordings += 1;
        share.seconds += about.samples as f64 * about.sample_time_s;
    })?;
    Ok(shares.into_values().filter(|share| share.recordings > 0 || filter.serials.is_empty()).collect())
}

/// Results of one question, model, version and outcome.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct ResultShare {
    /// The question.
    pub job: String,
    /// Name of the model file.
    pub model_name: Option<String>,
    /// SHA-256 of the model file, or the settings in its place.
    pub model: String,
    /// Version of greyrig.
    pub code: String,
    /// What came of it.
    pub outcome: String,
}

/// How many results there are of recordings that are meant, whatever their serial number.
///
/// # Errors
/// As [`each`].
pub fn results(
    store: &Store,
    filter: &Filter,
    ctx: &Context,
    told: &dyn Fn(&Path, &Error),
) -> Result<BTreeMap<ResultShare, usize>> {
    let mut shares = BTreeMap::new();
    for file in files::find::<Results>(store.root())?.files {
        ctx.check()?;
        let mut parts = file.folder.iter();
        let job = parts.next().and_then(|job| job.to_str()?.strip_prefix("job=")).unwrap_or_default();
        if !Partition::of(parts.as_path()).is_some_and(|partition| filter.admits(&partition)) {
            continue;
        }
        let wanted = |path: &str| ["model_name", "model", "code", "outcome"].contains(&path);
        let rows = files::about::<Results, _>(&file.path, &wanted, &|columns| {
            let column = |name: &str| columns.rows::<ByteArray>(name);
            let (mut models, mut codes) = (column("model")?, column("code")?);
            let (mut names, outcomes) = (column("model_name")?, column("outcome")?);
            let read = |cell: Option<Cells<'_, ByteArray>>| cell.and_then(|cell| text(&cell));
            let share = |outcome: Cells<'_, ByteArray>| ResultShare {
                job: job.to_owned(),
                model_name: read(names.next()),
                model: read(models.next()).unwrap_or_default(),
                code: read(codes.next()).unwrap_or_default(),
                outcome: read(Some(outcome)).unwrap_or_default(),
            };
            Ok(outcomes.map(share).collect())
        });
        match rows {
            Ok(rows) => rows.into_iter().for_each(|row| *shares.entry(row).or_default() += 1),
            Err(error) => told(&file.path, &error),
        }
    }
    Ok(shares)
}

fn abouts(columns: &Columns, partition: &Partition, path: &Path) -> std::result::Result<Vec<About>, ParquetError> {
    let (mut serial, mut time) = (columns.rows::<ByteArray>("serial")?, columns.rows::<i64>("time")?);
    let (mut interval, mut samples) = (columns.rows::<f64>("sample_time_s")?, columns.rows::<i32>("samples")?);
    let mut temperature = columns.rows::<f64>("temperature_c")?;
    let mut pressure = columns.rows::<f64>("pressure_hpa")?;
    let mut rows = Vec::new();
    for content in contents(columns, "sha256")? {
        let clock = time.next().and_then(|cell| jiff::Timestamp::from_microsecond(*cell.value()?).ok());
        rows.push(About {
            sha256: content.to_string(),
            serial: serial.next().and_then(|cell| text(&cell)),
            partition: partition.clone(),
            time: clock.map(|clock| jiff::tz::Offset::UTC.to_datetime(clock).to_string()),
            sample_time_s: interval.next().and_then(|cell| cell.value().copied()).unwrap_or_default(),
            samples: samples.next().and_then(|cell| usize::try_from(*cell.value()?).ok()).unwrap_or_default(),
            temperature_c: temperature.next().and_then(|cell| cell.value().copied()),
            pressure_hpa: pressure.next().and_then(|cell| cell.value().copied()),
            path: path.to_owned(),
        });
    }
    Ok(rows)
}

/// Digits of a SHA-256 that a key has to have at least.
const DIGITS: usize = 8;

/// The one recording that a key means: the begin of its SHA-256, or a serial number.
///
/// # Errors
/// There is none, or more than one; a file that is damaged.
pub fn get(store: &Store, key: &str, filter: &Filter, ctx: &Context, told: &dyn Fn(&Path, &Error)) -> Result<Entry> {
    let is_digest = key.len() >= DIGITS && key.chars().all(|c| c.is_ascii_hexdigit());
    let lower = key.to_lowercase();
    let mut found: Vec<About> = Vec::new();
    each(store, filter, ctx, told, &mut |about| {
        if about.serial.as_deref() == Some(key) || is_digest && about.sha256.starts_with(&lower) {
            found.push(about);
        }
    })?;
    let here = || Place::file(store.root());
    match found.as_slice() {
        [] => Err(Error::input(
            here(),
            format!("no recording has the serial number or the SHA-256 {key:?}"),
            format!("greyrig store ls {} --each lists them", store.root().display()),
        )),
        [about] => {
            let content = Content::parse(&about.sha256);
            for row in files::rows::<Recordings>(&about.path)? {
                match row {
                    Ok(entry) if Some(entry.content) == content => return Ok(entry),
                    _ => {}
                }
            }
            let what = format!("the row of {key:?} is damaged");
            Err(Error::input(Place::file(&about.path), what, "restore the file from a copy"))
        }
        several => {
            let some: Vec<&str> = several.iter().take(4).filter_map(|about| about.sha256.get(..12)).collect();
            let more = if several.len() > some.len() { ", …" } else { "" };
            Err(Error::input(
                here(),
                format!("{} recordings have the serial number {key:?}", several.len()),
                format!("give the begin of a SHA-256: {}{more}", some.join(", ")),
            ))
        }
    }
}
