//! What a diagnosis finds, step by step: the way from the model to what explains the data.

use std::sync::Arc;

use greyrig::effects::{Acts, EffectId};

use super::classes;
use super::completeness::{Completeness, Floor};
use crate::identify::minimise::Fit;
use crate::model::Kind;

/// Why a candidate does not count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Objection {
    /// The held-out error hardly falls.
    TooSmall,
    /// Its size is not significantly different from zero, or decoys do as well.
    NotSignificant,
    /// It makes R or K those of another motor.
    Implausible,
    /// It leaves a motor without flux and inertia.
    OfNoMotor,
    /// Its column is that of the supply or of the base parameters.
    NotIndependent,
}

impl Objection {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::TooSmall => "error hardly falls",
            Self::NotSignificant => "not significant, or no better than a placebo regressor",
            Self::Implausible => "R or K would be those of another motor",
            Self::OfNoMotor => "flux and inertia would be those of no motor",
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
    pub id: EffectId,
    /// The model with it.
    pub fit: Arc<Fit>,
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
    pub promises: Vec<(EffectId, f64)>,
    /// Those that were fitted, best first.
    pub tried: Vec<Tried>,
    /// Those that were added.
    pub winners: Vec<EffectId>,
    /// Whether these were tried together only.
    pub together: bool,
    /// Whether the free run was the judge.
    pub in_free_run: bool,
    /// Others that may do as well, where it was.
    pub as_well: Vec<EffectId>,
    /// Best gain of a decoy.
    pub decoy_gain: f64,
    /// Decoys tried, and how many of them gain enough, significantly, to be accepted if they were effects.
    pub decoys: [usize; 2],
}

impl Step {
    /// The effect that was added, as it was tried; the first of several.
    pub fn winner(&self) -> Option<&Tried> {
        let first = self.winners.first()?;
        self.tried.iter().find(|tried| tried.id == *first)
    }
}

/// The way from the model to what explains the data.
#[derive(Debug, Clone)]
pub struct Ladder {
    /// Steps, the last of which found nothing.
    pub steps: Vec<Step>,
    /// The effects that stay, in the order in which they should be added.
    pub found: Vec<EffectId>,
    /// For each of them, effects that would do as well in its place and are no class with it; looked for at the end.
    pub rivals: Vec<Vec<EffectId>>,
    /// The fit with all of them.
    pub fit: Fit,
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
        !dropped(self.fit.space.kind(), &self.steps, &self.found).is_empty()
    }

    /// Whether a step has added an effect or one of its class, even if it has been dropped since.
    pub fn has_added(&self, id: EffectId) -> bool {
        let added = self.steps.iter().flat_map(|s| &s.winners).chain(&self.found);
        added.into_iter().any(|other| classes::same(self.fit.space.kind(), *other, id))
    }

    /// Whether the effects that stay are those of another climb, or of their classes, in whatever order.
    pub fn has_found_the_same_as(&self, other: &Self) -> bool {
        let is_there = |id: &EffectId| other.found.iter().any(|own| classes::same(self.fit.space.kind(), *own, *id));
        self.found.len() == other.found.len() && self.found.iter().all(is_there)
    }

    /// Whether nothing is left to explain, or, where something was found, nearly nothing of what there was. The free
    /// run is the judge of what was found, where there is one: it adds up over time what a balance hardly shows. A
    /// balance that keeps most of its structure contradicts: slow structure of the load may pass for turbulence in the
    /// free run. Exception: for a sensor lag or compression the equation error is only corrected to first order (and
    /// amplifies noise at an inrush), so a complete free run overrides it. Without a finding the balances judge, but
    /// not against a free run that is far off.
    pub fn is_explained(&self) -> bool {
        is_explained(&self.found, [self.before, self.after], self.free_run.as_ref())
    }

    /// The same if what is left, structure of the torque balance alone, is a load that fluctuates: that is what it is
    /// in the free run, too, whose speed adds it up, and whose current follows the speed.
    pub fn is_explained_but_for_the_load(&self) -> bool {
        let after = Completeness { mechanical: 1.0, ..self.after };
        let free_run = self.free_run.as_ref().filter(|_| !self.found.is_empty());
        self.after.is_of_the_torque() && is_explained(&self.found, [self.before, after], free_run)
    }

    /// Whether effects that the model has already explain nearly all that exceeds the floor without them, if nothing
    /// was found beside them: by the rule by which they were named, or would be. `before` is the completeness of the
    /// balances without them, `free_run` that of the free run without and with them.
    pub fn is_explained_by(
        &self,
        known: &[EffectId],
        before: Completeness,
        free_run: &(Completeness, Completeness),
    ) -> bool {
        self.found.is_empty() && !known.is_empty() && is_explained(known, [before, self.after], Some(free_run))
    }

    /// Whether what was found leaves more in the free run than any healthy motor does.
    pub fn leaves_more_than_healthy(&self) -> bool {
        !self.found.is_empty() && self.free_run.is_some_and(|(_, with)| !with.may_be_healthy())
    }

    /// Fall of the error by what was found, of the free run where there is one: sum of the logarithms of both sides.
    pub fn fall(&self) -> f64 {
        let (without, with) = self.free_run.unwrap_or((self.before, self.after));
        (without.electrical / with.electrical).ln() + (without.mechanical / with.mechanical).ln()
    }

    /// Whether an effect may have been chosen too early, while others were missing: several leave more than a healthy
    /// motor, or one that explains nearly all; `left` is what they leave in the free run, if nothing of it is
    /// turbulence that passes to the current. In the place of one that leaves much two at a time have been tried by
    /// then.
    pub fn may_have_chosen_too_early(&self, left: &Completeness) -> bool {
        !self.found.is_empty() && !left.may_be_healthy() && (self.found.len() > 1 || self.is_explained())
    }
}

