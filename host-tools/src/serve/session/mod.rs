//! What a page shows: the recordings, the versions of the model, and what is being done. Each change is saved before
//! it is told.

mod ahead;
mod changes;
mod judging;
mod planes;
mod proposals;
mod signals;
mod spectra;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use greyrig::effects::EffectId;
use rayon::ThreadPoolBuilder;
use tokio::sync::watch;

use self::ahead::Ahead;
use super::api::{self, Role};
use super::curves::{Curves, Of};
use super::error::{Error, Result};
use super::job::Job;
use super::judge::Station;
use super::project::{Content, Project};
use super::recordings::{Entry, Kept, Recordings};
use super::task::{Outcome, Task};
use super::version::{Made, Version};
use crate::check;
use crate::context::Context;
use crate::error;
use crate::model::{Kind, Model};
use crate::plan::Limits;

pub use signals::Stretch;
pub use spectra::Over;

/// The revision that a change rests on; none: any.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Expected(pub Option<u32>);

/// A page's state.
struct State {
    revision: u32,
    shown: u32,
    recordings: Arc<Recordings>,
    versions: Vec<Version>,
    present: Option<u32>,
    next: u32,
    tour: Option<api::Tour>,
    station: Option<Arc<Station>>,
    judged: Option<Arc<api::Judged>>,
    job: Option<Job>,
    message: Option<String>,
    ahead: Ahead,
}

impl State {
    fn version(&self, id: u32) -> Result<&Version> {
        self.versions.iter().find(|v| v.told.id == id).ok_or(Error::NoVersion(id))
    }

    fn at_present(&self) -> Option<&Version> {
        self.version(self.present?).ok()
    }

    fn number(&mut self) -> u32 {
        self.next += 1;
        self.next
    }
}

/// A page's state, shared by those who ask for it and who works on it.
#[derive(Clone)]
pub struct Session {
    state: Arc<Mutex<State>>,
    project: Arc<Project>,
    curves: Arc<Curves>,
    seen: Arc<watch::Sender<()>>,
    kind: Option<Kind>,
}

/// Words as a shell takes them.
fn line(words: &[String]) -> String {
    // Only a NUL cannot be quoted, which no file name holds.
    let joined = shlex::try_join(words.iter().map(String::as_str)).unwrap_or_else(|_| words.join(" "));
    format!("greyrig {joined}")
}

fn words(of: &[&str]) -> Vec<String> {
    of.iter().map(|word| (*word).to_owned()).collect()
}

impl Session {
    /// Opens a project, or begins one, and adds recordings to it; those that cannot be used stay in it, with what is
    /// wrong with them.
    ///
    /// # Errors
    /// A project that cannot be opened, or whose model files are gone.
    pub fn open(folder: Option<&Path>, files: &[PathBuf], map: &[String], kind: Option<Kind>) -> error::Result<Self> {
        let (project, content) = Project::open(folder)?;
        let kind = kind.or(content.kind);
        let ctx = Context::quiet();
        let entries = content.recordings.into_iter().map(|kept| Entry::read(kept, &ctx)).collect();
        let mut recordings = Recordings::new(entries, None);
        let version = |told: api::Version| {
            let model = Model::load(&project.model_file(told.id))?;
            Ok(Version { told, model: Arc::new(model) })
        };
        let versions = content.versions.into_iter().map(version).collect::<error::Result<_>>()?;
        let station = |name: String| -> error::Result<Arc<Station>> {
            let path = project.station_file();
            let model = Model::load(&path)?;
            model.limits(&path)?;
            Ok(Arc::new(Station { name, path, model }))
        };
        let station = content.station.map(station).transpose()?;
        let mut next = content.next;
        let judges = files.len().checked_sub(1).filter(|last| *last > 0 && recordings.entries.is_empty());
        let is_new = |path: &&PathBuf| !recordings.entries.iter().any(|e| e.kept.path == **path);
        let added: Vec<Entry> = files
            .iter()
            .filter(is_new)
            .enumerate()
            .map(|(k, path)| {
                next += 1;
                let role = if judges == Some(k) { Role::Judge } else { Role::Fit };
                let map = map.to_vec();
                let kept = Kept { id: next, name: path.clone(), path: path.clone(), sha256: String::new(), role, map };
                Entry::read(kept, &ctx)
            })
            .collect();
        recordings = recordings.with(added, kind);
        let state = State {
            revision: 1,
            shown: 1,
            recordings: Arc::new(recordings),
            versions,
            present: content.present,
            next,
            tour: content.tour,
            judged: station.as_ref().and_then(|_| project.judged()).map(Arc::new),
            station,
            job: None,
            message: None,
            ahead: Ahead::default(),
        };
        let session = Self {
            state: Arc::new(Mutex::new(state)),
            project: Arc::new(project),
            curves: Arc::default(),
            seen: Arc::new(watch::Sender::new(())),
            kind,
        };
        session.save(&session.state())?;
        session.look_ahead(&mut session.state());
        Ok(session)
    }

    /// The project's folder.
    pub fn folder(&self) -> &Path {
        self.project.folder()
    }

