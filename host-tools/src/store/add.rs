//! Recordings into the store.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::Serialize;

use super::entry::Entry;
use super::files::{self, Incoming};
use super::recordings::Recordings;
use super::table::{Table, short};
use super::{Store, index, partition};
use crate::context::Context;
use crate::error::{Error, Place, Result};
use crate::recording::{self, Mapping};

/// What the user tells of all recordings, where they do not tell it themselves.
#[derive(Debug, Clone, Default)]
pub struct Given {
    /// How columns are named.
    pub mapping: Mapping,
    /// Entries of their metadata: `line`, `motor`, `date`. A recording that tells another one is refused.
    pub metadata: BTreeMap<&'static str, String>,
}

/// What has come of an addition. Each file is counted once.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Added {
    /// Files that were given.
    pub given: usize,
    /// Recordings that the store did not hold.
    pub added: usize,
    /// Recordings that it held already, or that were given twice.
    pub already_there: usize,
    /// Files that are no recordings, or damaged.
    pub refused: usize,
    /// Files that were not looked at, since the work was to stop.
    pub left: usize,
    /// Channels and other columns of what was added, by the numbers that they are kept as.
    pub kept_as: BTreeMap<&'static str, usize>,
    /// Whether the work was to stop.
    pub interrupted: bool,
}

/// Adds recordings that the store does not hold yet. `told` hears of each file of the store or of the user that cannot
/// be used.
///
/// # Errors
/// Whatever the system refuses about the store; what is in it stays.
pub fn add(
    store: &Store,
    runs: &[PathBuf],
    given: &Given,
    ctx: &Context,
    told: &(dyn Fn(&Path, &Error) + Sync),
) -> Result<Added> {
    let _lock = store.lock::<Recordings>(ctx)?;
    ctx.doing("looking at what is there");
    let files = files::find::<Recordings>(store.root())?.files;
    let mut known = index::known::<Recordings>(store.root(), &files, told)?;
    let mut incoming = Incoming::<Recordings>::new(store.root());
    let mut counts = Added { given: runs.len(), ..Added::default() };
    let steps = ctx.steps("recordings", runs.len() as u64);
    // So many are in memory at once as they were read.
    for some in runs.chunks(2 * rayon::current_num_threads()) {
        if ctx.check().is_err() {
            break;
        }
        let read: Vec<_> = some.par_iter().map(|run| (run, read(run, given, ctx))).collect();
        for (run, entry) in read {
            match entry {
                Ok((folder, entry)) => {
                    if known.insert(short(&Recordings::key(&entry))) {
                        counts.added += 1;
                        for samples in entry.channels.values().chain(entry.others.iter().map(|other| &other.1)) {
                            *counts.kept_as.entry(samples.name()).or_default() += 1;
                        }
                        incoming.put(&folder, entry)?;
                    } else {
                        counts.already_there += 1;
                    }
                }
                Err(Error::Interrupted) => continue,
                Err(error) => {
                    counts.refused += 1;
                    told(run, &error);
                }
            }
            steps.next();
        }
    }
    // What is read is kept, though the work is to stop.
    incoming.settle()?;
    counts.left = counts.given - counts.added - counts.already_there - counts.refused;
    counts.interrupted = ctx.check().is_err();
    Ok(counts)
}

/// A file as a row, with its folder.
fn read(run: &Path, given: &Given, ctx: &Context) -> Result<(PathBuf, Entry)> {
    let mut recording = recording::load(run, &given.mapping, ctx)?;
    for (key, value) in &given.metadata {
        let own = recording.metadata().get(*key).map(|own| own.trim()).filter(|own| !own.is_empty());
        match own {
            Some(own) if own != value => {
                return Err(Error::input(
                    Place::file(run),
                    format!("the recording tells {key} {own:?}, and {value:?} is given"),
                    "leave the option out, or correct the recording",
                ));
            }
            Some(_) => {}
            None => recording.set_metadata(*key, value),
        }
    }
    if let Some(date) = recording.metadata().get("date").filter(|date| partition::time(date).is_none()) {
        let what = format!("the date {date:?} is none");
        return Err(Error::input(Place::file(run), what, "write it as 2026-01-31 or 2026-01-31T06:15:00"));
    }
    let entry = Entry::of(&recording);
    let folder = entry
        .partition()
        .folder()
        .map_err(|e| Error::input(Place::file(run), e.to_string(), "give the line and the type a shorter name"))?;
    Ok((folder, entry))
}

/// The files that are meant by names of files and folders: of a folder all in it, not those of folders within.
///
/// # Errors
/// A folder that cannot be read.
pub fn files_of(names: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for name in names {
        if !name.is_dir() {
            files.push(name.clone());
            continue;
        }
        let entries = std::fs::read_dir(name).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
        let mut inside: Vec<PathBuf> = entries.map_err(|e| Error::io(name, e))?.iter().map(|e| e.path()).collect();
        inside.retain(|path| path.is_file());
        inside.sort();
        files.extend(inside);
    }
    Ok(files)
}
