//! What motors are judged by, and the last judgement.

use std::sync::Arc;

use tempfile::NamedTempFile;

use super::{Expected, Session, State, line, words};
use crate::model::Model;
use crate::serve::api;
use crate::serve::error::{Error, Result};
use crate::serve::judge::Station;
use crate::serve::task::Task;

impl Session {
    /// Takes a model file with limits that the page has sent.
    ///
    /// # Errors
    /// A file that is none, a model without limits, what the page shows being behind.
    pub fn set_station(&self, expected: Expected, name: &str, arrived: &NamedTempFile) -> Result<u32> {
        let model = Model::load(arrived.path())
            .map_err(|e| crate::serve::recordings::named(e, arrived.path(), name.as_ref()))?;
        let mut state = self.free(expected)?;
        self.take_station(&mut state, name.to_owned(), model)
    }

    pub(super) fn take_station(&self, state: &mut State, name: String, model: Model) -> Result<u32> {
        let station = Station::new(name, self.project.station_file(), model)?;
        self.project.save_station(&station.model)?;
        state.station = Some(Arc::new(station));
        state.judged = None;
        state.message = None;
        self.changed(state)
    }

    /// Begins to judge motors by their recordings.
    ///
    /// # Errors
    /// No station; as [`begin`](Self::begin).
    pub fn begin_to_judge(&self, expected: Expected, recordings: Vec<u32>) -> Result<u32> {
        let station = self.state().station.clone().ok_or(Error::NoStation)?;
        self.begin(expected, Task::Judge(station, recordings))
    }

    pub(super) fn have_judged(&self, state: &mut State, task: &Task, mut judged: api::Judged) -> Result<()> {
        if let Task::Judge(station, ids) = task {
            let entries = || ids.iter().filter_map(|id| state.recordings.entry(*id));
            let mut command: Vec<String> = entries().map(|e| e.kept.path.display().to_string()).collect();
            let mut rules: Vec<&String> = entries().flat_map(|e| &e.kept.map).collect();
            rules.dedup();
            command.extend(rules.into_iter().flat_map(|rule| ["--map".to_owned(), rule.clone()]));
            let model = station.path.display().to_string();
            judged.command = line(&[words(&["monitor"]), command, words(&["--model", &model])].concat());
        }
        judged.number = state.judged.as_ref().map_or(0, |before| before.number) + 1;
        self.project.save_judged(&judged)?;
        state.judged = Some(Arc::new(judged));
        self.look_ahead(state);
        self.changed(state).map(drop)
    }

    /// The last judgement.
    ///
    /// # Errors
    /// There is none.
    pub fn judged(&self) -> Result<Arc<api::Judged>> {
        self.state().judged.clone().ok_or(Error::NotJudged)
    }
}
