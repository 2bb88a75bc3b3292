//! The candidates that were fitted, as they are shown.

use std::collections::BTreeMap;
use std::sync::Arc;

use greyrig::effects::EffectId;
use rayon::prelude::*;
use serde::Serialize;

use super::Options;
use super::audit::Audit;
use super::ladder::{Ladder, Objection, Step, Tried};
use super::odds::Odds;
use super::sizes::{Size, sizes};
use crate::compare::PerSignal;
use crate::error::Result;
use crate::identify::Settings;
use crate::identify::minimise::{Effort, Fit};
use crate::recording::Recording;

/// Candidates whose free-run error is refined for the report, at most.
const REFINED: usize = 3;
/// And of these those that gain more than this share of what the best one gains.
const CLOSE: f64 = 0.5;

/// A candidate that was fitted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// The effect.
    pub effect: EffectId,
    /// Free-run error-to-signal ratio with it (after the effects found before it).
    pub esr_after: PerSignal,
    /// By how much the error on data held out falls: 0.9 is 90 %.
    pub held_out_gain: f64,
    /// Chance that it is what is missing, among the models of its step; none of what was not weighed.
    pub probability: Option<f64>,
    /// p-value, corrected for the number of candidates tried.
    pub p_value: f64,
    /// Its parameters.
    pub parameters: Vec<Size>,
    /// Effects that look alike.
    pub confused_with: Vec<EffectId>,
    /// Why it does not count, in words; `None`: it does.
    pub objection: Option<&'static str>,
    /// The step of the diagnosis in which it was tried, from 1.
    pub step: usize,
}

/// The fit of a candidate by the balances, and its error in the free run.
pub type InFreeRun = (Arc<Fit>, PerSignal);

/// Errors in the free run of the candidates of all steps, for the report: refined where it matters, for the others at
/// the estimate by the balances. What is `known` is not computed again.
pub fn errors_in_free_run(
    steps: &[Step],
    audit: &Audit<'_>,
    options: &Options,
    known: &[InFreeRun],
) -> Result<Vec<InFreeRun>> {
    if !options.candidates_refined {
        return Ok(Vec::new());
    }
    let best = steps.first().and_then(|s| s.tried.first()).map_or(0.0, |t| t.gain);
    let error = |(step, place, t): (usize, usize, &Tried)| {
        let error = match error_of(t, known) {
            Some(error) => error,
            None if step == 0 && place < REFINED && t.gain > CLOSE * best && t.objection.is_none() => {
                audit.ratio(audit.fit_with(&t.fit.space, Effort::ESTIMATE)?.rms)
            }
            None => audit.ratio(audit.error_at(&t.fit.space)),
        };
        Ok((Arc::clone(&t.fit), error))
    };
    let steps = steps.iter().enumerate();
    let tried = steps.flat_map(|(step, s)| s.tried.iter().enumerate().map(move |(place, t)| (step, place, t)));
    tried.collect::<Vec<_>>().into_par_iter().map(error).collect()
}

fn error_of(tried: &Tried, known: &[InFreeRun]) -> Option<PerSignal> {
    known.iter().find(|(fit, _)| Arc::ptr_eq(fit, &tried.fit)).map(|(_, error)| *error)
}

/// The candidates of all steps, with their errors in the free run, best first.
pub fn describe(
    ladder: &Ladder,
    odds: &Odds,
    errors: &[InFreeRun],
    options: &Options,
    recordings: &[Recording],
) -> Vec<Candidate> {
    let steps = ladder.steps.iter().enumerate();
    let tried = steps.flat_map(|(step, s)| s.tried.iter().map(move |t| (step, t)));
    let describe = |(step, t): (usize, &Tried)| {
        let esr_after = error_of(t, errors).unwrap_or_default();
        let probability = odds.effects.get(&(step + 1, t.id)).copied();
        candidate(t, step + 1, esr_after, probability, &options.settings, recordings)
    };
    tried.map(describe).collect()
}

fn candidate(
    tried: &Tried,
    step: usize,
    esr_after: PerSignal,
    probability: Option<f64>,
    settings: &Settings,
    recordings: &[Recording],
) -> Candidate {
    Candidate {
        effect: tried.id,
        esr_after,
        held_out_gain: 1.0 - (-0.5 * tried.gain).exp(),
        probability,
        p_value: tried.p_value,
        parameters: sizes(&[tried.id], &tried.fit.space, &BTreeMap::new(), settings, recordings),
        confused_with: tried.id.description().confused_with.to_vec(),
        objection: tried.objection.map(Objection::words),
        step,
    }
}
