//! Looking back at what a climb has found: superfluous effects, better forms, rivals.

use greyrig::effects::{EffectId, Sum};
use rayon::prelude::*;

use super::{Climb, THOROUGH, Way};
use crate::diagnose::criteria::{SAME_ERROR, SMALLEST_GAIN};
use crate::diagnose::ladder::{Ladder, Step, Tried};
use crate::diagnose::sizes::parameters_of;
use crate::diagnose::{classes, screening};
use crate::error::Result;
use crate::identify::minimise::{Effort, Fit, Residuals};
use crate::identify::space::{Freedom, Key, Space};

/// A rival that gains less than this share of the winner's gain is none.
const RIVAL_SHARE: f64 = 0.5;
/// Exchanges that are worth climbing on from.
const EXCHANGES: usize = 2;
/// How hard exchanges are fitted at first where there are more than are fitted any further.
const FIRST_LOOK: Effort = Effort { steps: 3, ..Effort::ESTIMATE };
/// Exchanges that are fitted any further. In four hard cases with five effects, with 14 to 25 of them, the two to climb
/// on from, and all that came near these, were among the first six after these steps.
const CLOSEST: usize = 8;
/// An effect without which the error would rise by more than this, by linearisation, is not superfluous.
const BEYOND_QUESTION: f64 = 5.0 * SMALLEST_GAIN;

/// An effect that was found, and a candidate to give it for.
type Pair<'t> = (EffectId, &'t Tried);

/// An effect that was found given for another one.
pub struct Exchange {
    given: EffectId,
    /// What it was given for.
    pub taken: EffectId,
    /// The balances with the other one, roughly.
    fit: Fit,
}

