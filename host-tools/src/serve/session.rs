//! What a page shows: the recordings, the versions of the model, and what is being done.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayon::ThreadPoolBuilder;
use serde_json::{Value, json};
use tempfile::TempDir;

use super::error::{Error, Result};
use super::questioned::Questioned;
use super::task::{Outcome, Task};
use super::version::Version;
use crate::check;
use crate::compare::compare;
use crate::context::{CancelFlag, Context, Progress};
use crate::error;
use crate::model::{Kind, Origin};
use crate::recording::{self, Mapping, Recording};
use crate::report::{Report, Step, figures};

/// What is being done.
struct Job {
    what: String,
    cancel: CancelFlag,
    at: At,
}

/// How far a job is.
#[derive(Clone, Default)]
struct At {
    doing: Arc<Mutex<(String, Option<f64>)>>,
    /// How often something new was begun.
    steps: Arc<AtomicUsize>,
}

impl At {
    fn present(&self) -> MutexGuard<'_, (String, Option<f64>)> {
        // It is only shown, and the next report replaces it: nothing that a panic leaves of it can mislead for long.
        self.doing.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Progress for At {
    fn at(&self, doing: &str, fraction: Option<f64>) {
        let mut present = self.present();
        if fraction.is_none() || present.0 != doing {
            self.steps.fetch_add(1, Ordering::Relaxed);
        }
        doing.clone_into(&mut present.0);
        present.1 = fraction;
    }
}

impl Job {
    fn as_json(&self) -> Value {
        let (doing, fraction) = self.at.present().clone();
        let steps = self.at.steps.load(Ordering::Relaxed);
        json!({ "what": self.what, "doing": doing, "fraction": fraction, "steps": steps })
    }
}

/// A page's state.
struct State {
    recordings: Arc<Questioned>,
    versions: Vec<Version>,
    present: usize,
    job: Option<Job>,
    error: Option<String>,
}

/// A page's state, shared by those who ask for it and who works on it.
#[derive(Clone)]
pub struct Session {
    state: Arc<Mutex<State>>,
    mapping: Arc<Mapping>,
    kind: Option<Kind>,
    /// Where recordings go that are added on the page.
    folder: Arc<TempDir>,
}

impl Session {
    /// A session with recordings and no model yet.
    ///
    /// # Errors
    /// A system without a folder for temporary files.
    pub fn new(recordings: Vec<Recording>, mapping: Mapping, kind: Option<Kind>) -> error::Result<Self> {
        let folder = tempfile::tempdir().map_err(|e| error::Error::io(std::env::temp_dir(), e))?;
        let recordings = Arc::new(Questioned::new(recordings, kind));
        let state = State { recordings, versions: Vec::new(), present: 0, job: None, error: None };
        Ok(Self { state: Arc::new(Mutex::new(state)), mapping: Arc::new(mapping), kind, folder: Arc::new(folder) })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Tasks panic without the lock. What is done under it are a few assignments, each of which leaves a state that
        // can be shown and worked on; a page that could never be used again would be worse.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins a task, whose outcome the state shows when it is there.
    ///
    /// # Errors
    /// Another task that has not ended, or something that the task needs and that is missing.
    pub fn begin(&self, task: Task) -> Result<()> {
        let mut state = self.free()?;
        if state.recordings.usable.is_empty() {
            return Err(Error::NoRecording);
        }
        if let Some(stop) = check::stop(&state.recordings.findings) {
            return Err(Error::Stopped(stop.recording.display().to_string(), stop.sentence()));
        }
        let before = state.versions.get(state.present).cloned();
        if before.is_none() && !matches!(task, Task::Identify) {
            return Err(Error::NoModel);
        }
        let pool = ThreadPoolBuilder::new().build();
        let pool = pool.map_err(|e| error::Error::usage(format!("threads cannot be had: {e}"), "free some memory"))?;
        let (cancel, at) = (CancelFlag::default(), At::default());
        // Threads of its own: with shared ones it would end only after what others have begun on them.
        let ctx = Context::of(cancel.clone()).watched(at.clone()).on(Arc::new(pool));
        state.job = Some(Job { what: task.name(), cancel, at });
        state.error = None;
        let (recordings, session, kind) = (Arc::clone(&state.recordings), self.clone(), self.kind);
        std::thread::spawn(move || {
            let run = std::panic::AssertUnwindSafe(|| task.run(&recordings.usable, kind, before.as_ref(), &ctx));
            let outcome = std::panic::catch_unwind(run).unwrap_or(Err(Error::Panicked));
            session.end(outcome);
        });
        Ok(())
    }

    /// Stops the task at its next step; the state is then what it was before.
    ///
    /// # Errors
    /// None that could be stopped.
    pub fn stop(&self) -> Result<()> {
        match &self.state().job {
            Some(job) => job.cancel.cancel(),
            None => return Err(Error::NothingToStop),
        }
        Ok(())
    }

    fn end(&self, outcome: Result<Outcome>) {
        let mut state = self.state();
        state.job = None;
        match outcome {
            Ok(Outcome::First(version)) => {
                state.versions = vec![*version];
                state.present = 0;
            }
            Ok(Outcome::Next(version)) => {
                let kept = state.present + 1;
                state.versions.truncate(kept);
                state.versions.push(*version);
                state.present = kept;
            }
            Ok(Outcome::Diagnosis(answer)) => {
                let present = state.present;
                state.versions[present].diagnosis = Some(answer);
            }
            Err(Error::Work(error::Error::Interrupted)) => {
                state.error = Some("stopped; all is as it was before".to_owned())
            }
            Err(error) => state.error = Some(error.to_string()),
        }
    }

    /// The state while nothing works on it.
    fn free(&self) -> Result<MutexGuard<'_, State>> {
        let state = self.state();
        match &state.job {
            Some(job) => Err(Error::Busy(job.what.clone())),
            None => Ok(state),
        }
    }

