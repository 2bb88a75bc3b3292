//! A parameter that changes in time, as the effect of the catalogue that it is.
//!
//! Neither the instant of a change nor which parameter it is can be found by the slope of an error. Both are looked for
//! ([`constancy`](super::constancy)) and then held, while the size of the change is fitted like any other. A model has
//! one instant, counted from the begin of a run: in a set of recordings a change can be told, and no model has it.

use std::collections::BTreeMap;

use greyrig::effects::{EffectId, Role};
use greyrig::motor::BaseParameter;

use super::audit::Audit;
use super::base;
use super::candidates::Candidate;
use super::climb::Climb;
use super::constancy::{Variation, With, jump};
use super::odds::Odds;
use super::sizes::sizes;
use crate::compare::PerSignal;
use crate::context::Context;
use crate::error::{Error, Result, if_possible};
use crate::experiment::Experiment;
use crate::identify::Settings;
use crate::identify::minimise::Fit;
use crate::identify::space::{Freedom, Key, Space};
use crate::model::Assignment;
use crate::recording::Recording;

/// What is said of a change within a set of recordings.
pub const SEVERAL: &str = "\na model has one instant, counted from the begin of a run: of several recordings, identify those before the \
                           change and those after it apart";

/// A parameter that jumps.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// As an effect.
    pub id: EffectId,
    /// Its parameters: what is looked for is to be held, and the size is where a fit begins.
    pub parameters: Vec<(Key, f64)>,
    /// Whether a model can have it: of one recording.
    pub is_of_one_recording: bool,
}

impl Change {
    /// What a parameter that varies is as an effect, if it changes in time and is one of the base model.
    pub fn of(varies: &Variation, experiments: &[Experiment]) -> Option<Self> {
        let (With::Time(border), Some(changed)) = (varies.with, varies.key.base()) else { return None };
        let d = jump()?;
        let number = BaseParameter::ALL.iter().position(|p| *p == changed)? as f64 + 1.0;
        let at_s = experiments.get(border.recording)?.elapsed_s + border.at_s;
        let [before, after] = varies.values;
        // Of nothing there is no multiple.
        let change = Some(after / before - 1.0).filter(|change| change.is_finite())?;
        let value = |role: Role| match role {
            Role::Instant => at_s,
            Role::Parameter => number,
            _ => change,
        };
        let with_value = |(place, p): (usize, &greyrig::effects::EffectParameter)| {
            (Key::Effect(d.id, place), value(p.role).clamp(p.range.0, p.range.1))
        };
        let parameters = d.parameters.iter().enumerate().map(with_value).collect();
        Some(Self { id: d.id, parameters, is_of_one_recording: experiments.len() == 1 })
    }

    /// A model that has it besides.
    pub fn added_to(&self, space: &Space, experiments: &[Experiment]) -> Space {
        let mut more = space.with_effect(self.id, &space.scales(experiments));
        for (key, value) in &self.parameters {
            if let Some(entry) = more.get_mut(*key) {
                entry.value = *value;
            }
        }
        more
    }

    /// Fits a model that has it besides in the free run: with its instant as it was found, and then free, from which
    /// that of the better fit is taken.
    ///
    /// # Errors
    /// An interrupt.
    pub fn fit(&mut self, space: &Space, audit: &Audit<'_>, experiments: &[Experiment]) -> Result<Fit> {
        let held = audit.fit(&self.added_to(space, experiments))?;
        let mut freed = held.space.clone();
        let instants = self.parameters.iter().map(|(key, _)| *key).filter(|key| has_role(*key, &[Role::Instant]));
        instants.for_each(|key| {
            if let Some(entry) = freed.get_mut(key) {
                entry.freedom = Freedom::Free(None);
            }
        });
        let free = audit.fit(&freed)?;
        let fit = if audit.fall(&held, &free) > 0.0 { free } else { held };
        self.parameters.iter_mut().for_each(|(key, value)| *value = fit.space.value(*key));
        Ok(fit)
    }

