//! What chance alone may have put behind the effect that was found.
//!
//! Where a motor runs steadily all friction is one torque; which law it follows rests on the run-up alone, and a load
//! that fluctuates then decides between two laws. In the balances such laws drown in the noise of the acceleration.
//! Candidates that come near to a single effect are fitted to the free run in its place. One is kept as a rival if its
//! validation error exceeds the winner's by less than two standard errors (delete-a-block jackknife), and its gain
//! falls short of the winner's by less than the rest of a law earns ([`LEAST_SHARE_OF_A_LAW`]).

use greyrig::effects::EffectId;
use rayon::prelude::*;

use super::{Judged, SecondLook};
use crate::diagnose::audit::LEAST_SHARE_OF_A_LAW;
use crate::diagnose::classes;
use crate::diagnose::ladder::Tried;
use crate::diagnose::sizes::parameters_of;
use crate::error::Result;
use crate::identify::minimise::{Fit, HeldOut};
use crate::identify::space::{Freedom, Key, Space};

/// Error of the free run at the fit of a candidate by the balances over that of what was found, sum of the logarithms
/// of both signals, up to which the candidate is fitted to the free run.
const NEAR: f64 = 0.7;
/// Standard errors that a difference of chance does not exceed.
const BY_CHANCE: f64 = 2.0;

impl SecondLook<'_> {
    /// Candidates of the first step that may be behind a single effect by chance.
    ///
    /// # Errors
    /// An interrupt.
    pub(super) fn behind_by_chance(&self, judged: &Judged) -> Result<Vec<EffectId>> {
        let (_, kept) = judged;
        let Some((own, others)) = self.of_first_step(judged) else { return Ok(Vec::new()) };
        let here = self.audit.log_error(kept);
        let is_near = |t: &&Tried| self.audit.log_error_at(&t.fit.space) - here < NEAR;
        let near: Vec<&Tried> = others.into_iter().filter(is_near).collect();
        let all = self.audit.fall(&self.free, kept);
        let may_be = |t: &&Tried| {
            self.climb.context().doing(t.id.id());
            let fit = self.audit.fit(&self.in_its_place(own.id, t, kept))?;
            let as_far = self.audit.fall(&fit, kept) < LEAST_SHARE_OF_A_LAW * all;
            Ok((as_far && self.is_behind_by_chance(kept, &fit)?).then_some(t.id))
        };
        let rivals: Vec<_> = near.par_iter().map(may_be).collect::<Result<_>>()?;
        Ok(rivals.into_iter().flatten().collect())
    }

    /// The single effect that was found, as it was tried in the first step by the balances, and what was tried there
    /// that is of another class and lacks nothing but size.
    pub(super) fn of_first_step<'j>(&self, (ladder, kept): &'j Judged) -> Option<(&'j Tried, Vec<&'j Tried>)> {
        let ([found], step) = (&ladder.found[..], ladder.steps.first()?) else { return None };
        if step.in_free_run || step.together {
            return None;
        }
        let own = step.tried.iter().find(|t| t.id == *found)?;
        let is_another = |t: &&Tried| !classes::same(kept.space.kind(), own.id, t.id);
        let lacks_size = |t: &&Tried| t.objection.is_none_or(|o| o.is_of_size());
        Some((own, step.tried.iter().filter(is_another).filter(lacks_size).collect()))
    }

    /// The model with a candidate in the place of an effect; if its law can be bent more, in its usual shape.
    fn in_its_place(&self, id: EffectId, other: &Tried, kept: &Fit) -> Space {
        let scales = kept.space.scales(self.climb.experiments());
        let mut space = kept.space.without_effect(id).with_effect(other.id, &scales);
        if parameters_of(other.id) > parameters_of(id) {
            space.hold(Key::shapes_of(other.id), Freedom::Pinned);
        } else {
            space.start_from(&other.fit.space, other.id);
        }
        space
    }

    /// Whether a fit is behind another one by chance.
    fn is_behind_by_chance(&self, ahead: &Fit, behind: &Fit) -> Result<bool> {
        let (difference, scatter) = difference(self.audit.held_out(behind)?, self.audit.held_out(ahead)?);
        Ok(difference < BY_CHANCE * scatter)
    }
}

/// By how much the error of a fit on data held out is larger than another one's, sum of the logarithms of both signals,
/// and its standard error.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn held_out(currents: &[f64]) -> HeldOut {
        HeldOut::new(currents.iter().map(|s| [*s, 0.0]).collect(), vec![[1.0, 0.0]; currents.len()])
    }

    #[test]
    fn a_difference_that_all_blocks_share_is_none_of_chance() {
        // Twice the squares in each block: ln 2 / 2, whichever is left out.
        let (difference, scatter) = difference(&held_out(&[2.0, 4.0, 6.0]), &held_out(&[1.0, 2.0, 3.0]));
        assert!((difference - 0.5 * 2f64.ln()).abs() < 1e-12 && scatter < 1e-12, "{difference} {scatter}");
    }

    #[test]
    fn a_difference_of_one_block_scatters_as_widely_as_it_is_large() {
        // Ten blocks alike, an eleventh in which one is worse by their sum: without that the two are equal.
        let alike = [1.0; 10];
        let one = held_out(&[&alike[..], &[11.0]].concat());
        let (difference, scatter) = difference(&one, &held_out(&[1.0; 11]));
        // By hand: ln(21/11)/2, ten times ln(20/10)/2 and once 0 without a block.
        let each: Vec<f64> = [[0.5 * 2f64.ln(); 10].as_slice(), &[0.0]].concat();
        let mean = each.iter().sum::<f64>() / 11.0;
        let by_hand = (10.0 / 11.0 * each.iter().map(|d| (d - mean).powi(2)).sum::<f64>()).sqrt();
        assert!((difference - 0.5 * (21.0f64 / 11.0).ln()).abs() < 1e-12 && (scatter - by_hand).abs() < 1e-12);
        assert!(difference < BY_CHANCE * scatter, "{difference} {scatter}");
    }
}
