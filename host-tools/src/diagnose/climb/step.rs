//! One step of a climb: all candidates at one model, each judged on data held out.

use std::sync::Arc;

use greyrig::effects::EffectId;
use greyrig::motor::BaseParameter;
use rayon::prelude::*;

use super::Climb;
use crate::diagnose::criteria::{
    BEYOND_DOUBT, LEAST_INDEPENDENT, OVER_DECOYS, SAME_ERROR, SIGNIFICANCE, SMALLEST_GAIN,
};
use crate::diagnose::decoys;
use crate::diagnose::ladder::{Objection, Step, Tried};
use crate::diagnose::screening::Promise;
use crate::diagnose::sizes::parameters_of;
use crate::error::Result;
use crate::identify::cross_validation::p_value;
use crate::identify::minimise::{Fit, Residuals};
use crate::identify::space::Space;

/// Candidates that are fitted after the screening.
const FITTED: usize = 7;
/// A candidate that promises less than this share of the best one's is not fitted.
const WORTH_FITTING: f64 = 0.03;
/// Nor is one that scores below this share of the required gain, but for those that are shown. In 250 exam cases (none
/// to five effects, on AC, in sets, of magnet motors) 962 candidates scored below half of it; one of them would have
/// been accepted, wrongly. Of 322 that scored between half and the whole, 14 would have been accepted.
const WORTH_TRYING: f64 = 0.5;
/// Candidates that are fitted at first, to be shown, however little they promise.
pub(super) const SHOWN: usize = 2;
/// Above [`BEYOND_DOUBT`] the usual level will do: independent rows are few then, because one structure fills them all.
const CONVENTIONAL: f64 = 0.01;
/// R and K that an effect changes by more than this factor are no longer those of the same motor.
const LARGEST_SHIFT: f64 = 3.0;
/// A motor whose flux and inertia both fall by more than this factor is none, however much the error falls: a flux and
/// an inertia of nothing fit any torque balance.
const OF_NO_MOTOR: f64 = 30.0;
/// An effect that gains less than this share of what all together gain may only be making up for the form of another
/// one.
const SMALLEST_SHARE: f64 = 0.02;

impl Climb<'_> {
    /// Tries the candidates of the catalogue at a fit, but for some; what has been `gained` so far tells what is too
    /// little. The first few are `shown`, however little they promise.
    pub(super) fn step(&self, fit: &Fit, left_out: &[EffectId], gained: f64, shown: usize) -> Result<Step> {
        let before = self.held_out(fit)?;
        self.ctx.check()?;
        self.ctx.doing("screening");
        let promises = self.screen(fit, left_out);
        let ranking: Vec<(EffectId, f64)> = promises.iter().map(|p| (p.id, p.gain)).collect();
        (self.ranked)(&ranking);
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
            let p = p_value(before, d, fit, self.problem.groups(), 1) * self.candidates.len() as f64;
            before.log_error() - d.log_error() >= smallest && p <= SIGNIFICANCE
        });
        let accepted = [decoys.len(), accepted.count()];
        let best = promises.first().map_or(0.0, |p| p.gain);
        let worthy: Vec<&Promise> = promises
            .iter()
            .enumerate()
            .filter(|(k, p)| p.gain > WORTH_FITTING * best && (p.gain > WORTH_TRYING * smallest || *k < shown))
            .map(|(_, promise)| promise)
            .take(FITTED)
            .collect();
        let fits = self.fits(fit, &worthy, smallest)?;
        let judge = |(promise, refined): (&Promise, Fit)| {
            let held_out = self.held_out(&refined)?;
            let gain = before.fall_to(held_out);
            let parameters = refined.space.free().count() - fit.space.free().count();
            let single = p_value(before, held_out, &refined, self.problem.groups(), parameters);
            let p_value = (single * self.candidates.len() as f64).min(1.0);
            let objection = if gain < smallest {
                Some(Objection::TooSmall)
            } else if p_value > if gain > BEYOND_DOUBT { CONVENTIONAL } else { SIGNIFICANCE }
                || gain < OVER_DECOYS * decoy_gain
            {
                Some(Objection::NotSignificant)
            } else if promise.independent < LEAST_INDEPENDENT && gain < BEYOND_DOUBT {
                Some(Objection::NotIndependent)
            } else if is_no_motor(&fit.space, &refined.space) {
                Some(Objection::OfNoMotor)
            } else if shift(&fit.space, &refined.space) > LARGEST_SHIFT && gain < BEYOND_DOUBT {
                Some(Objection::Implausible)
            } else {
                None
            };
            Ok(Tried { id: promise.id, fit: Arc::new(refined), gain, p_value, objection })
        };
        let mut tried: Vec<Tried> = fits.into_par_iter().map(judge).collect::<Result<_>>()?;
        tried.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        Ok(Step {
            promises: ranking,
            tried,
            winners: Vec::new(),
            together: false,
            in_free_run: false,
            as_well: Vec::new(),
            decoy_gain,
            decoys: accepted,
        })
    }
}

/// The candidate that counts: the best one, or one that does as well with fewer parameters, or by which its class is
/// named. Where its law lies at the
/// limit beyond which it would be another effect, that one counts if it does as well.
pub fn winner(tried: &[Tried]) -> Option<&Tried> {
    let best = tried.iter().filter(|t| t.objection.is_none()).map(|t| t.gain).fold(f64::NEG_INFINITY, f64::max);
    let winner = tried.iter().filter(|t| t.objection.is_none() && t.gain > best - SAME_ERROR).min_by(|a, b| {
        let [one, other] = [a, b].map(|t| (parameters_of(t.id), stands_for_another(t)));
        one.cmp(&other).then(b.gain.total_cmp(&a.gain))
    })?;
    let other = winner.fit.space.turned(winner.id).and_then(|into| tried.iter().find(|t| t.id == into));
    Some(other.filter(|other| other.gain > winner.gain - SAME_ERROR).unwrap_or(winner))
}

/// Whether the class of a candidate is named by another effect.
fn stands_for_another(t: &Tried) -> bool {
    t.id.description().named_as(t.fit.space.kind().flux_law()) != t.id
}

/// Whether flux and inertia have gone.
fn is_no_motor(before: &Space, after: &Space) -> bool {
    [BaseParameter::K, BaseParameter::J].into_iter().all(|p| before.value(p) > OF_NO_MOTOR * after.value(p))
}

/// Largest factor by which R or K differ. (J may: dry friction passes for inertia on a ramp.)
fn shift(before: &Space, after: &Space) -> f64 {
    [BaseParameter::R, BaseParameter::K]
        .into_iter()
        .map(|parameter| {
            let ratio = after.value(parameter) / before.value(parameter);
            ratio.max(1.0 / ratio)
        })
        .fold(1.0, f64::max)
}
