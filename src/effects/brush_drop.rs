//! Contact drop of the brushes.
//!
//! `u = … + V tanh(i / i_0)`: a voltage that hardly depends on the current once it flows, against its direction. The
//! smoothing current i_0 = 0.1 A stands for the resistive range of a dry contact.
//!
//! Source: Modelica Standard Library, Machines.Losses.DCMachines.Brush (constant drop, linear below a small current).

use super::{Description, EffectParameter, MAX_EFFECT_PARAMETERS, PhysicalEffect};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Width of the resistive range, A.
const SMOOTHING: f64 = 0.1;

/// Voltage drop of both brushes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrushDrop<S> {
    /// V, of both brushes together.
    pub voltage: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for BrushDrop<S> {
    const DESCRIPTION: Description = Description {
        id: "brush_drop",
        name: "contact drop of the brushes",
        equation: "u = … + V tanh(i / 0.1 A)",
        parameters: &[EffectParameter {
            name: "brush_drop",
            unit: "V",
            range: (-1.0, 20.0),
            start: 1.0,
            meaning: "voltage drop of both brushes together",
        }],
        signature: "first and third harmonic in phase with the current, both independent of amplitude and speed; most of it is \
                    swallowed by R",
        confused_with: &["saturation", "armature_reaction"],
        separated_by: "a locked rotor at low current, or a slow DC ramp through zero",
        source: "Modelica Standard Library, Machines.Losses.DCMachines.Brush",
    };
    fn from_values(values: &[S]) -> Self {
        Self { voltage: values.first().copied().unwrap_or_default() }
    }
    fn values(&self) -> [S; MAX_EFFECT_PARAMETERS] {
        [self.voltage, S::ZERO, S::ZERO, S::ZERO]
    }
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, balance: &mut Balance<N>) {
        balance.voltage += N::lift(self.voltage) * (at.current * N::constant(1.0 / SMOOTHING)).tanh();
    }
}
