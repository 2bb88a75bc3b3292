//! What leaves the program: files that appear whole or not at all, one JSON object on stdout, talk on stderr.

use std::fs::OpenOptions;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

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

/// Stops long work in a program that goes on, or lets it begin again.
pub fn stop_work(stopped: bool) {
    STOPPED.store(stopped, Ordering::Relaxed);
}

/// Fails with [`Error::Interrupted`] once the user has pressed Ctrl-C or the work was stopped. Long loops call this often.
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
/// and then takes the name.
///
/// # Errors
/// An existing file without `force`; whatever the system refuses; an interrupt.
pub fn write_file(path: &Path, force: bool, write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
    refuse_overwrite(path, force)?;
    check_interrupt()?;
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    if path.is_dir() {
        return Err(Error::io(path, std::io::Error::from(std::io::ErrorKind::IsADirectory)));
    }
    // A device such as /dev/stdout or /dev/full cannot be renamed onto.
    if path.exists() && !path.is_file() {
        let file = OpenOptions::new().write(true).open(path).map_err(|e| Error::io(path, e))?;
        let mut out = BufWriter::new(file);
        return write(&mut out).and_then(|()| out.flush()).map_err(|e| Error::io(path, e));
    }
    let fail = |e: std::io::Error| Error::io(path, e);
    let mut temporary = tempfile::Builder::new().prefix(".greyrig-").tempfile_in(folder).map_err(|e| {
        // The temporary file's own name would only puzzle.
        fail(e.kind().into())
    })?;
    {
        let mut out = BufWriter::new(temporary.as_file_mut());
        write(&mut out).and_then(|()| out.flush()).map_err(fail)?;
    }
    temporary.as_file().sync_all().map_err(fail)?;
    set_usual_permissions(temporary.path()).map_err(fail)?;
    check_interrupt()?;
    temporary.persist(path).map_err(|e| fail(e.error))?;
    Ok(())
}

/// Adds a line to a table that grows for days, and has it on the disk before it returns. A line that a crash has cut off
/// stays a line by itself; the header is written first if there is nothing yet.
///
/// # Errors
/// Whatever the system refuses.
pub fn append_line(path: &Path, header: &str, line: &str) -> Result<()> {
    let append = || {
        let mut file = OpenOptions::new().create(true).append(true).read(true).open(path)?;
        let mut text = String::new();
        if file.metadata()?.len() == 0 {
            text = format!("{header}\n");
        } else {
            let mut last = [0];
            file.seek(SeekFrom::End(-1))?;
            file.read_exact(&mut last)?;
            if last != *b"\n" {
                text.push('\n');
            }
        }
        text += line;
        text.push('\n');
        file.write_all(text.as_bytes())?;
        file.sync_all()
    };
    append().map_err(|e| Error::io(path, e))
}

/// A cell of a table with commas, quoted where it has to be.
pub fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// Fails when the file exists and `--force` was not given. Commands call this before long work, too.
pub fn refuse_overwrite(path: &Path, force: bool) -> Result<()> {
    if path.is_file() && !force {
        return Err(Error::usage(
            format!("{} exists already", path.display()),
            "choose another name or give --force to replace it",
        ));
    }
    Ok(())
}

/// Temporary files are private to their owner; a result should be as readable as any new file.
fn set_usual_permissions(path: &Path) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o644))?;
    }
    #[cfg(not(unix))]
    let _ = path;
    Ok(())
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
