//! What the page draws: signals, and where the model fails.

use std::sync::Arc;

use super::Session;
use crate::compare::{Signal, compare};
use crate::context::Context;
use crate::model::{Model, Origin};
use crate::recording::Channel;
use crate::report::Report;
use crate::serve::api;
use crate::serve::curves::Of;
use crate::serve::error::{Error, Result};
use crate::serve::plane::{Grid, Plane};
use crate::serve::pyramid::{Curve, Window};
use crate::serve::recordings::Recordings;
use crate::serve::simulated::{Kind, Simulated};

/// Free runs by the numbers of their recordings.
type All = Vec<(u32, Arc<Simulated>)>;

/// What is wanted of a curve.
#[derive(Debug, Clone, Copy)]
pub struct Stretch {
    /// From, to, s.
    pub range_s: [f64; 2],
    /// In how many parts at most.
    pub parts: usize,
    /// Period over which the RMS is wanted, s; none: the signal itself.
    pub rms_s: Option<f64>,
}

impl Stretch {
    fn of(&self, curve: &Curve) -> Window {
        let [from_s, to_s] = self.range_s;
        match self.rms_s {
            Some(period_s) => curve.rms(period_s).window(from_s, to_s, self.parts),
            None => curve.window(from_s, to_s, self.parts),
        }
    }
}

impl Session {
    /// The model file of a version.
    ///
    /// # Errors
    /// No such version.
    pub fn model_file(&self, version: u32) -> Result<String> {
        Ok(self.state().version(version)?.model.text()?)
    }

    /// What a version has learnt, as JSON.
    ///
    /// # Errors
    /// No such version, or one that has learnt nothing here.
    pub fn correction(&self, version: u32) -> Result<Vec<u8>> {
        self.state().version(version)?;
        self.project.correction(version).ok_or(Error::NothingLearnt(version))
    }

    /// The report on a version: the model against all recordings.
    ///
    /// # Errors
    /// No such version, or a model that cannot be simulated on these recordings.
    pub fn report(&self, version: u32) -> Result<String> {
        let (label, model, recordings) = {
            let state = self.state();
            let version = state.version(version)?;
            (version.told.label.clone(), Arc::clone(&version.model), Arc::clone(&state.recordings))
        };
        if recordings.usable.is_empty() {
            return Err(Error::NoRecording);
        }
        let comparison = compare(&model, &recordings.usable, &Context::quiet())?;
        let files: Vec<Origin> = recordings.usable.iter().map(Origin::from).collect();
        Ok(Report::new(label).comparison("Model against measurement", &comparison, &model).recordings(&files).html())
    }

    /// The model of a version, or of one of its candidates.
    fn model(&self, of: Of) -> Result<(Arc<Model>, Arc<Recordings>)> {
        let state = self.state();
        let recordings = Arc::clone(&state.recordings);
        match of {
            Of::Version(id) => Ok((Arc::clone(&state.version(id)?.model), recordings)),
            Of::Candidate(id, effect) => {
                let made = state.ahead.made(id, effect).ok_or(Error::NotYet(effect))?;
                Ok((Arc::new(made.model.clone()), recordings))
            }
        }
    }

    pub(super) fn simulated(&self, of: Of, recording: u32) -> Result<Arc<Simulated>> {
        let (model, recordings) = self.model(of)?;
        let r = recordings.usable(recording).ok_or(Error::NoRecordingAt(recording))?;
        let make = || Simulated::new(&model, r, &Context::quiet());
        self.curves.simulated(of, recording, recordings.samples(), make)
    }

    /// A stretch of a signal: as recorded, or of a model.
    ///
    /// # Errors
    /// No such recording, version or signal.
    pub fn window(
        &self,
        recording: u32,
        channel: Channel,
        curve: Kind,
        of: Option<Of>,
        stretch: Stretch,
    ) -> Result<Window> {
        let Some(of) = of.filter(|_| curve != Kind::Raw) else {
            let raw = self.raw(recording, channel)?;
            return Ok(stretch.of(&raw));
        };
        let signal = super::spectra::signal(channel).ok_or(Error::NoSignal)?;
        let simulated = self.simulated(of, recording)?;
        let curves = simulated.signal(signal).ok_or(Error::NoSignal)?;
        Ok(stretch.of(curves.curve(curve)))
    }

    /// All recordings with a role, simulated by a version.
    fn all(&self, version: u32) -> Result<All> {
        let ids = self.state().recordings.ids.clone();
        ids.into_iter().map(|id| Ok((id, self.simulated(Of::Version(version), id)?))).collect()
    }

    fn grid(&self, version: u32, plane: Plane) -> Result<(Grid, All)> {
        let all = self.all(version)?;
        let grid = Grid::over(plane, &all.iter().map(|(_, s)| &**s).collect::<Vec<_>>()).ok_or(Error::NoSignal)?;
        Ok((grid, all))
    }

    /// The residual of a signal over a plane.
    ///
    /// # Errors
    /// No such version; recordings that hold none of it.
    pub fn map(&self, version: u32, plane: Plane, signal: Signal) -> Result<api::Map> {
        let (grid, all) = self.grid(version, plane)?;
        let unit = match signal {
            Signal::Current => "A",
            Signal::Speed => "rad/s",
            Signal::Torque => "N m",
        };
        Ok(grid.map(&all.iter().map(|(_, s)| &**s).collect::<Vec<_>>(), signal, unit))
    }

    /// When a recording was in some cells of a map, s.
    ///
    /// # Errors
    /// As [`map`](Self::map).
    pub fn instants(&self, version: u32, plane: Plane, recording: u32, cells: &[usize]) -> Result<Vec<[f64; 2]>> {
        let (grid, all) = self.grid(version, plane)?;
        let (_, s) = all.iter().find(|(id, _)| *id == recording).ok_or(Error::NoRecordingAt(recording))?;
        Ok(grid.instants(s, cells))
    }

    /// The cells of a map in which a recording was between two times.
    ///
    /// # Errors
    /// As [`map`](Self::map).
    pub fn cells(&self, version: u32, plane: Plane, recording: u32, [from_s, to_s]: [f64; 2]) -> Result<Vec<u32>> {
        let (grid, all) = self.grid(version, plane)?;
        let (_, s) = all.iter().find(|(id, _)| *id == recording).ok_or(Error::NoRecordingAt(recording))?;
        Ok(grid.cells(s, from_s, to_s))
    }
}
