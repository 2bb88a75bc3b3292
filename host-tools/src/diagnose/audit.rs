//! The effects found, looked at once more in the free run.
//!
//! Equation error is quick and slightly biased; the free run is the judge. All effects are refined together by output
//! error, and each has to earn its place there: how far would the error rise without it, with all other parameters free
//! to move?

use std::collections::BTreeMap;

use greyrig::effects::{Description, EffectId};
use greyrig::motor::BaseParameter;

use super::classes;
use super::completeness::{self, Completeness, Course, Floor, Moments};
use super::constancy::{self, Variation};
use super::criteria::SMALLEST_GAIN;
use super::screening::{self, Loops, Pair, Promise};
use crate::compare::PerSignal;
use crate::context::Context;
use crate::error::Result;
use crate::experiment::Experiment;
use crate::identify::cross_validation::{self, p_value};
use crate::identify::intervals_of_fit;
use crate::identify::minimise::{Effort, Fit, HeldOut, Residuals, have_rows, log_error, minimise, resume, rms_of};
use crate::identify::output_error::{OutputError, Rows};
use crate::identify::refitted::held_out_refitted;
use crate::identify::scales::Scales;
use crate::identify::space::{Key, Space};
use crate::repeats;

/// A little friction, relative to what motors have.
const SMALL: f64 = 1e-3;

/// An effect that earns less than this share of what all together earn may only be making up for the form of another
/// one.
const LEAST_SHARE: f64 = 0.03;

/// And one that may be the rest of another one's law ([`classes::rounds_off`]). Where the plant's Stribeck or
/// stray-load law differs from the catalogue's, the mismatch earns 5 to 9 % as a spurious quadratic load or windage
/// exponent; genuine ones earn 13 % and more. The threshold lies between (80 pairs and 4 motors).
pub const LEAST_SHARE_OF_A_LAW: f64 = 0.105;

/// Excess over what does not repeat, as a logarithm, of the current from which a fit is suspected of the wrong valley.
const STRUCTURE: f64 = 0.3;

/// Share of what the fit without effects exceeds it by, of the current, that a fit may leave without such a suspicion,
/// if it has ended. In 120 cases with two and one withheld effect on AC a second fit came to another end only where
/// that was 86 % or the first had not.
const MUCH: f64 = 0.5;

/// An estimate whose error exceeds that of a fit by more than this, sum of the logarithms of both signals, is not
/// finished.
const FAR_OFF: f64 = 1.0;

/// The free run of a set of recordings.
pub struct Audit<'a> {
    problem: OutputError<'a>,
    times: Vec<(usize, f64)>,
    blocks: Vec<usize>,
    period_s: f64,
    /// Time constant of the rotor, s.
    time_constant_s: f64,
    /// Recordings of the same excitation, two by two.
    repeats: Vec<[usize; 2]>,
    /// Of the fits.
    ctx: Context,
}

impl<'a> Audit<'a> {
    /// Prepares the recordings; `space` tells how many sub-steps they need and how slow the rotor is.
    ///
    /// # Errors
    /// Data without a single usable row.
    pub fn new(experiments: &'a [Experiment], space: &Space, ctx: &Context) -> Result<Self> {
        let substeps = |e: &Experiment| space.motor().ok().and_then(|m| e.substeps(&m).ok()).unwrap_or(1);
        let rows = experiments.iter().map(|e| Rows::new(e, substeps(e))).collect();
        let problem = OutputError::new(rows)?;
        let times = problem.times();
        let period_s = completeness::period_s(experiments);
        let time_constant_s = time_constant_s(&problem, space).max(period_s);
        let repeats = repeats::of_experiments(experiments);
        let (blocks, ctx) = (cross_validation::blocks(&times), ctx.quietly());
        Ok(Self { blocks, times, problem, period_s, time_constant_s, repeats, ctx })
    }

    /// Fits a model by output error.
    ///
    /// # Errors
    /// An interrupt.
    pub fn fit(&self, space: &Space) -> Result<Fit> {
        self.fit_with(space, Effort::USUAL)
    }

    /// The same with another effort.
    ///
    /// # Errors
    /// An interrupt.
    pub fn fit_with(&self, space: &Space, effort: Effort) -> Result<Fit> {
        minimise(space, &self.problem, effort, None, &self.ctx)
    }

    /// Goes on from a rough fit.
    ///
    /// # Errors
    /// An interrupt.
    pub fn finish(&self, rough: &Fit) -> Result<Fit> {
        self.finish_with(rough, Effort::USUAL)
    }

    /// The same with another effort.
    ///
    /// # Errors
    /// An interrupt.
    pub fn finish_with(&self, rough: &Fit, effort: Effort) -> Result<Fit> {
        resume(rough, &self.problem, effort, &self.ctx)
    }

