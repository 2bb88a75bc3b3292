//! Tables that grow by a line for days, of which no line is lost: results of a shift, the history of a golden motor.
//!
//! | what happens | what is left |
//! | --- | --- |
//! | the file begins with another header | it is refused, and untouched |
//! | two programs write at once | one waits for the other: the file is locked from reading to the last line's end |
//! | power cut or kill within a line | the rest of that line moves to `NAME.cut`, so that no number that lacks digits is read |
//! | the disk is full | the file is as long as before |
//!
//! A line counts once its end is there. A number that has lost its last digits is a number like any other, so that only
//! the end tells whether the line is whole.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::context::Context;
use crate::error::{Error, Place, Result};
use crate::output;

/// How often a locked file is tried.
const GLANCE: Duration = Duration::from_millis(10);
/// After this time the user is told what is waited for. A line takes some milliseconds.
const PATIENCE: Duration = Duration::from_secs(2);

/// A table that is open and locked until this is dropped.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    header: &'static str,
    text: String,
    /// Bytes up to the last line's end.
    whole: u64,
    aside: Option<PathBuf>,
}

impl Journal {
    /// Opens a table, or begins one, and waits until nobody else has it.
    ///
    /// # Errors
    /// A file with another header, whatever the system refuses, Ctrl-C while it waits.
    pub fn open(path: &Path, header: &'static str, ctx: &Context) -> Result<Self> {
        refuse_others(path)?;
        let fail = |e| Error::io(path, e);
        let mut file = loop {
            let file = OpenOptions::new().create(true).append(true).read(true).open(path).map_err(fail)?;
            lock(&file, path, ctx)?;
            // While this waited, the file may have been moved away.
            if is_still(&file, path).map_err(fail)? {
                break file;
            }
        };
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(fail)?;
        let (text, cut) = lines(path, &bytes, header)?;
        let mut journal = Self { path: path.to_owned(), file, header, whole: text.len() as u64, text, aside: None };
        if !cut.is_empty() {
            journal.set_aside(cut)?;
        }
        Ok(journal)
    }

    /// What the user should know: that the last line had no end, and where it is now.
    pub fn warning(&self) -> Option<String> {
        let (path, aside) = (self.path.display(), self.aside.as_ref()?.display());
        Some(format!("{path}: the last line was cut off before its end; what there was of it is in {aside}"))
    }

    /// What the table holds: the header and whole lines; nothing, if it is new.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Adds lines, and has them on the disk before it returns.
    ///
    /// # Errors
    /// Whatever the system refuses; the file is then as it was.
    pub fn append(&mut self, lines: &[String]) -> Result<()> {
        let mut text = String::new();
        let header = Some(self.header).filter(|_| self.whole == 0);
        for line in header.into_iter().chain(lines.iter().map(String::as_str)) {
            text += line;
            text.push('\n');
        }
        if let Err(error) = self.file.write_all(text.as_bytes()).and_then(|()| self.file.sync_all()) {
            // The first error is the one that counts; what this leaves is cut off when the file is opened next.
            let _ = self.file.set_len(self.whole);
            return Err(Error::io(&self.path, error));
        }
        self.whole += text.len() as u64;
        self.text += &text;
        Ok(())
    }

    /// Moves the begin of a line that has no end to a file beside. It is there before it is gone here.
    fn set_aside(&mut self, cut: &[u8]) -> Result<()> {
        let mut name = self.path.clone().into_os_string();
        name.push(".cut");
        let beside = PathBuf::from(name);
        OpenOptions::new()
            .create(true)
            .append(true)
            .open(&beside)
            .and_then(|mut file| file.write_all(&[cut, b"\n"].concat()).and_then(|()| file.sync_all()))
            .map_err(|e| Error::io(&beside, e))?;
        self.file.set_len(self.whole).and_then(|()| self.file.sync_all()).map_err(|e| Error::io(&self.path, e))?;
        self.aside = Some(beside);
        Ok(())
    }
}

/// Fails unless a table of this name can be opened, or begun. It waits for nobody and changes nothing.
///
/// # Errors
/// A file with another header, whatever the system refuses.
pub fn check(path: &Path, header: &str) -> Result<()> {
    refuse_others(path)?;
    match OpenOptions::new().append(true).read(true).open(path) {
        Ok(mut file) => {
            let mut begin = vec![0; header.len() + 2];
            let mut count = 0;
            // A reader may get less than it asks for.
            while count < begin.len() {
                match file.read(&mut begin[count..]).map_err(|e| Error::io(path, e))? {
                    0 => break,
                    more => count += more,
                }
            }
            check_header(path, &begin[..count], header)
        }
        Err(e) if e.kind() == ErrorKind::NotFound => output::check_folder(path),
        Err(e) => Err(Error::io(path, e)),
    }
}

/// Devices and pipes hold no table.
fn refuse_others(path: &Path) -> Result<()> {
    match std::fs::metadata(path) {
        Ok(about) if about.is_dir() => Err(Error::io(path, ErrorKind::IsADirectory.into())),
        Ok(about) if !about.is_file() => {
            Err(Error::input(Place::file(path), "a device cannot hold a table that grows", "name a file"))
        }
        _ => Ok(()),
    }
}

/// The whole lines, and what is behind the last line's end.
fn lines<'b>(path: &Path, bytes: &'b [u8], header: &str) -> Result<(String, &'b [u8])> {
    check_header(path, bytes, header)?;
    let end = bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |n| n + 1);
    let (whole, cut) = bytes.split_at(end);
    let text = std::str::from_utf8(whole).map_err(|e| {
        let line = bytes[..e.valid_up_to()].iter().filter(|&&byte| byte == b'\n').count() + 1;
        Error::input(Place::at(path, line, 0), "this line is no text", "restore the file, or name another one")
    })?;
    Ok((text.to_owned(), cut))
}

