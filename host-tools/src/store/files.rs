//! The files of a table: named by what is in them, written whole or not at all, small ones put together.
//!
//! A file is one row group, and is called by its number of rows and a digest of their keys: the same rows make the same
//! name. Small files are exchanged for one that holds their rows in three steps: the new one is written beside under a
//! hidden name; a note of what takes the place of what goes to the disk; names are changed, the old files removed, and
//! the note with them. Whoever writes to the store next, and finds a note, ends the exchange.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

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
pub const HIDDEN: &str = ".greyrig-";
const EXTENSION: &str = "parquet";
/// Bytes of samples after which a row group is full, whatever its number of rows: a bound of the memory, some hundred
/// recordings of the shop floor.
const GROUP_BYTES: usize = 64 << 20;
/// A file of this size is left as it is, though it has few rows.
const LARGE: u64 = 8 << 20;
/// Rows wait for the disk at most as long: what a kill costs.
const WAIT: Duration = Duration::from_secs(5);
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

/// The files in one folder of a table.
///
/// # Errors
/// Whatever the system refuses; a folder that is not there has none.
pub fn in_folder<T: Table>(root: &Path, folder: &Path) -> Result<Vec<PathBuf>> {
    let folder = root.join(T::FOLDER).join(folder);
    let entries = match std::fs::read_dir(&folder) {
        Ok(entries) => entries,
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        Err(e) => return Err(Error::io(&folder, e)),
    };
    let mut files = Vec::new();
    for entry in entries {
        let path = entry.map_err(|e| Error::io(&folder, e))?.path();
        if path.extension().is_some_and(|e| e == EXTENSION) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
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
    recording::fence(path, || groups::<T, R>(file, wanted, take).map_err(|e| damaged(path, e)))
}

fn groups<T: Table, R>(
    file: File,
    wanted: &dyn Fn(&str) -> bool,
    take: &dyn Fn(&Columns) -> std::result::Result<Vec<R>, ParquetError>,
) -> std::result::Result<Vec<R>, ParquetError> {
    let file = SerializedFileReader::new(file)?;
    let mut rows = Vec::new();
    for group in 0..file.num_row_groups() {
        rows.extend(take(&Columns::read(&file, group, &T::schema(), wanted)?)?);
    }
    Ok(rows)
}

/// The rows of a file that another program has in its memory, each for itself; `name` is what it is called there.
///
/// # Errors
/// What is no such file; a system without room for temporary files.
pub fn decode<T: Table>(name: &Path, bytes: &[u8]) -> Result<Vec<std::result::Result<T::Row, String>>> {
    let refused = |e| Error::io(std::env::temp_dir(), e);
    let mut file = tempfile::tempfile().map_err(refused)?;
    file.write_all(bytes).map_err(refused)?;
    recording::fence(name, || {
        groups::<T, _>(file, &|_| true, &T::take).map_err(|e| {
            let remedy = "give rows of a store, with its columns as they are";
            Error::input(Place::file(name), format!("these are no rows of the store: {e}"), remedy)
        })
    })
}

/// Rows as the content of a file of the store.
///
/// # Errors
/// None of rows that came from it.
pub fn encode<T: Table>(rows: &[T::Row]) -> std::result::Result<Vec<u8>, ParquetError> {
    let mut columns = Columns::of(&T::schema())?;
    rows.iter().try_for_each(|row| T::put(row, &mut columns))?;
    columns.encode(&[("greyrig_store", super::SCHEMA.to_string())])
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
    let bytes = encode::<T>(rows).map_err(|e| damaged(&path, e))?;
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
    /// When nothing waited for the disk.
    since: Instant,
}

impl<'a, T: Table> Incoming<'a, T> {
    /// None yet.
    pub fn new(root: &'a Path) -> Self {
        Self { root, folders: BTreeMap::new(), bytes: 0, touched: Vec::new(), since: Instant::now() }
    }

    /// Takes a row in, and writes a row group that is full, or all where some have waited for long.
    ///
    /// # Errors
    /// Whatever the system refuses.
    pub fn put(&mut self, folder: &Path, row: T::Row) -> Result<()> {
        self.bytes += T::bytes(&row);
        let rows = self.folders.entry(folder.to_owned()).or_default();
        rows.push(row);
        if rows.len() >= T::FULL {
            self.write(folder)?;
        }
        if self.since.elapsed() > WAIT {
            return self.settle();
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
    fn flush(&mut self) -> Result<()> {
        let folders: Vec<PathBuf> = self.folders.keys().cloned().collect();
        folders.iter().try_for_each(|folder| self.write(folder))
    }

    /// Writes all that is left, and puts small files together where there are many, or enough for a full row group.
    ///
    /// # Errors
    /// Whatever the system refuses.
    pub fn settle(&mut self) -> Result<()> {
        self.flush()?;
        self.since = Instant::now();
        let touched = std::mem::take(&mut self.touched);
        touched.iter().try_for_each(|folder| put_together::<T>(self.root, folder))
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
    let Some(exchange) = prepared::<T>(root, folder)? else { return Ok(()) };
    begin_exchange::<T>(root, &exchange)?;
    end_exchange::<T>(root)
}

/// Notes what is to be exchanged: from here on it will be.
fn begin_exchange<T: Table>(root: &Path, exchange: &Exchange) -> Result<()> {
    let text = serde_json::to_vec(exchange).map_err(|e| damaged(root, e))?;
    output::write_file(&note(root, T::FOLDER), true, |out| out.write_all(&text)).map_err(not_kept)?;
    settle(root)
}

/// Writes the rows of the small files of a folder anew, under hidden names; none: they are few and hold few.
fn prepared<T: Table>(root: &Path, folder: &Path) -> Result<Option<Exchange>> {
    let here = root.join(T::FOLDER).join(folder);
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
        return Ok(None);
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
    Ok(Some(exchange))
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

#[cfg(test)]
mod tests {
    use super::super::entry::Entry;
    use super::super::exact::Samples;
    use super::super::recordings::Recordings;
    use super::*;
    use crate::recording::{Channel, Recording};

    const LINE: &str = "line=A";

    fn entry(n: u32) -> Entry {
        let values = (0..20).map(|k| f64::from(k + n)).collect();
        Entry::of(&Recording::builder(1e-3).channel(Channel::Current, values).build().unwrap())
    }

    /// Files of so many rows each, side by side.
    fn side_by_side(root: &Path, rows: &[u32]) {
        let mut n = 0;
        for &rows in rows {
            let entries: Vec<Entry> = (n..n + rows).map(entry).collect();
            write::<Recordings>(root, Path::new(LINE), &entries, &name_of::<Recordings>(&entries)).unwrap();
            n += rows;
        }
    }

    /// Rows of each file, and all keys.
    fn held(root: &Path) -> (Vec<usize>, Vec<Key>) {
        let files = find::<Recordings>(root).unwrap().files;
        let mut held: Vec<Key> = files.iter().flat_map(|file| keys::<Recordings>(&file.path).unwrap()).collect();
        held.sort_unstable();
        let mut rows: Vec<usize> = files.iter().map(|file| file.rows.unwrap()).collect();
        rows.sort_unstable();
        (rows, held)
    }

    fn expected(rows: u32) -> Vec<Key> {
        let mut keys: Vec<Key> = (0..rows).map(|n| Recordings::key(&entry(n))).collect();
        keys.sort_unstable();
        keys
    }

    #[test]
    fn small_files_make_full_row_groups() {
        let folder = tempfile::tempdir().unwrap();
        side_by_side(folder.path(), &[30, 30, 1]);
        put_together::<Recordings>(folder.path(), Path::new(LINE)).unwrap();
        assert_eq!(held(folder.path()), (vec![1, 30, 30], expected(61)), "few files with few rows stay");
        side_by_side(folder.path(), &[30, 30, 1, 50, 40]);
        put_together::<Recordings>(folder.path(), Path::new(LINE)).unwrap();
        assert_eq!(held(folder.path()), (vec![23, 64, 64], expected(151)));
    }

    /// A writer is killed at each step of an exchange; the next one finds every row once.
    #[test]
    fn an_exchange_that_was_cut_off_is_ended() {
        for step in 0..5 {
            let folder = tempfile::tempdir().unwrap();
            let (root, top) = (folder.path(), folder.path().join("recordings"));
            side_by_side(root, &[40, 40, 40]);
            let exchange = prepared::<Recordings>(root, Path::new(LINE)).unwrap().unwrap();
            if step >= 1 {
                begin_exchange::<Recordings>(root, &exchange).unwrap();
            }
            let renamed = [0, 0, 1, exchange.new.len(), exchange.new.len()][step];
            for (hidden, name) in &exchange.new[..renamed] {
                std::fs::rename(top.join(hidden), top.join(name)).unwrap();
            }
            let removed = if step == 4 { 2 } else { 0 };
            exchange.old[..removed].iter().for_each(|old| std::fs::remove_file(top.join(old)).unwrap());
            assert_eq!(is_exchanging::<Recordings>(root), step >= 1);

            make_good::<Recordings>(root).unwrap();
            let rows = if step == 0 { vec![40, 40, 40] } else { vec![56, 64] };
            assert_eq!(held(root), (rows, expected(120)), "step {step}");
            assert_eq!(find::<Recordings>(root).unwrap().unfinished, [] as [PathBuf; 0]);
            assert!(!is_exchanging::<Recordings>(root));
        }
    }

    #[test]
    fn a_note_leads_nowhere_else() {
        let folder = tempfile::tempdir().unwrap();
        let (root, precious) = (folder.path().join("store"), folder.path().join("precious"));
        std::fs::create_dir(&root).unwrap();
        std::fs::write(&precious, "").unwrap();
        for old in ["../../precious", precious.to_str().unwrap()] {
            let exchange = Exchange { new: Vec::new(), old: vec![PathBuf::from(old)] };
            begin_exchange::<Recordings>(&root, &exchange).unwrap();
            let told = make_good::<Recordings>(&root).unwrap_err().to_string();
            assert!(told.contains("outside of the store"), "{told}");
            assert!(precious.exists());
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (root, outside) = (folder.path().join("store"), folder.path().join("outside"));
        side_by_side(&root, &[2]);
        side_by_side(&outside, &[5]);
        std::os::unix::fs::symlink(outside.join("recordings"), root.join("recordings/line=B")).unwrap();
        let found = find::<Recordings>(&root).unwrap();
        assert_eq!((found.files.len(), found.strangers.len()), (1, 1));
    }

    #[test]
    fn a_damaged_file_is_one_line() {
        let folder = tempfile::tempdir().unwrap();
        side_by_side(folder.path(), &[3]);
        let path = find::<Recordings>(folder.path()).unwrap().files.remove(0).path;
        let whole = std::fs::read(&path).unwrap();
        for cut in [0, 3, 4, 100, whole.len() / 2, whole.len() - 1] {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let told = rows::<Recordings>(&path).unwrap_err().to_string();
            assert!(told.contains("damaged") && !told.contains('\n'), "{told}");
        }
        // Whatever bit is wrong, no row comes out as it was not put in.
        let (entries, mut wrong) = ((0..3).map(entry).collect::<Vec<_>>(), 0);
        for at in (4..whole.len()).step_by(11) {
            let mut damaged = whole.clone();
            damaged[at] ^= 0x10;
            std::fs::write(&path, &damaged).unwrap();
            let taken = rows::<Recordings>(&path).unwrap_or_default();
            // An offset below the last bit is none.
            let samples = |entry: &Entry| {
                let values: Vec<Vec<f64>> = entry.channels.values().map(Samples::values).collect();
                (entry.content, values, entry.sample_time_s)
            };
            for row in taken.into_iter().flatten() {
                assert!(entries.iter().any(|entry| samples(entry) == samples(&row)), "byte {at}");
                wrong += 1;
            }
        }
        assert!(wrong > 0, "some bits matter to other columns alone");
    }
}
