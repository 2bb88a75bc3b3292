//! What a climb can miss, looked for once more with the free run as the judge.
//!
//! A climb adds one effect at a time by the balances of voltage and torque. Two effects whose contributions cancel gain
//! nothing one at a time; the fit of one of them may end in a wrong valley without the other; and what acts at low speed
//! only, such as weak Stribeck friction, drowns in the noise of the acceleration, while the free run adds it up.
//!
//! An effect that is found here has to take most of what the free run's error exceeds its floor by, on data held out.

use super::Progress;
use super::audit::Audit;
use super::classes;
use super::ladder::{Climb, Ladder, Objection, Tried};
use crate::error::Result;
use crate::identify::minimise::{Effort, Refined};
use crate::identify::scales::Scales;
use crate::identify::space::Space;

/// Excess over the floor, sum of the logarithms of both signals, below which nothing is looked for.
const WORTH_LOOKING: f64 = 0.3;
/// Least fall of the error on data held out, sum of the logarithms of both signals.
const SMALLEST_FALL: f64 = 0.5;
/// Share of the excess that may be left in the signal that gains more. (The other one may hold turbulence.)
const LEFT: f64 = 0.4;
/// Fall of the free run's error, with the parameters that the balances give, from which a candidate is fitted.
const WORTH_FITTING: f64 = 0.2;
/// Candidates that are fitted in the free run, at most.
const FITTED: usize = 3;
/// Effects that are added so.
const ADDED: usize = 2;

/// Adds what the last step of a climb tried and did not count, where the free run needs it.
///
/// # Errors
/// An interrupt.
pub fn singles(
    climb: &Climb<'_>,
    audit: &Audit<'_>,
    ladder: &mut Ladder,
    kept: &mut Refined,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<()> {
    for _ in 0..ADDED {
        let Some(last) = ladder.steps.last().filter(|_| audit.excess(kept, kept).iter().sum::<f64>() > WORTH_LOOKING)
        else {
            break;
        };
        let error = |space: &Space| audit.error_at(space).map(f64::ln).iter().sum::<f64>();
        let without = error(&ladder.fit.space);
        let mut candidates: Vec<(f64, &Tried)> = last
            .tried
            .iter()
            .filter(|t| t.objection.is_some_and(Objection::is_of_size))
            .filter(|t| ladder.found.iter().all(|id| !classes::same(id, t.id)))
            .map(|t| (without - error(&t.fit.space), t))
            .filter(|(gain, _)| *gain > WORTH_FITTING)
            .collect();
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut best: Option<(&'static str, Refined)> = None;
        for (_, tried) in candidates.into_iter().take(FITTED) {
            progress(Progress::Doing(tried.id));
            let mut space = kept.space.with_effect(tried.id, &Scales::of(&kept.space, climb.experiments()));
            space.start_from(&tried.fit.space, tried.id);
            let fit = audit.fit_with(&space, Effort::ROUGH)?;
            if best.as_ref().is_none_or(|(_, b)| audit.held_out_fall(b, &fit) > 0.0) {
                best = Some((tried.id, fit));
            }
        }
        let Some((id, fit)) = best else { break };
        let fit = audit.fit(&fit.space)?;
        if !suffices(audit, kept, &fit) {
            break;
        }
        climb.accept(ladder, id, &fit.space, audit.held_out_fall(kept, &fit))?;
        *kept = fit;
    }
    Ok(())
}

/// Fits what a climb has found in the free run, and drops what does not earn its place there. `free` is the free run of the
/// model as it was.
///
/// # Errors
/// An interrupt.
pub fn judged(climb: &Climb<'_>, audit: &Audit<'_>, ladder: &mut Ladder, free: &Refined) -> Result<Refined> {
    let found = ladder.found.clone();
    let all = audit.fit_with_effects(&ladder.fit.space, free, &Scales::of(&free.space, climb.experiments()))?;
    let fit = audit.keep_earners(free, all, &mut ladder.found)?;
    if found != ladder.found {
        climb.narrow(ladder, &found)?;
    }
    Ok(fit)
}

/// Climbs on from what is left of a climb that began with a wrong effect, which the free run has dropped.
///
/// # Errors
/// An interrupt.
pub fn again(
    climb: &Climb<'_>,
    audit: &Audit<'_>,
    base: &Refined,
    free: &Refined,
    ladder: &Ladder,
    kept: &Refined,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<Option<(Ladder, Refined)>> {
    if ladder.has_lost_none() || ladder.found.is_empty() {
        return Ok(None);
    }
    let other = climb.climb_on(base, ladder.fit.clone(), ladder.found.clone(), ladder.steps.clone(), progress)?;
    judged_if_better(climb, audit, other, free, kept)
}

/// Climbs once more, by two effects at first.
///
/// # Errors
/// An interrupt.
pub fn pairs(
    climb: &Climb<'_>,
    audit: &Audit<'_>,
    base: &Refined,
    free: &Refined,
    _: &Ladder,
    kept: &Refined,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<Option<(Ladder, Refined)>> {
    let Some(other) = climb.climb_by_two(base, progress)? else { return Ok(None) };
    judged_if_better(climb, audit, other, free, kept)
}

/// Another climb, if the free run is better for it.
fn judged_if_better(
    climb: &Climb<'_>,
    audit: &Audit<'_>,
    mut other: Ladder,
    free: &Refined,
    kept: &Refined,
) -> Result<Option<(Ladder, Refined)>> {
    let fit = judged(climb, audit, &mut other, free)?;
    Ok(suffices(audit, kept, &fit).then_some((other, fit)))
}

/// Whether a fit takes most of what an earlier one exceeds the floor by, on data held out too.
fn suffices(audit: &Audit<'_>, before: &Refined, after: &Refined) -> bool {
    let (over, left) = (audit.excess(before, after), audit.excess(after, after));
    let gains_more = if over[0] - left[0] > over[1] - left[1] { 0 } else { 1 };
    left[gains_more] < LEFT * over[gains_more] && audit.held_out_fall(before, after) > SMALLEST_FALL
}
