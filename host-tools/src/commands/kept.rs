//! Recordings that nobody can make again: where they cannot be what was asked for, they are kept under another name.

use std::path::{Path, PathBuf};

use crate::context::Context;
use crate::error::{Error, Result};
use crate::recording::{self, Recording};

/// Writes what nobody can make again under a name that nothing has yet: `run.csv` becomes `run.WORD.csv`,
/// `run.WORD-2.csv` …
///
/// # Errors
/// A file that cannot be written; an interrupt.
pub fn keep(recording: &Recording, out: &Path, word: &str, ctx: &Context) -> Result<PathBuf> {
    if out.exists() && !out.is_file() {
        recording::write(recording, out, true, ctx)?;
        return Ok(out.to_owned());
    }
    let extension = out.extension().unwrap_or_default().to_string_lossy();
    let mut number = 1;
    loop {
        let word = if number == 1 { word.to_owned() } else { format!("{word}-{number}") };
        let path = out.with_extension(format!("{word}.{extension}"));
        number += 1;
        if path.exists() {
            continue;
        }
        match recording::write(recording, &path, false, ctx) {
            Err(_) if path.is_file() => {}
            written => return written.map(|()| path),
        }
    }
}

/// A recording that cannot be written where it was to go, on a full disk say, goes to the folder of temporary files.
/// Tells the `error` that kept it from there, or the wish to stop.
pub fn keep_elsewhere(recording: &Recording, out: &Path, error: Error, ctx: &Context) -> Error {
    let Some(name) = out.file_name().filter(|_| !out.exists() || out.is_file()) else { return error };
    for folder in [out.with_file_name(""), std::env::temp_dir()] {
        match keep(recording, &folder.join(name), "unsaved", ctx) {
            Ok(path) => {
                eprintln!("greyrig: the recording is in {}", path.display());
                break;
            }
            Err(stop @ Error::Interrupted) => return stop,
            Err(_) => {}
        }
    }
    error
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use greyrig::units::{CalibrationSettings, Counts};

    use super::*;
    use crate::device::capture::Capture;
    use crate::device::recorded;

    fn some_recording() -> Recording {
        let counts = Counts { voltage: 2100, current: 2050, speed: 10 };
        let capture = Capture { first: 0, samples: vec![Some(counts); 10], reconnections: 0 };
        recorded::recording(&capture, &CalibrationSettings::default(), BTreeMap::new()).unwrap()
    }

    #[test]
    fn what_is_incomplete_takes_a_name_that_is_free() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("run.csv");
        for name in ["run.incomplete.csv", "run.incomplete-2.csv", "run.incomplete-3.csv"] {
            assert_eq!(
                keep(&some_recording(), &out, "incomplete", &Context::quiet()).unwrap(),
                folder.path().join(name)
            );
            assert!(folder.path().join(name).is_file());
        }
        assert!(!out.exists());
    }

    /// The name was taken while the recording went on.
    #[test]
    fn a_recording_that_cannot_take_its_name_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("run.csv");
        std::fs::write(&out, "another").unwrap();
        let keep =
            |ctx: &Context| keep_elsewhere(&some_recording(), &out, Error::usage("taken", "choose another"), ctx);
        let stopped = Context::quiet();
        stopped.cancel_flag().cancel();
        assert!(matches!(keep(&stopped), Error::Interrupted));
        assert!(!folder.path().join("run.unsaved.csv").exists());
        assert!(matches!(keep(&Context::quiet()), Error::Usage { .. }), "why it is not where it was to go");
        assert!(folder.path().join("run.unsaved.csv").is_file());
        assert_eq!(std::fs::read_to_string(&out).unwrap(), "another");
    }
}
