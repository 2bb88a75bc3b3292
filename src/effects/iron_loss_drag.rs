//! Iron loss of the armature as a torque: hysteresis and eddy currents in the teeth, whose field is in proportion to
//! the current.
//!
//! `J dω/dt = … − c (i² ω + h |i|^1.5 sign(ω))`, c in N m s/(A² rad), h in A^½ rad/s: at a speed of h/√|i| both parts
//! are the same. The eddy currents' loss (f B)² over the speed is a torque in proportion to ω B². The loss of
//! hysteresis, f B^n with Steinmetz's n from 1.5 to 2, is one that does not depend on the speed and that holds a rotor
//! at rest; with n = 2 it would be no term of its own, as K and J can take its place.
//!
//! Source: C. P. Steinmetz 1892; H. Jordan 1924 and G. Bertotti 1988 (separation of iron losses); Modelica Standard
//! Library, Machines.Losses.DCMachines.Core.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Braking torque of the iron loss.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IronLossDrag<S> {
    /// c, N m s/(A² rad).
    pub coefficient: S,
    /// h, A^½ rad/s.
    pub hysteresis: S,
}

/// Current, A, below which the torque of hysteresis fades as i² does; it keeps its slope finite.
const FADES_BELOW_A: f64 = 1e-6;

impl<S: Scalar<Base = S>> PhysicalEffect<S> for IronLossDrag<S> {
    const DESCRIPTION: Description = Description {
        name: "drag by iron loss",
        equation: "J dω/dt = … − c (i² ω + h |i|^1.5 sign(ω))",
        acts: Acts::Mechanical,
        parameters: &[
            EffectParameter {
                name: "iron_loss_drag",
                unit: "N m s/(A² rad)",
                role: Role::Size,
                range: (0.0, 1e4),
                start: 0.1,
                relative: Relative::FrictionPerCurrentSquaredSpeed,
                meaning: "torque of the eddy currents per speed and square of the current",
            },
            EffectParameter {
                name: "iron_loss_hysteresis",
                unit: "A^½ rad/s",
                role: Role::Shape,
                range: (0.0, 1e6),
                start: 0.3,
                relative: Relative::SpeedRootCurrent,
                meaning: "speed at which hysteresis takes as much as the eddy currents, times the root of the current",
            },
        ],
        size_in_words: "iron losses brake by {} per speed and square of the current",
        excited_by: &[Excitation::Current, Excitation::Speed],
        prior: Prior::occasional("armatures of thick or poor sheets"),
        rest_of_law: &[EffectId::QuadraticLoad],
        why: "The armature's iron is magnetised to and fro as it turns. What that costs comes from the shaft: a \
              torque that goes with the square of the flux, and with speed.",
        noticed: "A motor that draws more current at no load and high speed, and has a hot armature without a hot \
                  winding.",
        remedy: "No fault, if it was always there. If it has grown: sheets that were shorted by rubbing, turning or \
                 a burr. Stray load is told as the same class.",
        signature: "a torque in proportion to i² that falls with the speed; the voltage balance is clean",
        confused_with: &[
            EffectId::StrayLoadTorque,
            EffectId::CommutationDemagnetisation,
            EffectId::QuadraticLoad,
            EffectId::FanDynamics,
        ],
        separated_by: &[
            Separation::by("a run at one speed and several currents"),
            Separation::by("nothing against the stray load torque, with which it is one class"),
        ],
        source: "separation of iron losses by Jordan and Bertotti",
        ..Description::usual(EffectId::IronLossDrag)
    };
    fields!(coefficient, hysteresis);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        let square = at.current * at.current;
        balance.friction += square.times(self.coefficient) * at.speed;
        let root = square.plus(S::constant(FADES_BELOW_A * FADES_BELOW_A)).inverse_fourth_root();
        balance.dry_friction += (square * root).times(self.coefficient * self.hysteresis);
    }
}
