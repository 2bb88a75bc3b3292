//! What the free run needs and the balances do not show: one effect, or two at once.

use std::sync::Arc;

use greyrig::effects::{Description, EffectId};
use rayon::prelude::*;

use super::{Judged, SMALLEST_FALL, SecondLook};
use crate::diagnose::classes;
use crate::diagnose::criteria::{LEAST_INDEPENDENT, SAME_ERROR};
use crate::diagnose::ladder::{Objection, Step, Tried};
use crate::diagnose::screening::Promise;
use crate::error::Result;
use crate::identify::minimise::{Effort, Fit};
use crate::identify::scales::Scales;
use crate::identify::space::Space;

/// Excess over the floor, sum of the logarithms of both signals, below which nothing is looked for.
pub(super) const WORTH_LOOKING: f64 = 0.3;
/// Share that may be left, in the signal that gains more, of the logarithm by which the error exceeds its floor.
const LEFT: f64 = 0.4;
/// The same of a rough fit that is worth finishing. In 40 cases with a withheld and 24 with three effects on AC the end
/// of 66 fits left at most 0.2 less than the rough one.
const LEFT_ROUGHLY: f64 = 0.6;
/// Fall of the free run's error that a linearisation has to promise for a candidate to be fitted.
const WORTH_FITTING: f64 = 0.2;
/// Candidates that are fitted in the free run, at most.
const FITTED: usize = 3;
/// And of these those whose fit is finished, best first.
const FINISHED: usize = 2;
/// Partners that are fitted with a single effect that gains without sufficing.
const PARTNERS: usize = 2;
/// Effects that are added so.
const ADDED: usize = 2;

/// Effects that are to be tried, and where to begin.
type Attempt = (Vec<EffectId>, Space);
/// Effects, and a fit with them.
type Model = (Vec<EffectId>, Fit);
/// The same, and those that may do as well.
type WithRivals = (Vec<EffectId>, Fit, Vec<EffectId>);