    /// Who knows it may use the page.
    pub fn token(&self) -> &str {
        self.project.token()
    }

    /// What cannot be used, in a line each.
    pub fn unusable(&self) -> Vec<String> {
        self.state().recordings.entries.iter().filter_map(|e| e.read.as_ref().err().cloned()).collect()
    }

    /// Tells of changes and of progress.
    pub fn watch(&self) -> watch::Receiver<()> {
        self.seen.subscribe()
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Tasks panic without the lock. What is done under it are a few assignments, each of which leaves a state that
        // can be shown and worked on; a page that could never be used again would be worse.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The page is no longer served: a project without a name in which nothing is goes.
    pub fn leave(&self) {
        self.project.leave(&self.content(&self.state()));
    }

    fn save(&self, state: &State) -> error::Result<()> {
        self.project.save(&self.content(state))
    }

    fn content(&self, state: &State) -> Content {
        let mut content = Content {
            kind: self.kind,
            recordings: state.recordings.entries.iter().map(|e| e.kept.clone()).collect(),
            versions: state.versions.iter().map(|v| v.told.clone()).collect(),
            present: state.present,
            next: state.next,
            tour: state.tour.clone(),
            station: state.station.as_ref().map(|station| station.name.clone()),
            ..Content::begun()
        };
        // What is computed ahead is computed anew.
        for v in &mut content.versions {
            v.diagnosis.iter_mut().flat_map(|d| &mut d.candidates).for_each(|c| c.predicted = None);
        }
        content
    }

    /// What has been changed is saved and told.
    fn changed(&self, state: &mut State) -> Result<u32> {
        state.revision += 1;
        self.show(state);
        self.save(state)?;
        Ok(state.revision)
    }

    fn show(&self, state: &mut State) {
        state.shown += 1;
        self.seen.send_replace(());
    }

    /// The state while nothing works on it, if it is the one that a change rests on.
    fn free(&self, expected: Expected) -> Result<MutexGuard<'_, State>> {
        let state = self.state();
        if let Some(job) = &state.job {
            return Err(Error::Busy(job.what().to_owned()));
        }
        match expected.0.is_none_or(|revision| revision == state.revision) {
            true => Ok(state),
            false => Err(Error::Behind),
        }
    }

