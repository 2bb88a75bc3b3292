//! A single effect that the free run contradicts.
//!
//! The balances weigh what a noisy derivative shows; of two laws that act at the same places, as a drop with the sign
//! of the current and a dead zone with that of the voltage, they may prefer the wrong one by little, while the free run
//! comes far closer with the other. Then the other one is followed.

use super::{Judged, SMALLEST_FALL, SecondLook};
use crate::error::Result;

impl SecondLook<'_> {
    /// Exchanges a single effect for the candidate of the first step that comes closest in the free run, as fitted to
    /// the balances, where that is closer on data held out, too, and explains all.
    pub(super) fn not_contradicted(&self, judged: Judged) -> Result<Judged> {
        let (ladder, kept) = &judged;
        let Some((own, others)) = self.of_first_step(&judged) else { return Ok(judged) };
        let here = self.audit.log_error(kept);
        let closer = others.into_iter().map(|t| (here - self.audit.log_error_at(&t.fit.space), t));
        let closest = closer.filter(|(closer, _)| *closer > SMALLEST_FALL).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, other)) = closest else { return Ok(judged) };
        self.climb.context().doing(other.id.id());
        let exchange = self.climb.exchange(ladder, own.id, other)?;
        let Some(other) = self.climb.climb_away_from(&exchange, self.base, ladder)? else { return Ok(judged) };
        let Some(other) = self.judged_if_closer(other, &judged)? else { return Ok(judged) };
        let is_closer = other.0.is_explained() && self.audit.held_out_fall(&judged.1, &other.1)? > SMALLEST_FALL;
        Ok(if is_closer && !other.0.found.is_empty() { other } else { judged })
    }
}
