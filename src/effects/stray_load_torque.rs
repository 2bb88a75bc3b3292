//! Stray load loss as a torque: what the loaded machine loses beyond copper, iron, brushes and friction.
//!
//! `J dω/dt = … − c i² ω|ω|`, c in N m s²/(A² rad²).
//!
//! Source: Modelica Standard Library, Machines.Losses.DCMachines.StrayLoad, with the exponent 2 of the speed.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Representative,
    Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Braking torque that grows with the square of the current and of the speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrayLoadTorque<S> {
    /// c, N m s²/(A² rad²).
    pub coefficient: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for StrayLoadTorque<S> {
    const DESCRIPTION: Description = Description {
        name: "stray load torque",
        equation: "J dω/dt = … − c i² ω|ω|",
        acts: Acts::Mechanical,
        parameters: &[EffectParameter {
            name: "stray_load_torque",
            unit: "N m s²/(A² rad²)",
            role: Role::Size,
            range: (0.0, 1e4),
            start: 0.1,
            relative: Relative::FrictionPerCurrentSquaredSpeedSquared,
            meaning: "torque per square of the current and of the speed",
        }],
        size_in_words: "losses under load brake by {}",
        excited_by: &[Excitation::Current, Excitation::Speed],
        prior: Prior::occasional("losses that no circuit holds are a per cent of the power or so"),
        represented_by: &[Representative { effect: EffectId::IronLossDrag, law: None }],
        rest_of_law: &[EffectId::QuadraticLoad],
        why: "Fields of the slots and of the turning current drive losses that no circuit holds. They brake with the \
              load and rise steeply with speed.",
        noticed: "A motor that pulls a little less than its figures say, at full load and speed alone. It is warmer \
                  than copper and iron explain.",
        remedy: "Name it as one class with iron loss. A motor in which it grew was machined anew, or has a damaged \
                 stack.",
        signature: "that of iron loss, with a steeper rise over the speed",
        confused_with: &[EffectId::IronLossDrag, EffectId::FanDynamics, EffectId::QuadraticLoad],
        separated_by: &[
            Separation::by("coast-downs with and without a current against the fan"),
            Separation::by("nothing against iron loss, with which it is one class"),
        ],
        source: "Modelica Standard Library, Machines.Losses.DCMachines.StrayLoad",
        ..Description::usual(EffectId::StrayLoadTorque)
    };
    fields!(coefficient);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        balance.friction += at.current.times(self.coefficient) * at.current * at.speed * at.speed.abs();
    }
}