/// [`Ladder::is_explained`] by the completeness of the balances, at the beginning and at the end, and that of the free
/// run.
fn is_explained(
    found: &[EffectId],
    [before, after]: [Completeness; 2],
    free_run: Option<&(Completeness, Completeness)>,
) -> bool {
    match (free_run, found.is_empty()) {
        (free_run, true) => after.is_complete() && free_run.is_none_or(|(without, _)| without.may_be_healthy()),
        (Some((without, with)), false) => {
            let roughly_undone = with.is_complete() && found.iter().any(|id| bends_in_the_chain(*id));
            with.explains(without) && (roughly_undone || !after.leaves_most(&before))
        }
        (None, false) => after.explains(&before),
    }
}

/// Whether an effect makes a channel another function of time or size than the signal plus a constant.
fn bends_in_the_chain(id: EffectId) -> bool {
    let d = id.description();
    d.acts == Acts::Measuring && d.two_make_it.is_none()
}

/// What a climb that goes on leaves out: what was dropped, but not what was dropped before the free run has added
/// something that stays, beside which it may be needed.
pub fn left_out(kind: Kind, steps: &[Step], found: &[EffectId]) -> Vec<EffectId> {
    let stays = |step: &Step| step.in_free_run && step.winners.iter().any(|id| found.contains(id));
    let last = steps.iter().rposition(stays).map_or(0, |k| k + 1);
    dropped(kind, &steps[last..], found)
}

/// Effects that steps have added and that are no longer among what was found.
pub fn dropped(kind: Kind, steps: &[Step], found: &[EffectId]) -> Vec<EffectId> {
    let added = steps.iter().flat_map(|s| &s.winners).copied();
    added.filter(|id| found.iter().all(|kept| !classes::same(kind, *kept, *id))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(winners: &[EffectId], in_free_run: bool) -> Step {
        Step {
            promises: Vec::new(),
            tried: Vec::new(),
            winners: winners.to_vec(),
            together: false,
            in_free_run,
            as_well: Vec::new(),
            decoy_gain: 0.0,
            decoys: [0, 0],
        }
    }

    #[test]
    fn what_a_climb_began_with_and_dropped_is_left_out() {
        let steps = [step(&[EffectId::Stribeck], false), step(&[EffectId::Saturation], false), step(&[], false)];
        assert_eq!(left_out(Kind::Universal, &steps, &[EffectId::Saturation]), [EffectId::Stribeck]);
    }

    #[test]
    fn what_was_dropped_is_tried_beside_what_the_free_run_has_added_since() {
        let steps = [
            step(&[EffectId::SpeedLag], false),
            step(&[EffectId::Saturation], false),
            step(&[EffectId::Stribeck], true),
        ];
        assert!(left_out(Kind::Universal, &steps, &[EffectId::Saturation, EffectId::Stribeck]).is_empty());
        // But not where that has not stayed, nor what was dropped afterwards.
        assert_eq!(
            left_out(Kind::Universal, &steps, &[EffectId::Saturation]),
            [EffectId::SpeedLag, EffectId::Stribeck]
        );
        let more = [&steps[..], &[step(&[EffectId::BrushDrop], false)]].concat();
        assert_eq!(
            left_out(Kind::Universal, &more, &[EffectId::Saturation, EffectId::Stribeck]),
            [EffectId::BrushDrop]
        );
    }

    fn left(electrical: f64, mechanical: f64) -> Completeness {
        Completeness { electrical, mechanical }
    }

    #[test]
    fn balances_contradict_a_free_run_but_not_one_that_is_complete_with_what_bends_in_the_chain() {
        let balances = [left(1.1, 4.2), left(1.1, 3.8)];
        let free_run = (left(20.0, 9.0), left(1.1, 1.2));
        let explained = |found: EffectId, free_run| is_explained(&[found], balances, Some(free_run));
        assert!(explained(EffectId::CurrentCompression, &free_run) && explained(EffectId::SpeedLag, &free_run));
        assert!(!explained(EffectId::Saturation, &free_run), "an effect of the motor has to show in its balance");
        assert!(!explained(EffectId::CurrentOffset, &free_run), "the balances undo an offset exactly");
        // Explained, a twentieth of the speed's structure being left, but not complete.
        let nearly = (left(20.0, 9.0), left(1.1, 1.38));
        assert!(!explained(EffectId::CurrentCompression, &nearly));
        assert!(is_explained(&[EffectId::Saturation], [left(1.1, 4.2), left(1.1, 1.4)], Some(&nearly)));
    }

    #[test]
    fn nothing_found_is_no_acquittal_where_the_free_run_is_far_off() {
        let balances = [left(1.2, 1.2); 2];
        let explained = |free_run: Option<Completeness>| is_explained(&[], balances, free_run.map(|c| (c, c)).as_ref());
        assert!(explained(None) && explained(Some(left(1.1, 1.7))));
        assert!(!explained(Some(left(1.1, 3.0))));
        assert!(!is_explained(&[], [left(1.2, 1.6); 2], None), "a balance keeps structure");
    }
}