    /// Adds a recording that the page has sent.
    ///
    /// # Errors
    /// A task that has not ended, or a file that is no recording.
    pub fn add_recording(&self, name: &str, content: &[u8]) -> Result<()> {
        drop(self.free()?);
        let name = Path::new(name).file_name().ok_or(Error::NoName)?;
        let path = self.folder.path().join(name);
        std::fs::write(&path, content).map_err(|e| error::Error::io(name, e))?;
        let added = recording::load(&path, &self.mapping, &Context::quiet())
            .map_err(|e| named(e, &path, Path::new(name)))?
            .named(name);
        self.question_anew(|before| Ok(before.with(added.clone(), self.kind)))
    }

    /// Takes out the recording at a place; its file stays as it is.
    ///
    /// # Errors
    /// A task that has not ended, or no such recording.
    pub fn remove_recording(&self, place: usize) -> Result<()> {
        self.question_anew(|before| before.without(place, self.kind).ok_or(Error::NoRecordingAt(place)))
    }

    /// Puts what `change` makes of the recordings in their place. That takes a while, in which the page goes on.
    fn question_anew(&self, change: impl Fn(&Questioned) -> Result<Questioned>) -> Result<()> {
        loop {
            let before = Arc::clone(&self.free()?.recordings);
            let questioned = Arc::new(change(&before)?);
            let mut state = self.free()?;
            // Otherwise they have been changed meanwhile.
            if Arc::ptr_eq(&state.recordings, &before) {
                state.recordings = questioned;
                state.error = None;
                return Ok(());
            }
        }
    }

    /// Goes to another version of the model.
    ///
    /// # Errors
    /// A task that has not ended, or no such version.
    pub fn go_to(&self, version: usize) -> Result<()> {
        let mut state = self.free()?;
        if version >= state.versions.len() {
            return Err(Error::NoVersion(version));
        }
        state.present = version;
        state.error = None;
        Ok(())
    }

    /// The model file of the present version.
    ///
    /// # Errors
    /// No model yet.
    pub fn model_file(&self) -> Result<String> {
        let state = self.state();
        let version = state.versions.get(state.present);
        Ok(version.ok_or(Error::NoModel)?.model.text()?)
    }

    /// The report on a version: the model against all recordings.
    ///
    /// # Errors
    /// No such version, or a model that cannot be simulated on these recordings.
    pub fn report(&self, version: usize) -> Result<String> {
        let (label, model, recordings) = {
            let state = self.state();
            let version = state.versions.get(version).ok_or(Error::NoVersion(version))?;
            (version.label.clone(), version.model.clone(), Arc::clone(&state.recordings))
        };
        let comparison = compare(&model, &recordings.usable, &Context::quiet())?;
        let files: Vec<Origin> = recordings.usable.iter().map(Origin::from).collect();
        Ok(Report::new(label).comparison("Model against measurement", &comparison, &model).recordings(&files).html())
    }

    /// The error falling from version to version up to the present one, as far as they rest on the same recordings.
    pub fn error_falling(&self) -> String {
        let state = self.state();
        let Some(present) = state.versions.get(state.present) else { return String::new() };
        let shown = state.versions[..=state.present].iter().filter(|v| v.recordings == present.recordings);
        let steps: Vec<Step> = shown.map(|v| Step { label: v.label.clone(), esr: v.held_out }).collect();
        figures::error_falling(&steps, present.floor)
    }

    /// The state as the page reads it.
    pub fn as_json(&self) -> Value {
        let state = self.state();
        json!({
            "schema": 1,
            "recordings": state.recordings.usable.iter().map(recording_as_json).collect::<Vec<_>>(),
            "data_findings": state.recordings.findings,
            "versions": state.versions.iter().map(Version::as_json).collect::<Vec<_>>(),
            "present": state.present,
            "job": state.job.as_ref().map(Job::as_json),
            "error": state.error,
        })
    }
}

/// An error with the name that the user knows a file by.
fn named(error: error::Error, path: &Path, name: &Path) -> error::Error {
    use error::Error as E;
    match error {
        E::Input { mut place, what, remedy } if place.path == path => {
            place.path = name.to_owned();
            E::Input { place, what, remedy }
        }
        E::Io { source, remedy, .. } => E::Io { path: name.to_owned(), source, remedy },
        other => other,
    }
}

fn recording_as_json(r: &Recording) -> Value {
    json!({
        "name": r.path().display().to_string(),
        "seconds": r.duration_s(),
        "sample_time_s": r.sample_time_s(),
        "channels": r.channels().keys().map(|c| c.column()).collect::<Vec<_>>(),
        "warnings": r.warnings(),
    })
}
