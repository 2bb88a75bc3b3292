//! What the form of a law has swallowed.
//!
//! Two laws of a class may fit alike as long as something else is missing, one because it is bent to take that along:
//! of a motor with saturation and a brush drop armature reaction was found, whose softer curve makes up for most of the
//! drop, so that nothing seemed to be missing beside it. Beside the other law the drop is seen at once.

use greyrig::effects::EffectId;

use super::more::WORTH_LOOKING;
use super::{Judged, SecondLook};
use crate::diagnose::classes;
use crate::diagnose::criteria::SMALLEST_GAIN;
use crate::diagnose::ladder::Tried;
use crate::error::Result;

impl SecondLook<'_> {
    /// Climbs on from another law of the class of an effect, where something is left; if more is found beside it, which
    /// takes most of that.
    pub(super) fn in_another_form(&self, judged: Judged) -> Result<Judged> {
        if self.audit.excess(&judged.1, &judged.1).iter().sum::<f64>() <= WORTH_LOOKING {
            return Ok(judged);
        }
        let ladder = &judged.0;
        let kind = judged.1.space.kind();
        let tried = |id: EffectId| ladder.steps.iter().flat_map(|step| &step.tried).find(|t| t.id == id);
        let of_its_class = |id: &EffectId| -> Vec<(EffectId, &Tried)> {
            let others = classes::class_of(kind, *id).unwrap_or_default().into_iter().filter(|other| other != id);
            others.filter_map(tried).map(|t| (*id, t)).collect()
        };
        for (id, other) in ladder.found.iter().flat_map(of_its_class) {
            self.climb.context().doing(other.id.id());
            let exchange = self.climb.exchange(ladder, id, other)?;
            if !self.climb.may_come_closer_by(&exchange, ladder)? {
                continue;
            }
            let more = self.climb.climb_on_from(&exchange, self.base, ladder)?;
            // An inductance is what two laws of the flux differ by, and nothing besides.
            let differs = |id: &EffectId| !ladder.found.contains(id) && classes::bends_with(*id, &more.found);
            if more.found.iter().any(differs) || self.climb.gain(&ladder.fit, &more.fit)? < SMALLEST_GAIN {
                continue;
            }
            let more = self.judged(more)?;
            if self.is_better(&judged, &more)? {
                return Ok(more);
            }
        }
        Ok(judged)
    }
}