    /// Fits a model with effects from where another search has ended. Where that leaves much structure in the current,
    /// or is no better than `base`, the fit without them, the start may lie in another valley: then once more from
    /// `base`, with the effects as they usually are.
    ///
    /// # Errors
    /// An interrupt.
    pub fn fit_with_effects(&self, space: &Space, base: &Fit, scales: &Scales) -> Result<Fit> {
        let fit = self.fit(space)?;
        let [left, was] = [&fit, base].map(|other| self.excess(other, &fit)[0]);
        let leaves_little = left < STRUCTURE || fit.ended && left < MUCH * was;
        if leaves_little && self.fall(base, &fit) > 0.0 {
            return Ok(fit);
        }
        let present = base.space.effects();
        let added = space.effects().iter().filter(|id| !present.contains(id));
        let usual = added.fold(base.space.clone(), |usual, id| usual.with_effect(*id, scales));
        let other = self.fit_with(&usual, Effort::ESTIMATE)?;
        if self.fall(&fit, &other) < -FAR_OFF {
            return Ok(fit);
        }
        let other = self.finish(&other)?;
        Ok(if self.fall(&fit, &other) > 0.0 { other } else { fit })
    }

    /// Drops effects that do not earn their place, the least one first; all of them, if the error hardly falls by all.
    /// `base` is the fit without any.
    ///
    /// # Errors
    /// An interrupt.
    pub fn keep_earners(&self, base: &Fit, fit: Fit, found: &mut Vec<EffectId>) -> Result<Fit> {
        if self.fall(base, &fit) < SMALLEST_GAIN {
            found.clear();
            return Ok(base.clone());
        }
        let mut fit = fit;
        let mut proved: Vec<EffectId> = Vec::new();
        loop {
            let all = self.fall(base, &fit);
            let worths = found.iter().filter(|id| !proved.contains(id)).map(|id| (*id, self.worth(&fit, *id)));
            let doubtful = worths.map(|(id, worth)| (id, worth, smallest_share(id, found, all)));
            let doubtful = doubtful.filter(|(id, worth, smallest)| worth < smallest || classes::bends_with(*id, found));
            let least = doubtful.min_by(|a, b| a.1.total_cmp(&b.1));
            let Some((id, _, smallest)) = least else { return Ok(fit) };
            // Over a long way the others only seem to be able to take its part.
            let without = self.fit(&fit.space.without_effect(id))?;
            if self.fall(&without, &fit) < smallest {
                found.retain(|other| *other != id);
                fit = without;
            } else {
                proved.push(id);
            }
        }
    }

    /// By how much the error of a fit would rise without one of its effects: by linearisation; 0 where that says more
    /// than the error rises by with all other parameters as they are, which it cannot.
    fn worth(&self, fit: &Fit, id: EffectId) -> f64 {
        let worth = screening::worth(fit, self.problem.groups(), id);
        let without = self.error_at(&fit.space.without_effect(id));
        let most = log_error(without, self.has()) - self.log_error(fit);
        if worth > most { 0.0 } else { worth }
    }

    /// Tries candidates at a fit by linearisation of the free run, most promising first.
    pub fn screen(&self, fit: &Fit, scales: &Scales, candidates: &[&'static Description]) -> Vec<Promise> {
        screening::screen(fit, &self.problem, scales, candidates, Loops::AsTheyAre)
    }

    /// Tries the candidates of a screening two at a time, most promising first.
    pub fn pairs(&self, fit: &Fit, scales: &Scales, promises: &[Promise]) -> Vec<Pair> {
        screening::pairs(fit, &self.problem, scales, promises)
    }

    /// By how much a fit's error exceeds what does not repeat in another fit's: logarithms, of current and speed.
    pub fn excess(&self, fit: &Fit, best: &Fit) -> [f64; 2] {
        let over = self.over_floor(fit, best);
        [over.electrical.ln(), over.mechanical.ln()]
    }

    /// A fit's error over what does not repeat in another fit's.
    pub fn over_floor(&self, fit: &Fit, best: &Fit) -> Completeness {
        Completeness::of(fit, &self.floor(best))
    }

    /// The error of a fit without and one with effects over what does not repeat, to which belongs what turbulence
    /// makes of the current by way of the speed.
    pub fn completeness_of_both(&self, without: &Fit, with: &Fit) -> (Completeness, Completeness) {
        self.completeness_with(self.floor(with), without, with)
    }

    /// The same of a model beside which nothing was found, to acquit it.
    pub fn completeness_alone(&self, fit: &Fit) -> (Completeness, Completeness) {
        self.completeness_with(self.floor_with(fit, Moments::Rare), fit, fit)
    }

    fn completeness_with(&self, floor: Floor, without: &Fit, with: &Fit) -> (Completeness, Completeness) {
        // Not where something is looked for: weak friction moves the speed as slowly as turbulence does.
        let passed_on = self.problem.through_the_speed(with);
        let floor = floor.with_turbulence_passed_on(with, &self.problem, &passed_on, &self.course());
        (Completeness::of(without, &floor), Completeness::of(with, &floor))
    }

    /// How the speed of a fit wanders: [`completeness::wandering`].
    pub fn wandering(&self, fit: &Fit) -> f64 {
        completeness::wandering(fit, &self.problem, &self.course())
    }

    /// How much of a fit's error of the speed comes back in recordings of the same excitation:
    /// [`completeness::comes_back`].
    pub fn comes_back(&self, fit: &Fit) -> Option<f64> {
        completeness::comes_back(fit, &self.problem, &self.course())
    }

    fn floor(&self, best: &Fit) -> Floor {
        self.floor_with(best, Moments::OfTurbulence)
    }

    fn floor_with(&self, best: &Fit, moments: Moments) -> Floor {
        Floor::of_free_run(best, &self.problem, &self.course(), self.time_constant_s, moments)
    }

    fn course(&self) -> Course<'_> {
        Course { times: &self.times, period_s: self.period_s, repeats: &self.repeats }
    }

