//! Files that appear whole or not at all.

use std::fs::OpenOptions;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

use crate::error::{Error, Result};

/// Writes a file whole or not at all: the content goes to a temporary file in the same folder, reaches the disk,
/// and then takes the name. Where the name is a link, the file that it leads to is replaced; a replaced file keeps its
/// permissions.
///
/// # Errors
/// An existing file without `force`, one that somebody else makes meanwhile included; whatever the system refuses.
pub fn write_file(path: &Path, force: bool, write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
    refuse_overwrite(path, force)?;
    let fail = |e: std::io::Error| Error::io(path, e);
    if path.is_dir() {
        return Err(fail(ErrorKind::IsADirectory.into()));
    }
    // A device such as /dev/stdout or /dev/full cannot be renamed onto.
    if path.exists() && !path.is_file() {
        let file = OpenOptions::new().write(true).open(path).map_err(fail)?;
        let mut out = BufWriter::new(file);
        return write(&mut out).and_then(|()| out.flush()).map_err(fail);
    }
    let target = target(path).map_err(fail)?;
    let mut temporary = temporary(&target).map_err(fail)?;
    {
        let mut out = BufWriter::new(temporary.as_file_mut());
        write(&mut out).and_then(|()| out.flush()).map_err(fail)?;
    }
    if let Ok(before) = std::fs::metadata(&target) {
        temporary.as_file().set_permissions(before.permissions()).map_err(fail)?;
    }
    temporary.as_file().sync_all().map_err(fail)?;
    if force {
        temporary.persist(&target).map_err(|e| fail(e.error))?;
        return Ok(());
    }
    match temporary.persist_noclobber(&target) {
        Ok(_) => Ok(()),
        Err(e) if e.error.kind() == ErrorKind::AlreadyExists => Err(exists_already(path)),
        // Some file systems can only replace.
        Err(e) => {
            refuse_overwrite(path, false)?;
            e.file.persist(&target).map(drop).map_err(|e| fail(e.error))
        }
    }
}

/// The most links from one to the next, as in Linux.
const MOST_LINKS: usize = 40;

/// Where a name leads to in the end, whether that is there or not.
fn target(path: &Path) -> std::io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        match std::fs::read_link(&path) {
            // A link to "/…" replaces the whole.
            Ok(next) => path = folder(&path).join(next),
            Err(_) => return Ok(path),
        }
    }
    Err(std::io::Error::other("too many links lead from one to the next"))
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A temporary file beside a file, with the permissions of any new file.
fn temporary(target: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".greyrig-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The system takes off what the user's mask forbids.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    // The temporary file's own name would only puzzle.
    builder.tempfile_in(folder(target)).map_err(|e| e.kind().into())
}

/// Fails when the file exists and `--force` was not given, or when there is no folder to write to. Commands call this
/// before long work, too.
pub fn refuse_overwrite(path: &Path, force: bool) -> Result<()> {
    if path.is_file() && !force {
        return Err(exists_already(path));
    }
    check_folder(path)
}

fn exists_already(path: &Path) -> Error {
    Error::usage(format!("{} exists already", path.display()), "choose another name or give --force to replace it")
}

/// Fails unless the folder is there that a file is to be written to.
///
/// # Errors
/// As the system has it.
pub fn check_folder(path: &Path) -> Result<()> {
    let fail = |e| Error::io(path, e);
    let target = target(path).map_err(fail)?;
    match std::fs::metadata(folder(&target)).map_err(fail)?.is_dir() {
        true => Ok(()),
        false => Err(fail(ErrorKind::NotADirectory.into())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(path: &Path, force: bool, text: &str) -> Result<()> {
        write_file(path, force, |out| out.write_all(text.as_bytes()))
    }

    fn count(folder: &Path) -> usize {
        std::fs::read_dir(folder).unwrap().count()
    }

    /// Somebody else's file that comes while this one is written is theirs.
    #[test]
    fn nobody_loses_the_race_for_a_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.csv");
        let told = write_file(&path, false, |out| {
            std::fs::write(&path, "theirs")?;
            out.write_all(b"ours")
        });
        let told = told.unwrap_err().to_string();
        assert!(told.contains("exists already") && told.contains("--force"), "{told}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "theirs");
        assert_eq!(count(folder.path()), 1, "no temporary file is left");
        write(&path, true, "ours").unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "ours");
    }

    /// Of many at once exactly one makes the file.
    #[test]
    fn one_of_many_writers_makes_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.csv");
        let made = std::thread::scope(|scope| {
            let writers: Vec<_> = (0..8)
                .map(|n| {
                    scope.spawn({
                        let path = &path;
                        move || write(path, false, &n.to_string()).is_ok()
                    })
                })
                .collect();
            writers.into_iter().map(|writer| usize::from(writer.join().unwrap())).sum::<usize>()
        });
        assert_eq!((made, count(folder.path())), (1, 1));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_and_what_it_leads_to_is_written() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        std::fs::create_dir(here.join("data")).unwrap();
        symlink("data/run.csv", here.join("one")).unwrap();
        symlink(here.join("one"), here.join("two")).unwrap();
        // It leads to nothing yet.
        write(&here.join("two"), false, "first").unwrap();
        assert!(write(&here.join("two"), false, "second").unwrap_err().to_string().contains("two exists already"));
        write(&here.join("two"), true, "third").unwrap();
        assert_eq!(std::fs::read_to_string(here.join("data/run.csv")).unwrap(), "third");
        assert!(here.join("one").is_symlink() && here.join("two").is_symlink());
        assert_eq!((count(here), count(&here.join("data"))), (3, 1));
        symlink("round", here.join("round")).unwrap();
        assert!(write(&here.join("round"), true, "").is_err());
        symlink("no/such/run.csv", here.join("nowhere")).unwrap();
        assert!(refuse_overwrite(&here.join("nowhere"), false).is_err(), "told before long work");
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_those_of_the_file_or_of_any_new_one() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let mode = |name: &str| folder.path().join(name).metadata().unwrap().permissions().mode() & 0o777;
        std::fs::write(folder.path().join("usual"), "").unwrap();
        write(&folder.path().join("new"), false, "").unwrap();
        assert_eq!(mode("new"), mode("usual"));
        for kept in [0o600, 0o640, 0o664] {
            std::fs::set_permissions(folder.path().join("new"), std::fs::Permissions::from_mode(kept)).unwrap();
            write(&folder.path().join("new"), true, "again").unwrap();
            assert_eq!(mode("new"), kept);
        }
    }
}
