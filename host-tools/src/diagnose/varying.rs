//! What a parameter that varies makes of a verdict.

use super::audit::Audit;
use super::climb::Climb;
use super::constancy::Variation;
use super::ladder::Ladder;
use super::verdict::{Verdict, VerdictKind};
use crate::error::Result;
use crate::identify::minimise::Fit;

/// A search that has ended, and what is asked of parameters that vary.
pub struct Varying<'a> {
    /// The balances.
    pub climb: &'a Climb<'a>,
    /// The free run, and its fits without and with all effects.
    pub in_free_run: Option<(&'a Audit<'a>, &'a [Fit; 2])>,
    /// The model as it was, by the balances.
    pub base: &'a Fit,
    /// What was found.
    pub ladder: &'a Ladder,
    /// Whether nothing was: no effect, and nothing in the samples.
    pub alone: bool,
    /// Whether nothing was in the samples.
    pub samples_are_clean: bool,
    /// Whether the effects that the model has explain nearly all.
    pub by_what_it_has: bool,
    /// Whether an effect that was found is strained.
    pub is_strained: bool,
}

impl Varying<'_> {
    /// The verdict and the parameter that varies beside it, which was found in the balances if it was; `judge` gives
    /// the verdict of a motor whose parameters are constants.
    ///
    /// # Errors
    /// An interrupt.
    pub fn decide(
        &self,
        varies: Option<Variation>,
        judge: impl FnOnce() -> Verdict,
    ) -> Result<(Option<Variation>, Verdict)> {
        let instead = if self.samples_are_clean { self.climb.changes_instead(self.base, self.ladder)? } else { None };
        if let Some(change) = instead.filter(|change| self.shows(change, 0)) {
            let verdict = Verdict::changed(&change);
            return Ok((Some(change), verdict));
        }
        let verdict = judge();
        let is_outside = verdict.kind == VerdictKind::OutsideCatalogue;
        let in_free_run = || {
            let is_open = is_outside && !self.by_what_it_has && !self.is_strained;
            self.in_free_run.filter(|_| is_open).and_then(|(audit, [_, with])| audit.changes(with))
        };
        let varies = varies.filter(|varies| self.shows(varies, 1)).or_else(in_free_run);
        let verdict = match &varies {
            Some(varies) if self.alone => verdict.beside(varies),
            _ => verdict,
        };
        let is_constant = varies.as_ref().is_none_or(|varies| varies.of_law().is_some());
        let verdict = if self.by_what_it_has && is_constant { verdict.but_for_forms() } else { verdict };
        Ok((varies, verdict))
    }

    /// Whether it shows in one of the fits of the free run, too.
    fn shows(&self, varies: &Variation, fit: usize) -> bool {
        self.in_free_run.is_none_or(|(audit, fits)| audit.shows(varies, &fits[fit]))
    }
}
