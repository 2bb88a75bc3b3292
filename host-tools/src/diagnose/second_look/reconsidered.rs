//! What was passed over though it fits better.
//!
//! Cross-validation cannot credit Stribeck friction: the one or two blocks of the run-up that identify it are the ones
//! left out. Another effect that bends the torque over the whole range, such as windage with another exponent, is then
//! preferred, though it fits worse. The free run adds weak torques up and separates the two.

use greyrig::effects::EffectId;

use super::{Judged, SecondLook};
use crate::diagnose::criteria::SMALLEST_GAIN;
use crate::diagnose::ladder::Tried;
use crate::error::Result;
use crate::identify::minimise::Fit;

impl SecondLook<'_> {
    /// Gives an effect for one that was passed over, where the free run comes closer by that, on data held out too.
    pub(super) fn reconsidered(&self, judged: Judged) -> Result<Judged> {
        for [own, other] in self.climb.passed_over(&judged.0) {
            self.climb.context().doing(other.id.id());
            let gain = self.audit.log_error_at(&own.fit.space) - self.audit.log_error_at(&other.fit.space);
            if gain < SMALLEST_GAIN || !self.is_closer(&judged.1, &self.in_place_of(own.id, other, &judged.1)?)? {
                continue;
            }
            let exchange = self.climb.exchange(&judged.0, own.id, other)?;
            let anew = self.judged(self.climb.climb_on_from(&exchange, self.base, &judged.0)?)?;
            if self.is_closer(&judged.1, &anew.1)? && (anew.0.is_explained() || !judged.0.is_explained()) {
                return Ok(anew);
            }
        }
        Ok(judged)
    }

    /// The fit of the free run with a candidate in the place of an effect, from where the balances have put it.
    fn in_place_of(&self, id: EffectId, other: &Tried, kept: &Fit) -> Result<Fit> {
        let scales = kept.space.scales(self.climb.experiments());
        let mut space = kept.space.without_effect(id).with_effect(other.id, &scales);
        space.start_from(&other.fit.space, other.id);
        self.audit.fit(&space)
    }

    /// Whether a fit comes closer to the data, those held out too.
    fn is_closer(&self, one: &Fit, other: &Fit) -> Result<bool> {
        Ok(self.audit.fall(one, other) > SMALLEST_GAIN && self.audit.held_out_fall(one, other)? > SMALLEST_GAIN)
    }
}
