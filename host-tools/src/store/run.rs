//! One question to many recordings of a store, on all cores.
//!
//! Recordings are read file by file, in the order of their folders, and handed to whoever is free; their results go to
//! the store some seconds after they are there. In memory are one file's recordings, one for each core, the results
//! that are not written yet, and the keys of one folder's: nothing that grows with the store.

use std::collections::{BTreeMap, HashSet, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use serde::Serialize;

use super::entry::Entry;
use super::files::{self, DataFile, Incoming};
use super::filter::Filter;
use super::job::Task;
use super::partition::Partition;
use super::recordings::Recordings;
use super::results::{Outcome, Results, key};
use super::table::Key;
use super::{Store, listing, partition};
use crate::context::Context;
use crate::error::{Error, Place, Result};

/// What has come of a run. Each recording that is meant is counted once.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Ran {
    /// Recordings whose result was there already.
    pub done_before: usize,
    /// Recordings that were asked, by what came of it.
    pub outcomes: BTreeMap<String, usize>,
    /// Recordings of another motor type than the model's, which were left out.
    pub other_type: usize,
    /// Rows of the store that are damaged, which were left out.
    pub damaged: usize,
    /// Recordings that have no result though they were asked, which is told.
    pub failed: usize,
    /// Whether the work was to stop.
    pub interrupted: bool,
}

impl Ran {
    /// Recordings that were asked.
    pub fn asked(&self) -> usize {
        self.outcomes.values().sum()
    }
}

/// Who hears of each file that cannot be used.
pub type Told<'a> = &'a (dyn Fn(&Path, &Error) + Sync);

/// Asks all recordings that are meant and that have no result of this task and version yet.
///
/// # Errors
/// Whatever the system refuses about the store; what is in it stays.
pub fn run(store: &Store, task: &Task, filter: &Filter, ctx: &Context, told: Told<'_>) -> Result<Ran> {
    let _lock = store.lock::<Results>(ctx)?;
    let mut ran = Ran::default();
    loop {
        let files = listing::files(store, filter)?;
        let all: usize = files.iter().map(|(_, file)| file.rows.unwrap_or(0)).sum();
        let steps = ctx.steps(task.job.name(), all as u64);
        let stream = Stream {
            store,
            task,
            filter,
            told,
            files: files.into_iter(),
            ready: VecDeque::new(),
            done: HashSet::new(),
            done_of: None,
            done_before: 0,
            skipped: 0,
            damaged: 0,
            vanished: false,
        };
        let (stream, ran_now) = (Mutex::new(stream), Mutex::new(Ran::default()));
        let sink = Mutex::new(Incoming::<Results>::new(store.root()));
        let failed: Mutex<Option<Error>> = Mutex::new(None);
        let work = || -> Result<()> {
            loop {
                if ctx.check().is_err() || held(&failed).is_some() {
                    return Ok(());
                }
                let (next, skipped) = {
                    let mut stream = held(&stream);
                    (stream.next()?, std::mem::take(&mut stream.skipped))
                };
                (0..skipped).for_each(|_| steps.next());
                let Some((folder, entry)) = next else { return Ok(()) };
                let asked = catch_unwind(AssertUnwindSafe(|| ask(task, &entry, ctx)));
                match asked
                    .unwrap_or_else(|_| Ok(Asked::Failed("the program failed on it: report this as a bug".into())))
                {
                    Ok(Asked::Answered(outcome)) => {
                        *held(&ran_now).outcomes.entry(outcome.outcome.clone()).or_default() += 1;
                        held(&sink).put(&folder, *outcome)?;
                    }
                    Ok(Asked::OtherType) => held(&ran_now).other_type += 1,
                    Ok(Asked::Failed(what)) => {
                        held(&ran_now).failed += 1;
                        let name = entry.serial.clone().unwrap_or_else(|| entry.content.to_string());
                        let what = format!("recording {name} is left out: {what}");
                        told(
                            store.root(),
                            &Error::input(Place::file(store.root()), what, "get it with greyrig store get"),
                        );
                    }
                    Err(Error::Interrupted) => return Ok(()),
                    Err(error) => return Err(error),
                }
                steps.next();
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..rayon::current_num_threads() {
                scope.spawn(|| {
                    if let Err(error) = work() {
                        held(&failed).get_or_insert(error);
                    }
                });
            }
        });
        let kept = own(sink).settle();
        let (stream, now) = (own(stream), own(ran_now));
        // Once more round, what was asked in the round before has a result.
        ran.done_before = stream.done_before - ran.asked().min(stream.done_before);
        for (outcome, number) in now.outcomes {
            *ran.outcomes.entry(outcome).or_default() += number;
        }
        (ran.other_type, ran.damaged, ran.failed) = (now.other_type, stream.damaged, now.failed);
        ran.interrupted = ctx.check().is_err();
        if let Some(error) = own(failed) {
            return Err(error);
        }
        kept?;
        // Somebody has put files together meanwhile: their recordings are in others now.
        if !stream.vanished || ran.interrupted {
            return Ok(ran);
        }
    }
}

/// What is shared between threads; one that has panicked leaves it whole.
fn held<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

