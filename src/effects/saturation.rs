//! Saturation of the main flux.
//!
//! The flux no longer grows in proportion to the current, in the back-EMF and in the torque alike (the air-gap
//! power is E i on one side and M ω on the other):
//! ```text
//! φ(i)   = r i + (1 − r) i_k atan(i / i_k)
//! φ'(i)  = r + (1 − r) / (1 + (i / i_k)²)
//! dλ/di  = L (1 − c + c φ'(i))
//! ```
//! | symbol | parameter | unit |
//! |---|---|---|
//! | i_k | `saturation_knee`, current at which the slope has fallen half-way | A |
//! | r | `saturation_slope`, slope that is left at high current | 1 |
//! | c | `saturation_linked`, share of the inductance that belongs to the saturating path | 1 |
//!
//! Source: the arc-tangent law of the SaturatingInductor of the Modelica Standard Library, and the "straight line plus arc
//! tangent" B(H) law of finite-element programs.

use super::{Description, EffectParameter, MAX_EFFECT_PARAMETERS, PhysicalEffect};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Flux that grows less than in proportion to the current.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Saturation<S> {
    /// i_k, A.
    pub knee: S,
    /// r.
    pub slope: S,
    /// c.
    pub linked: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for Saturation<S> {
    const DESCRIPTION: Description = Description {
        id: "saturation",
        name: "saturation of the main flux",
        equation: "K φ(i) ω and K φ(i) i with φ = r i + (1 − r) i_k atan(i/i_k), dλ/di = L (1 − c + c φ'(i))",
        parameters: &[
            EffectParameter {
                name: "saturation_knee",
                unit: "A",
                range: (0.01, 1e4),
                start: 6.0,
                meaning: "current at which the slope of the flux has fallen half-way",
            },
            EffectParameter {
                name: "saturation_slope",
                unit: "1",
                range: (-0.5, 1.0),
                start: 0.2,
                meaning: "slope of the flux at high current, relative to that at low current",
            },
            EffectParameter {
                name: "saturation_linked",
                unit: "1",
                range: (-0.2, 1.2),
                start: 0.5,
                meaning: "share of the inductance that saturates with the flux",
            },
        ],
        signature: "third harmonic in phase with the current, growing with speed and voltage; the base fit answers with a \
                    negative mu0 and too large a resistance",
        confused_with: &["armature_reaction", "current_compression", "brush_drop"],
        separated_by: "a locked rotor, where it vanishes from the voltage but for the inductance; DC steps show φ(i) point by \
                       point",
        source: "Modelica Standard Library, SaturatingInductor (arc-tangent flux)",
    };
    fn from_values(values: &[S]) -> Self {
        let value = |n: usize| values.get(n).copied().unwrap_or_default();
        Self { knee: value(0), slope: value(1), linked: value(2) }
    }
    fn values(&self) -> [S; MAX_EFFECT_PARAMETERS] {
        [self.knee, self.slope, self.linked, S::ZERO]
    }
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, balance: &mut Balance<N>) {
        let (knee, slope, linked) = (N::lift(self.knee), N::lift(self.slope), N::lift(self.linked));
        let x = at.current / knee;
        let bent = N::ONE - slope;
        // With magnets the flux is there without current, and the current's share bends it in the same way.
        let relative = if x.value() == S::ZERO { N::ONE } else { slope + bent * x.atan() / x };
        balance.flux = balance.flux * relative;
        let local = slope + bent / (N::ONE + x * x);
        balance.inductance = balance.inductance * (N::ONE - linked + linked * local);
    }
}
