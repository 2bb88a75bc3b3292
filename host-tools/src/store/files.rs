//! The files of a table: named by what is in them, written whole or not at all, small ones put together.
//!
//! A file is one row group, and is called by its number of rows and a digest of their keys: the same rows make the same
//! name. Small files are exchanged for one that holds their rows in three steps: the new one is written beside under a
//! hidden name; a note of what takes the place of what goes to the disk; names are changed, the old files removed, and
//! the note with them. Whoever writes to the store next, and finds a note, ends the exchange.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::columns::Columns;
use super::table::{Key, Table};
use crate::error::{Error, Place, Result};
use crate::output;
use crate::recording;

/// What files that are being written are called; the temporary ones of [`output::write_file`] begin so, too.
const HIDDEN: &str = ".greyrig-";
const EXTENSION: &str = "parquet";
/// Bytes of samples after which a row group is full, whatever its number of rows: a bound of the memory, some hundred
/// recordings of the shop floor.
const GROUP_BYTES: usize = 64 << 20;
/// A file of this size is left as it is, though it has few rows.
const LARGE: u64 = 8 << 20;
/// Small files of a folder that may lie side by side. Each addition makes one; a row is then written a few times in
/// all, and a reader opens few files more than there have to be.
const SIDE_BY_SIDE: usize = 8;

/// A file of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DataFile {
    /// The file.
    pub path: PathBuf,
    /// Its folder, relative to that of the table.
    pub folder: PathBuf,
    /// Rows that its name tells; none: it has another name.
    pub rows: Option<usize>,
}

/// What lies in the folder of a table.
#[derive(Debug, Default)]
pub struct Found {
    /// Its files, in the order of their folders.
    pub files: Vec<DataFile>,
    /// Files that were never finished.
    pub unfinished: Vec<PathBuf>,
    /// What is no part of a store.
    pub strangers: Vec<PathBuf>,
}

/// What lies in the folder of a table. Links are not followed: they may lead anywhere.
///
/// # Errors
/// Whatever the system refuses.
pub fn find<T: Table>(root: &Path) -> Result<Found> {
    let top = root.join(T::FOLDER);
    let mut found = Found::default();
    let mut open = vec![top.clone()];
    while let Some(folder) = open.pop() {
        let entries = match std::fs::read_dir(&folder) {
            Ok(entries) => entries,
            Err(e) if e.kind() == ErrorKind::NotFound => continue,
            Err(e) => return Err(Error::io(&folder, e)),
        };
        for entry in entries {
            let entry = entry.map_err(|e| Error::io(&folder, e))?;
            let (path, kind) = (entry.path(), entry.file_type().map_err(|e| Error::io(entry.path(), e))?);
            let name = entry.file_name().to_string_lossy().into_owned();
            if kind.is_dir() {
                open.push(path);
            } else if name.starts_with(HIDDEN) {
                found.unfinished.push(path);
            } else if kind.is_file() && path.extension().is_some_and(|e| e == EXTENSION) {
                let relative = folder.strip_prefix(&top).unwrap_or(Path::new("")).to_owned();
                found.files.push(DataFile { path, folder: relative, rows: rows_of(&name) });
            } else {
                found.strangers.push(path);
            }
        }
    }
    found.files.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(found)
}

/// Rows that the name of a file tells.
fn rows_of(name: &str) -> Option<usize> {
    let (rows, digest) = name.strip_suffix(".parquet")?.split_once('-')?;
    (digest.len() == 16).then(|| rows.parse().ok())?
}

fn name_of<T: Table>(rows: &[T::Row]) -> String {
    let mut keys: Vec<Key> = rows.iter().map(T::key).collect();
    keys.sort_unstable();
    let mut hash = Sha256::new();
    keys.iter().for_each(|key| hash.update(key));
    let digest: String = hash.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect();
    format!("{:05}-{digest}.{EXTENSION}", rows.len())
}

/// A damaged file of the store.
fn damaged(path: &Path, what: impl std::fmt::Display) -> Error {
    let remedy = "restore it from a copy, or remove it and add its recordings again";
    Error::input(Place::file(path), format!("this file of the store is damaged ({what}) and left out"), remedy)
}

/// Reads columns of a file, row group by row group.
fn read<T: Table, R>(
    path: &Path,
    wanted: &dyn Fn(&str) -> bool,
    take: &dyn Fn(&Columns) -> std::result::Result<Vec<R>, ParquetError>,
) -> Result<Vec<R>> {
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    recording::fence(path, || {
        let rows = || {
            let file = SerializedFileReader::new(file)?;
            let mut rows = Vec::new();
            for group in 0..file.num_row_groups() {
                rows.extend(take(&Columns::read(&file, group, &T::schema(), wanted)?)?);
            }
            Ok(rows)
        };
        rows().map_err(|e: ParquetError| damaged(path, e))
    })
}

/// All rows of a file, each for itself.
///
/// # Errors
/// A file that is gone, or damaged as a whole.
pub fn rows<T: Table>(path: &Path) -> Result<Vec<std::result::Result<T::Row, String>>> {
    read::<T, _>(path, &|_| true, &T::take)
}

