//! Gain error of the speed channel.
//!
//! `ω_shown = (1 + e) ω`, e dimensionless. With g = 1 + e a fit gives K/g, J/g², μ0/g, μ1/g² and μ2/g³, exactly:
//! neither the voltage nor the power changes.
//!
//! Source: the base equations, which are unchanged when all quantities are scaled along.

use super::{
    Acts, Description, EffectId, EffectParameter, Memory, PhysicalEffect, Prior, Relative, Role, Seen, Separation,
};
use crate::motor::State;
use crate::scalar::Scalar;

/// Speed that is shown too large or too small by a factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedGain<S> {
    /// e.
    pub error: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for SpeedGain<S> {
    const DESCRIPTION: Description = Description {
        name: "gain error of the speed channel",
        equation: "ω_shown = (1 + e) ω",
        acts: Acts::Measuring,
        seen: Seen::Invisible("a reference meter for the speed, or a stroboscope"),
        parameters: &[EffectParameter {
            name: "speed_gain",
            unit: "1",
            role: Role::Size,
            range: (-0.5, 0.5),
            start: 0.02,
            relative: Relative::Absolute,
            meaning: "relative error of the gain, positive when too large a speed is shown",
        }],
        size_in_words: "the speed channel shows {} too much",
        prior: Prior::occasional("a wrong number of lines, or the tolerance of a tachometer"),
        on_speed_channel: true,
        why: "The tacho shows a share too much or too little: a wrong number of lines, or its tolerance. K, J and \
              friction take its place.",
        noticed: "Nothing at all in these three channels. A stroboscope shows another speed.",
        remedy: "Check the number of pulses per turn, and compare with a stroboscope. Put the factor into `--map`, \
                 or the rig's calibration.",
        signature: "none: parameters of the base model take its place",
        confused_with: &[EffectId::VoltageGain, EffectId::CurrentGain, EffectId::CommutationResistance],
        separated_by: &[Separation::by("a reference meter for the speed")],
        source: "scaling of the base equations",
        ..Description::usual(EffectId::SpeedGain)
    };
    fields!(error);
    #[inline(always)]
    fn measure(&self, _: &Memory<S>, reading: &mut State<S>) {
        reading.speed = reading.speed * (S::ONE + self.error);
    }
}
