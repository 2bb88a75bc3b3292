//! Load of a fan or a pump, where the base model is without it or has it fixed.
//!
//! `J dω/dt = … − c ω|ω|`, c in N m s²/rad².
//!
//! Source: similarity law of turbomachines (torque in proportion to the square of the speed); Modelica Standard
//! Library, Mechanics.Rotational.Sources.QuadraticSpeedDependentTorque.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::{Balance, BaseParameter, OperatingPoint};
use crate::scalar::Scalar;

/// Torque in proportion to the square of the speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraticLoad<S> {
    /// c, N m s²/rad².
    pub coefficient: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for QuadraticLoad<S> {
    const DESCRIPTION: Description = Description {
        name: "load that grows with the square of the speed",
        equation: "J dω/dt = … − c ω|ω|",
        acts: Acts::Mechanical,
        stands_for: Some(BaseParameter::Mu2),
        parameters: &[EffectParameter {
            name: "quadratic_load",
            unit: "N m s²/rad²",
            role: Role::Size,
            range: (0.0, 1e4),
            start: 1.0,
            relative: Relative::FrictionPerSpeedSquared,
            meaning: "torque per square of the speed",
        }],
        size_in_words: "the load grows by {} with the square of the speed",
        excited_by: &[Excitation::Speed],
        prior: Prior::common("fans and pumps, and the windage of any fast rotor"),
        why: "Air and oil brake with the square of the speed. A model with friction in proportion to the speed alone \
              is right at one speed, and too slow or too fast at all others.",
        noticed: "The rotor moves air: a fan or bare arms can be heard rushing. The speed gains less and less from \
                  each volt.",
        remedy: "Name it, if there is a fan or a disc. If there should be none, look for a guard that is missing, or \
                 a rotor that churns in oil.",
        signature: "a braking torque that grows faster than the speed, in either direction",
        confused_with: &[EffectId::WindageExponent, EffectId::StrayLoadTorque, EffectId::IronLossDrag],
        separated_by: &[Separation::open_supply("a coast-down from full speed without a current")],
        source: "similarity law of turbomachines",
        ..Description::usual(EffectId::QuadraticLoad)
    };
    fields!(coefficient);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        balance.turbulent_friction = balance.turbulent_friction.plus(self.coefficient);
    }
}