    /// Begins a task, whose outcome the state shows when it is there.
    ///
    /// # Errors
    /// Another task that has not ended, or something that the task needs and that is missing.
    pub fn begin(&self, expected: Expected, task: Task) -> Result<u32> {
        let mut state = self.free(expected)?;
        if task.rests_on_recordings() {
            if state.recordings.usable.is_empty() {
                return Err(Error::NoRecording);
            }
            if let Some(stop) = check::stop(&state.recordings.findings) {
                return Err(Error::Stopped(stop.recording.display().to_string(), stop.sentence()));
            }
        }
        let before = state.at_present().cloned();
        if before.is_none() && task.rests_on_version() {
            return Err(Error::NoModel);
        }
        state.message = None;
        if let (Task::Add(added), Some(version)) = (&task, &before)
            && let ([id], []) = (&added.effects[..], &added.terms[..])
            && let Some(made) = state.ahead.made(version.told.id, *id)
        {
            let made = made.clone();
            return self.come_to(&mut state, &task, Some(version.told.id), made);
        }
        state.ahead.stop();
        let pool = ThreadPoolBuilder::new().build();
        let pool = pool.map_err(|e| error::Error::usage(format!("threads cannot be had: {e}"), "free some memory"))?;
        let job = Job::new(task.name(), Arc::clone(&self.seen));
        // Threads of its own: with shared ones it would end only after what others have begun on them.
        let ctx = job.context().on(Arc::new(pool));
        state.job = Some(job);
        self.show(&mut state);
        let revision = state.revision;
        let (recordings, session) = (Arc::clone(&state.recordings), self.clone());
        std::thread::spawn(move || {
            let run = || task.run(&recordings, session.kind, before.as_ref(), &ctx);
            let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).unwrap_or(Err(Error::Panicked));
            session.end(&task, before.map(|v| v.told.id), outcome);
        });
        Ok(revision)
    }

    /// Stops the task at its next step; the state is then what it was before.
    ///
    /// # Errors
    /// None that could be stopped.
    pub fn stop(&self) -> Result<u32> {
        let mut state = self.state();
        match &state.job {
            Some(job) => job.stop(),
            None => return Err(Error::NothingToStop),
        }
        self.show(&mut state);
        Ok(state.revision)
    }

    fn end(&self, task: &Task, before: Option<u32>, outcome: Result<Outcome>) {
        let mut state = self.state();
        state.job = None;
        let done = match outcome {
            Ok(Outcome::First(made)) => self.come_to(&mut state, task, None, *made).map(drop),
            Ok(Outcome::Next(made)) => self.come_to(&mut state, task, before, *made).map(drop),
            Ok(Outcome::Diagnosis(answer)) => self.answered(&mut state, before, *answer),
            Ok(Outcome::Corrected(made, correction)) => self
                .project
                .save_correction(state.next + 1, &correction)
                .map_err(Error::Work)
                .and_then(|()| self.come_to(&mut state, task, before, *made).map(drop)),
            Ok(Outcome::Plan(plan)) => self.planned(&mut state, task, before, *plan),
            Ok(Outcome::Challenge(challenge)) => self.challenged(&mut state, task, before, *challenge),
            Ok(Outcome::Station(model)) => {
                self.take_station(&mut state, "learnt from recordings".to_owned(), *model).map(drop)
            }
            Ok(Outcome::Judged(judged)) => self.have_judged(&mut state, task, *judged),
            Err(error) => Err(error),
        };
        if let Err(error) = done {
            state.message = Some(match error {
                Error::Work(error::Error::Interrupted) => "stopped; all is as it was before".to_owned(),
                error => error.to_string(),
            });
            self.look_ahead(&mut state);
            self.show(&mut state);
        }
    }

    fn answered(&self, state: &mut State, before: Option<u32>, mut answer: api::Diagnosis) -> Result<()> {
        let id = before.ok_or(Error::NoModel)?;
        answer.basis = state.recordings.basis();
        let model = self.project.model_file(id).display().to_string();
        let command = [words(&["diagnose"]), state.recordings.arguments(), words(&["--model", &model])];
        answer.command = line(&command.concat());
        let version = state.versions.iter_mut().find(|v| v.told.id == id).ok_or(Error::NoVersion(id))?;
        version.told.diagnosis = Some(answer);
        self.look_ahead(state);
        self.changed(state).map(drop)
    }

    /// A model becomes the present version.
    fn come_to(&self, state: &mut State, task: &Task, parent: Option<u32>, made: Made) -> Result<u32> {
        let id = state.number();
        let out = self.project.model_file(id).display().to_string();
        let files = state.recordings.arguments();
        let command = match (task, parent) {
            (Task::Add(added), Some(parent)) => {
                let model = self.project.model_file(parent).display().to_string();
                [words(&["add"]), added.arguments(), words(&["--model", &model]), files, words(&["--out", &out])]
            }
            (Task::Train(training), Some(parent)) => {
                let model = self.project.model_file(parent).display().to_string();
                [words(&["train"]), files, words(&["--model", &model]), training.arguments(), words(&["--out", &out])]
            }
            (Task::Open(..), _) => [words(&["compare"]), files, words(&["--model", &out]), vec![], vec![]],
            _ => [words(&["identify"]), files, words(&["--out", &out]), vec![], vec![]],
        };
        self.project.save_model(id, &made.model)?;
        let mut version = made.version(id, parent, line(&command.concat()), state.recordings.basis());
        if let (Task::Train(_), Some(parent)) = (task, parent) {
            // The physics stays as it was.
            version.told.parameters.clone_from(&state.version(parent)?.told.parameters);
        }
        if let (Task::Add(added), Some(parent)) = (task, parent)
            && let ([effect], []) = (&added.effects[..], &added.terms[..])
        {
            // The curves that were looked at beforehand are its own.
            self.curves.adopt(Of::Candidate(parent, *effect), Of::Version(id));
        }
        state.versions.push(version);
        state.present = Some(id);
        self.look_ahead(state);
        self.changed(state)
    }

    /// What the stream of events tells.
    pub fn tick(&self) -> api::Tick {
        let state = self.state();
        api::Tick { revision: state.revision, shown: state.shown, job: state.job.as_ref().map(Job::told) }
    }

    /// The state as the page reads it.
    pub fn told(&self) -> api::State {
        let state = self.state();
        let mut versions: Vec<api::Version> = state.versions.iter().map(|v| v.told.clone()).collect();
        for version in &mut versions {
            let id = version.id;
            for candidate in version.diagnosis.iter_mut().flat_map(|d| &mut d.candidates).filter(|c| c.step == 1) {
                let made = candidate.effect.parse().ok().and_then(|effect| state.ahead.made(id, effect));
                candidate.predicted = made.map(|made| made.held_out.into());
            }
        }
        let out = self.project.model_file(state.next + 1).display().to_string();
        let identify = || line(&[words(&["identify"]), state.recordings.arguments(), words(&["--out", &out])].concat());
        let kind = state.at_present().map_or_else(|| Kind::of(self.kind, &state.recordings.usable), |v| v.model.kind);
        let usual = Limits::usual(kind);
        api::State {
            schema: 1,
            revision: state.revision,
            shown: state.shown,
            project: self.project.folder().display().to_string(),
            recordings: state.recordings.told(),
            basis: state.recordings.basis(),
            versions,
            present: state.present,
            job: state.job.as_ref().map(Job::told),
            ahead: state.ahead.left(),
            message: state.message.clone(),
            catalogue: EffectId::ALL.iter().map(ToString::to_string).collect(),
            identify: (!state.recordings.usable.is_empty()).then(identify),
            tour: state.tour.clone(),
            kind: kind.to_string(),
            usual_limits: [usual.voltage_v, usual.current_a],
            station: state.station.as_ref().map(|station| station.told()),
            judged: state.judged.as_ref().map(|judged| judged.number),
        }
    }
}
