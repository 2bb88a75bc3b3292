//! What leaves the program: files that appear whole or not at all, one JSON object on stdout, talk on stderr.

use std::fs::OpenOptions;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use tempfile::NamedTempFile;

use crate::error::{Error, Result};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static STOPPED: AtomicBool = AtomicBool::new(false);

/// Arranges that Ctrl-C (and a polite kill) stops long work at its next check instead of in the middle of a file.
pub fn catch_interrupts() {
    // A second handler can only fail to install when one is there already, which is what is wanted.
    let _ = ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed));
}

/// Whether the user has pressed Ctrl-C.
pub fn is_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// Takes note of a Ctrl-C that has ended the work, so that what there is of it can be written; the next one stops that,
/// too.
pub fn take_interrupt() {
    INTERRUPTED.store(false, Ordering::Relaxed);
}

/// Stops long work in a program that goes on, or lets it begin again.
pub fn stop_work(stopped: bool) {
    STOPPED.store(stopped, Ordering::Relaxed);
}

/// Fails with [`Error::Interrupted`] once the user has pressed Ctrl-C or the work was stopped. Long loops call this
/// often.
pub fn check_interrupt() -> Result<()> {
    if is_interrupted() || STOPPED.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(()) }
}

/// The bars on the terminal, one below the other.
static BARS: LazyLock<MultiProgress> = LazyLock::new(MultiProgress::new);

/// A progress bar on stderr when that is a terminal, and nothing at all otherwise.
pub fn progress(what: &'static str, steps: u64) -> ProgressBar {
    let bar = BARS.add(ProgressBar::new(steps));
    if let Ok(style) = ProgressStyle::with_template("{msg:24} [{bar:32}] {percent:>3} % {eta}") {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.set_message(what);
    bar
}

/// Writes a file whole or not at all: the content goes to a temporary file in the same folder, reaches the disk,
/// and then takes the name. Where the name is a link, the file that it leads to is replaced; a replaced file keeps its
/// permissions.
///
/// # Errors
/// An existing file without `force`, one that somebody else makes meanwhile included; whatever the system refuses; an
/// interrupt.
pub fn write_file(path: &Path, force: bool, write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
    refuse_overwrite(path, force)?;
    check_interrupt()?;
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
    check_interrupt()?;
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

/// Prints one JSON object on stdout, with the fields that every command shares put first.
pub fn print_json(command: &str, recordings: &[String], body: impl serde::Serialize) -> Result<()> {
    let mut object = serde_json::Map::new();
    object.insert("schema".into(), 1.into());
    object.insert("command".into(), command.into());
    object.insert("recordings".into(), recordings.into());
    match serde_json::to_value(body) {
        Ok(serde_json::Value::Object(fields)) => object.extend(fields),
        Ok(other) => {
            object.insert("result".into(), other);
        }
        Err(e) => {
            return Err(Error::usage(format!("the result cannot be written as JSON: {e}"), "report this as a bug"));
        }
    }
    print_line(&serde_json::Value::Object(object).to_string())
}

/// Prints a line on stdout; a reader that has gone away (`| head`) is not an error.
pub fn print_line(text: &str) -> Result<()> {
    match writeln!(std::io::stdout().lock(), "{text}") {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::io("standard output", e)),
        _ => Ok(()),
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
