//! Clipping: the current channel rests at the end of its range while the current goes on.
//!
//! `i_shown = max(−c, min(i, c))`, c in A; c = 0 stands for no limit.
//!
//! Source: converter and amplifier with a limited range.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Seen,
    Separation,
};
use crate::motor::State;
use crate::scalar::Scalar;

/// Current that is shown no larger than the range of the channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdcClipping<S> {
    /// c, A; 0: none.
    pub level: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for AdcClipping<S> {
    const DESCRIPTION: Description = Description {
        name: "clipped current channel",
        equation: "i_shown = max(−c, min(i, c))",
        acts: Acts::Measuring,
        seen: Seen::Samples,
        parameters: &[EffectParameter {
            name: "clipping_level",
            unit: "A",
            role: Role::Size,
            range: (0.0, 1e4),
            start: 1.0,
            relative: Relative::Current,
            meaning: "largest current that is shown; 0: no limit",
        }],
        size_in_words: "the current channel shows {} at most",
        excited_by: &[Excitation::Current],
        prior: Prior::occasional("a range that was chosen for the nominal current, and an inrush"),
        of_data: true,
        why: "The current goes beyond what the channel can show. The tops are cut flat, and a fit takes that for \
              saturation.",
        noticed: "Peaks are flat, with equal values one after the other, in the inrush most.",
        remedy: "Choose a larger range. `greyrig check` tells it, and masks these samples; nothing is to be added to \
                 the model.",
        signature: "flat tops of equal codes; to a fit it looks like saturation",
        confused_with: &[EffectId::Saturation, EffectId::CurrentCompression, EffectId::ArmatureReaction],
        separated_by: &[Separation::by("the samples: codes that repeat at the extreme")],
        source: "converter with a limited range",
        ..Description::usual(EffectId::AdcClipping)
    };
    fields!(level);
    #[inline(always)]
    fn measure(&self, _: &Memory<S>, reading: &mut State<S>) {
        if self.level > S::ZERO {
            if reading.current > self.level {
                reading.current = self.level;
            } else if reading.current < -self.level {
                reading.current = -self.level;
            }
        }
    }
}