/// The keys of all rows of a file.
///
/// # Errors
/// As [`rows`].
pub fn keys<T: Table>(path: &Path) -> Result<Vec<Key>> {
    read::<T, _>(path, &|column| T::KEYS.contains(&column), &T::keys)
}

/// What some columns of a file tell.
///
/// # Errors
/// As [`rows`].
pub fn about<T: Table, R>(
    path: &Path,
    wanted: &dyn Fn(&str) -> bool,
    take: &dyn Fn(&Columns) -> std::result::Result<Vec<R>, ParquetError>,
) -> Result<Vec<R>> {
    read::<T, R>(path, wanted, take)
}

/// Writes rows as a file, in a folder relative to that of the table.
fn write<T: Table>(root: &Path, folder: &Path, rows: &[T::Row], name: &str) -> Result<PathBuf> {
    let folder = root.join(T::FOLDER).join(folder);
    std::fs::create_dir_all(&folder).map_err(|e| not_kept(Error::io(&folder, e)))?;
    let path = folder.join(name);
    let mut columns = Columns::of(&T::schema()).map_err(|e| damaged(&path, e))?;
    rows.iter().try_for_each(|row| T::put(row, &mut columns)).map_err(|e| damaged(&path, e))?;
    let schema = super::SCHEMA.to_string();
    let bytes = columns.encode(&[("greyrig_store", schema)]).map_err(|e| damaged(&path, e))?;
    output::write_file(&path, true, |out| out.write_all(&bytes)).map_err(not_kept)?;
    Ok(path)
}

/// What a full disk leaves of a store is all that was in it.
fn not_kept(error: Error) -> Error {
    match error {
        Error::Io { path, source, remedy } => {
            let full =
                matches!(source.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge);
            let remedy = if full {
                "free some space and give the same command again: what is in the store stays, and nothing is added twice"
                    .to_owned()
            } else {
                remedy
            };
            Error::Io { path, source, remedy }
        }
        other => other,
    }
}

/// Has the names in a folder on the disk.
fn settle(folder: &Path) -> Result<()> {
    #[cfg(unix)]
    File::open(folder).and_then(|folder| folder.sync_all()).map_err(|e| Error::io(folder, e))?;
    #[cfg(not(unix))]
    let _ = folder;
    Ok(())
}

/// Rows on their way into a table, by folder.
#[derive(Debug)]
pub struct Incoming<'a, T: Table> {
    root: &'a Path,
    folders: BTreeMap<PathBuf, Vec<T::Row>>,
    bytes: usize,
    /// Folders that were written to.
    touched: Vec<PathBuf>,
}

impl<'a, T: Table> Incoming<'a, T> {
    /// None yet.
    pub fn new(root: &'a Path) -> Self {
        Self { root, folders: BTreeMap::new(), bytes: 0, touched: Vec::new() }
    }

    /// Takes a row in, and writes a row group that is full.
    ///
    /// # Errors
    /// Whatever the system refuses.
    pub fn put(&mut self, folder: &Path, row: T::Row) -> Result<()> {
        self.bytes += T::bytes(&row);
        let rows = self.folders.entry(folder.to_owned()).or_default();
        rows.push(row);
        if rows.len() >= T::FULL {
            return self.write(folder);
        }
        if self.bytes >= GROUP_BYTES {
            // The largest makes most room.
            let size = |rows: &Vec<T::Row>| rows.iter().map(T::bytes).sum::<usize>();
            let largest = self.folders.iter().max_by_key(|(_, rows)| size(rows)).map(|(folder, _)| folder.clone());
            return largest.map_or(Ok(()), |folder| self.write(&folder));
        }
        Ok(())
    }

    fn write(&mut self, folder: &Path) -> Result<()> {
        let Some(rows) = self.folders.remove(folder).filter(|rows| !rows.is_empty()) else { return Ok(()) };
        self.bytes = self.bytes.saturating_sub(rows.iter().map(T::bytes).sum());
        let path = write::<T>(self.root, folder, &rows, &name_of::<T>(&rows))?;
        settle(path.parent().unwrap_or(self.root))?;
        if !self.touched.iter().any(|touched| touched == folder) {
            self.touched.push(folder.to_owned());
        }
        Ok(())
    }

    /// Writes all that is left.
    ///
    /// # Errors
    /// Whatever the system refuses.
    pub fn flush(&mut self) -> Result<()> {
        let folders: Vec<PathBuf> = self.folders.keys().cloned().collect();
        folders.iter().try_for_each(|folder| self.write(folder))
    }

    /// Writes all that is left, and puts small files together where there are many, or enough for a full row group.
    ///
    /// # Errors
    /// Whatever the system refuses.
    pub fn finish(mut self) -> Result<()> {
        self.flush()?;
        self.touched.iter().try_for_each(|folder| put_together::<T>(self.root, folder))
    }
}

/// What takes the place of what. Paths are relative to the folder of the table.
#[derive(Debug, Serialize, Deserialize)]
struct Exchange {
    /// Hidden names, and those that they get.
    new: Vec<(PathBuf, PathBuf)>,
    old: Vec<PathBuf>,
}

