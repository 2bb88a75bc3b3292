//! Contact drop of the brushes.
//!
//! `V (1 − exp(−|i|/i_0)) sign(i)`, both brushes together.
//!
//! Source: Modelica Standard Library, Machines.Losses.DCMachines.Brush (constant drop with a transition at low
//! current); the exponential transition is the usual smooth one.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// A voltage drop that hardly depends on the size of the current.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrushDrop<S> {
    /// V, V.
    pub drop: S,
    /// i_0, A.
    pub transition: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for BrushDrop<S> {
    const DESCRIPTION: Description = Description {
        name: "contact drop of the brushes",
        equation: "u = … + V (1 − exp(−|i|/i_0)) sign(i)",
        acts: Acts::Electrical,
        parameters: &[
            EffectParameter {
                name: "brush_drop",
                unit: "V",
                role: Role::Size,
                range: (0.0, 50.0),
                start: 0.008,
                relative: Relative::Voltage,
                meaning: "drop of both brushes at high current",
            },
            EffectParameter {
                name: "brush_transition",
                unit: "A",
                role: Role::Shape,
                range: (1e-4, 1e3),
                start: 0.03,
                relative: Relative::Current,
                meaning: "current over which the drop builds up",
            },
        ],
        size_in_words: "the brushes take {} whatever the current",
        excited_by: &[Excitation::Current, Excitation::LowVoltage],
        prior: Prior::common("carbon brushes drop half a volt to two volts each"),
        why: "Carbon on copper takes about the same voltage at any current. At small currents that is a large share \
              of all, so that the motor seems to have more resistance there, and the current has a flat spot at \
              zero.",
        noticed: "A motor that does not start to turn, or draws no current, at the lowest voltages. A dark film on \
                  the bars is good; with more drop than usual, brushes are short, springs weak, or the film is \
                  thick.",
        remedy: "Name it: every brushed motor has it. If it has grown, measure the length of the brushes and the \
                 force of the springs, and look at the film.",
        signature: "third harmonic in phase with the current, independent of amplitude and speed; most of it passes for \
                    resistance",
        confused_with: &[EffectId::Saturation, EffectId::ArmatureReaction, EffectId::SupplyDeadZone],
        separated_by: &[
            Separation::locked_rotor("a locked rotor at low current"),
            Separation::by("a DC ramp through zero"),
        ],
        source: "Modelica Standard Library, Machines.Losses.DCMachines.Brush",
        ..Description::usual(EffectId::BrushDrop)
    };
    fields!(drop, transition);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        // The curve is odd: that of a positive current, turned round with its slope kept.
        let against = if at.current.value() < S::ZERO { S::ONE } else { -S::ONE };
        let rise = against * self.drop;
        balance.voltage += at.current.times(against / self.transition).exp().times(rise).plus(-rise);
    }
}