    /// Logarithm of the error at given parameters: [`log_error`].
    pub fn log_error_at(&self, space: &Space) -> f64 {
        log_error(self.error_at(space), self.has())
    }

    /// Logarithm of a fit's error: [`log_error`].
    pub fn log_error(&self, fit: &Fit) -> f64 {
        fit.log_error(self.problem.groups())
    }

    /// Fall of the error from one fit to another: sum of the logarithms of both signals' RMS.
    pub fn fall(&self, before: &Fit, after: &Fit) -> f64 {
        self.log_error(before) - self.log_error(after)
    }

    /// Fall of the error on blocks of time held out, from one fit to another: sum of the logarithms of both signals.
    ///
    /// # Errors
    /// An interrupt.
    pub fn held_out_fall(&self, before: &Fit, after: &Fit) -> Result<f64> {
        Ok(self.held_out(before)?.fall_to(self.held_out(after)?))
    }

    /// The errors of a fit on blocks of time held out.
    ///
    /// # Errors
    /// An interrupt.
    pub fn held_out<'f>(&self, fit: &'f Fit) -> Result<&'f HeldOut> {
        fit.held_out(|fit| held_out_refitted(fit, &self.problem, &self.blocks, &self.ctx))
    }

    /// p-value of what a fit gains on another one by `parameters` more.
    ///
    /// # Errors
    /// An interrupt.
    pub fn p_value(&self, before: &Fit, after: &Fit, parameters: usize) -> Result<f64> {
        Ok(p_value(self.held_out(before)?, self.held_out(after)?, after, self.problem.groups(), parameters))
    }

    /// 95 % intervals of the free parameters of a fit.
    pub fn intervals(&self, fit: &Fit) -> BTreeMap<Key, [f64; 2]> {
        intervals_of_fit(&self.problem, fit)
    }

    /// A parameter that changes in time in what a fit leaves over.
    pub fn changes(&self, fit: &Fit) -> Option<Variation> {
        let floor = self.floor_with(fit, Moments::Rare);
        constancy::find_in_free_run(fit, self.problem.groups(), &self.times, &self.blocks, &floor)
    }

    /// Whether a parameter that varies in the balances does so in a fit of the free run.
    pub fn shows(&self, varies: &Variation, fit: &Fit) -> bool {
        varies.shows_in(fit, self.problem.groups(), &self.times, &self.blocks)
    }

    /// RMS of the free run's error at given parameters: current, A, and speed, rad/s.
    pub fn error_at(&self, space: &Space) -> [f64; 2] {
        let residuals = self.problem.at(space, &space.coordinates());
        rms_of(&residuals, self.problem.groups())
    }

    /// Error-to-signal ratios of RMS errors of current, A, and speed, rad/s.
    pub fn ratio(&self, rms: [f64; 2]) -> PerSignal {
        let (signal, has) = (self.signals(), self.has());
        let of = |g: usize| (has[g] && signal[g] > 0.0).then(|| rms[g] / signal[g]).filter(|r| r.is_finite());
        PerSignal { current: of(0), speed: of(1), torque: None }
    }

    /// RMS of the measured current and speed.
    pub fn signals(&self) -> [f64; 2] {
        self.problem.sizes()
    }

    /// Whether there are rows of the current and of the speed.
    pub fn has(&self) -> [bool; 2] {
        have_rows(self.problem.groups())
    }
}

/// What an effect has to earn beside the others that were `found`, of what `all` together earn.
fn smallest_share(id: EffectId, found: &[EffectId], all: f64) -> f64 {
    let share = if classes::rounds_off(id, found) { LEAST_SHARE_OF_A_LAW } else { LEAST_SHARE };
    SMALLEST_GAIN.max(share * all)
}

/// Time constant of the rotor, s: its inertia times the speed that a little more viscous friction takes away, over the
/// torque of that friction. Fast motion, where the load fluctuates most, counts most.
fn time_constant_s(problem: &OutputError<'_>, space: &Space) -> f64 {
    let at = |space: &Space| problem.at(space, &space.coordinates());
    let mut braked = space.clone();
    let Some(friction) = braked.get_mut(BaseParameter::Mu1) else { return 0.0 };
    let more = SMALL * friction.scale;
    friction.value += more;
    let slower = rms_of(&(at(&braked) - at(space)), problem.groups())[1];
    space.value(BaseParameter::J) * slower / (more * problem.sizes()[1])
}
