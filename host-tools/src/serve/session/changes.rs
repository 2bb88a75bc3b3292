//! What the page changes without taking its time: recordings, their roles, the present version.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use tempfile::NamedTempFile;

use super::ahead::Ahead;
use super::{Expected, Session, words};
use crate::context::Context;
use crate::demo;
use crate::error;
use crate::model::Kind;
use crate::recording;
use crate::rig::Setup;
use crate::serve::api::{self, Role};
use crate::serve::error::{Error, Result};
use crate::serve::recordings::{Entry, Kept, Recordings};

impl Session {
    /// A file for what the page sends.
    ///
    /// # Errors
    /// A task that has not ended; whatever the system refuses.
    pub fn receive(&self) -> Result<NamedTempFile> {
        drop(self.free(Expected(None))?);
        Ok(self.project.receive()?)
    }

    /// Adds a recording that the page has sent; one that cannot be used stays, with what is wrong with it.
    ///
    /// # Errors
    /// A task that has not ended, a file without a name.
    pub fn add_recording(&self, name: &str, arrived: NamedTempFile) -> Result<u32> {
        let name = Path::new(name).file_name().filter(|name| !name.is_empty()).ok_or(Error::NoName)?;
        let path = self.project.keep(arrived, Path::new(name))?;
        let name = path.file_name().map_or_else(|| name.into(), PathBuf::from);
        let id = self.state().number();
        let kept = Kept { id, name, path, sha256: String::new(), role: Role::Fit, map: Vec::new() };
        let entry = Entry::read(kept, &Context::quiet());
        self.question_anew(Expected(None), |before| {
            let mut entry = entry.clone();
            entry.kept.role = before.role_of_next();
            Ok(before.with([entry], self.kind))
        })
    }

    /// Reads a recording anew with rules of `--map`.
    ///
    /// # Errors
    /// A task that has not ended, no such recording, what the page shows being behind.
    pub fn map_recording(&self, expected: Expected, id: u32, map: Vec<String>) -> Result<u32> {
        let (before, new) = {
            let mut state = self.free(expected)?;
            let entry = state.recordings.entry(id).ok_or(Error::NoRecordingAt(id))?.kept.clone();
            (entry, state.number())
        };
        // Curves go by the number, and with another mapping they are others.
        let entry = Entry::read(Kept { id: new, map, sha256: String::new(), ..before }, &Context::quiet());
        self.question_anew(expected, |recordings| {
            let mut entries = recordings.entries.clone();
            let place = entries.iter().position(|e| e.kept.id == id).ok_or(Error::NoRecordingAt(id))?;
            entries[place] = entry.clone();
            Ok(Recordings::new(entries, self.kind))
        })
    }

    /// Takes out a recording; its file stays as it is.
    ///
    /// # Errors
    /// A task that has not ended, no such recording, what the page shows being behind.
    pub fn remove_recording(&self, expected: Expected, id: u32) -> Result<u32> {
        let done = self.question_anew(expected, |before| before.without(id, self.kind).ok_or(Error::NoRecordingAt(id)));
        self.curves.forget(id);
        done
    }

    /// Says what a recording is for.
    ///
    /// # Errors
    /// As [`remove_recording`](Self::remove_recording).
    pub fn set_role(&self, expected: Expected, id: u32, role: Role) -> Result<u32> {
        self.question_anew(expected, |before| before.with_role(id, role, self.kind).ok_or(Error::NoRecordingAt(id)))
    }

    /// Puts what `change` makes of the recordings in their place. That takes a while, in which the page goes on.
    fn question_anew(&self, expected: Expected, change: impl Fn(&Recordings) -> Result<Recordings>) -> Result<u32> {
        loop {
            let before = Arc::clone(&self.free(expected)?.recordings);
            let questioned = Arc::new(change(&before)?);
            let mut state = self.free(expected)?;
            // Otherwise they have been changed meanwhile.
            if Arc::ptr_eq(&state.recordings, &before) {
                state.recordings = questioned;
                state.message = None;
                // They rest on other recordings.
                state.ahead.stop();
                state.ahead = Ahead::default();
                self.curves.forget_candidates();
                self.look_ahead(&mut state);
                return self.changed(&mut state);
            }
        }
    }

    /// Records a motor of the virtual rig that hides something, for a project without recordings.
    ///
    /// # Errors
    /// A project that has recordings; a task that has not ended.
    pub fn tour(&self, expected: Expected, seed: u32) -> Result<u32> {
        let hidden = demo::hidden(u64::from(seed));
        let ctx = Context::quiet();
        let mut entries = Vec::new();
        for (k, profile) in ["staircase", "ramp"].into_iter().enumerate() {
            let setup = Setup::new(Kind::Universal).profile(profile)?.seed(u64::from(seed) + k as u64);
            let setup = hidden.iter().try_fold(setup, |setup, effect| setup.effect(effect))?;
            let run = setup.run_in(&ctx)?.recording;
            let name = format!("{profile}.csv");
            let arrived = self.project.receive()?;
            let file =
                tempfile::Builder::new().suffix(".csv").tempfile_in(arrived.path().parent().unwrap_or(Path::new(".")));
            let file = file.map_err(|e| error::Error::io(&name, e))?;
            recording::write(&run, file.path(), true, &ctx)?;
            let path = self.project.keep(file, Path::new(&name))?;
            let id = self.state().number();
            let role = if k == 0 { Role::Fit } else { Role::Judge };
            let name = path.file_name().map_or_else(|| name.into(), PathBuf::from);
            entries.push(Entry::read(Kept { id, name, path, sha256: String::new(), role, map: Vec::new() }, &ctx));
        }
        let revision = self.question_anew(expected, |before| match before.entries.is_empty() {
            true => Ok(before.with(entries.clone(), self.kind)),
            false => Err(Error::NotEmpty),
        })?;
        let mut state = self.free(Expected(Some(revision)))?;
        state.tour = Some(api::Tour { seed, hidden: words(hidden) });
        self.changed(&mut state)
    }

    /// Goes to another version of the model.
    ///
    /// # Errors
    /// A task that has not ended, no such version, what the page shows being behind.
    pub fn go_to(&self, expected: Expected, version: u32) -> Result<u32> {
        let mut state = self.free(expected)?;
        state.version(version)?;
        state.present = Some(version);
        state.message = None;
        self.look_ahead(&mut state);
        self.changed(&mut state)
    }

    /// Writes a note to a version; an empty one takes it away.
    ///
    /// # Errors
    /// As [`go_to`](Self::go_to).
    pub fn write_note(&self, expected: Expected, version: u32, text: &str) -> Result<u32> {
        let mut state = self.free(expected)?;
        let of = state.versions.iter_mut().find(|v| v.told.id == version).ok_or(Error::NoVersion(version))?;
        of.told.note = Some(text.trim().to_owned()).filter(|text| !text.is_empty());
        self.changed(&mut state)
    }

    /// Takes out a version from which no other was made; its model file stays.
    ///
    /// # Errors
    /// As [`go_to`](Self::go_to), and a version that others were made from.
    pub fn remove_version(&self, expected: Expected, version: u32) -> Result<u32> {
        let mut state = self.free(expected)?;
        let parent = state.version(version)?.told.parent;
        if state.versions.iter().any(|v| v.told.parent == Some(version)) {
            return Err(Error::HasFollowers);
        }
        state.versions.retain(|v| v.told.id != version);
        if state.present == Some(version) {
            state.present = parent.or(state.versions.last().map(|v| v.told.id));
        }
        state.message = None;
        self.look_ahead(&mut state);
        self.changed(&mut state)
    }
}