    /// As a candidate: fitted in the free run, or as the balances tell it of a model.
    pub fn as_candidate(
        &self,
        varies: &Variation,
        fitted: Option<(&Fit, &Audit<'_>)>,
        base: &Space,
        experiments: &[Experiment],
        settings: &Settings,
        recordings: &[Recording],
    ) -> Candidate {
        let (parameters, esr_after) = match fitted {
            Some((fit, audit)) => {
                (sizes(&[self.id], &fit.space, &audit.intervals(fit), settings, recordings), audit.ratio(fit.rms))
            }
            None => {
                let space = self.added_to(base, experiments);
                (sizes(&[self.id], &space, &BTreeMap::new(), settings, recordings), PerSignal::default())
            }
        };
        Candidate {
            effect: self.id,
            esr_after,
            held_out_gain: 1.0 - (-0.5 * varies.gain).exp(),
            probability: Some(Odds::by_p_value(varies.p_value, self.id.description().prior)),
            p_value: varies.p_value,
            parameters,
            confused_with: self.id.description().confused_with.to_vec(),
            objection: None,
            step: 1,
        }
    }

    /// What is to be held of it.
    fn held(&self) -> impl Iterator<Item = Assignment> + '_ {
        let is_held = |key: &Key| has_role(*key, &[Role::Instant, Role::Parameter]);
        let assigned =
            |(key, value): &(Key, f64)| key.of_effect().map(|p| Assignment { name: p.name.to_owned(), value: *value });
        self.parameters.iter().filter(move |(key, _)| is_held(key)).filter_map(assigned)
    }
}

/// Whether a parameter is one of these to its effect.
fn has_role(key: Key, roles: &[Role]) -> bool {
    key.of_effect().is_some_and(|p| roles.contains(&p.role))
}

/// Lets settings that ask for a change in time, and do not say when it is and of what, hold what the recordings tell of
/// it.
///
/// # Errors
/// Recordings that tell of none, or that no model can have it of; those that cannot be used; an interrupt.
pub fn hold(settings: &mut Settings, recordings: &[Recording], ctx: &Context) -> Result<()> {
    let Some(d) = jump().filter(|d| settings.effects.contains(&d.id)) else { return Ok(()) };
    let held = |role: Role| d.parameters.iter().filter(move |p| p.role == role).map(|p| p.name);
    let names: Vec<&str> = held(Role::Instant).chain(held(Role::Parameter)).collect();
    if names.iter().all(|name| settings.fixed.iter().any(|fixed| fixed.name == *name)) {
        return Ok(());
    }
    let mut without = settings.clone();
    without.effects.retain(|id| *id != d.id);
    without.fixed.retain(|fixed| d.parameters.iter().all(|p| p.name != fixed.name));
    let by_hand = names.iter().map(|name| format!("--fix {name}=…")).collect::<Vec<_>>().join(" ");
    let change = find(recordings, &without, ctx)?.ok_or_else(|| {
        Error::usage(
            format!("{}: these recordings tell of no parameter that changes in time", d.id),
            format!("say when and which with {by_hand}, or leave it out"),
        )
    })?;
    if !change.is_of_one_recording {
        return Err(Error::usage(
            format!("{}: a model has one instant, counted from the begin of a run, and these are several runs", d.id),
            "identify the recordings before the change and those after it apart",
        ));
    }
    // What the user has said stays so.
    let told = |held: &Assignment| settings.fixed.iter().any(|fixed| fixed.name == held.name);
    let untold: Vec<Assignment> = change.held().filter(|held| !told(held)).collect();
    settings.fixed.extend(untold);
    Ok(())
}

/// The change in time that recordings tell of beside a model.
fn find(recordings: &[Recording], settings: &Settings, ctx: &Context) -> Result<Option<Change>> {
    let (coarse, space) = base::prepared(recordings, settings, ctx)?;
    let Some(climb) = Climb::new(&coarse, Vec::new(), 0, ctx) else { return Ok(None) };
    let base = climb.fit_from_what_is_known(&space, &settings.known)?;
    let ladder = climb.climb(&base, None)?;
    let audit = if climb.is_of_whole_motor() { if_possible(Audit::new(&coarse, &base.space, ctx))? } else { None };
    let free = audit.as_ref().map(|audit| audit.fit(&base.space)).transpose()?;
    let shows = |varies: &Variation| match (&audit, &free) {
        (Some(audit), Some(free)) => audit.shows(varies, free),
        _ => true,
    };
    let in_free_run = || audit.as_ref().zip(free.as_ref()).and_then(|(audit, free)| audit.changes(free));
    let varies = climb.varies(&base, &ladder).filter(shows).or_else(in_free_run);
    let mut change = varies.and_then(|varies| Change::of(&varies, &coarse));
    if let (Some(change), Some(audit), Some(free)) = (&mut change, &audit, &free)
        && change.is_of_one_recording
    {
        change.fit(&free.space, audit, &coarse)?;
    }
    Ok(change)
}
