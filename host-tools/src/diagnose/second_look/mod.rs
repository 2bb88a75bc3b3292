//! What a climb can miss, looked for once more with the free run as the judge.
//!
//! A climb adds one effect at a time by the balances of voltage and torque. Two effects whose contributions cancel gain
//! nothing one at a time; the fit of one of them may end in a wrong valley without the other; and what acts at low
//! speed only, such as weak Stribeck friction, drowns in the noise of the acceleration, while the free run adds it up.
//! And where several are missing, the one that gains most at first may be none of them.
//!
//! An effect that is found here has to take most of what the free run's error exceeds its floor by, on data held out.

mod another_form;
mod by_chance;
mod contradicted;
mod more;
mod reconsidered;
mod surrogates;

use greyrig::effects::EffectId;
use rayon::prelude::*;

use super::audit::Audit;
use super::climb::{Climb, Way};

use super::completeness::Completeness;
use super::ladder::Ladder;
use crate::diagnose::criteria::{SAME_ERROR, SMALLEST_GAIN};
use crate::error::Result;
use crate::identify::minimise::{Effort, Fit};
use crate::identify::space::Space;

/// Least fall of the error on data held out, sum of the logarithms of both signals.
const SMALLEST_FALL: f64 = 0.5;

/// The free run as the judge of a climb.
pub struct SecondLook<'a> {
    climb: &'a Climb<'a>,
    audit: &'a Audit<'a>,
    /// The model as it was, fitted to the balances.
    base: &'a Fit,
    /// And to the free run.
    free: Fit,
}

/// A climb, and what it found fitted in the free run.
type Judged = (Ladder, Fit);

impl<'a> SecondLook<'a> {
    /// Fits the model as it was, `base` by the balances, in the free run. Where it ends farther off than it was at its
    /// `start` values, the balances had led it astray, and it begins there.
    ///
    /// # Errors
    /// An interrupt.
    pub fn new(climb: &'a Climb<'a>, audit: &'a Audit<'a>, base: &'a Fit, start: &Space) -> Result<Self> {
        let mut free = audit.fit(&base.space)?;
        if audit.log_error_at(start).total_cmp(&audit.log_error(&free)).is_lt() {
            let other = audit.fit(start)?;
            if audit.fall(&free, &other) > 0.0 {
                free = other;
            }
        }
        Ok(Self { climb, audit, base, free })
    }

    /// The free run of the model as it was.
    pub fn free(&self) -> &Fit {
        &self.free
    }

    /// Judges what a climb has found, and looks for what it has missed while something is left to explain.
    ///
    /// # Errors
    /// An interrupt.
    pub fn at(&self, ladder: Ladder) -> Result<Judged> {
        let mut judged = self.reconsidered(self.judged(ladder)?)?;
        // If forward selection found something and structure remains, hysteresis comes first: the effects found may be
        // proxies for it. If it found nothing, the search on the simulation error comes first, because it may find
        // hysteresis itself.
        let has_begun = judged.0.steps.first().is_some_and(|step| !step.winners.is_empty());
        if has_begun && !judged.0.is_explained() {
            let other = self.by_loop(&judged.0)?;
            self.take_if_better(&mut judged, other)?;
        }
        // Beside a wrong choice there is more to look for, and in vain.
        let judged = self.not_contradicted(self.exchanged(judged)?)?;
        let settled = judged.0.found.clone();
        let judged = self.with_more(judged)?;
        let mut best = self.in_another_form(judged)?;
        for look in [Self::by_loop, Self::again, Self::by_two].into_iter().skip(usize::from(has_begun)) {
            if best.0.is_explained() {
                break;
            }
            let other = look(self, &best.0)?;
            self.take_if_better(&mut best, other)?;
        }
        if best.0.found != settled {
            best = self.exchanged(best)?;
        }
        let mut best = self.without_surrogates(best)?;
        self.climb.find_rivals(&mut best.0)?;
        self.confirm_rivals(&mut best)?;
        let by_chance = self.behind_by_chance(&best)?;
        if let Some(rivals) = best.0.rivals.first_mut() {
            let others: Vec<_> = by_chance.into_iter().filter(|id| !rivals.contains(id)).collect();
            rivals.extend(others);
        }
        Ok(best)
    }

