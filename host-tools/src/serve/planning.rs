//! The recording that would tell rival effects apart, and what the present ones would have shown.

use greyrig::effects::EffectId;

use super::api;
use super::error::Result;
use crate::answers::plan::rehearsed;
use crate::challenge::{self, challenge};
use crate::context::Context;
use crate::model::Model;
use crate::plan::{self, Limits, plan};
use crate::recording::Recording;

/// Proposals that are shown of a pair.
const SHOWN: usize = 10;

/// What a plan is made for.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// Effects to tell apart; none: the pairs that are known to be confused.
    pub rivals: Vec<EffectId>,
    /// Length of all recordings of a proposal together, s.
    pub seconds: f64,
    /// What is kept to.
    pub limits: Limits,
}

impl Wanted {
    /// As a command takes it.
    pub fn arguments(&self) -> Vec<String> {
        let rivals: Vec<String> = self.rivals.iter().map(ToString::to_string).collect();
        let named = if rivals.is_empty() { vec![] } else { vec!["--rivals".to_owned(), rivals.join(",")] };
        let Limits { voltage_v, current_a } = self.limits;
        let limits = [("--seconds", self.seconds), ("--max-voltage", voltage_v), ("--max-current", current_a)];
        named.into_iter().chain(limits.into_iter().flat_map(|(name, x)| [name.to_owned(), x.to_string()])).collect()
    }
}

/// A plan.
///
/// # Errors
/// As [`plan()`].
pub fn planned(model: &Model, wanted: &Wanted, ctx: &Context) -> Result<api::Plan> {
    let plan = plan(model, &wanted.rivals, wanted.seconds, wanted.limits, ctx)?;
    let contest = |c: &plan::Contest| api::Contest {
        rivals: c.rivals.map(|id| id.to_string()),
        separated_by: c.separated_by.clone(),
        proposals: c.proposals.iter().take(SHOWN).map(proposal).collect(),
    };
    Ok(api::Plan {
        voltage_v: plan.limits.voltage_v,
        current_a: plan.limits.current_a,
        contests: plan.contests.iter().map(contest).collect(),
        best: plan.best.iter().map(take).collect(),
        command: String::new(),
        rehearsal: rehearsed(&plan.best, model.kind).map(|line| line.to_string()),
    })
}

fn proposal(of: &plan::Proposal) -> api::Proposal {
    api::Proposal { takes: of.recordings.iter().map(take).collect(), separation: of.separation }
}

fn take(of: &plan::Take) -> api::Take {
    api::Take {
        profile: of.profile.to_owned(),
        seconds: of.seconds,
        peak_voltage_v: of.peak_voltage_v,
        peak_current_a: of.peak_current_a,
    }
}

/// The voltage of a recording that a plan proposes, V, at the rig's rate.
///
/// # Errors
/// As [`plan::voltage`].
pub fn voltage(model: &Model, plan: &api::Plan, profile: &str, seconds: f64) -> Result<Vec<f64>> {
    let rivals = plan.contests.iter().flat_map(|c| &c.rivals).filter_map(|name| name.parse().ok());
    let rivals: Vec<EffectId> = rivals.collect();
    let limits = Limits { voltage_v: plan.voltage_v, current_a: plan.current_a };
    Ok(plan::voltage(model, &rivals, (profile, seconds), limits, &Context::quiet())?)
}

/// A challenge.
///
/// # Errors
/// As [`challenge()`].
pub fn challenged(
    recordings: &[Recording],
    model: &Model,
    effects: &[EffectId],
    ctx: &Context,
) -> Result<api::Challenge> {
    let c = challenge(recordings, model, effects, ctx)?;
    let effect = |e: &challenge::Challenged| api::Challenged {
        effect: e.effect.to_string(),
        name: e.name.to_owned(),
        unit: crate::numbers::unit(e.unit),
        revealed_from: e.revealed_from,
        hidden_up_to: e.hidden_up_to,
        esr: e.esr.into(),
        mistaken_for: e.mistaken_for.map(|id| id.to_string()),
        objection: e.objection.map(str::to_owned),
    };
    let out = |o: &challenge::OutOfReach| api::OutOfReach {
        effect: o.effect.to_string(),
        name: o.name.to_owned(),
        text: o.text.clone(),
    };
    Ok(api::Challenge {
        found: c.found.iter().map(ToString::to_string).collect(),
        unexplained: c.unexplained,
        effects: c.effects.iter().map(effect).collect(),
        out_of_reach: c.out_of_reach.iter().map(out).collect(),
        basis: String::new(),
        command: String::new(),
    })
}