impl Climb<'_> {
    /// Exchanges effects for others of their class where these now fit better: which form a law has is seen only when
    /// what else was missing is there. (Otherwise the next effect would be named for the difference of the two forms.)
    pub(super) fn better_forms(&self, fit: &mut Fit, found: &mut [EffectId], steps: &mut [Step]) -> Result<()> {
        for present in found {
            for other in classes::class_of(fit.space.kind(), *present).unwrap_or_default() {
                if other == *present {
                    continue;
                }
                let Some(step) = steps.iter_mut().find(|s| s.winners.contains(present)) else { continue };
                let Some(tried) = step.tried.iter().find(|t| t.id == other) else { continue };
                self.ctx.doing(other.id());
                let scales = fit.space.scales(self.experiments);
                let mut space = fit.space.without_effect(*present).with_effect(other, &scales);
                space.start_from(&tried.fit.space, other);
                let begun = self.fit_beside(fit, &space, Effort::ESTIMATE)?;
                if self.gain(&begun, fit)? > SMALLEST_GAIN {
                    continue;
                }
                let exchanged = self.go_on(&begun, THOROUGH)?;
                // A soft curve may reach farther beyond the data than the right one does, and still be the wrong one.
                let gains = self.gain(fit, &exchanged)? >= SMALLEST_GAIN;
                if gains && self.error(&exchanged) < self.error(fit) {
                    step.winners.iter_mut().filter(|id| *id == present).for_each(|id| *id = other);
                    *fit = exchanged;
                    *present = other;
                }
            }
        }
        Ok(())
    }

    /// Drops effects that the later ones have made superfluous.
    pub(super) fn look_back(&self, fit: &mut Fit, found: &mut Vec<EffectId>) -> Result<()> {
        let mut k = 0;
        while found.len() > 1 && k + 1 < found.len() {
            self.ctx.doing(found[k].id());
            // The linearisation knows the worth of what is far from superfluous.
            if screening::worth(fit, self.problem.groups(), found[k]) > BEYOND_QUESTION {
                k += 1;
                continue;
            }
            let less = self.fit_from(Some(fit.rms), &fit.space.without_effect(found[k]), Effort::USUAL)?;
            if self.gain(&less, fit)? < SMALLEST_GAIN {
                found.remove(k);
                *fit = less;
            } else {
                k += 1;
            }
        }
        Ok(())
    }

    /// Gives two effects for the one that is both of them together, where it does as well.
    pub(super) fn one_for_two(&self, fit: &mut Fit, found: &mut Vec<EffectId>, steps: &mut [Step]) -> Result<()> {
        let is_tried = |id: EffectId| self.candidates.iter().any(|d| d.id == id);
        let fits = |(one, sum): &(EffectId, Sum)| {
            sum.two.iter().all(|id| found.contains(id)) && !found.contains(one) && is_tried(*one)
        };
        let Some((one, sum)) = classes::sums(fit.space.kind()).find(fits) else { return Ok(()) };
        self.ctx.doing(one.id());
        let scales = fit.space.scales(self.experiments);
        let less = sum.two.iter().fold(fit.space.clone(), |space, id| space.without_effect(*id));
        let given = self.fit_from(Some(fit.rms), &less.with_effect(one, &scales), THOROUGH)?;
        if self.gain(&given, fit)? >= SAME_ERROR {
            return Ok(());
        }
        *fit = given;
        for effects in steps.iter_mut().map(|step| &mut step.winners).chain([found]) {
            if let Some(place) = effects.iter().position(|id| sum.two.contains(id)) {
                effects[place] = one;
            }
            effects.retain(|id| !sum.two.contains(id));
        }
        Ok(())
    }

    /// Looks, for each effect found, for others that would do as well in its place: those of its step, swapped.
    ///
    /// # Errors
    /// An interrupt.
    pub fn find_rivals(&self, ladder: &mut Ladder) -> Result<()> {
        let (fit, found) = (&ladder.fit, &ladder.found);
        let error = self.held_out(fit)?.log_error();
        let mut all = Vec::new();
        for id in found {
            let step = ladder.steps.iter().find(|s| s.winners.contains(id));
            let mut rivals = step.map_or_else(Vec::new, |s| s.as_well.clone());
            // What was tried together only is no rival of its other half.
            let tried: &[Tried] = step.filter(|s| !s.together).map_or(&[], |s| &s.tried);
            let gain = tried.iter().find(|t| t.id == *id).map_or(0.0, |t| t.gain);
            let rivals_here = tried.iter().filter(|t| t.gain > RIVAL_SHARE * gain && !found.contains(&t.id));
            let others: Vec<&Tried> = rivals_here.filter(|r| !classes::same(fit.space.kind(), *id, r.id)).collect();
            let does_as_well = |rival: &&Tried| {
                self.ctx.doing(rival.id.id());
                // With more parameters it is one only in its usual shape: a law can be bent to look like another one.
                let bends = parameters_of(rival.id) > parameters_of(*id);
                let swapped = match found.len() {
                    1 if !bends => (*rival.fit).clone(),
                    _ => self.swapped(fit, *id, rival, bends, Effort::USUAL)?,
                };
                Ok(self.held_out(&swapped)?.log_error() - error < SAME_ERROR)
            };
            let as_well: Vec<bool> = others.par_iter().map(does_as_well).collect::<Result<_>>()?;
            rivals.extend(others.iter().zip(as_well).filter(|(_, as_well)| *as_well).map(|(rival, _)| rival.id));
            all.push(rivals);
        }
        ladder.rivals = all;
        Ok(())
    }

    /// Exchanges of an effect found for a candidate that gained something in a step and was not added: the two after
    /// which the error on data held out is the smallest.
    ///
    /// # Errors
    /// An interrupt.
    pub fn exchanges(&self, ladder: &Ladder) -> Result<Vec<Exchange>> {
        let pairs = to_exchange(ladder);
        let pairs = if pairs.len() > CLOSEST { self.closest(&ladder.fit, pairs)? } else { pairs };
        let fit = |(given, other): Pair<'_>| {
            self.ctx.doing(other.id.id());
            let fit = self.swapped(&ladder.fit, given, other, false, Effort::ESTIMATE)?;
            Ok((self.held_out(&fit)?.log_error(), Exchange { given, taken: other.id, fit }))
        };
        let mut fits: Vec<_> = pairs.into_par_iter().map(fit).collect::<Result<_>>()?;
        fits.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(fits.into_iter().map(|(_, exchange)| exchange).take(EXCHANGES).collect())
    }

    /// The exchanges that come closest after a few steps.
    fn closest<'t>(&self, fit: &Fit, pairs: Vec<Pair<'t>>) -> Result<Vec<Pair<'t>>> {
        let look = |(given, other): Pair<'t>| {
            self.ctx.doing(other.id.id());
            let begun = self.fit_beside(fit, &self.space_swapped(fit, given, other), FIRST_LOOK)?;
            Ok((self.error(&begun), (given, other)))
        };
        let mut looks: Vec<_> = pairs.into_par_iter().map(look).collect::<Result<_>>()?;
        looks.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(looks.into_iter().map(|(_, pair)| pair).take(CLOSEST).collect())
    }

    /// Candidates that another one was preferred to for its error on data held out, though they fit the balances
    /// better: with the effect found in their place, and the candidate.
    pub fn passed_over<'l>(&self, ladder: &'l Ladder) -> Vec<[&'l Tried; 2]> {
        let kind = ladder.fit.space.kind();
        let of_one = |id: &EffectId| {
            let step = ladder.steps.iter().find(|s| !s.together && !s.in_free_run && s.winners.contains(id))?;
            let own = step.tried.iter().find(|t| t.id == *id)?;
            let fits_better = |t: &&Tried| self.error(&t.fit) < self.error(&own.fit);
            let others = step.tried.iter().filter(|t| !ladder.found.iter().any(|id| classes::same(kind, *id, t.id)));
            Some(others.filter(fits_better).map(move |other| [own, other]).collect::<Vec<_>>())
        };
        ladder.found.iter().filter_map(of_one).flatten().collect()
    }

    /// What was found, with one effect given for another one.
    ///
    /// # Errors
    /// An interrupt.
    pub fn exchange(&self, ladder: &Ladder, given: EffectId, other: &Tried) -> Result<Exchange> {
        let fit = match ladder.found.len() {
            1 => (*other.fit).clone(),
            _ => self.swapped(&ladder.fit, given, other, false, Effort::ESTIMATE)?,
        };
        Ok(Exchange { given, taken: other.id, fit })
    }

    /// Whether a climb from an exchange may come closer than what was found, by the exchange and what promises most
    /// beside it.
    ///
    /// # Errors
    /// An interrupt.
    pub fn may_come_closer_by(&self, exchange: &Exchange, ladder: &Ladder) -> Result<bool> {
        let promised = self.screen(&exchange.fit, &[]).first().map_or(0.0, |promise| promise.gain);
        Ok(self.gain(&ladder.fit, &exchange.fit)? + promised >= SMALLEST_GAIN)
    }

    /// Climbs on from an exchange in what was found beside `base`.
    ///
    /// # Errors
    /// An interrupt.
    pub fn climb_on_from(&self, exchange: &Exchange, base: &Fit, ladder: &Ladder) -> Result<Ladder> {
        self.climb_on(base, self.exchanged(exchange, ladder)?)
    }

    /// The same, unless the climb takes back what was given, or another law of its class, and comes no closer by having
    /// both.
    ///
    /// # Errors
    /// An interrupt.
    pub fn climb_away_from(&self, exchange: &Exchange, base: &Fit, ladder: &Ladder) -> Result<Option<Ladder>> {
        let mut way = self.exchanged(exchange, ladder)?;
        let takes_back = |added| classes::same(base.space.kind(), added, exchange.given);
        while let Some(added) = self.add_the_next(base, &mut way)? {
            if takes_back(added) && self.gain(&ladder.fit, &way.fit)? < SMALLEST_GAIN {
                return Ok(None);
            }
        }
        self.ended(base, way).map(Some)
    }

    /// What was found, with an effect given for another one.
    fn exchanged(&self, exchange: &Exchange, ladder: &Ladder) -> Result<Way> {
        let (mut found, mut steps) = (ladder.found.clone(), ladder.steps.clone());
        let winners = steps.iter_mut().flat_map(|step| &mut step.winners);
        winners.chain(&mut found).filter(|id| **id == exchange.given).for_each(|id| *id = exchange.taken);
        Ok(Way { fit: self.go_on(&exchange.fit, THOROUGH)?, found, steps })
    }

    /// A fit with a rival in the place of an effect, in its usual shape if it `bends`.
    fn swapped(&self, fit: &Fit, id: EffectId, rival: &Tried, bends: bool, effort: Effort) -> Result<Fit> {
        let mut space = self.space_swapped(fit, id, rival);
        if bends {
            space.hold(Key::shapes_of(rival.id), Freedom::Pinned);
        }
        self.fit_from(Some(fit.rms), &space, effort)
    }

    /// Where such a fit begins: with the rival of the size that it had when it was tried.
    fn space_swapped(&self, fit: &Fit, id: EffectId, rival: &Tried) -> Space {
        let scales = fit.space.scales(self.experiments);
        let mut space = fit.space.without_effect(id).with_effect(rival.id, &scales);
        let size = Key::size_of(rival.id);
        if let (Some(entry), Some(known)) = (space.get_mut(size), rival.fit.space.get(size)) {
            entry.value = known.value;
        }
        space
    }
}

