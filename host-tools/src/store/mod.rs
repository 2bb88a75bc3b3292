//! A store of many recordings and of what came of them, in Parquet.
//!
//! ```text
//! STORE/greyrig-store.json                                  the layout's number
//! STORE/recordings/line=…/type=…/day=…/00064-….parquet      a row a recording
//! STORE/results/job=…/line=…/type=…/day=…/00512-….parquet   a row a recording, model and version
//! ```
//!
//! Rows are only ever added. A recording is known by the SHA-256 of what it holds ([`entry::Content`]), a result by its
//! recording, its model and the version of greyrig: whatever is given twice is there once, and work that was cut off
//! goes on where it was. Files appear whole or not at all ([`files`]). Any reader of Parquet that knows folders as Hive
//! names them reads the store as it is.
//!
//! ```
//! use greyrig_host::context::Context;
//! use greyrig_host::rig::{Kind, Setup};
//! use greyrig_host::store::{Filter, Store, add};
//!
//! let folder = tempfile::tempdir()?;
//! let run = folder.path().join("run.csv");
//! let made = Setup::new(Kind::PmDc).seconds(0.5).run()?.recording;
//! greyrig_host::recording::write(&made, &run, false, &Context::quiet())?;
//! let store = Store::open_or_begin(&folder.path().join("motors"))?;
//! for expected in [1, 0] {
//!     let added = add::add(&store, &[run.clone()], &add::Given::default(), &Context::quiet(), &|_, _| ())?;
//!     assert_eq!((added.added, added.added + added.already_there), (expected, 1));
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod add;
pub mod entry;
pub mod exact;
pub mod files;
pub mod filter;
pub mod fleet;
pub mod grid;
pub mod job;
pub mod listing;
pub mod partition;
pub mod recordings;
pub mod results;
pub mod run;
pub mod table;
pub mod verify;

mod columns;
mod index;

use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

pub use columns::Columns;
pub use filter::Filter;

use crate::context::Context;
use crate::error::{Error, Place, Result};
use crate::{journal, output};
use table::Table;

/// The layout of the store that this version reads and writes.
pub const SCHEMA: u32 = 1;
/// The file that makes a folder a store.
const MARK: &str = "greyrig-store.json";

#[derive(Debug, Serialize, Deserialize)]
struct Mark {
    schema: u32,
}

/// A store.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Store {
    root: PathBuf,
}

/// The right to write to a table, until this is dropped.
#[derive(Debug)]
pub struct Lock {
    _file: File,
}

impl Store {
    /// Opens a store.
    ///
    /// # Errors
    /// A folder that is none, a store of a newer layout, whatever the system refuses.
    pub fn open(root: &Path) -> Result<Self> {
        let mark = root.join(MARK);
        let text = match std::fs::read(&mark) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound && root.is_dir() => {
                return Err(Error::input(
                    Place::file(root),
                    "this folder is no store",
                    format!("begin one with greyrig store add {} RUN…", root.display()),
                ));
            }
            // Of a file or of nothing at all the system tells best.
            Err(e) if root.is_dir() => return Err(Error::io(&mark, e)),
            Err(e) => return Err(Error::io(root, e)),
        };
        let unclear = |e: serde_json::Error| {
            Error::input(Place::file(&mark), format!("this tells no layout: {e}"), "restore the file from a copy")
        };
        let Mark { schema } = serde_json::from_slice(&text).map_err(unclear)?;
        if schema != SCHEMA {
            return Err(Error::input(
                Place::file(&mark),
                format!("this store has layout {schema}, and this greyrig knows layout {SCHEMA}"),
                "use the greyrig that wrote it, or a newer one; nothing was changed",
            ));
        }
        Ok(Self { root: root.to_owned() })
    }

    /// Opens a store, or begins one where there is nothing or an empty folder.
    ///
    /// # Errors
    /// As [`Self::open`]; a folder that holds something else.
    pub fn open_or_begin(root: &Path) -> Result<Self> {
        // What another program has not finished yet, which begins the same store, is nothing.
        let hidden = |entry: std::io::Result<std::fs::DirEntry>| {
            entry.is_ok_and(|entry| entry.file_name().to_string_lossy().starts_with(files::HIDDEN))
        };
        let entries = std::fs::read_dir(root).map(|mut entries| entries.all(hidden));
        match entries {
            Ok(false) => return Self::open(root),
            Ok(true) => {}
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                output::check_folder(root)?;
                match std::fs::create_dir(root) {
                    Err(e) if e.kind() != std::io::ErrorKind::AlreadyExists => return Err(Error::io(root, e)),
                    _ => {}
                }
            }
            Err(e) => return Err(Error::io(root, e)),
        }
        let text = format!("{{\"schema\": {SCHEMA}}}\n");
        match output::write_file(&root.join(MARK), false, |out| out.write_all(text.as_bytes())) {
            // Somebody else has begun it meanwhile.
            Err(Error::Usage { .. }) | Ok(()) => Self::open(root),
            Err(other) => Err(other),
        }
    }

    /// Its folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Waits until nobody writes to a table, and keeps others from it.
    ///
    /// # Errors
    /// As [`Self::lock`].
    pub fn hold<T: Table>(&self, ctx: &Context) -> Result<Lock> {
        let path = self.root.join(format!("{}.lock", T::FOLDER));
        let file = OpenOptions::new().create(true).append(true).open(&path).map_err(|e| Error::io(&path, e))?;
        journal::lock(&file, &path, ctx)?;
        Ok(Lock { _file: file })
    }

    /// Waits for the right to write to a table, and makes good what a writer left that was killed.
    ///
    /// # Errors
    /// Whatever the system refuses; an interrupt.
    pub fn lock<T: Table>(&self, ctx: &Context) -> Result<Lock> {
        let lock = self.hold::<T>(ctx)?;
        files::make_good::<T>(&self.root)?;
        Ok(lock)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_store_begins_in_an_empty_folder_and_nowhere_else() {
        let folder = tempfile::tempdir().unwrap();
        let here = |name: &str| folder.path().join(name);
        assert!(Store::open(&here("none")).is_err());
        Store::open_or_begin(&here("new")).unwrap();
        assert_eq!(Store::open(&here("new")).unwrap(), Store::open_or_begin(&here("new")).unwrap());
        std::fs::create_dir(here("other")).unwrap();
        Store::open_or_begin(&here("other")).unwrap();
        std::fs::create_dir(here("taken")).unwrap();
        std::fs::write(here("taken").join("a.csv"), "").unwrap();
        let told = Store::open_or_begin(&here("taken")).unwrap_err().to_string();
        assert!(told.contains("no store") && told.contains("greyrig store add"), "{told}");
        assert!(Store::open_or_begin(&here("no/such/folder")).is_err());
        std::fs::write(here("new").join(MARK), "{\"schema\": 2, \"more\": 1}").unwrap();
        let told = Store::open(&here("new")).unwrap_err().to_string();
        assert!(told.contains("layout 2") && told.contains("nothing was changed"), "{told}");
    }
}
