//! Constant torque: gravity on the load, an unbalanced spring, or the offset of a torque sensor or drive.
//!
//! `J dω/dt = … − T` with T in N m (a force in N on a linear drive). Unlike dry friction it does not change its sign
//! with the direction of motion, which is what tells the two apart: a recording in both directions.
//!
//! Source: A. Janot, M. Gautier, M. Brunot: Data set and reference models of EMPS, nonlinearbenchmark.org, 2019, where
//! it is the offset of the drive's force.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Constant torque against the positive direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueOffset<S> {
    /// T, N m.
    pub torque: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for TorqueOffset<S> {
    const DESCRIPTION: Description = Description {
        name: "constant torque",
        equation: "J dω/dt = … − T",
        acts: Acts::Mechanical,
        parameters: &[EffectParameter {
            name: "torque_offset",
            unit: "N m",
            role: Role::Size,
            range: (-1e4, 1e4),
            start: 0.5,
            relative: Relative::Friction,
            meaning: "constant torque against the positive direction",
        }],
        size_in_words: "{} pull one way all the time",
        excited_by: &[Excitation::BothDirections],
        prior: Prior::occasional("a weight on the shaft, or the zero of a torque sensor"),
        why: "Something pulls always the same way: a weight, a slope, a spring. It helps in one direction and \
              hinders in the other.",
        noticed: "The rotor creeps, or wants current to stay where it is. One direction is quicker than the other at \
                  any speed.",
        remedy: "Look for what hangs on the shaft, for a table that is not level, and for a zero error of the torque \
                 sensor. On a rotor that turns one way alone it is the same as dry friction.",
        signature: "a torque error that does not change its sign with the direction of motion",
        confused_with: &[EffectId::AsymmetricFriction, EffectId::CoulombFriction],
        separated_by: &[Separation::both_directions("motion in both directions at several speeds")],
        source: "Janot, Gautier, Brunot 2019 (EMPS)",
        ..Description::usual(EffectId::TorqueOffset)
    };
    fields!(torque);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        balance.torque = balance.torque.plus(-self.torque);
    }
}
