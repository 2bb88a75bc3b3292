//! Gain error of the current channel.
//!
//! `i_shown = (1 + e) i`, e dimensionless. With g = 1 + e a fit gives R/g and L/g and, for a series motor, K/g, g J and
//! g μ, for permanent magnets K, g J and g μ, exactly: the voltage stays and the power grows by g.
//!
//! Source: the base equations, which are unchanged when all quantities are scaled along.

use super::{
    Acts, Description, EffectId, EffectParameter, Memory, PhysicalEffect, Prior, Relative, Role, Seen, Separation,
};
use crate::motor::State;
use crate::scalar::Scalar;

/// Current that is shown too large or too small by a factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurrentGain<S> {
    /// e.
    pub error: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for CurrentGain<S> {
    const DESCRIPTION: Description = Description {
        name: "gain error of the current channel",
        equation: "i_shown = (1 + e) i",
        acts: Acts::Measuring,
        seen: Seen::Invisible("a reference meter for the current"),
        parameters: &[EffectParameter {
            name: "current_gain",
            unit: "1",
            role: Role::Size,
            range: (-0.5, 0.5),
            start: 0.02,
            relative: Relative::Absolute,
            meaning: "relative error of the gain, positive when too large a current is shown",
        }],
        size_in_words: "the current channel shows {} too much",
        prior: Prior::common("shunts and Hall sensors have a tolerance of a per cent or so"),
        why: "The ammeter shows a share too much or too little. R, K and friction take its place, so that the curves \
              fit as before with wrong figures.",
        noticed: "Nothing at all in these three channels. R from this rig differs from the ohmmeter's.",
        remedy: "Compare with a reference meter at two currents, and put the factor into `--map`, or the rig's \
                 calibration. No recording of the motor can tell it.",
        signature: "none: parameters of the base model take its place",
        confused_with: &[EffectId::VoltageGain, EffectId::SpeedGain],
        separated_by: &[Separation::by("a reference meter for the current")],
        source: "scaling of the base equations",
        ..Description::usual(EffectId::CurrentGain)
    };
    fields!(error);
    #[inline(always)]
    fn measure(&self, _: &Memory<S>, reading: &mut State<S>) {
        reading.current = reading.current * (S::ONE + self.error);
    }
}
