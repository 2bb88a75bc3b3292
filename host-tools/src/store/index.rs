//! Which recordings the store holds, remembered: so that an addition need not open every file.
//!
//! The index is a cache beside the table. The name of a file tells its keys (it is a digest of them), so that what is
//! known of a file stays true while a file of that name is there; of files that are not in the index the keys are read
//! from the files. An entry whose checksum does not hold ends what is believed of it.

use std::collections::{HashMap, HashSet};
use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;

use rayon::prelude::*;
use sha2::{Digest, Sha256};

use super::files::{self, DataFile};
use super::table::{Table, short};
use crate::error::{Error, Result};
use crate::output;

const MAGIC: &[u8] = b"greyrig index 1\n";
/// Bytes of a key, of what a file is known by, and of a checksum.
const WORD: usize = 16;

/// Keys of a table: 16 bytes each.
#[derive(Debug, Default)]
pub struct Known {
    /// Of the files, in their order.
    old: Vec<u128>,
    new: HashSet<u128>,
}

impl Known {
    /// Notes a key; whether it was not known.
    pub fn insert(&mut self, key: u128) -> bool {
        self.old.binary_search(&key).is_err() && self.new.insert(key)
    }
}

/// Keys of files, by what a file is known by.
type Entries = HashMap<u128, Vec<u128>>;

/// The keys of all rows in some files, and has them remembered. `told` hears of files that cannot be read. Only who
/// holds the lock may do this.
///
/// # Errors
/// Whatever the system refuses.
pub fn known<T: Table>(root: &Path, files: &[DataFile], told: &(dyn Fn(&Path, &Error) + Sync)) -> Result<Known> {
    let path = root.join(format!("{}.index", T::FOLDER));
    let (mut entries, whole) = read(&path);
    let new: Vec<(u128, Vec<u128>)> = files
        .par_iter()
        .filter(|file| !entries.contains_key(&known_by(file)))
        .filter_map(|file| match files::keys::<T>(&file.path) {
            Ok(keys) => Some((known_by(file), keys.iter().map(short).collect())),
            Err(error) => {
                told(&file.path, &error);
                None
            }
        })
        .collect();
    let there: HashSet<u128> = files.iter().map(known_by).collect();
    let all = entries.len();
    entries.retain(|file, _| there.contains(file));
    let (stale, kept) = (all - entries.len(), entries.len());
    if !whole || stale > kept {
        let every = entries.iter().chain(new.iter().map(|(file, keys)| (file, keys)));
        let bytes = [MAGIC.to_vec(), every.flat_map(|(file, keys)| entry(*file, keys)).collect()].concat();
        output::write_file(&path, true, |out| out.write_all(&bytes))?;
    } else if !new.is_empty() {
        let bytes: Vec<u8> = new.iter().flat_map(|(file, keys)| entry(*file, keys)).collect();
        let appended = OpenOptions::new().append(true).open(&path).and_then(|mut file| file.write_all(&bytes));
        appended.map_err(|e| Error::io(&path, e))?;
    }
    entries.extend(new);
    let mut old: Vec<u128> = entries.into_values().flatten().collect();
    old.par_sort_unstable();
    Ok(Known { old, new: HashSet::new() })
}

fn known_by(file: &DataFile) -> u128 {
    let name = file.path.file_name().unwrap_or_default();
    half(&Sha256::digest(file.folder.join(name).as_os_str().as_encoded_bytes()))
}

fn half(digest: &[u8]) -> u128 {
    digest.first_chunk().map_or(0, |half| u128::from_le_bytes(*half))
}

/// Number of keys, the file, the keys, the checksum.
fn entry(file: u128, keys: &[u128]) -> Vec<u8> {
    let mut bytes = (keys.len() as u64).to_le_bytes().to_vec();
    bytes.extend(file.to_le_bytes());
    keys.iter().for_each(|key| bytes.extend(key.to_le_bytes()));
    let checksum = half(&Sha256::digest(&bytes));
    bytes.extend(checksum.to_le_bytes());
    bytes
}

/// What is remembered, and whether all of it can be believed.
fn read(path: &Path) -> (Entries, bool) {
    let mut entries = Entries::new();
    let bytes = std::fs::read(path).unwrap_or_default();
    let Some(mut rest) = bytes.strip_prefix(MAGIC) else { return (entries, false) };
    let word = |bytes: &[u8]| half(bytes);
    while !rest.is_empty() {
        let next = || -> Option<(u128, Vec<u128>, usize)> {
            let count = usize::try_from(u64::from_le_bytes(*rest.first_chunk()?)).ok()?;
            let body = size_of::<u64>().checked_add(count.checked_add(1)?.checked_mul(WORD)?)?;
            let checksum = rest.get(body..body.checked_add(WORD)?)?;
            let about = rest.get(..body)?;
            if half(&Sha256::digest(about)) != word(checksum) {
                return None;
            }
            let mut words = about.get(size_of::<u64>()..)?.chunks_exact(WORD).map(word);
            Some((words.next()?, words.collect(), body + WORD))
        };
        let Some((file, keys, length)) = next() else { return (entries, false) };
        entries.insert(file, keys);
        rest = rest.get(length..).unwrap_or_default();
    }
    (entries, true)
}

#[cfg(test)]
mod tests {
    use super::super::entry::Entry;
    use super::super::files::{Incoming, find};
    use super::super::recordings::Recordings;
    use super::*;
    use crate::recording::{Channel, Recording};

    fn entry_of(n: u32) -> Entry {
        let values = (0..20).map(|k| f64::from(k + n)).collect();
        Entry::of(&Recording::builder(1e-3).channel(Channel::Current, values).build().unwrap())
    }

    fn put(root: &Path, numbers: std::ops::Range<u32>) {
        let mut incoming = Incoming::<Recordings>::new(root);
        numbers.for_each(|n| incoming.put(Path::new("line=A"), entry_of(n)).unwrap());
        incoming.settle().unwrap();
    }

    fn holds(root: &Path, n: u32) -> bool {
        let files = find::<Recordings>(root).unwrap().files;
        let known = known::<Recordings>(root, &files, &|path, error| panic!("{}: {error}", path.display()));
        !known.unwrap().insert(short(&Recordings::key(&entry_of(n))))
    }

    #[test]
    fn what_is_remembered_is_what_is_there() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        assert!(!holds(root, 0));
        for n in 0..12 {
            put(root, n..n + 1);
            assert!(holds(root, n) && !holds(root, n + 1), "{n}: also where small files are put together");
        }
        put(root, 100..170);
        assert!((0..12).chain(100..170).all(|n| holds(root, n)));
        // What is gone is not there, whatever the index has of it.
        for file in find::<Recordings>(root).unwrap().files {
            std::fs::remove_file(file.path).unwrap();
        }
        assert!((0..12).chain(100..170).all(|n| !holds(root, n)));
    }

    #[test]
    fn a_damaged_index_is_not_believed() {
        let folder = tempfile::tempdir().unwrap();
        let (root, index) = (folder.path(), folder.path().join("recordings.index"));
        put(root, 0..3);
        assert!(holds(root, 1));
        let whole = std::fs::read(&index).unwrap();
        for at in (0..whole.len()).step_by(7) {
            let mut damaged = whole.clone();
            damaged[at] ^= 1;
            std::fs::write(&index, &damaged).unwrap();
            assert!(holds(root, 1) && !holds(root, 5), "byte {at}");
            std::fs::write(&index, &whole[..at]).unwrap();
            assert!(holds(root, 2) && !holds(root, 5), "cut at {at}");
        }
    }
}