impl SecondLook<'_> {
    /// Adds what the free run needs and the balances do not show: one effect, or two that gain nothing one at a time.
    pub(super) fn with_more(&self, judged: Judged) -> Result<Judged> {
        let (mut ladder, mut kept) = judged;
        for _ in 0..ADDED {
            if self.audit.excess(&kept, &kept).iter().sum::<f64>() <= WORTH_LOOKING {
                break;
            }
            self.climb.context().doing("free run");
            let scales = kept.space.scales(self.climb.experiments());
            let objection = |id: EffectId| {
                let last = ladder.steps.last().and_then(|s| s.tried.iter().find(|t| t.id == id));
                last.and_then(|t| t.objection)
            };
            let mut candidates = self.climb.candidates_beside(&kept.space, &[]);
            // What looks like the base model cannot be named, but it may be what another effect is named for.
            let hidden = candidates.iter().filter(|d| objection(d.id) == Some(Objection::NotIndependent));
            let hidden: Vec<EffectId> = hidden.map(|d| d.id).collect();
            candidates.retain(|d| objection(d.id).is_none_or(Objection::is_of_size));
            let promises = self.promises(&kept, &scales, &candidates);
            let singles = promises.iter().filter(|p| p.gain > WORTH_FITTING).take(FITTED);
            let singles = singles.map(|p| (vec![p.id], p.space.clone())).collect();
            let singles = self.fitted(singles)?;
            let mut found = self.sufficient(&kept, &singles)?;
            if found.is_none() {
                let pairs = self.audit.pairs(&kept, &scales, &promises).into_iter();
                let pairs = pairs.filter(|p| p.gain > WORTH_FITTING).take(FITTED).map(|p| (p.ids.to_vec(), p.space));
                let partners = self.partners(&kept, &singles, &scales, &candidates)?;
                found = self.sufficient(&kept, &self.fitted(pairs.chain(partners).collect())?)?;
            }
            let Some((ids, fit, mut as_well)) = found else { break };
            let before = ladder.found.clone();
            as_well.extend(hidden.iter().filter(|h| ids.iter().all(|id| !classes::same(kept.space.kind(), *id, **h))));
            ladder.found.extend(&ids);
            ladder.steps.push(self.step(&kept, &fit, ids, as_well, &promises, candidates.len())?);
            (ladder, kept) = self.narrowed(ladder, fit)?;
            // Where nothing of it has stayed, the same would promise most once more.
            if ladder.found == before {
                break;
            }
        }
        Ok((ladder, kept))
    }

    /// What was found in the free run, as a step of the ladder.
    fn step(
        &self,
        kept: &Fit,
        fit: &Fit,
        ids: Vec<EffectId>,
        as_well: Vec<EffectId>,
        promises: &[Promise],
        candidates: usize,
    ) -> Result<Step> {
        let parameters = fit.space.free().count() - kept.space.free().count();
        let tries = candidates.pow(ids.len() as u32) as f64;
        let shared = Arc::new(fit.clone());
        let gain = self.audit.held_out_fall(kept, fit)?;
        let p_value = (self.audit.p_value(kept, fit, parameters)? * tries).min(1.0);
        let tried = |id: &EffectId| Tried { id: *id, fit: Arc::clone(&shared), gain, p_value, objection: None };
        Ok(Step {
            promises: promises.iter().map(|p| (p.id, p.gain)).collect(),
            tried: ids.iter().map(tried).collect(),
            together: ids.len() > 1,
            winners: ids,
            in_free_run: true,
            as_well,
            decoy_gain: 0.0,
            decoys: [0, 0],
        })
    }

    /// The candidates that have a column of their own in the free run, most promising first.
    fn promises(&self, fit: &Fit, scales: &Scales, candidates: &[&'static Description]) -> Vec<Promise> {
        let mut promises = self.audit.screen(fit, scales, candidates);
        promises.retain(|p| p.independent >= LEAST_INDEPENDENT);
        promises
    }

    /// The best single effect, where it gains without sufficing, and what promises most beside it: two laws that are
    /// bent may gain together what the linearisation of neither shows.
    fn partners(
        &self,
        kept: &Fit,
        singles: &[Model],
        scales: &Scales,
        candidates: &[&'static Description],
    ) -> Result<Vec<Attempt>> {
        let Some((ids, fit)) = singles.first() else { return Ok(Vec::new()) };
        if self.audit.held_out_fall(kept, fit)? <= SMALLEST_FALL {
            return Ok(Vec::new());
        }
        let others: Vec<_> =
            candidates.iter().copied().filter(|d| !classes::same(kept.space.kind(), d.id, ids[0])).collect();
        let promises = self.promises(fit, scales, &others).into_iter().filter(|p| p.gain > WORTH_FITTING);
        Ok(promises.take(PARTNERS).map(|p| (vec![ids[0], p.id], p.space)).collect())
    }

    /// Fits models with more effects roughly, the one with the smallest error on data held out first; of those with the
    /// same effects only that.
    fn fitted(&self, attempts: Vec<Attempt>) -> Result<Vec<Model>> {
        let fit = |(ids, space): Attempt| {
            self.climb.context().doing(ids[0].id());
            let fit = self.audit.fit_with(&space, Effort::ROUGH)?;
            Ok((self.error(&fit)?, (ids, fit)))
        };
        let mut fits: Vec<(f64, Model)> = attempts.into_par_iter().map(fit).collect::<Result<_>>()?;
        fits.sort_by(|a, b| a.0.total_cmp(&b.0));
        let alike = |a: &Model, b: &Model| a.0.iter().all(|id| b.0.contains(id));
        let mut best: Vec<Model> = Vec::new();
        for (_, fit) in fits {
            if best.iter().all(|other| !alike(&fit, other)) {
                best.push(fit);
            }
        }
        Ok(best)
    }

    /// The first of these models that suffices, and the effects of those that do as well.
    fn sufficient(&self, kept: &Fit, models: &[Model]) -> Result<Option<WithRivals>> {
        for (k, (ids, rough)) in models.iter().enumerate().take(FINISHED) {
            if !self.takes_all_but(LEFT_ROUGHLY, kept, rough) {
                continue;
            }
            let fit = self.audit.finish(rough)?;
            if self.suffices(kept, &fit)? {
                let mut rivals = Vec::new();
                for (_, (others, other)) in models.iter().enumerate().filter(|(other, _)| *other != k) {
                    if self.error(other)? - self.error(&fit)? < SAME_ERROR {
                        rivals.extend(others.iter().copied());
                    }
                }
                rivals.retain(|id| ids.iter().all(|own| !classes::same(kept.space.kind(), *own, *id)));
                return Ok(Some((ids.clone(), fit, rivals)));
            }
        }
        Ok(None)
    }

    /// Whether a fit takes most of what an earlier one exceeds the floor by, on data held out too.
    pub(super) fn suffices(&self, before: &Fit, after: &Fit) -> Result<bool> {
        Ok(self.takes_all_but(LEFT, before, after) && self.audit.held_out_fall(before, after)? > SMALLEST_FALL)
    }

    /// Whether a fit leaves less than a share, in the signal that gains more, of the logarithm by which the error of an
    /// earlier one exceeds the floor.
    fn takes_all_but(&self, share: f64, before: &Fit, after: &Fit) -> bool {
        let (over, left) = (self.audit.excess(before, after), self.audit.excess(after, after));
        let gains_more = if over[0] - left[0] > over[1] - left[1] { 0 } else { 1 };
        left[gains_more] < share * over[gains_more]
    }
}
