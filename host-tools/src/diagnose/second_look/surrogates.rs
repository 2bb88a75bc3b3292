//! Effects that stand in for the form of another one's law.
//!
//! A contact drop that grows with the speed looks, to a catalogue whose drop does not, like a drop with saturation and
//! a load of the air besides: each takes a part of what the speed adds. Where what is left goes with the law of one
//! effect ([`constancy`](crate::diagnose::constancy)), that one alone, with its size going with current or speed, is
//! fitted to the balances of the model as it was. If it comes closer than all that was found, on data held out, the
//! others were its surrogates.

use super::{Judged, SecondLook};
use crate::diagnose::criteria::SMALLEST_GAIN;
use crate::error::Result;

impl SecondLook<'_> {
    /// Leaves of what was found the one effect whose law has another form, where that does as much as all.
    pub(super) fn without_surrogates(&self, judged: Judged) -> Result<Judged> {
        let ladder = &judged.0;
        let form = if ladder.found.len() > 1 { self.climb.varies(&ladder.fit, ladder) } else { None };
        let Some(id) = form.and_then(|form| form.of_law()).filter(|id| ladder.found.contains(id)) else {
            return Ok(judged);
        };
        self.climb.context().doing(id.id());
        let scales = self.base.space.scales(self.climb.experiments());
        let mut space = self.base.space.with_effect(id, &scales);
        space.start_from(&ladder.fit.space, id);
        let alone = self.climb.fit(&space)?;
        let found = self.climb.log_error_held_out(&ladder.fit)?;
        let form = self.climb.varies(&alone, ladder).filter(|form| form.of_law() == Some(id));
        if form.is_none_or(|form| form.log_error + SMALLEST_GAIN >= found) {
            return Ok(judged);
        }
        let free = self.audit.fit(&alone.space)?;
        let mut alone = ladder.clone();
        self.climb.narrow(&mut alone, self.base, &[id], &free)?;
        alone.free_run = Some(self.completeness(&free));
        Ok((alone, free))
    }
}
