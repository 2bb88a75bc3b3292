//! Effects found one after the other, each judged on data held out, with a look back at every step.

use std::collections::BTreeMap;

use greyrig::effects::Description;

use super::Progress;
use super::blocks::{self, HeldOut, held_out, p_value};
use super::classes;
use super::completeness::{Completeness, Floor};
use super::decoys;
use super::lead::{self, Lead};
use super::screening::{self, Promise};
use super::shape::{self, Shape};
use crate::error::Result;
use crate::experiment::Experiment;
use crate::identify::equation_error::{Balance, EquationError};
use crate::identify::intervals_of;
use crate::identify::minimise::{CARRIED_ON, Effort, Refined, Residuals, minimise};
use crate::identify::scales::Scales;
use crate::identify::space::Space;
use crate::output;

/// Candidates that are fitted after the screening.
const FITTED: usize = 7;
/// A candidate that promises less than this share of the best one's is not fitted.
const WORTH_FITTING: f64 = 0.03;
/// Smallest fall of the held-out error, sum of the logarithms of both balances.
pub const SMALLEST_GAIN: f64 = 0.1;
/// Largest p-value, over the number of candidates tried. Strict, because turbulence of the load is not quite white and the
/// blocks are not quite alike: at 1 % one healthy motor in twenty would be accused.
const SIGNIFICANCE: f64 = 1e-4;
/// Where the error falls to a third the usual level will do: the rows are few then because one structure fills them all.
const CONVENTIONAL: f64 = 0.01;
/// An effect has to beat the best decoy's gain by this factor.
const OVER_DECOYS: f64 = 2.0;
/// R and K that an effect changes by more than this factor are no longer those of the same motor.
const LARGEST_SHIFT: f64 = 3.0;
/// A gain (error down to a third in one balance) that neither of these two objections can undo, and that needs less proof.
const BEYOND_DOUBT: f64 = 1.0;
/// Least part of a candidate's column that has to be its own.
pub const LEAST_INDEPENDENT: f64 = 0.01;
/// Held-out errors within this of each other are the same.
pub const SAME_ERROR: f64 = 0.04;
/// Pairs that are fitted where one effect at a time leaves structure.
const PAIRS: usize = 4;
/// A rival that gains less than this share of the winner's gain is none.
const RIVAL_SHARE: f64 = 0.5;
/// An effect that gains less than this share of what all together gain may only be making up for the form of another one.
const SMALLEST_SHARE: f64 = 0.02;
/// How hard a model is fitted before candidates are tried on it.
const THOROUGH: Effort = Effort { steps: 24, tolerance: 1e-4, carried_on: CARRIED_ON };
/// How hard each candidate is fitted at first.
const BEGINNING: Effort = Effort { steps: 4, tolerance: 1e-2, carried_on: CARRIED_ON };
/// A candidate that then gains less than this share of what the best one gains is not fitted any further.
const WORTH_FINISHING: f64 = 0.3;
/// How hard the others are.
const EFFORT: Effort = Effort { steps: 12, tolerance: 1e-3, carried_on: CARRIED_ON };

/// Why a candidate does not count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Objection {
    /// The held-out error hardly falls.
    TooSmall,
    /// Its size is not significantly different from zero, or decoys do as well.
    NotSignificant,
    /// It makes R or K those of another motor.
    Implausible,
    /// Its column is that of the supply or of the base parameters.
    NotIndependent,
}

impl Objection {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::TooSmall => "error hardly falls",
            Self::NotSignificant => "not significant, or no better than a decoy",
            Self::Implausible => "R or K would be those of another motor",
            Self::NotIndependent => "looks like the supply or the base model here",
        }
    }

    /// Whether it is that too little is gained.
    pub fn is_of_size(self) -> bool {
        matches!(self, Self::TooSmall | Self::NotSignificant)
    }
}