/// Fails unless the first line is the header. One that was cut off while it was written is its begin.
fn check_header(path: &Path, bytes: &[u8], header: &str) -> Result<()> {
    let right = match bytes.iter().position(|&byte| byte == b'\n') {
        Some(end) => bytes[..end].strip_suffix(b"\r").unwrap_or(&bytes[..end]) == header.as_bytes(),
        None => header.as_bytes().starts_with(bytes),
    };
    if right {
        return Ok(());
    }
    Err(Error::input(
        Place::at(path, 1, 1),
        "the file holds something else, and is left as it is",
        format!("name another file, or one that begins with {header:?}"),
    ))
}

/// Another program holds the lock.
#[derive(Debug, thiserror::Error)]
#[error("another program writes to {}", .0.display())]
struct Locked(PathBuf);

/// Waits for the lock. Where the file system knows none, nobody can be waited for.
pub(crate) fn lock(file: &File, path: &Path, ctx: &Context) -> Result<()> {
    let begin = Instant::now();
    let mut told = false;
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(()),
            Err(TryLockError::Error(e)) if e.kind() == ErrorKind::Unsupported => return Ok(()),
            Err(TryLockError::Error(e)) => return Err(Error::io(path, e)),
            Err(TryLockError::WouldBlock) => {}
        }
        ctx.check()?;
        if !told && begin.elapsed() > PATIENCE {
            ctx.goes_on_after(&Locked(path.to_owned()));
            told = true;
        }
        std::thread::sleep(GLANCE);
    }
}

/// Whether the name still leads to the file that is open.
#[cfg(unix)]
fn is_still(file: &File, path: &Path) -> std::io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let open = file.metadata()?;
    match std::fs::metadata(path) {
        Ok(now) => Ok((now.dev(), now.ino()) == (open.dev(), open.ino())),
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(false),
        Err(e) => Err(e),
    }
}

/// Elsewhere an open file cannot be moved away.
#[cfg(not(unix))]
fn is_still(_: &File, _: &Path) -> std::io::Result<bool> {
    Ok(true)
}

/// A cell of a table with commas, quoted where it has to be. Line ends become blanks: a line of the file is a line of
/// the table.
pub fn cell(text: &str) -> String {
    let text = text.replace(['\n', '\r'], " ");
    if text.contains([',', '"']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "check,voltage_v";

    fn file(content: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv");
        std::fs::write(&path, content).unwrap();
        (folder, path)
    }

    fn append(path: &Path, line: &str) -> Result<()> {
        Journal::open(path, HEADER, &Context::quiet())?.append(&[line.to_owned()])
    }

    #[test]
    fn lines_are_added_behind_the_header() {
        let (folder, path) = file("");
        append(&path, "1,230").unwrap();
        append(&path, "2,231").unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "check,voltage_v\n1,230\n2,231\n");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    /// Cut at every byte: what was whole is there, and nothing else.
    #[test]
    fn a_cut_at_any_byte_leaves_whole_lines_only() {
        let whole = "check,voltage_v\n1,230\n2,230.5\n";
        for length in 0..=whole.len() {
            let (_folder, path) = file(&whole[..length]);
            append(&path, "3,229").unwrap();
            let end = whole[..length].rfind('\n').map_or(0, |n| n + 1);
            let kept = if end == 0 { "check,voltage_v\n" } else { &whole[..end] };
            assert_eq!(std::fs::read_to_string(&path).unwrap(), format!("{kept}3,229\n"), "cut to {length} bytes");
            let beside = std::fs::read_to_string(path.with_extension("csv.cut")).unwrap_or_default();
            let rest = &whole[end..length];
            let expected = if rest.is_empty() { String::new() } else { format!("{rest}\n") };
            assert_eq!(beside, expected, "cut to {length} bytes");
        }
    }

    #[test]
    fn another_file_is_left_as_it_is() {
        for content in
            ["t_s,u_v\n0,1\n", "check,voltage_v,more\n", "check;voltage_v\n", "x", "\n", "\u{feff}check,voltage_v\n"]
        {
            let (folder, path) = file(content);
            for error in [append(&path, "1,230").unwrap_err(), check(&path, HEADER).unwrap_err()] {
                let told = error.to_string();
                assert!(told.contains("t.csv:1:1: ") && told.contains("begins with"), "{told}");
                assert_eq!(error.exit_code(), 2);
            }
            assert_eq!(std::fs::read_to_string(&path).unwrap(), content);
            assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        }
        // A spreadsheet's line ends are no other header.
        let (_folder, path) = file("check,voltage_v\r\n1,230\r\n");
        check(&path, HEADER).unwrap();
        append(&path, "2,231").unwrap();
    }

    /// A reader that holds the lock sees no line of others until it has written its own.
    #[test]
    fn writers_wait_for_each_other() {
        let (_folder, path) = file("");
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..25 {
                        let mut journal = Journal::open(&path, HEADER, &Context::quiet()).unwrap();
                        let next = journal.text().lines().count().max(1);
                        journal.append(&[format!("{next},230")]).unwrap();
                    }
                });
            }
        });
        let text = std::fs::read_to_string(&path).unwrap();
        let numbers: Vec<usize> = text.lines().skip(1).map(|l| l.split(',').next().unwrap().parse().unwrap()).collect();
        assert_eq!(numbers, (1..=100).collect::<Vec<_>>());
    }

    #[test]
    fn a_cell_is_one_cell_of_one_line() {
        assert_eq!(cell("plain"), "plain");
        assert_eq!(cell("a, b"), "\"a, b\"");
        assert_eq!(cell("a \"b\"\nc"), "\"a \"\"b\"\" c\"");
    }
}
