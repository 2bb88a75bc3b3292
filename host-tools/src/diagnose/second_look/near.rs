//! What another effect does nearly as well, or better, as the judge of the free run sees it.
//!
//! Where a motor runs steadily all friction is one torque; which law it follows rests on the run-up alone, and a load that fluctuates then
//! decides between two laws. In the balances such laws drown in the noise of the acceleration. Candidates that come near to a single
//! effect are fitted to the free run in its place: one that comes closer than it takes its place, and one is a rival that is behind it
//! by chance, its error on data held out being larger by no more than the difference scatters from one block of time to the next
//! (delete-a-block jackknife).

use rayon::prelude::*;

use super::{Judged, SecondLook};
use crate::diagnose::audit::LEAST_SHARE_OF_A_LAW;
use crate::diagnose::blocks::HeldOut;
use crate::diagnose::fit::Fit;
use crate::diagnose::ladder::{Ladder, Tried};
use crate::diagnose::{Progress, Watch, classes};
use crate::error::Result;

/// Error of the free run at the fit of a candidate by the balances over that of what was found, sum of the logarithms of both signals, up
/// to which the candidate is fitted to the free run.
const NEAR: f64 = 0.7;
/// Standard errors that a difference of chance does not exceed.
const BY_CHANCE: f64 = 2.0;

impl SecondLook<'_> {
    /// Gives a single effect for one that comes closer in the free run, on data held out too, and explains as much; or else lists what is
    /// behind it by chance.
    pub(super) fn closest(&self, judged: Judged, progress: &Watch<'_>) -> Result<(Judged, Vec<&'static str>)> {
        let (ladder, kept) = &judged;
        let near = self.near(ladder, kept, progress)?;
        let Some((own, _)) = of_first_step(ladder) else { return Ok((judged, Vec::new())) };
        if let Some((other, _)) = near.iter().find(|(_, fit)| self.is_closer(kept, fit)) {
            let exchange = self.climb.exchange(ladder, own.id, other)?;
            let anew = self.judged(self.climb.climb_on_from(&exchange, self.base, ladder, progress)?)?;
            if self.is_closer(kept, &anew.1) && (anew.0.is_explained() || !ladder.is_explained()) {
                return Ok((anew, Vec::new()));
            }
        }
        let all = self.audit.fall(&self.free, kept);
        let as_far = |fit: &Fit| self.audit.fall(&self.free, fit) > (1.0 - LEAST_SHARE_OF_A_LAW) * all;
        let by_chance = near.iter().filter(|(_, fit)| as_far(fit) && self.is_behind_by_chance(kept, fit));
        let by_chance = by_chance.map(|(other, _)| other.id).collect();
        Ok((judged, by_chance))
    }

    /// The candidates of the first step that come near to the single effect that was found, fitted to the free run in its place.
    fn near<'l>(&self, ladder: &'l Ladder, kept: &Fit, progress: &Watch<'_>) -> Result<Vec<(&'l Tried, Fit)>> {
        let Some((own, step)) = of_first_step(ladder) else { return Ok(Vec::new()) };
        let kind = kept.space.kind();
        let here: f64 = kept.rms.iter().filter(|rms| **rms > 0.0).map(|rms| rms.ln()).sum();
        let counts = |t: &&Tried| !classes::same(kind, own.id, t.id) && t.objection.is_none_or(|o| o.is_of_size());
        let near: Vec<&Tried> = step.iter().filter(counts).filter(|t| self.log_error_at(t) - here < NEAR).collect();
        let fit = |t: &'l Tried| {
            progress(Progress::Doing(t.id));
            Ok((t, self.in_place_of(own.id, t, kept)?))
        };
        near.into_par_iter().map(fit).collect()
    }

    /// Whether a fit is behind another one by chance.
    fn is_behind_by_chance(&self, ahead: &Fit, behind: &Fit) -> bool {
        let (difference, scatter) = difference(self.audit.held_out(behind), self.audit.held_out(ahead));
        difference < BY_CHANCE * scatter
    }
}

/// The single effect that was found, as it was tried in the first step by the balances, and all that was tried there.
fn of_first_step(ladder: &Ladder) -> Option<(&Tried, &[Tried])> {
    let ([found], step) = (&ladder.found[..], ladder.steps.first()?) else { return None };
    let own = step.tried.iter().find(|t| t.id == *found)?;
    (!step.in_free_run && !step.together).then_some((own, &step.tried))
}

/// By how much the error of a fit on data held out is larger than another one's, sum of the logarithms of both signals, and its standard
/// error.
fn difference(one: &HeldOut, other: &HeldOut) -> (f64, f64) {
    let total = |held_out: &HeldOut, g: usize| held_out.squares.iter().map(|s| s[g]).sum::<f64>();
    let totals = [0, 1].map(|g| [total(one, g), total(other, g)]);
    let without = |left_out: [[f64; 2]; 2]| -> f64 {
        let there_is = (0..2).filter(|g| totals[*g].iter().all(|total| *total > 0.0));
        there_is.map(|g| 0.5 * ((totals[g][0] - left_out[g][0]) / (totals[g][1] - left_out[g][1])).ln()).sum()
    };
    let pairs = one.squares.iter().zip(&other.squares);
    let each: Vec<f64> = pairs.map(|(a, b)| without([0, 1].map(|g| [a[g], b[g]]))).collect();
    let blocks = each.len() as f64;
    let mean = each.iter().sum::<f64>() / blocks;
    let squares: f64 = each.iter().map(|d| (d - mean).powi(2)).sum();
    (without([[0.0; 2]; 2]), ((blocks - 1.0) / blocks * squares).sqrt())
}