    /// Takes another climb, if there is one and it has ended clearly better.
    fn take_if_better(&self, best: &mut Judged, other: Option<Ladder>) -> Result<()> {
        let Some(other) = other else { return Ok(()) };
        if let Some(other) = self.judged_if_closer(other, best)?
            && self.is_better(best, &other)?
        {
            *best = other;
        }
        Ok(())
    }

    /// Whether another climb has ended clearly better: it takes most of what the first one leaves, or it explains all
    /// and the first one does not.
    fn is_better(&self, one: &Judged, other: &Judged) -> Result<bool> {
        let explains = other.0.is_explained() && !one.0.is_explained();
        let falls = || self.audit.held_out_fall(&one.1, &other.1).map(|fall| fall > SMALLEST_FALL);
        Ok(self.suffices(&one.1, &other.1)? || (explains && falls()?))
    }

    /// Fits what a climb has found in the free run, and drops what does not earn its place there.
    fn judged(&self, ladder: Ladder) -> Result<Judged> {
        if ladder.found.is_empty() {
            return Ok((Ladder { free_run: Some(self.completeness(&self.free)), ..ladder }, self.free.clone()));
        }
        let all = self.fit_with_all(&ladder)?;
        self.narrowed(ladder, all)
    }

    /// The same of another search, unless it cannot win: its training error is a lower bound of its validation error.
    /// Where the validation error of the best one is within [`SMALLEST_FALL`] of that bound, the other one is given up.
    fn judged_if_closer(&self, other: Ladder, best: &Judged) -> Result<Option<Judged>> {
        if other.found.is_empty() {
            return self.judged(other).map(Some);
        }
        let all = self.fit_with_all(&other)?;
        let may_fall = self.error(&best.1)? - self.audit.log_error(&all);
        if may_fall < if all.ended { SMALLEST_FALL } else { 0.0 } {
            return Ok(None);
        }
        self.narrowed(other, all).map(Some)
    }

    /// All that a climb has found, fitted in the free run.
    fn fit_with_all(&self, ladder: &Ladder) -> Result<Fit> {
        let scales = self.free.space.scales(self.climb.experiments());
        self.audit.fit_with_effects(&ladder.fit.space, &self.free, &scales)
    }

    /// Drops what does not earn its place in a fit of the free run.
    fn narrowed(&self, mut ladder: Ladder, all: Fit) -> Result<Judged> {
        let mut kept = ladder.found.clone();
        let mut fit = self.audit.keep_earners(&self.free, all, &mut kept)?;
        self.climb.narrow(&mut ladder, self.base, &kept, &fit)?;
        ladder.free_run = Some(self.completeness(&fit));
        if !fit.ended && !ladder.is_explained() {
            fit = self.audit.finish_with(&fit, Effort::PATIENT)?;
            ladder.free_run = Some(self.completeness(&fit));
        }
        Ok((ladder, fit))
    }

    /// Completeness of the free run without and with effects.
    fn completeness(&self, fit: &Fit) -> (Completeness, Completeness) {
        match fit.space.effects() == self.free.space.effects() {
            true => self.audit.completeness_alone(fit),
            false => self.audit.completeness_of_both(&self.free, fit),
        }
    }