/// Each effect found, and each candidate that gained something in a step and was not added.
fn to_exchange(ladder: &Ladder) -> Vec<Pair<'_>> {
    let kind = ladder.fit.space.kind();
    let mut others: Vec<&Tried> = ladder.steps.iter().flat_map(|s| &s.tried).collect();
    others.retain(|t| t.gain > SMALLEST_GAIN && ladder.found.iter().all(|id| !classes::same(kind, *id, t.id)));
    others.sort_by(|a, b| a.id.cmp(&b.id).then(b.gain.total_cmp(&a.gain)));
    others.dedup_by_key(|t| t.id);
    ladder.found.iter().flat_map(|id| others.iter().map(move |other| (*id, *other))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::Context;
    use crate::diagnose::base;
    use crate::diagnose::holds::Holds;
    use crate::identify::{self, Settings};
    use crate::model::Kind;
    use crate::rig::Setup;

    /// What a motor with saturation, hysteresis and a brush drop leaves to `look` at: the climb, the fit that it begins
    /// with, and what it has found.
    fn climbed(look: impl FnOnce(&Climb<'_>, &Fit, &Ladder)) {
        let setup = Setup::new(Kind::Universal).profile("staircase").unwrap().seconds(6.0);
        let effects = ["saturation=0.35", "hysteresis=0.2", "brush_drop=2.5"];
        let setup = effects.iter().fold(setup, |setup, effect| setup.effect(effect).unwrap());
        let settings = Settings::new(Kind::Universal);
        let full = identify::prepare(&[setup.run().unwrap().recording], &settings.filter, &settings.chain).unwrap();
        let mut space = identify::build_space(&settings).unwrap();
        let coarse = base::start(&mut space, &full).unwrap();
        // Another law of a drop's class would come closer by its form, and be no other effect.
        let other_law = |id| id == EffectId::ConverterDeadTime;
        let candidates = screening::candidates(Kind::Universal, Holds::of(&full), other_law);
        let climb = Climb::new(&coarse, candidates, 6, &Context::quiet()).unwrap();
        let base = climb.fit(&space).unwrap();
        let ladder = climb.climb(&base, None).unwrap();
        assert_eq!(ladder.found.len(), 3, "{:?}", ladder.found);
        look(&climb, &base, &ladder);
    }

    /// A candidate that a climb has tried.
    fn tried(ladder: &Ladder, id: EffectId) -> &Tried {
        ladder.steps.iter().flat_map(|s| &s.tried).find(|t| t.id == id).unwrap_or_else(|| panic!("{id} was not tried"))
    }

    #[test]
    fn a_climb_that_takes_back_what_was_given_is_over() {
        climbed(|climb, base, ladder| {
            for (given, taken) in
                [(EffectId::BrushDrop, EffectId::WindingTemperature), (EffectId::Hysteresis, EffectId::StrayLoadTorque)]
            {
                let exchange = climb.exchange(ladder, given, tried(ladder, taken)).unwrap();
                let away = climb.climb_away_from(&exchange, base, ladder).unwrap();
                assert!(away.is_none(), "{taken} is not there: {:?}", away.map(|other| other.found));
            }
        });
    }

    #[test]
    fn having_both_counts_where_that_comes_closer() {
        climbed(|climb, base, ladder| {
            // As if saturation alone had been found, and the rest passed over.
            let alone = tried(ladder, EffectId::Saturation).fit.as_ref().clone();
            let ladder = Ladder {
                found: vec![EffectId::Saturation],
                fit: alone,
                steps: ladder.steps[..1].to_vec(),
                ..ladder.clone()
            };
            let exchange = climb.exchange(&ladder, EffectId::Saturation, tried(&ladder, EffectId::BrushDrop)).unwrap();
            let away = climb.climb_away_from(&exchange, base, &ladder).unwrap().expect("a climb");
            let all = [EffectId::Saturation, EffectId::Hysteresis, EffectId::BrushDrop];
            assert!(all.iter().all(|id| away.found.contains(id)), "{:?}", away.found);
        });
    }

    #[test]
    fn exchanges_that_are_far_behind_after_a_few_steps_are_so_at_their_end() {
        climbed(|climb, _, ladder| {
            let pairs = to_exchange(ladder);
            assert!(pairs.len() > CLOSEST, "all are fitted to their end");
            let to_its_end = |(given, other): Pair<'_>| {
                let fit = climb.swapped(&ladder.fit, given, other, false, Effort::ESTIMATE).unwrap();
                (climb.held_out(&fit).unwrap().log_error(), [given, other.id])
            };
            let mut all: Vec<_> = pairs.into_iter().map(to_its_end).collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            let best: Vec<_> = all.iter().map(|(_, pair)| *pair).take(EXCHANGES).collect();
            let exchanges = climb.exchanges(ladder).unwrap();
            assert_eq!(exchanges.iter().map(|e| [e.given, e.taken]).collect::<Vec<_>>(), best);
        });
    }
}
