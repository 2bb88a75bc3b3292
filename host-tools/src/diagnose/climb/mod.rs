//! Effects found one after the other, each judged on data held out, with a look back at every step.

mod fits;
mod revision;
mod step;

use std::collections::BTreeMap;
use std::sync::Arc;

use greyrig::effects::{Description, EffectId};
use greyrig::motor::BaseParameter;
use rayon::prelude::*;

use super::Ranked;
use super::classes;
use super::completeness::{self, Completeness, Course, Floor};
use super::constancy::{self, Variation};
use super::criteria::SMALLEST_GAIN;
use super::fluctuation::{self, Fluctuation};
use super::ladder::{Ladder, Step, Tried, left_out};
use super::lead::{self, Lead};
use super::screening::{self, Loops, Pair, Promise};
use super::shape::{self, Shape};
use crate::context::Context;
use crate::error::Result;
use crate::experiment::Experiment;
use crate::identify::cross_validation::{self, held_out, p_value};
use crate::identify::equation_error::{Balance, EquationError};
use crate::identify::intervals_of;
use crate::identify::minimise::{CARRIED_ON, Effort, Fit, HeldOut, Residuals, minimise, minimise_beside, resume};
use crate::identify::refitted::held_out_refitted;
use crate::identify::space::{Key, Space};
use crate::model::Assignment;
use crate::repeats;
use step::{SHOWN, winner};

/// Pairs that are fitted where one effect at a time leaves structure.
const PAIRS: usize = 4;
/// How hard a model is fitted before candidates are tried on it.
const THOROUGH: Effort = Effort { steps: 24, tolerance: 1e-4, carried_on: CARRIED_ON, confirmed: true };

/// How far a climb has come.
pub struct Way {
    /// The fit of the balances.
    pub fit: Fit,
    /// The effects that it holds beside those of the base.
    pub found: Vec<EffectId>,
    /// The steps so far.
    pub steps: Vec<Step>,
}

/// The data and the settings of a climb.
pub struct Climb<'a> {
    experiments: &'a [Experiment],
    problem: EquationError<'a>,
    blocks: Vec<usize>,
    period_s: f64,
    /// Recordings of the same excitation, two by two.
    repeats: Vec<[usize; 2]>,
    candidates: Vec<&'static Description>,
    most: usize,
    ctx: Context,
    /// Of the fits, of which nobody is told.
    fits: Context,
    ranked: &'a Ranked<'a>,
}

impl<'a> Climb<'a> {
    /// `candidates` are tried at each step, `most` effects are added at most. `None` if no balance can be formed.
    pub fn new(
        experiments: &'a [Experiment],
        candidates: Vec<&'static Description>,
        most: usize,
        ctx: &Context,
    ) -> Option<Self> {
        let problem = EquationError::new(experiments)?;
        let blocks = cross_validation::blocks(problem.times());
        let period_s = completeness::period_s(experiments);
        let repeats = repeats::of_experiments(experiments);
        let (ctx, fits, ranked) = (ctx.clone(), ctx.quietly(), &|_: &[_]| ());
        Some(Self { experiments, problem, blocks, period_s, repeats, candidates, most, ctx, fits, ranked })
    }

    /// The same, with somebody who is told how each screening ranks the candidates.
    #[must_use]
    pub fn ranked_to(self, ranked: &'a Ranked<'a>) -> Self {
        Self { ranked, ..self }
    }

    /// Whom the work is done for.
    pub fn context(&self) -> &Context {
        &self.ctx
    }

    /// Fits a model as it is.
    ///
    /// # Errors
    /// An interrupt.
    pub fn fit(&self, space: &Space) -> Result<Fit> {
        self.fit_from(None, space, THOROUGH)
    }

    /// The same from the values that a model has, too, where it has effects; the better end counts.
    ///
    /// # Errors
    /// An interrupt.
    pub fn fit_from_what_is_known(&self, space: &Space, known: &[Assignment]) -> Result<Fit> {
        let Some(known) = space.started_at(known) else { return self.fit(space) };
        let (usual, from_known) = rayon::join(|| self.fit(space), || self.fit(&known));
        let (usual, from_known) = (usual?, from_known?);
        Ok(if self.error(&from_known) < self.error(&usual) { from_known } else { usual })
    }

    /// Fits a model, from the weights that another fit has ended on.
    fn fit_from(&self, weights: Option<[f64; 2]>, space: &Space, effort: Effort) -> Result<Fit> {
        minimise(space, &self.problem, effort, weights, &self.fits)
    }

    /// Fits a model that is that of a fit and a few parameters more.
    fn fit_beside(&self, fit: &Fit, space: &Space, effort: Effort) -> Result<Fit> {
        minimise_beside(fit, space, &self.problem, effort, &self.fits)
    }

