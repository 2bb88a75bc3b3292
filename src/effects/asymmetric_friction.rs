//! Friction that depends on the direction: brushes that are not radial, a helical gear, a worm or a spindle.
//!
//! `J dω/dt = … − a |ω| − d |s|`, s = direction of motion, a in N m s/rad, d in N m: forwards the viscous friction is
//! μ1 + a and the dry friction μ0 + d, backwards μ1 − a and μ0 − d. At rest the dry part is absent, and the rotor
//! breaks away at μ0 either way.
//!
//! Source: A. Janot, M. Gautier, M. Brunot: Data set and reference models of EMPS, nonlinearbenchmark.org, 2019, whose
//! friction is a dry and a viscous term with an offset; here with an offset of both.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Friction that is larger forwards than backwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AsymmetricFriction<S> {
    /// a, N m s/rad.
    pub viscous: S,
    /// d, N m.
    pub dry: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for AsymmetricFriction<S> {
    const DESCRIPTION: Description = Description {
        name: "friction that depends on the direction",
        equation: "J dω/dt = … − a |ω| − d |s|",
        acts: Acts::Mechanical,
        parameters: &[
            EffectParameter {
                name: "asymmetric_viscous",
                unit: "N m s/rad",
                role: Role::Size,
                range: (-1e4, 1e4),
                start: 0.1,
                relative: Relative::FrictionPerSpeed,
                meaning: "half the difference of viscous friction between forwards and backwards",
            },
            EffectParameter {
                name: "asymmetric_dry",
                unit: "N m",
                role: Role::SecondSize,
                range: (-1e4, 1e4),
                start: 0.1,
                relative: Relative::Friction,
                meaning: "half the difference of dry friction between forwards and backwards",
            },
        ],
        size_in_words: "friction differs by twice {} between forwards and backwards",
        second_size_in_words: Some("viscous friction differs by twice {} between forwards and backwards"),
        excited_by: &[Excitation::BothDirections],
        prior: Prior::occasional("oblique brushes, worm and helical gears"),
        why: "Friction is another one forwards than backwards. With one law for both the model is too slow one way \
              and too fast the other.",
        noticed: "The same voltage gives another speed, and the same coast-down another length, in each direction. \
                  Gears, screws and brushes that are set for one direction sound different the other way.",
        remedy: "Record both directions. A screw or a gear that is worn on one flank, brushes that tilt in their \
                 holders, and a load that helps one way are the usual causes.",
        signature: "a torque error that does not change its sign with the direction and grows with the speed",
        confused_with: &[EffectId::TorqueOffset, EffectId::CoulombFriction],
        separated_by: &[
            Separation::both_directions("motion in both directions at several speeds"),
            Separation::by("breakaway from rest against a constant torque, which holds or drives the rotor there too"),
        ],
        source: "Janot, Gautier, Brunot 2019 (EMPS), extended",
        ..Description::usual(EffectId::AsymmetricFriction)
    };
    fields!(viscous, dry);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        balance.friction += at.speed.abs().times(self.viscous);
        balance.dry_asymmetry += self.dry;
    }
}