/// A candidate that was fitted.
#[derive(Debug, Clone)]
pub struct Tried {
    /// The effect.
    pub id: &'static str,
    /// The model with it.
    pub fit: Refined,
    /// Its errors on data held out.
    pub held_out: HeldOut,
    /// Fall of the held-out error, sum of the logarithms of both balances.
    pub gain: f64,
    /// p-value of its size, corrected for the number of candidates.
    pub p_value: f64,
    /// Why it does not count, if it does not.
    pub objection: Option<Objection>,
}

/// One step: all candidates at one model.
#[derive(Debug, Clone)]
pub struct Step {
    /// Screening of all candidates, most promising first.
    pub promises: Vec<(&'static str, f64)>,
    /// Those that were fitted, best first.
    pub tried: Vec<Tried>,
    /// Those that were added.
    pub winners: Vec<&'static str>,
    /// Whether these were tried together only.
    pub together: bool,
    /// Best gain of a decoy.
    pub decoy_gain: f64,
    /// Decoys tried, and how many of them gain enough, significantly, to be accepted if they were effects.
    pub decoys: [usize; 2],
}

/// The way from the model to what explains the data.
#[derive(Debug, Clone)]
pub struct Ladder {
    /// Steps, the last of which found nothing.
    pub steps: Vec<Step>,
    /// The effects that stay, in the order in which they should be added.
    pub found: Vec<&'static str>,
    /// For each of them, effects that would do as well in its place and are no class with it.
    pub rivals: Vec<Vec<&'static str>>,
    /// The fit with all of them.
    pub fit: Refined,
    /// Completeness at the beginning.
    pub before: Completeness,
    /// And at the end.
    pub after: Completeness,
    /// What does not repeat.
    pub floor: Floor,
    /// Completeness of the free run without and with what was found, where there is one.
    pub free_run: Option<(Completeness, Completeness)>,
}

impl Ladder {
    /// Whether an effect that was added has been dropped since.
    pub fn has_dropped(&self) -> bool {
        !dropped(&self.steps, &self.found).is_empty()
    }

    /// Whether nothing is left to explain, or nearly nothing of what there was, in the balances or in the free run.
    pub fn is_explained(&self) -> bool {
        let explained = || self.after.explains(&self.before, self.free_run.as_ref());
        self.after.is_complete() || (!self.found.is_empty() && explained())
    }
}

/// The data and the settings of a climb.
pub struct Climb<'a> {
    experiments: &'a [Experiment],
    problem: EquationError<'a>,
    blocks: Vec<usize>,
    period_s: f64,
    candidates: Vec<&'static Description>,
    most: usize,
}

impl<'a> Climb<'a> {
    /// `candidates` are tried at each step, `most` effects are added at most. `None` if no balance can be formed.
    pub fn new(experiments: &'a [Experiment], candidates: Vec<&'static Description>, most: usize) -> Option<Self> {
        let problem = EquationError::new(experiments)?;
        let blocks = blocks::blocks(problem.times());
        let period_s = experiments.iter().find_map(|e| e.mains_period_s).unwrap_or(0.02);
        Some(Self { experiments, problem, blocks, period_s, candidates, most })
    }

    /// Fits a model as it is.
    ///
    /// # Errors
    /// An interrupt.
    pub fn fit(&self, space: &Space) -> Result<Refined> {
        minimise(space, &self.problem, THOROUGH, None, &mut || ())
    }