    /// Goes on from where a fit has ended.
    fn go_on(&self, fit: &Fit, effort: Effort) -> Result<Fit> {
        resume(fit, &self.problem, effort, &self.fits)
    }

    /// Screens the candidates at the fit of a model, but for some: a first ranking.
    fn screen(&self, fit: &Fit, left_out: &[EffectId]) -> Vec<Promise> {
        let scales = fit.space.scales(self.experiments);
        screening::screen(fit, &self.problem, &scales, &self.candidates_beside(&fit.space, left_out), Loops::AsTheyAre)
    }

    /// The candidates that a model does not have yet, but for some.
    pub fn candidates_beside(&self, space: &Space, left_out: &[EffectId]) -> Vec<&'static Description> {
        // A second member of a class would only lend the first one another form.
        let present = |d: &&Description| space.effects().iter().any(|id| classes::same(space.kind(), *id, d.id));
        // What the base model has by another name differs from it by rounding alone, of which two at a time make
        // something.
        let in_base =
            |d: &&Description| d.stands_for.is_some_and(|term| space.free().any(|entry| entry.key == Key::Base(term)));
        let candidates = self.candidates.iter().copied();
        candidates.filter(|d| !present(d) && !in_base(d) && !left_out.contains(&d.id)).collect()
    }

    /// One step from a fitted model: all candidates, and the one that would be added.
    ///
    /// # Errors
    /// An interrupt.
    pub fn first_step(&self, fit: &Fit) -> Result<Step> {
        let mut step = self.step(fit, &[], 0.0, SHOWN)?;
        step.winners = winner(&step.tried).map(|t| t.id).into_iter().collect();
        Ok(step)
    }

    /// Climbs from a fitted model; its first step may be known already.
    ///
    /// # Errors
    /// An interrupt.
    pub fn climb(&self, base: &Fit, first: Option<Step>) -> Result<Ladder> {
        let mut way = Way { fit: base.clone(), found: Vec::new(), steps: Vec::new() };
        if let Some(step) = first
            && self.most > 0
            && self.take(step, &mut way)?.is_none()
        {
            return self.ended(base, way);
        }
        self.climb_on(base, way)
    }

    /// Climbs on from where earlier steps have led, without what has been dropped since.
    pub(super) fn climb_on(&self, base: &Fit, mut way: Way) -> Result<Ladder> {
        while self.add_the_next(base, &mut way)?.is_some() {}
        self.ended(base, way)
    }

    /// Adds the effect of the next step to what a climb has found, and tells it; none, if nothing is left to add.
    fn add_the_next(&self, base: &Fit, way: &mut Way) -> Result<Option<EffectId>> {
        if way.found.len() >= self.most {
            return Ok(None);
        }
        let Way { fit, found, steps } = &*way;
        let left_out = left_out(base.space.kind(), steps, found);
        let gained = self.gain(base, fit)?;
        let shown = if steps.is_empty() { SHOWN } else { 0 };
        let step = self.step(fit, &left_out, gained, shown)?;
        self.take(step, way)
    }

    /// Takes the best of a step, if it is good enough.
    fn take(&self, mut step: Step, way: &mut Way) -> Result<Option<EffectId>> {
        let Way { fit, found, steps } = way;
        let winner = winner(&step.tried).map(|t| (t.id, Arc::clone(&t.fit)));
        step.winners = winner.iter().map(|w| w.0).collect();
        steps.push(step);
        let Some((id, next)) = winner else { return Ok(None) };
        found.push(id);
        // To its end, or the next candidates would be praised for what more steps alone bring.
        *fit = self.go_on(&next, THOROUGH)?;
        if found.len() > 1 {
            self.better_forms(fit, found, steps)?;
        }
        Ok(Some(id))
    }

    /// Looks back at the end of a climb.
    fn ended(&self, base: &Fit, way: Way) -> Result<Ladder> {
        let Way { mut fit, mut found, mut steps } = way;
        self.look_back(&mut fit, &mut found)?;
        self.one_for_two(&mut fit, &mut found, &mut steps)?;
        let floor = if self.problem.is_of_whole_motor() { self.floor(&fit) } else { Floor::UNKNOWN };
        let (before, after) = (Completeness::of(base, &floor), Completeness::of(&fit, &floor));
        Ok(Ladder { steps, found, rivals: Vec::new(), fit, before, after, floor, free_run: None })
    }

    /// Climbs on from an effect with memory that promises most, but nothing at a small size, as hysteresis does where
    /// the noise of a direct current turns it round within a small loop; if it lowers the error more than an earlier
    /// climb has done, which has not come by it.
    ///
    /// # Errors
    /// An interrupt.
    pub fn climb_by_loop(&self, base: &Fit, earlier: &Ladder) -> Result<Option<Ladder>> {
        let scales = base.space.scales(self.experiments);
        let candidates = self.candidates_beside(&base.space, &[]);
        let promises = screening::screen(base, &self.problem, &scales, &candidates, Loops::HiddenByNoise);
        let hidden = |p: &&Promise| {
            let promised = earlier.steps.first().is_some_and(|s| s.promises.iter().any(|(id, _)| *id == p.id));
            !promised && !earlier.has_added(p.id)
        };
        let Some(first) = promises.first().filter(hidden) else { return Ok(None) };
        self.ctx.doing(first.id.id());
        let begun = self.fit_beside(base, &first.space, Effort::USUAL)?;
        if self.held_out(&begun)?.log_error() >= self.held_out(&earlier.fit)?.log_error() {
            return Ok(None);
        }
        self.climb_from(base, begun, vec![first.id], &promises).map(Some)
    }

    /// Tries the candidates two at a time at the fit of a model, and climbs on from the two that lower the error most,
    /// if they lower it more than an earlier climb has done, which has not come by them both.
    ///
    /// # Errors
    /// An interrupt.
    pub fn climb_by_two(&self, base: &Fit, earlier: &Ladder) -> Result<Option<Ladder>> {
        let promises = self.screen(base, &[]);
        let scales = base.space.scales(self.experiments);
        let mut pairs = screening::pairs(base, &self.problem, &scales, &promises);
        pairs.truncate(PAIRS);
        let begin = |pair: Pair| {
            self.ctx.doing(pair.ids[0].id());
            let fit = self.fit_beside(base, &pair.space, Effort::USUAL)?;
            Ok((self.held_out(&fit)?.log_error(), pair.ids, fit))
        };
        let begun: Vec<_> = pairs.into_par_iter().map(begin).collect::<Result<_>>()?;
        let best = begun.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let error = self.held_out(&earlier.fit)?.log_error();
        let Some((_, winners, fit)) = best.filter(|best| best.0 < error) else { return Ok(None) };
        if winners.iter().all(|id| earlier.has_added(*id)) {
            return Ok(None);
        }
        self.climb_from(base, fit, winners.to_vec(), &promises).map(Some)
    }

    /// Climbs on from a fit with one effect or two, as the first step.
    fn climb_from(&self, base: &Fit, begun: Fit, winners: Vec<EffectId>, promises: &[Promise]) -> Result<Ladder> {
        let gain = self.gain(base, &begun)?;
        let parameters = begun.space.free().count() - base.space.free().count();
        let p = p_value(self.held_out(base)?, self.held_out(&begun)?, &begun, self.problem.groups(), parameters);
        let tries = self.candidates.len().pow(winners.len() as u32) as f64;
        let begun = Arc::new(begun);
        let tried = |id: &EffectId| Tried {
            id: *id,
            fit: Arc::clone(&begun),
            gain,
            p_value: (p * tries).min(1.0),
            objection: None,
        };
        let step = Step {
            promises: promises.iter().map(|p| (p.id, p.gain)).collect(),
            tried: winners.iter().map(tried).collect(),
            winners: winners.clone(),
            together: winners.len() > 1,
            in_free_run: false,
            as_well: Vec::new(),
            decoy_gain: 0.0,
            decoys: [0, 0],
        };
        let fit = self.go_on(&begun, THOROUGH)?;
        self.climb_on(base, Way { fit, found: winners, steps: vec![step] })
    }

    /// Leaves of what was found what the free run has kept, and fits the balances anew to that, from where they were
    /// and from where the free run's fit `free` has ended: one of the two may lie in a wrong valley. The floor stays
    /// that of the fit with more effects, but for the inertia, which a wrong effect can take along, and with it the
    /// noise of the torque; it is found anew where the same was recorded twice. `base` is the fit without any effects.
    ///
    /// # Errors
    /// An interrupt.
    pub fn narrow(&self, ladder: &mut Ladder, base: &Fit, kept: &[EffectId], free: &Fit) -> Result<()> {
        let inertia = ladder.fit.space.value(BaseParameter::J);
        let dropped: Vec<_> = ladder.found.iter().filter(|id| !kept.contains(id)).collect();
        let space = dropped.iter().fold(ladder.fit.space.clone(), |space, id| space.without_effect(**id));
        let fitted = |space: &Space| self.fit_from(Some(ladder.fit.rms), space, Effort::USUAL);
        let present = || match space.effects() == free.space.effects() {
            true if dropped.is_empty() => Ok(Some(ladder.fit.clone())),
            true => fitted(&space).map(Some),
            false => Ok(None),
        };
        let (fit, other) = rayon::join(|| fitted(&free.space), present);
        let (fit, other) = (fit?, other?);
        ladder.fit = match other {
            Some(other) if self.error(&other) <= self.error(&fit) => other,
            _ => fit,
        };
        ladder.found = kept.to_vec();
        ladder.floor = match self.repeats.is_empty() {
            true if self.problem.is_of_slow_samples() => ladder.floor,
            true => ladder.floor.with_inertia(ladder.fit.space.value(BaseParameter::J) / inertia),
            false => self.floor(&ladder.fit),
        };
        ladder.before = Completeness::of(base, &ladder.floor);
        ladder.after = Completeness::of(&ladder.fit, &ladder.floor);
        Ok(())
    }

    /// The recordings.
    pub fn experiments(&self) -> &[Experiment] {
        self.experiments
    }

    /// The balance of each row.
    pub fn groups(&self) -> &[u8] {
        self.problem.groups()
    }

    /// Whether the recordings hold voltage, current and speed.
    pub fn is_of_whole_motor(&self) -> bool {
        self.problem.is_of_whole_motor()
    }

    /// Share of an effect's column that the other parameters do not explain.
    pub fn independence(&self, fit: &Fit, d: &Description) -> Option<f64> {
        screening::independence(fit, &self.problem, &fit.space.scales(self.experiments), d)
    }

    /// What generic terms make of what a fit leaves over.
    pub fn lead(&self, fit: &Fit) -> Lead {
        lead::find(fit, &self.problem, &self.blocks)
    }

    /// A parameter that varies in what a fit leaves over; a decoy gains what it did in the last step.
    pub fn varies(&self, fit: &Fit, ladder: &Ladder) -> Option<Variation> {
        let decoy_gain = ladder.steps.last().map_or(0.0, |step| step.decoy_gain);
        let whole = self.is_of_whole_motor();
        whole.then(|| constancy::find(fit, &self.problem, &self.blocks, &ladder.floor, decoy_gain)).flatten()
    }

    /// A change in time of the model as it was, with which it comes closer on data held out than by all that was found:
    /// the effects are surrogates for it then.
    ///
    /// # Errors
    /// An interrupt.
    pub fn changes_instead(&self, base: &Fit, ladder: &Ladder) -> Result<Option<Variation>> {
        if ladder.found.is_empty() {
            return Ok(None);
        }
        let found = self.log_error_held_out(&ladder.fit)?;
        let change = self.varies(base, ladder).filter(|varies| varies.of_law().is_none());
        Ok(change.filter(|change| change.log_error + SMALLEST_GAIN < found))
    }

    /// The shape of what a fit leaves over, in the balance that lacks more.
    pub fn shape(&self, fit: &Fit, floor: &Floor) -> Option<Shape> {
        let left = Completeness::of(fit, floor);
        let balance = if left.electrical > left.mechanical { Balance::Voltage } else { Balance::Torque };
        shape::of(fit, &self.problem, balance)
    }

    /// What a fit leaves over in the torque balance, if it is a load that fluctuates.
    pub fn fluctuation(&self, fit: &Fit) -> Option<Fluctuation> {
        fluctuation::of(fit, &self.problem)
    }

    /// 95 % intervals of the parameters of a fit by equation error, from its blocks.
    pub fn intervals(&self, fit: &Fit) -> BTreeMap<Key, [f64; 2]> {
        intervals_of(fit, &self.blocks)
    }

    /// What does not repeat.
    fn floor(&self, fit: &Fit) -> Floor {
        let course = Course { times: self.problem.times(), period_s: self.period_s, repeats: &self.repeats };
        Floor::of_balances(fit, &self.problem, &course)
    }

    /// The logarithm of a fit's error on the data that it was fitted to.
    fn error(&self, fit: &Fit) -> f64 {
        fit.log_error(self.problem.groups())
    }

    /// Whether a block may reach far beyond all others, which tell of it all the same. Without a current a step does
    /// so, but of that the others tell next to nothing.
    fn may_hold_an_inrush(&self) -> bool {
        self.is_of_whole_motor()
    }

    /// Fall of the error on data held out from one fit to another, sum of the logarithms of both balances.
    ///
    /// # Errors
    /// An interrupt.
    pub fn gain(&self, before: &Fit, fit: &Fit) -> Result<f64> {
        Ok(self.held_out(before)?.fall_to(self.held_out(fit)?))
    }

    /// The logarithm of a fit's error on data held out.
    ///
    /// # Errors
    /// An interrupt.
    pub fn log_error_held_out(&self, fit: &Fit) -> Result<f64> {
        Ok(self.held_out(fit)?.log_error())
    }

    /// The errors of a fit on data held out.
    ///
    /// # Errors
    /// An interrupt.
    pub fn held_out<'f>(&self, fit: &'f Fit) -> Result<&'f HeldOut> {
        fit.held_out(|fit| match self.may_hold_an_inrush() {
            true => held_out_refitted(fit, &self.problem, &self.blocks, &self.fits),
            false => Ok(held_out(fit, self.problem.groups(), &self.blocks)),
        })
    }
}
