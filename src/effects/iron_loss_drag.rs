//! Iron loss of the armature as a torque: eddy currents in the teeth, whose field is in proportion to the current.
//!
//! `J dω/dt = … − c i² ω`, c in N m s/(A² rad). The loss (f B)² over the speed is a torque in proportion to ω B². The part
//! of hysteresis, in proportion to i², is no term of its own: K and J take its place.
//!
//! Source: H. Jordan 1924 and G. Bertotti 1988 (separation of iron losses); Modelica Standard Library,
//! Machines.Losses.DCMachines.Core.

use super::{Acts, Description, EffectParameter, Memory, PhysicalEffect, Relative};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Braking torque of the iron loss.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IronLossDrag<S> {
    /// c, N m s/(A² rad).
    pub coefficient: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for IronLossDrag<S> {
    const DESCRIPTION: Description = Description {
        id: "iron_loss_drag",
        name: "drag by iron loss",
        equation: "J dω/dt = … − c i² ω",
        acts: Acts::Mechanical,
        parameters: &[EffectParameter {
            name: "iron_loss_drag",
            unit: "N m s/(A² rad)",
            range: (0.0, 1e4),
            start: 0.1,
            relative: Relative::FrictionPerCurrentSquaredSpeed,
            meaning: "torque per speed and square of the current",
        }],
        signature: "a torque in proportion to i² that falls with the speed; the voltage balance is clean",
        confused_with: &["stray_load_torque", "commutation_demagnetisation", "quadratic_load", "fan_dynamics"],
        separated_by: "a run at one speed and several currents; nothing against the stray load torque, with which it is \
                       one class",
        source: "separation of iron losses by Jordan and Bertotti",
        ..Description::USUAL
    };
    fields!(coefficient);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        balance.friction += at.current.times(self.coefficient) * at.current * at.speed;
    }
}