    /// Leaves of the rivals those that do as well in the place of what was found in the free run, too, now that all is
    /// there.
    fn confirm_rivals(&self, judged: &mut Judged) -> Result<()> {
        let (ladder, kept) = judged;
        let scales = kept.space.scales(self.climb.experiments());
        for (found, rivals) in ladder.found.iter().zip(&mut ladder.rivals) {
            rivals.retain(|id| !ladder.found.contains(id));
            let confirm = |rival: &EffectId| {
                self.climb.context().doing(rival.id());
                let swapped = self.audit.fit(&kept.space.without_effect(*found).with_effect(*rival, &scales))?;
                Ok((self.error(&swapped)? - self.error(kept)? < SAME_ERROR).then_some(*rival))
            };
            let confirmed: Vec<_> = rivals.par_iter().map(confirm).collect::<Result<_>>()?;
            *rivals = confirmed.into_iter().flatten().collect();
        }
        Ok(())
    }

    pub(super) fn error(&self, fit: &Fit) -> Result<f64> {
        Ok(self.audit.held_out(fit)?.log_error())
    }

    /// Climbs on from what is left, if anything is, of a climb that began with a wrong effect, which the free run has
    /// dropped.
    fn again(&self, ladder: &Ladder) -> Result<Option<Ladder>> {
        if !ladder.has_dropped() {
            return Ok(None);
        }
        let way = Way { fit: ladder.fit.clone(), found: ladder.found.clone(), steps: ladder.steps.clone() };
        let again = self.climb.climb_on(self.base, way)?;
        Ok((again.found != ladder.found).then_some(again))
    }

    /// Exchanges an effect for another one that was passed over, where the free run comes clearly closer by that: the
    /// first effects of several are chosen while the others are missing, and a later one may be named for what a wrong
    /// one of them leaves.
    fn exchanged(&self, judged: Judged) -> Result<Judged> {
        if !judged.0.may_have_chosen_too_early(&self.audit.over_floor(&judged.1, &judged.1)) {
            return Ok(judged);
        }
        for exchange in self.climb.exchanges(&judged.0)? {
            let Some(other) = self.climb.climb_away_from(&exchange, self.base, &judged.0)? else { continue };
            // Where the balances cannot tell, the free run may.
            let farther = self.climb.gain(&other.fit, &judged.0.fit)?;
            let leads_back = other.has_found_the_same_as(&judged.0) && farther > -SAME_ERROR;
            if leads_back || farther > SMALLEST_GAIN {
                continue;
            }
            let Some(other) = self.judged_if_closer(other, &judged)? else { continue };
            if other.0.is_explained() && self.audit.held_out_fall(&judged.1, &other.1)? > SMALLEST_FALL {
                return self.without_later_than(exchange.taken, other);
            }
        }
        Ok(judged)
    }

    /// Leaves out what was found beside the wrong effect that another one has taken the place of, where that alone does
    /// as well: from the free run of the model as it was, as the wrong one may have led into another valley.
    fn without_later_than(&self, taken: EffectId, judged: Judged) -> Result<Judged> {
        let place = |id: EffectId| judged.0.steps.iter().position(|step| step.winners.contains(&id));
        let mut kept = judged.0.found.clone();
        kept.retain(|id| place(*id) <= place(taken));
        if kept.len() == judged.0.found.len() {
            return Ok(judged);
        }
        let scales = self.free.space.scales(self.climb.experiments());
        let space = kept.iter().fold(self.free.space.clone(), |space, id| space.with_effect(*id, &scales));
        let fewer = self.audit.fit(&space)?;
        if self.audit.fall(&fewer, &judged.1) >= SMALLEST_GAIN {
            return Ok(judged);
        }
        let mut ladder = judged.0.clone();
        self.climb.narrow(&mut ladder, self.base, &kept, &fewer)?;
        ladder.free_run = Some(self.completeness(&fewer));
        Ok(if ladder.is_explained() { (ladder, fewer) } else { judged })
    }

    /// Climbs once more, from an effect whose loop the noise hides.
    fn by_loop(&self, ladder: &Ladder) -> Result<Option<Ladder>> {
        self.climb.climb_by_loop(self.base, ladder)
    }

    /// Climbs once more, by two effects at first.
    fn by_two(&self, ladder: &Ladder) -> Result<Option<Ladder>> {
        self.climb.climb_by_two(self.base, ladder)
    }
}
