//! What a climb can miss, looked for once more with the free run as the judge.
//!
//! A climb adds one effect at a time by the balances of voltage and torque. Two effects whose contributions cancel gain
//! nothing one at a time; the fit of one of them may end in a wrong valley without the other; and what acts at low speed
//! only, such as weak Stribeck friction, drowns in the noise of the acceleration, while the free run adds it up. And where
//! several are missing, the one that gains most at first may be none of them.
//!
//! An effect that is found here has to take most of what the free run's error exceeds its floor by, on data held out.

use greyrig::effects::Description;

use super::Progress;
use super::audit::Audit;
use super::classes;
use super::climb::{Climb, LEAST_INDEPENDENT, SAME_ERROR};
use super::completeness::Completeness;
use super::ladder::{Ladder, Objection, Step, Tried};
use super::screening::Promise;
use crate::error::Result;
use crate::identify::minimise::{Effort, Refined};
use crate::identify::scales::Scales;
use crate::identify::space::Space;

/// Excess over the floor, sum of the logarithms of both signals, below which nothing is looked for.
const WORTH_LOOKING: f64 = 0.3;
/// Least fall of the error on data held out, sum of the logarithms of both signals.
const SMALLEST_FALL: f64 = 0.5;
/// Share that may be left, in the signal that gains more, of the logarithm by which the error exceeds its floor.
const LEFT: f64 = 0.4;
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

/// The free run as the judge of a climb.
pub struct SecondLook<'a> {
    climb: &'a Climb<'a>,
    audit: &'a Audit<'a>,
    /// The model as it was, fitted to the balances.
    base: &'a Refined,
    /// And to the free run.
    free: Refined,
}

