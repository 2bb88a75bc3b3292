//! Whether a store holds what it says: every row is read, and its samples held against its SHA-256.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::Serialize;

use super::Store;
use super::entry::Content;
use super::files::{self, DataFile};
use super::recordings::Recordings;
use super::results::Results;
use super::table::{Key, Table, short};
use crate::context::Context;
use crate::error::{Error, Place, Result};

/// What was found in a store.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Verified {
    /// Whole recordings.
    pub recordings: usize,
    /// Whole results.
    pub results: usize,
    /// Files of both tables.
    pub files: usize,
    /// Channels and other columns, by the numbers that they are kept as.
    pub kept_as: BTreeMap<&'static str, usize>,
    /// Files that cannot be read.
    pub damaged_files: usize,
    /// Rows that are not what was put in.
    pub damaged_rows: usize,
    /// Recordings, and results, that are there more than once.
    pub twice: usize,
    /// Recordings in a folder that is not theirs.
    pub misplaced: usize,
    /// Results of recordings that the store does not hold.
    pub without_recording: usize,
    /// Files that were never finished; the next writer removes them.
    pub unfinished: usize,
    /// Files that are no part of a store, links among them; nothing reads them.
    pub strangers: usize,
}

impl Verified {
    /// Whether all is as it was put in.
    pub const fn is_whole(&self) -> bool {
        self.damaged_files + self.damaged_rows + self.twice + self.misplaced == 0
    }
}

/// Keys of a file's rows, and the numbers that its channels are kept as.
type Whole = (Vec<u128>, BTreeMap<&'static str, usize>);

/// Reads all of a store. `told` hears of each file that is not as it should be.
///
/// # Errors
/// Whatever the system refuses about the store's folders; an interrupt.
pub fn verify(store: &Store, ctx: &Context, told: &(dyn Fn(&Path, &Error) + Sync)) -> Result<Verified> {
    // What is being put together would be there twice.
    let _locks = (store.hold::<Recordings>(ctx)?, store.hold::<Results>(ctx)?);
    let (recordings, results) = (files::find::<Recordings>(store.root())?, files::find::<Results>(store.root())?);
    let mut verified = Verified {
        files: recordings.files.len() + results.files.len(),
        unfinished: recordings.unfinished.len() + results.unfinished.len(),
        strangers: recordings.strangers.len() + results.strangers.len(),
        ..Verified::default()
    };
    for path in recordings.strangers.iter().chain(&results.strangers) {
        told(
            path,
            &Error::input(Place::file(path), "this is no part of the store, and nobody reads it", "move it away"),
        );
    }
    let steps = ctx.steps("files", verified.files as u64);
    let (damaged, misplaced) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let look = |file: &DataFile| -> Result<Option<Whole>> {
        ctx.check()?;
        let rows = files::rows::<Recordings>(&file.path);
        steps.next();
        let rows = match rows {
            Ok(rows) => rows,
            Err(error) => {
                told(&file.path, &error);
                return Ok(None);
            }
        };
        let (mut keys, mut forms) = (Vec::new(), BTreeMap::new());
        for (n, row) in rows.into_iter().enumerate() {
            let wrong = |what: String, remedy: &str| {
                let what = format!("row {}: {what}", n + 1);
                told(&file.path, &Error::input(Place::file(&file.path), what, remedy));
            };
            match row {
                Err(what) => {
                    damaged.fetch_add(1, Ordering::Relaxed);
                    wrong(what, "restore the file from a copy; all commands leave the row out");
                }
                Ok(entry) => {
                    let own = entry.partition().folder().ok();
                    if own.as_ref() != Some(&file.folder) {
                        misplaced.fetch_add(1, Ordering::Relaxed);
                        let own = own.unwrap_or_default();
                        wrong(format!("the recording belongs to {}", own.display()), "move the file there");
                    }
                    for samples in entry.channels.values().chain(entry.others.iter().map(|other| &other.1)) {
                        *forms.entry(samples.name()).or_default() += 1;
                    }
                    keys.push(short(&Recordings::key(&entry)));
                }
            }
        }
        Ok(Some((keys, forms)))
    };
    let looked: Vec<_> = recordings.files.par_iter().map(look).collect::<Result<_>>()?;
    let mut known = HashSet::new();
    for whole in looked {
        let Some((keys, forms)) = whole else {
            verified.damaged_files += 1;
            continue;
        };
        for (form, number) in forms {
            *verified.kept_as.entry(form).or_default() += number;
        }
        verified.recordings += keys.len();
        verified.twice += keys.into_iter().filter(|key| !known.insert(*key)).count();
    }
    (verified.damaged_rows, verified.misplaced) = (damaged.into_inner(), misplaced.into_inner());
    let mut folder = None;
    let mut there: HashSet<Key> = HashSet::new();
    for file in &results.files {
        ctx.check()?;
        // A result's key tells it from the others of its folder.
        if folder != Some(&file.folder) {
            there.clear();
            folder = Some(&file.folder);
        }
        match files::rows::<Results>(&file.path) {
            Ok(rows) => {
                for row in rows {
                    match row {
                        Ok(outcome) => {
                            verified.results += 1;
                            verified.twice += usize::from(!there.insert(Results::key(&outcome)));
                            let Content(recording) = outcome.recording;
                            verified.without_recording += usize::from(!known.contains(&short(&recording)));
                        }
                        Err(_) => verified.damaged_rows += 1,
                    }
                }
            }
            Err(error) => {
                verified.damaged_files += 1;
                told(&file.path, &error);
            }
        }
        steps.next();
    }
    Ok(verified)
}