fn note(root: &Path, table: &str) -> PathBuf {
    root.join(format!("{table}.exchange.json"))
}

/// Puts the small files of a folder together.
fn put_together<T: Table>(root: &Path, folder: &Path) -> Result<()> {
    let top = root.join(T::FOLDER);
    let here = top.join(folder);
    let mut small = Vec::new();
    for entry in std::fs::read_dir(&here).map_err(|e| Error::io(&here, e))? {
        let entry = entry.map_err(|e| Error::io(&here, e))?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let Some(rows) = rows_of(&name).filter(|rows| *rows < T::FULL) else { continue };
        if entry.metadata().map_err(|e| Error::io(entry.path(), e))?.len() < LARGE {
            small.push((name, rows));
        }
    }
    let all: usize = small.iter().map(|(_, rows)| rows).sum();
    if small.len() < 2 || all < T::FULL && small.len() <= SIDE_BY_SIDE {
        return Ok(());
    }
    small.sort();
    let mut exchange = Exchange { new: Vec::new(), old: Vec::new() };
    let (mut rows, mut bytes) = (Vec::new(), 0);
    let write = |rows: &mut Vec<T::Row>, exchange: &mut Exchange| -> Result<()> {
        let name = name_of::<T>(rows);
        let hidden = format!("{HIDDEN}{name}.new");
        write::<T>(root, folder, rows, &hidden)?;
        exchange.new.push((folder.join(hidden), folder.join(name)));
        rows.clear();
        Ok(())
    };
    for (name, _) in small {
        // What is damaged stays where it is, for somebody to look at.
        let Ok(taken) = self::rows::<T>(&here.join(&name)) else { continue };
        let Ok(taken) = taken.into_iter().collect::<std::result::Result<Vec<_>, _>>() else { continue };
        for row in taken {
            bytes += T::bytes(&row);
            rows.push(row);
            if rows.len() >= T::FULL || bytes >= GROUP_BYTES {
                write(&mut rows, &mut exchange)?;
                bytes = 0;
            }
        }
        exchange.old.push(folder.join(name));
    }
    if !rows.is_empty() {
        write(&mut rows, &mut exchange)?;
    }
    // A file whose rows come out as they were keeps its name.
    exchange.old.retain(|old| exchange.new.iter().all(|(_, new)| new != old));
    settle(&here)?;
    let text = serde_json::to_vec(&exchange).map_err(|e| damaged(&here, e))?;
    output::write_file(&note(root, T::FOLDER), true, |out| out.write_all(&text)).map_err(not_kept)?;
    settle(root)?;
    end_exchange::<T>(root)
}

/// Ends an exchange of which there is a note.
fn end_exchange<T: Table>(root: &Path) -> Result<()> {
    let (note, top) = (note(root, T::FOLDER), root.join(T::FOLDER));
    let text = match std::fs::read(&note) {
        Ok(text) => text,
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        Err(e) => return Err(Error::io(&note, e)),
    };
    let unclear =
        |what: &str| Error::input(Place::file(&note), what, "restore the file from a copy; nothing was changed");
    let exchange: Exchange =
        serde_json::from_slice(&text).map_err(|e| unclear(&format!("this is no note of an exchange: {e}")))?;
    let inside = |path: &Path| path.components().all(|c| matches!(c, std::path::Component::Normal(_)));
    let paths = exchange.new.iter().flat_map(|(a, b)| [a, b]).chain(&exchange.old);
    if let Some(outside) = paths.into_iter().find(|path| !inside(path)) {
        return Err(unclear(&format!("{} is outside of the store", outside.display())));
    }
    let gone = |result: std::io::Result<()>| match result {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(()),
        result => result,
    };
    for (hidden, name) in &exchange.new {
        // One that is gone has its name already.
        gone(std::fs::rename(top.join(hidden), top.join(name))).map_err(|e| Error::io(top.join(name), e))?;
        if !top.join(name).is_file() {
            return Err(unclear(&format!("{} is missing", name.display())));
        }
    }
    let folders = exchange.new.iter().map(|(_, name)| name).filter_map(|name| name.parent());
    folders.into_iter().try_for_each(|folder| settle(&top.join(folder)))?;
    for old in &exchange.old {
        gone(std::fs::remove_file(top.join(old))).map_err(|e| Error::io(top.join(old), e))?;
    }
    std::fs::remove_file(&note).map_err(|e| Error::io(&note, e))
}

/// Whether an exchange has not come to its end.
pub fn is_exchanging<T: Table>(root: &Path) -> bool {
    note(root, T::FOLDER).exists()
}

/// Makes good what a writer left that was killed: ends its exchange, removes what it never finished. Only who holds the
/// lock may do this.
///
/// # Errors
/// Whatever the system refuses.
pub fn make_good<T: Table>(root: &Path) -> Result<()> {
    end_exchange::<T>(root)?;
    for path in find::<T>(root)?.unfinished {
        std::fs::remove_file(&path).map_err(|e| Error::io(&path, e))?;
    }
    Ok(())
}