/// A climb, and what it found fitted in the free run.
type Judged = (Ladder, Refined);
/// Effects, and a fit with them.
type Model = (Vec<&'static str>, Refined);
/// The same, and those that would do as well.
type Found = (Vec<&'static str>, Refined, Vec<&'static str>);

impl<'a> SecondLook<'a> {
    /// Fits the model as it was, `base` by the balances, in the free run.
    ///
    /// # Errors
    /// An interrupt.
    pub fn new(climb: &'a Climb<'a>, audit: &'a Audit<'a>, base: &'a Refined) -> Result<Self> {
        Ok(Self { climb, audit, base, free: audit.fit(&base.space)? })
    }

    /// The free run of the model as it was.
    pub fn free(&self) -> &Refined {
        &self.free
    }

    /// Judges what a climb has found, and looks for what it has missed while something is left to explain.
    ///
    /// # Errors
    /// An interrupt.
    pub fn at(&self, ladder: Ladder, progress: &mut dyn FnMut(Progress<'_>)) -> Result<Judged> {
        let judged = self.judged(ladder)?;
        let mut best = self.with_more(judged, progress)?;
        for look in [Self::again, Self::by_two] {
            if best.0.is_explained() {
                break;
            }
            if let Some(other) = look(self, &best.0, progress)? {
                let other = self.judged(other)?;
                if self.is_better(&best, &other) {
                    best = other;
                }
            }
        }
        self.climb.find_rivals(&mut best.0, progress)?;
        self.confirm_rivals(&mut best, progress)?;
        Ok(best)
    }

    /// Whether another climb has ended clearly better: it takes most of what the first one leaves, or it explains all and
    /// the first one does not.
    fn is_better(&self, one: &Judged, other: &Judged) -> bool {
        let explains = other.0.is_explained() && !one.0.is_explained();
        self.suffices(&one.1, &other.1) || (explains && self.audit.held_out_fall(&one.1, &other.1) > SMALLEST_FALL)
    }

    /// Fits what a climb has found in the free run, and drops what does not earn its place there.
    fn judged(&self, ladder: Ladder) -> Result<Judged> {
        if ladder.found.is_empty() {
            return Ok((Ladder { free_run: Some(self.completeness(&self.free)), ..ladder }, self.free.clone()));
        }
        let scales = Scales::of(&self.free.space, self.climb.experiments());
        let all = self.audit.fit_with_effects(&ladder.fit.space, &self.free, &scales)?;
        self.narrowed(ladder, all)
    }

    /// Drops what does not earn its place in a fit of the free run.
    fn narrowed(&self, mut ladder: Ladder, all: Refined) -> Result<Judged> {
        let mut kept = ladder.found.clone();
        let fit = self.audit.keep_earners(&self.free, all, &mut kept)?;
        self.climb.narrow(&mut ladder, &kept, &fit)?;
        ladder.free_run = Some(self.completeness(&fit));
        Ok((ladder, fit))
    }

    /// Completeness of the free run without and with effects.
    fn completeness(&self, fit: &Refined) -> (Completeness, Completeness) {
        self.audit.completeness_of_both(&self.free, fit)
    }

    /// Adds what the free run needs and the balances do not show: one effect, or two that gain nothing one at a time.
    fn with_more(&self, judged: Judged, progress: &mut dyn FnMut(Progress<'_>)) -> Result<Judged> {
        let (mut ladder, mut kept) = judged;
        for _ in 0..ADDED {
            if self.audit.excess(&kept, &kept).iter().sum::<f64>() <= WORTH_LOOKING {
                break;
            }
            progress(Progress::Doing("free run"));
            let scales = Scales::of(&kept.space, self.climb.experiments());
            let objected = |id: &str| {
                let last = ladder.steps.last().and_then(|s| s.tried.iter().find(|t| t.id == id));
                last.and_then(|t| t.objection).is_some_and(|o| !Objection::is_of_size(o))
            };
            let mut candidates = self.climb.candidates_beside(&kept.space, &[]);
            candidates.retain(|d| !objected(d.id));
            let promises = self.promises(&kept, &scales, &candidates);
            let singles = promises.iter().filter(|p| p.gain > WORTH_FITTING).take(FITTED);
            let singles = singles.map(|p| (vec![p.id], p.space.clone())).collect();
            let singles = self.fitted(singles, progress)?;
            let mut found = self.sufficient(&kept, &singles)?;
            if found.is_none() {
                let pairs = self.audit.pairs(&kept, &scales, &promises).into_iter();
                let pairs = pairs.filter(|p| p.gain > WORTH_FITTING).take(FITTED).map(|p| (p.ids.to_vec(), p.space));
                let partners = self.partners(&kept, &singles, &scales, &candidates);
                found = self.sufficient(&kept, &self.fitted(pairs.chain(partners).collect(), progress)?)?;
            }
            let Some((ids, fit, rivals)) = found else { break };
            let gain = self.audit.held_out_fall(&kept, &fit);
            let parameters = fit.space.free().count() - kept.space.free().count();
            let tries = candidates.len().pow(ids.len() as u32) as f64;
            let tried = |id: &&'static str| Tried {
                id,
                fit: fit.clone(),
                held_out: self.audit.held_out(&fit),
                gain,
                p_value: (self.audit.p_value(&kept, &fit, parameters) * tries).min(1.0),
                objection: None,
            };
            let step = Step {
                promises: promises.iter().map(|p| (p.id, p.gain)).collect(),
                tried: ids.iter().map(tried).collect(),
                together: ids.len() > 1,
                winners: ids,
                as_well: rivals,
                decoy_gain: 0.0,
                decoys: [0, 0],
            };
            ladder.found.extend(&step.winners);
            ladder.steps.push(step);
            (ladder, kept) = self.narrowed(ladder, fit)?;
        }
        Ok((ladder, kept))
    }

    /// The candidates that have a column of their own in the free run, most promising first.
    fn promises(&self, fit: &Refined, scales: &Scales, candidates: &[&'static Description]) -> Vec<Promise> {
        let mut promises = self.audit.screen(fit, scales, candidates);
        promises.retain(|p| p.independent >= LEAST_INDEPENDENT);
        promises
    }

    /// The best single effect, where it gains without sufficing, and what promises most beside it: two laws that are bent
    /// may gain together what the linearisation of neither shows.
    fn partners(
        &self,
        kept: &Refined,
        singles: &[Model],
        scales: &Scales,
        candidates: &[&'static Description],
    ) -> Vec<(Vec<&'static str>, Space)> {
        let gains = |single: &&Model| self.audit.held_out_fall(kept, &single.1) > SMALLEST_FALL;
        let Some((ids, fit)) = singles.first().filter(gains) else { return Vec::new() };
        let others: Vec<_> = candidates.iter().copied().filter(|d| !classes::same(d.id, ids[0])).collect();
        let promises = self.promises(fit, scales, &others).into_iter().filter(|p| p.gain > WORTH_FITTING);
        promises.take(PARTNERS).map(|p| (vec![ids[0], p.id], p.space)).collect()
    }

    /// Fits models with more effects roughly, the one with the smallest error on data held out first.
    fn fitted(
        &self,
        models: Vec<(Vec<&'static str>, Space)>,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Vec<Model>> {
        let mut fits = Vec::new();
        for (ids, space) in models {
            progress(Progress::Doing(ids[0]));
            fits.push((ids, self.audit.fit_with(&space, Effort::ROUGH)?));
        }
        fits.sort_by(|a, b| self.error(&a.1).total_cmp(&self.error(&b.1)));
        Ok(fits)
    }

    /// The first of these models that suffices, and the effects of those that do as well.
    fn sufficient(&self, kept: &Refined, models: &[Model]) -> Result<Option<Found>> {
        for (k, (ids, rough)) in models.iter().enumerate().take(FINISHED) {
            let fit = self.audit.finish(rough)?;
            if self.suffices(kept, &fit) {
                let others = models.iter().enumerate().filter(|(other, _)| *other != k).map(|(_, model)| model);
                let as_well = others.filter(|(_, other)| self.error(other) - self.error(&fit) < SAME_ERROR);
                let rivals = as_well.flat_map(|(other, _)| other).copied();
                let rivals = rivals.filter(|id| ids.iter().all(|own| !classes::same(own, id))).collect();
                return Ok(Some((ids.clone(), fit, rivals)));
            }
        }
        Ok(None)
    }

    /// Leaves of the rivals those that do as well in the place of what was found in the free run, too, now that all is there.
    fn confirm_rivals(&self, judged: &mut Judged, progress: &mut dyn FnMut(Progress<'_>)) -> Result<()> {
        let (ladder, kept) = judged;
        let scales = Scales::of(&kept.space, self.climb.experiments());
        for (found, rivals) in ladder.found.iter().zip(&mut ladder.rivals) {
            let mut confirmed = Vec::new();
            for rival in rivals.iter().copied().filter(|id| !ladder.found.contains(id)) {
                progress(Progress::Doing(rival));
                let swapped = self.audit.fit(&kept.space.without_effect(found).with_effect(rival, &scales))?;
                if self.error(&swapped) - self.error(kept) < SAME_ERROR {
                    confirmed.push(rival);
                }
            }
            *rivals = confirmed;
        }
        Ok(())
    }

    fn error(&self, fit: &Refined) -> f64 {
        self.audit.held_out(fit).log_error()
    }

    /// Climbs on from what is left of a climb that began with a wrong effect, which the free run has dropped.
    fn again(&self, ladder: &Ladder, progress: &mut dyn FnMut(Progress<'_>)) -> Result<Option<Ladder>> {
        if !ladder.has_dropped() || ladder.found.is_empty() {
            return Ok(None);
        }
        let (fit, found, steps) = (ladder.fit.clone(), ladder.found.clone(), ladder.steps.clone());
        let again = self.climb.climb_on(self.base, fit, found, steps, progress)?;
        Ok((again.found != ladder.found).then_some(again))
    }

    /// Climbs once more, by two effects at first.
    fn by_two(&self, ladder: &Ladder, progress: &mut dyn FnMut(Progress<'_>)) -> Result<Option<Ladder>> {
        self.climb.climb_by_two(self.base, ladder, progress)
    }

    /// Whether a fit takes most of what an earlier one exceeds the floor by, on data held out too.
    fn suffices(&self, before: &Refined, after: &Refined) -> bool {
        let (over, left) = (self.audit.excess(before, after), self.audit.excess(after, after));
        let gains_more = if over[0] - left[0] > over[1] - left[1] { 0 } else { 1 };
        left[gains_more] < LEFT * over[gains_more] && self.audit.held_out_fall(before, after) > SMALLEST_FALL
    }
}
