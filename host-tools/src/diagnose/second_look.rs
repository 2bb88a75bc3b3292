//! What a climb can miss, looked for once more with the free run as the judge.
//!
//! A climb adds one effect at a time by the balances of voltage and torque. Two effects whose contributions cancel gain
//! nothing one at a time; the fit of one of them may end in a wrong valley without the other; and what acts at low speed
//! only, such as weak Stribeck friction, drowns in the noise of the acceleration, while the free run adds it up. And where
//! several are missing, the one that gains most at first may be none of them.
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
        let mut best = self.with_singles(judged, progress)?;
        for look in [Self::again, Self::by_two] {
            if best.0.is_explained() {
                break;
            }
            if let Some(other) = look(self, &best.0, progress)? {
                let other = self.judged(other)?;
                if self.suffices(&best.1, &other.1) {
                    best = other;
                }
            }
        }
        Ok(best)
    }

    /// Fits what a climb has found in the free run, and drops what does not earn its place there.
    fn judged(&self, mut ladder: Ladder) -> Result<Judged> {
        let fit = if ladder.found.is_empty() {
            self.free.clone()
        } else {
            let found = ladder.found.clone();
            let scales = Scales::of(&self.free.space, self.climb.experiments());
            let all = self.audit.fit_with_effects(&ladder.fit.space, &self.free, &scales)?;
            let fit = self.audit.keep_earners(&self.free, all, &mut ladder.found)?;
            if found != ladder.found {
                self.climb.narrow(&mut ladder, &found)?;
            }
            fit
        };
        ladder.free_run = Some(self.audit.completeness_of_both(&self.free, &fit));
        Ok((ladder, fit))
    }

    /// Adds what the last step of a climb tried and did not count, where the free run needs it.
    fn with_singles(&self, judged: Judged, progress: &mut dyn FnMut(Progress<'_>)) -> Result<Judged> {
        let (mut ladder, mut kept) = judged;
        for _ in 0..ADDED {
            let left = self.audit.excess(&kept, &kept).iter().sum::<f64>();
            let Some(last) = ladder.steps.last().filter(|_| left > WORTH_LOOKING) else { break };
            let error = |space: &Space| self.audit.error_at(space).map(f64::ln).iter().sum::<f64>();
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
                let scales = Scales::of(&kept.space, self.climb.experiments());
                let mut space = kept.space.with_effect(tried.id, &scales);
                space.start_from(&tried.fit.space, tried.id);
                let fit = self.audit.fit_with(&space, Effort::ROUGH)?;
                if best.as_ref().is_none_or(|(_, b)| self.audit.held_out_fall(b, &fit) > 0.0) {
                    best = Some((tried.id, fit));
                }
            }
            let Some((id, fit)) = best else { break };
            let fit = self.audit.fit(&fit.space)?;
            if !self.suffices(&kept, &fit) {
                break;
            }
            self.climb.accept(&mut ladder, id, &fit.space, self.audit.held_out_fall(&kept, &fit))?;
            kept = fit;
            ladder.free_run = Some(self.audit.completeness_of_both(&self.free, &kept));
        }
        Ok((ladder, kept))
    }

    /// Climbs on from what is left of a climb that began with a wrong effect, which the free run has dropped.
    fn again(&self, ladder: &Ladder, progress: &mut dyn FnMut(Progress<'_>)) -> Result<Option<Ladder>> {
        if !ladder.has_dropped() || ladder.found.is_empty() {
            return Ok(None);
        }
        let (fit, found, steps) = (ladder.fit.clone(), ladder.found.clone(), ladder.steps.clone());
        self.climb.climb_on(self.base, fit, found, steps, progress).map(Some)
    }

    /// Climbs once more, by two effects at first.
    fn by_two(&self, _: &Ladder, progress: &mut dyn FnMut(Progress<'_>)) -> Result<Option<Ladder>> {
        self.climb.climb_by_two(self.base, progress)
    }

    /// Whether a fit takes most of what an earlier one exceeds the floor by, on data held out too.
    fn suffices(&self, before: &Refined, after: &Refined) -> bool {
        let (over, left) = (self.audit.excess(before, after), self.audit.excess(after, after));
        let gains_more = if over[0] - left[0] > over[1] - left[1] { 0 } else { 1 };
        left[gains_more] < LEFT * over[gains_more] && self.audit.held_out_fall(before, after) > SMALLEST_FALL
    }
}
