//! The fits of the candidates of a step: begun, and finished where they lead.

use rayon::prelude::*;

use super::{Climb, THOROUGH};
use crate::diagnose::criteria::SMALLEST_GAIN;
use crate::diagnose::screening::Promise;
use crate::diagnose::{classes, screening};
use crate::error::Result;
use crate::identify::minimise::{Effort, Fit};
use crate::identify::space::Space;

/// How hard each candidate is fitted at first.
const BEGINNING: Effort = Effort { steps: 4, tolerance: 1e-2, carried_on: 4, confirmed: false };
/// A candidate that then gains less than this share of what the screening promised has lost its way: it begins once
/// more, from a small size.
const KEPT_PROMISE: f64 = 0.5;
/// A candidate that then gains less than this share of what the best one gains is not fitted any further.
const WORTH_FINISHING: f64 = 0.3;

/// Fall of the logarithm of the error from which a fit has come a long way: that of either signal by a factor of e.
const FAR: f64 = 2.0;

/// A candidate and the model with it.
type Fitted<'p> = (&'p Promise, Fit);

impl Climb<'_> {
    /// Fits the candidates that are worth it.
    pub(super) fn fits<'p>(&self, fit: &Fit, worthy: &[&'p Promise], smallest: f64) -> Result<Vec<Fitted<'p>>> {
        let begin = |promise: &&'p Promise| {
            self.ctx.doing(promise.id.id());
            let (refined, gain) = self.begin(fit, promise, smallest)?;
            Ok((*promise, refined, gain))
        };
        let begun: Vec<(&Promise, Fit, f64)> = worthy.par_iter().map(begin).collect::<Result<_>>()?;
        // Of a fit that is still far from its end, data held out say little where one block reaches beyond all others.
        let fall = |refined: &Fit| self.error(fit) - self.error(refined);
        let most = begun.iter().map(|b| b.2).fold(0.0, f64::max);
        let farthest = begun.iter().map(|b| fall(&b.1)).fold(0.0, f64::max);
        let finish = |(promise, refined, gain): (&'p Promise, Fit, f64)| {
            let leads = gain > WORTH_FINISHING * most
                || self.may_hold_an_inrush() && fall(&refined) > WORTH_FINISHING * farthest;
            Ok((promise, if leads { self.finish(fit, promise, &refined)? } else { refined }))
        };
        let finished: Vec<Fitted<'p>> = begun.into_par_iter().map(finish).collect::<Result<_>>()?;
        let again = |fitted: &Fitted<'p>| self.begun_in_its_class(fitted, &finished);
        let again: Vec<Option<Fit>> = finished.par_iter().map(again).collect::<Result<_>>()?;
        Ok(finished.into_iter().zip(again).map(|((promise, fit), better)| (promise, better.unwrap_or(fit))).collect())
    }

    /// The first steps of a candidate's fit, and what they gain.
    fn begin(&self, fit: &Fit, promise: &Promise, smallest: f64) -> Result<(Fit, f64)> {
        let from = |space: &Space| -> Result<(Fit, f64)> {
            let refined = self.fit_from(Some(fit.rms), space, BEGINNING)?;
            let gain = self.gain(fit, &refined)?;
            Ok((refined, gain))
        };
        let first = from(&promise.space)?;
        if promise.gain <= smallest || first.1 >= KEPT_PROMISE * promise.gain {
            return Ok(first);
        }
        let again = from(&screening::at_small_size(&promise.space, promise.id))?;
        Ok(if again.1 > first.1 { again } else { first })
    }

    /// The rest of a candidate's fit. Where it leads far away from the model without it, a quick beginning may have led
    /// to a wrong local minimum: then once more, with care, from where the screening suggests. (Not for data without
    /// current: there a flexible friction law overfits a single step if the fit is continued.)
    fn finish(&self, fit: &Fit, promise: &Promise, begun: &Fit) -> Result<Fit> {
        let usual = self.go_on(begun, Effort::USUAL)?;
        if !self.may_hold_an_inrush() {
            return Ok(usual);
        }
        let quick = if usual.ended { usual } else { self.go_on(&usual, Effort::PATIENT)? };
        if self.error(fit) - self.error(&quick) < FAR {
            return Ok(quick);
        }
        let careful = self.fit_from(Some(fit.rms), &promise.space, THOROUGH)?;
        Ok(if self.error(&careful) < self.error(&quick) { careful } else { quick })
    }

    /// A better fit of a candidate from where another law of its class has ended, if that has come to a better valley.
    fn begun_in_its_class(&self, (promise, refined): &Fitted<'_>, fits: &[Fitted<'_>]) -> Result<Option<Fit>> {
        let kind = refined.space.kind();
        let leads = |(other, fit): &&Fitted<'_>| {
            other.id != promise.id
                && classes::same(kind, other.id, promise.id)
                && self.error(fit) < self.error(refined) - SMALLEST_GAIN
        };
        let leader = fits.iter().filter(leads).min_by(|a, b| self.error(&a.1).total_cmp(&self.error(&b.1)));
        let Some((other, there)) = leader else { return Ok(None) };
        let scales = there.space.scales(self.experiments);
        let space = there.space.without_effect(other.id).with_effect(promise.id, &scales);
        let again = self.fit_from(Some(there.rms), &space, Effort::PATIENT)?;
        Ok((self.error(&again) < self.error(refined)).then_some(again))
    }
}