fn own<T>(shared: Mutex<T>) -> T {
    shared.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// What came of asking one recording.
pub(super) enum Asked {
    Answered(Box<Outcome>),
    /// The model is of another type of motor.
    OtherType,
    /// It has no answer, for this reason.
    Failed(String),
}

/// Asks one recording.
///
/// # Errors
/// An interrupt; whatever the system refuses.
pub(super) fn ask(task: &Task, entry: &Entry, ctx: &Context) -> Result<Asked> {
    let recording = match entry.recording() {
        Ok(recording) => recording,
        Err(e) => return Ok(Asked::Failed(format!("its row is no recording: {e}"))),
    };
    if task.is_of_another_type(&recording) {
        return Ok(Asked::OtherType);
    }
    let answer = task.ask(recording, &ctx.quietly())?;
    Ok(Asked::Answered(Box::new(Outcome {
        recording: entry.content,
        serial: entry.serial.clone(),
        time_us: entry.time_us,
        model: task.model_key.clone(),
        model_name: task.model_name.clone(),
        code: env!("CARGO_PKG_VERSION").to_owned(),
        outcome: answer.outcome,
        text: answer.text,
        esr_current: answer.esr.current,
        esr_speed: answer.esr.speed,
        parameters: answer.parameters,
        answer: answer.json.to_string(),
    })))
}

/// Where the results of a folder of recordings lie, relative to the folder of results.
fn folder_of(task: &Task, folder: &Path) -> Result<PathBuf> {
    let job = partition::folder("job", Some(task.job.name()));
    let job = job.map_err(|e| Error::usage(e.to_string(), "report this as a bug"))?;
    Ok(Path::new(&job).join(folder))
}

/// Recordings that are still to be asked, one after the other.
struct Stream<'a> {
    store: &'a Store,
    task: &'a Task,
    filter: &'a Filter,
    told: Told<'a>,
    files: std::vec::IntoIter<(Partition, DataFile)>,
    /// Of the file that is open, with the folder of their results.
    ready: VecDeque<(PathBuf, Entry)>,
    /// Keys of the results in that folder, and of those to come.
    done: HashSet<Key>,
    done_of: Option<PathBuf>,
    done_before: usize,
    /// Rows that nobody is handed, and that are to be told as done.
    skipped: usize,
    damaged: usize,
    /// Whether a file was gone that had been there.
    vanished: bool,
}

impl Stream<'_> {
    fn next(&mut self) -> Result<Option<(PathBuf, Entry)>> {
        loop {
            if let Some(next) = self.ready.pop_front() {
                return Ok(Some(next));
            }
            let Some((_, file)) = self.files.next() else { return Ok(None) };
            let folder = folder_of(self.task, &file.folder)?;
            if self.done_of.as_ref() != Some(&folder) {
                self.done = done(self.store, &folder, self.told)?;
                self.done_of = Some(folder.clone());
            }
            match self.open(&file, &folder) {
                Ok(()) => {}
                Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => self.vanished = true,
                Err(error) => {
                    self.damaged += file.rows.unwrap_or(1);
                    self.skipped += file.rows.unwrap_or(0);
                    (self.told)(&file.path, &error);
                }
            }
        }
    }

    fn key(&self, content: &super::entry::Content) -> Key {
        key(content, &self.task.model_key, env!("CARGO_PKG_VERSION"))
    }

    /// Makes the recordings of a file ready that have no result yet.
    fn open(&mut self, file: &DataFile, folder: &Path) -> Result<()> {
        let is_done = |stream: &Self, key: Key| stream.done.contains(&stream.key(&super::entry::Content(key)));
        // Samples are read only where there is something to ask.
        let keys = files::keys::<Recordings>(&file.path)?;
        if self.filter.serials.is_empty() && keys.iter().all(|key| is_done(self, *key)) {
            self.done_before += keys.len();
            self.skipped += keys.len();
            return Ok(());
        }
        for row in files::rows::<Recordings>(&file.path)? {
            match row {
                Err(what) => {
                    self.damaged += 1;
                    self.skipped += 1;
                    let what = format!("a row of this file of the store is damaged ({what}) and left out");
                    let error = Error::input(Place::file(&file.path), what, "restore the file from a copy");
                    (self.told)(&file.path, &error);
                }
                Ok(entry) if !self.filter.admits_serial(entry.serial.as_deref()) => self.skipped += 1,
                Ok(entry) => {
                    if self.done.insert(self.key(&entry.content)) {
                        self.ready.push_back((folder.to_owned(), entry));
                    } else {
                        self.done_before += 1;
                        self.skipped += 1;
                    }
                }
            }
        }
        Ok(())
    }
}

/// The keys of the results in a folder.
fn done(store: &Store, folder: &Path, told: Told<'_>) -> Result<HashSet<Key>> {
    let mut keys = HashSet::new();
    for file in files::in_folder::<Results>(store.root(), folder)? {
        match files::keys::<Results>(&file) {
            Ok(of_file) => keys.extend(of_file),
            Err(error) => told(&file, &error),
        }
    }
    Ok(keys)
}