    /// Screens the candidates at the fit of a model, but for some: a first ranking.
    fn screen(&self, fit: &Refined, left_out: &[&'static str]) -> Vec<Promise> {
        let scales = Scales::of(&fit.space, self.experiments);
        screening::screen(fit, &self.problem, &scales, &self.candidates_beside(&fit.space, left_out))
    }

    /// The candidates that a model does not have yet, but for some.
    pub fn candidates_beside(&self, space: &Space, left_out: &[&'static str]) -> Vec<&'static Description> {
        // A second member of a class would only lend the first one another form.
        let present = |d: &&Description| space.effects().iter().any(|id| classes::same(id, d.id));
        self.candidates.iter().copied().filter(|d| !present(d) && !left_out.contains(&d.id)).collect()
    }

    /// One step from a fitted model: all candidates, and the one that would be added.
    ///
    /// # Errors
    /// An interrupt.
    pub fn first_step(&self, fit: &Refined) -> Result<Step> {
        let mut step = self.step(fit, &[], 0.0, &mut |_| ())?;
        step.winners = winner(&step.tried).map(|t| t.id).into_iter().collect();
        Ok(step)
    }

    /// Climbs from a fitted model. `progress` is told the steps done.
    ///
    /// # Errors
    /// An interrupt.
    pub fn climb(&self, base: &Refined, progress: &mut dyn FnMut(Progress<'_>)) -> Result<Ladder> {
        self.climb_on(base, base.clone(), Vec::new(), Vec::new(), progress)
    }

    /// Climbs on from a fit that holds the effects found in earlier steps, without those that have been dropped since.
    pub(super) fn climb_on(
        &self,
        base: &Refined,
        mut fit: Refined,
        mut found: Vec<&'static str>,
        mut steps: Vec<Step>,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Ladder> {
        let left_out = dropped(&steps, &found);
        while found.len() < self.most {
            let gained = self.held_out(base).log_error() - self.held_out(&fit).log_error();
            let mut step = self.step(&fit, &left_out, gained, progress)?;
            let winner = winner(&step.tried).map(|t| (t.id, t.fit.clone()));
            step.winners = winner.iter().map(|w| w.0).collect();
            steps.push(step);
            let Some((id, next)) = winner else { break };
            found.push(id);
            // To its end, or the next candidates would be praised for what more steps alone bring.
            fit = minimise(&next.space, &self.problem, THOROUGH, Some(next.rms), &mut || ())?;
            if found.len() > 1 {
                self.better_forms(&mut fit, &mut found, &mut steps, progress)?;
            }
        }
        self.look_back(&mut fit, &mut found, progress)?;
        let rivals = self.rivals(&fit, &found, &steps, progress)?;
        let floor = if self.problem.is_of_whole_motor() { self.floor(&fit) } else { Floor::UNKNOWN };
        let (before, after) = (Completeness::of(base, &floor), Completeness::of(&fit, &floor));
        Ok(Ladder { steps, found, rivals, fit, before, after, floor, free_run: None })
    }

    /// Exchanges effects for others of their class where these now fit better: which form a law has is seen only when what
    /// else was missing is there. (Otherwise the next effect would be named for the difference of the two forms.)
    fn better_forms(
        &self,
        fit: &mut Refined,
        found: &mut [&'static str],
        steps: &mut [Step],
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<()> {
        for present in found {
            for other in classes::class_of(present).unwrap_or(&[]).iter().copied() {
                if other == *present {
                    continue;
                }
                let Some(step) = steps.iter_mut().find(|s| s.winners.contains(present)) else { continue };
                let Some(tried) = step.tried.iter().find(|t| t.id == other) else { continue };
                progress(Progress::Doing(other));
                let scales = Scales::of(&fit.space, self.experiments);
                let mut space = fit.space.without_effect(present).with_effect(other, &scales);
                space.start_from(&tried.fit.space, other);
                let exchanged = minimise(&space, &self.problem, THOROUGH, Some(fit.rms), &mut || ())?;
                if self.held_out(fit).log_error() - self.held_out(&exchanged).log_error() >= SMALLEST_GAIN {
                    step.winners.iter_mut().filter(|id| *id == present).for_each(|id| *id = other);
                    *fit = exchanged;
                    *present = other;
                }
            }
        }
        Ok(())
    }

    /// Takes in effects that the free run has found, as a step of its own, and climbs no further. `rivals` would have done as
    /// well.
    pub fn accept(&self, ladder: &mut Ladder, step: Step, rivals: &[&'static str]) {
        ladder.found.extend(&step.winners);
        ladder.rivals.extend(step.winners.iter().map(|_| rivals.to_vec()));
        ladder.steps.push(step);
    }

    /// Tries the candidates two at a time at the fit of a model, and climbs on from the two that lower the error most, if they
    /// lower it more than an earlier climb has done.
    ///
    /// # Errors
    /// An interrupt.
    pub fn climb_by_two(
        &self,
        base: &Refined,
        earlier: &Ladder,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Option<Ladder>> {
        let promises = self.screen(base, &[]);
        let scales = Scales::of(&base.space, self.experiments);
        let mut begun = Vec::new();
        for pair in screening::pairs(base, &self.problem, &scales, &promises).into_iter().take(PAIRS) {
            progress(Progress::Doing(pair.ids[0]));
            let fit = minimise(&pair.space, &self.problem, EFFORT, Some(base.rms), &mut || ())?;
            begun.push((self.held_out(&fit), pair.ids, fit));
        }
        let best = begun.into_iter().min_by(|a, b| a.0.log_error().total_cmp(&b.0.log_error()));
        let earlier = self.held_out(&earlier.fit).log_error();
        let Some((held_out, winners, fit)) = best.filter(|b| b.0.log_error() < earlier) else { return Ok(None) };
        let gain = self.held_out(base).log_error() - held_out.log_error();
        let parameters = fit.space.free().count() - base.space.free().count();
        let p = p_value(&self.held_out(base), &held_out, &fit, self.problem.groups(), parameters);
        let p_value = (p * (self.candidates.len() * self.candidates.len()) as f64).min(1.0);
        let tried = |id| Tried { id, fit: fit.clone(), held_out: held_out.clone(), gain, p_value, objection: None };
        let step = Step {
            promises: promises.iter().map(|p| (p.id, p.gain)).collect(),
            tried: winners.map(tried).to_vec(),
            winners: winners.to_vec(),
            together: true,
            decoy_gain: 0.0,
            decoys: [0, 0],
        };
        let fit = minimise(&fit.space, &self.problem, THOROUGH, Some(fit.rms), &mut || ())?;
        self.climb_on(base, fit, winners.to_vec(), vec![step], progress).map(Some)
    }

    /// The recordings.
    pub fn experiments(&self) -> &[Experiment] {
        self.experiments
    }

    /// What does not repeat.
    fn floor(&self, fit: &Refined) -> Floor {
        Floor::of(fit, &self.problem, self.problem.times(), self.period_s)
    }

    /// Leaves of what was found what the free run has kept, and fits the balances anew to that, from where they were and
    /// from where the free run's fit `free` has ended: one of the two may lie in a wrong valley.
    ///
    /// # Errors
    /// An interrupt.
    pub fn narrow(&self, ladder: &mut Ladder, kept: &[&'static str], free: &Refined) -> Result<()> {
        let mut space = ladder.fit.space.clone();
        let found = std::mem::replace(&mut ladder.found, kept.to_vec());
        let rivals = std::mem::take(&mut ladder.rivals);
        for (id, rivals) in found.iter().zip(rivals) {
            if kept.contains(id) {
                ladder.rivals.push(rivals);
            } else {
                space = space.without_effect(id);
            }
        }
        let mut fit = minimise(&free.space, &self.problem, EFFORT, Some(ladder.fit.rms), &mut || ())?;
        if space.effects() == free.space.effects() {
            let other = minimise(&space, &self.problem, EFFORT, Some(ladder.fit.rms), &mut || ())?;
            let error = |fit: &Refined| fit.log_error(self.problem.groups());
            if error(&other) <= error(&fit) {
                fit = other;
            }
        }
        ladder.fit = fit;
        ladder.after = Completeness::of(&ladder.fit, &ladder.floor);
        Ok(())
    }

    /// Whether the recordings hold voltage, current and speed.
    pub fn is_of_whole_motor(&self) -> bool {
        self.problem.is_of_whole_motor()
    }

    /// Share of an effect's column that the other parameters do not explain.
    pub fn independence(&self, fit: &Refined, d: &Description) -> Option<f64> {
        screening::independence(fit, &self.problem, &Scales::of(&fit.space, self.experiments), d)
    }

    /// What generic terms make of what a fit leaves over.
    pub fn lead(&self, fit: &Refined) -> Lead {
        lead::find(fit, &self.problem, &self.blocks)
    }

    /// The shape of what is left in the balance that lacks more.
    pub fn shape(&self, ladder: &Ladder) -> Option<Shape> {
        let balance =
            if ladder.after.electrical > ladder.after.mechanical { Balance::Voltage } else { Balance::Torque };
        shape::of(&ladder.fit, &self.problem, balance)
    }

    /// 95 % intervals of the parameters of a fit by equation error, by name, from its blocks.
    pub fn intervals(&self, fit: &Refined) -> BTreeMap<String, [f64; 2]> {
        intervals_of(fit, &self.blocks)
    }

    fn held_out(&self, fit: &Refined) -> HeldOut {
        held_out(fit, self.problem.groups(), &self.blocks)
    }

    fn step(
        &self,
        fit: &Refined,
        left_out: &[&'static str],
        gained: f64,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Step> {
        let before = self.held_out(fit);
        progress(Progress::Doing("screening"));
        let promises = self.screen(fit, left_out);
        let ranking: Vec<(&'static str, f64)> = promises.iter().map(|p| (p.id, p.gain)).collect();
        progress(Progress::Ranking(&ranking));
        let columns: Vec<_> = promises.iter().map(|p| p.column.clone()).collect();
        let decoys = decoys::tried(
            fit,
            self.problem.groups(),
            self.problem.times(),
            &self.blocks,
            &columns,
            1 + fit.space.effects().len() as u64,
        );
        let smallest = SMALLEST_GAIN.max(SMALLEST_SHARE * gained);
        let decoy_gain = decoys.iter().map(|d| before.log_error() - d.log_error()).fold(0.0, f64::max);
        let accepted = decoys.iter().filter(|d| {
            let p = p_value(&before, d, fit, self.problem.groups(), 1) * self.candidates.len() as f64;
            before.log_error() - d.log_error() >= smallest && p <= SIGNIFICANCE
        });
        let accepted = [decoys.len(), accepted.count()];
        let best = promises.first().map_or(0.0, |p| p.gain);
        let mut begun = Vec::new();
        for promise in promises.iter().filter(|p| p.gain > WORTH_FITTING * best).take(FITTED) {
            output::check_interrupt()?;
            progress(Progress::Doing(promise.id));
            let refined = minimise(&promise.space, &self.problem, BEGINNING, Some(fit.rms), &mut || ())?;
            let gain = before.log_error() - self.held_out(&refined).log_error();
            begun.push((promise, refined, gain));
        }
        let most = begun.iter().map(|b| b.2).fold(0.0, f64::max);
        let mut tried = Vec::new();
        for (promise, refined, gain) in begun {
            output::check_interrupt()?;
            let refined = if gain > WORTH_FINISHING * most {
                minimise(&refined.space, &self.problem, EFFORT, Some(refined.rms), &mut || ())?
            } else {
                refined
            };
            let held_out = self.held_out(&refined);
            let gain = before.log_error() - held_out.log_error();
            let parameters = refined.space.free().count() - fit.space.free().count();
            let single = p_value(&before, &held_out, &refined, self.problem.groups(), parameters);
            let p_value = (single * self.candidates.len() as f64).min(1.0);
            let objection = if gain < smallest {
                Some(Objection::TooSmall)
            } else if p_value > if gain > BEYOND_DOUBT { CONVENTIONAL } else { SIGNIFICANCE }
                || gain < OVER_DECOYS * decoy_gain
            {
                Some(Objection::NotSignificant)
            } else if promise.independent < LEAST_INDEPENDENT && gain < BEYOND_DOUBT {
                Some(Objection::NotIndependent)
            } else if shift(&fit.space, &refined.space) > LARGEST_SHIFT && gain < BEYOND_DOUBT {
                Some(Objection::Implausible)
            } else {
                None
            };
            tried.push(Tried { id: promise.id, fit: refined, held_out, gain, p_value, objection });
        }
        tried.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        Ok(Step { promises: ranking, tried, winners: Vec::new(), together: false, decoy_gain, decoys: accepted })
    }

    /// Drops effects that the later ones have made superfluous.
    fn look_back(
        &self,
        fit: &mut Refined,
        found: &mut Vec<&'static str>,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<()> {
        let mut k = 0;
        while found.len() > 1 && k + 1 < found.len() {
            progress(Progress::Doing(found[k]));
            let less = minimise(&fit.space.without_effect(found[k]), &self.problem, EFFORT, Some(fit.rms), &mut || ())?;
            if self.held_out(&less).log_error() - self.held_out(fit).log_error() < SMALLEST_GAIN {
                found.remove(k);
                *fit = less;
            } else {
                k += 1;
            }
        }
        Ok(())
    }

    /// For each effect found, those of its step that would do as well in its place.
    fn rivals(
        &self,
        fit: &Refined,
        found: &[&'static str],
        steps: &[Step],
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Vec<Vec<&'static str>>> {
        let error = self.held_out(fit).log_error();
        let mut all = Vec::new();
        for id in found {
            let mut rivals = Vec::new();
            let step = steps.iter().find(|s| s.winners.contains(id));
            let tried: &[Tried] = step.map_or(&[], |s| &s.tried);
            let gain = tried.iter().find(|t| t.id == *id).map_or(0.0, |t| t.gain);
            // With more parameters it is no rival: a law that has to be bent to look like another one.
            let rivals_here = tried.iter().filter(|t| {
                t.gain > RIVAL_SHARE * gain && !found.contains(&t.id) && parameters_of(t.id) <= parameters_of(id)
            });
            for rival in rivals_here {
                progress(Progress::Doing(rival.id));
                let swapped = if found.len() == 1 {
                    rival.fit.clone()
                } else {
                    let scales = Scales::of(&fit.space, self.experiments);
                    let mut space = fit.space.without_effect(id).with_effect(rival.id, &scales);
                    if let (Some(entry), Some(known)) =
                        (space.get_mut(size_of(rival.id)), rival.fit.space.get(size_of(rival.id)))
                    {
                        entry.value = known.value;
                    }
                    minimise(&space, &self.problem, EFFORT, Some(fit.rms), &mut || ())?
                };
                if self.held_out(&swapped).log_error() - error < SAME_ERROR && !classes::same(id, rival.id) {
                    rivals.push(rival.id);
                }
            }
            all.push(rivals);
        }
        Ok(all)
    }
}

/// The candidate that counts: the best one, or one that does as well with fewer parameters.
fn winner(tried: &[Tried]) -> Option<&Tried> {
    let best = tried.iter().filter(|t| t.objection.is_none()).map(|t| t.gain).fold(f64::NEG_INFINITY, f64::max);
    tried
        .iter()
        .filter(|t| t.objection.is_none() && t.gain > best - SAME_ERROR)
        .min_by(|a, b| parameters_of(a.id).cmp(&parameters_of(b.id)).then(b.gain.total_cmp(&a.gain)))
}

/// Effects that steps have added and that are no longer among what was found.
fn dropped(steps: &[Step], found: &[&'static str]) -> Vec<&'static str> {
    let added = steps.iter().flat_map(|s| &s.winners).copied();
    added.filter(|id| found.iter().all(|kept| !classes::same(kept, id))).collect()
}

/// Number of parameters of an effect.
fn parameters_of(id: &str) -> usize {
    greyrig::effects::Effect::<f64>::CATALOGUE.iter().find(|d| d.id == id).map_or(0, |d| d.parameters.len())
}

/// Name of the size of an effect.
pub fn size_of(id: &str) -> &'static str {
    greyrig::effects::Effect::<f64>::CATALOGUE.iter().find(|d| d.id == id).map_or("", |d| d.parameters[0].name)
}

/// Largest factor by which R or K differ. (J may: dry friction passes for inertia on a ramp.)
fn shift(before: &Space, after: &Space) -> f64 {
    ["R", "K"]
        .iter()
        .map(|name| {
            let ratio = after.value(name) / before.value(name);
            ratio.max(1.0 / ratio)
        })
        .fold(1.0, f64::max)
}
