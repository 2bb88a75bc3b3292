//! Gain error of the voltage channel.
//!
//! `u_recorded = (1 + e) u`, so that `u/(1 + e)` of the record reaches the motor; e is dimensionless. R, L, K, J and
//! the friction of a fit all become larger by the same factor, exactly.
//!
//! Source: the base equations, which are unchanged when all quantities are scaled along.

use super::{
    Acts, Description, EffectId, EffectParameter, Memory, PhysicalEffect, Prior, Relative, Role, Seen, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Voltage that is shown too large or too small by a factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VoltageGain<S> {
    /// e.
    pub error: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for VoltageGain<S> {
    const DESCRIPTION: Description = Description {
        name: "gain error of the voltage channel",
        equation: "u_recorded = (1 + e) u",
        acts: Acts::Electrical,
        seen: Seen::Invisible("a reference meter for the voltage"),
        bends_supply: true,
        parameters: &[EffectParameter {
            name: "voltage_gain",
            unit: "1",
            role: Role::Size,
            range: (-0.5, 0.5),
            start: 0.02,
            relative: Relative::Absolute,
            meaning: "relative error of the gain, positive when too large a voltage is shown",
        }],
        size_in_words: "the voltage channel shows {} too much",
        prior: Prior::common("resistors of a divider have a tolerance of a per cent or so"),
        why: "The voltmeter shows a share too much or too little. All parameters shrink or grow with it, so that the \
              curves fit as before with wrong figures.",
        noticed: "Nothing at all in these three channels. K from this rig differs from K of another one.",
        remedy: "Compare with a reference meter at two voltages, and put the factor into `--map`, or the rig's \
                 calibration. No recording of the motor can tell it.",
        signature: "none: all parameters of the base model take its place",
        confused_with: &[EffectId::CurrentGain, EffectId::SpeedGain, EffectId::CommutationResistance],
        separated_by: &[Separation::by("a reference meter for the voltage")],
        source: "scaling of the base equations",
        ..Description::usual(EffectId::VoltageGain)
    };
    fields!(error);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        balance.supply = balance.supply.times(S::ONE / (S::ONE + self.error));
    }
}
