//! Dry friction, where the base model is without it or has it fixed.
//!
//! `J dω/dt = … − T sign(ω)`, T in N m; at rest it holds the rotor against torques up to T.
//!
//! Source: C. A. Coulomb 1785; Modelica Standard Library, Machines.Losses.Friction and
//! Mechanics.Rotational.Components.BearingFriction.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::{Balance, BaseParameter, OperatingPoint};
use crate::scalar::Scalar;

/// Torque against the motion, whatever the speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoulombFriction<S> {
    /// T, N m.
    pub torque: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for CoulombFriction<S> {
    const DESCRIPTION: Description = Description {
        name: "dry friction",
        equation: "J dω/dt = … − T sign(ω)",
        acts: Acts::Mechanical,
        stands_for: Some(BaseParameter::Mu0),
        parameters: &[EffectParameter {
            name: "coulomb_friction",
            unit: "N m",
            role: Role::Size,
            range: (0.0, 1e4),
            start: 1.0,
            relative: Relative::Friction,
            meaning: "torque against the motion",
        }],
        size_in_words: "the rotor is held by {} before it moves",
        excited_by: &[Excitation::LowSpeed, Excitation::Speed],
        prior: Prior::common("bearings and brushes rub in every motor"),
        why: "A dry contact brakes with the same torque at any speed. Near standstill it is the whole load: the \
              rotor does not start until the current has overcome it, and stops at once.",
        noticed: "A rotor that stops within a few turns when the supply opens, instead of dying away. It does not \
                  move at small currents. Seals and brushes rub; it can be felt by hand.",
        remedy: "Name it. If it has grown, turn the rotor by hand: brushes that press too hard, a seal, a bearing \
                 without grease, something that rubs.",
        signature: "a constant torque error that changes its sign with the direction; a rotor that stops too late and \
                    starts too early",
        confused_with: &[
            EffectId::TorqueOffset,
            EffectId::Stribeck,
            EffectId::AsymmetricFriction,
            EffectId::SupplyDeadZone,
        ],
        separated_by: &[
            Separation::both_directions("motion in both directions"),
            Separation::open_supply("the end of a coast-down"),
        ],
        source: "Coulomb's law",
        ..Description::usual(EffectId::CoulombFriction)
    };
    fields!(torque);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        balance.dry_friction = balance.dry_friction.plus(self.torque);
    }
}
