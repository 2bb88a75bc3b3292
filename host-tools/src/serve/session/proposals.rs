//! What a version's plan and challenge have come to, and what a plan proposes.

use super::{Session, State, line, words};
use crate::rig::SAMPLE_RATE_HZ;
use crate::serve::api;
use crate::serve::error::{Error, Result};
use crate::serve::planning;
use crate::serve::pyramid::{Curve, Pyramid};
use crate::serve::task::Task;

impl Session {
    fn version_in(state: &mut State, id: Option<u32>) -> Result<&mut api::Version> {
        let id = id.ok_or(Error::NoModel)?;
        state.versions.iter_mut().find(|v| v.told.id == id).map(|v| &mut v.told).ok_or(Error::NoVersion(id))
    }

    pub(super) fn planned(&self, state: &mut State, task: &Task, of: Option<u32>, mut plan: api::Plan) -> Result<()> {
        let version = Self::version_in(state, of)?;
        let model = self.project.model_file(version.id).display().to_string();
        let wanted = if let Task::Plan(wanted) = task { wanted.arguments() } else { Vec::new() };
        plan.command = line(&[words(&["plan", "--model", &model]), wanted].concat());
        version.plan = Some(plan);
        self.look_ahead(state);
        self.changed(state).map(drop)
    }

    pub(super) fn challenged(
        &self,
        state: &mut State,
        task: &Task,
        of: Option<u32>,
        mut challenge: api::Challenge,
    ) -> Result<()> {
        let (files, basis) = (state.recordings.arguments(), state.recordings.basis());
        let version = Self::version_in(state, of)?;
        let model = self.project.model_file(version.id).display().to_string();
        let effects = if let Task::Challenge(effects) = task { &effects[..] } else { &[] };
        let named = effects.iter().flat_map(|id| ["--effect".to_owned(), id.to_string()]).collect();
        challenge.command = line(&[words(&["challenge"]), files, words(&["--model", &model]), named].concat());
        challenge.basis = basis;
        version.challenge = Some(challenge);
        self.look_ahead(state);
        self.changed(state).map(drop)
    }

    /// The voltage of a recording that a version's plan proposes.
    ///
    /// # Errors
    /// No such version, or one without a plan; a profile that is none.
    pub fn proposed(&self, version: u32, profile: &str, seconds: f64) -> Result<Curve> {
        let (model, plan) = {
            let state = self.state();
            let of = state.version(version)?;
            (of.model.clone(), of.told.plan.clone().ok_or(Error::NoPlan(version))?)
        };
        let voltage = planning::voltage(&model, &plan, profile, seconds)?;
        let samples = voltage.iter().map(|u| *u as f32).collect();
        Ok(Curve { start_s: 0.0, step_s: 1.0 / SAMPLE_RATE_HZ, pyramid: Pyramid::new(samples) })
    }
}
