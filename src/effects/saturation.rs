//! Saturation of the main flux.
//!
//! The flux no longer grows in proportion to the current, in the back-EMF and in the torque alike (the air-gap
//! power is E i on one side and M ω on the other):
//! ```text
//! φ(i)   = i (1 − a (1 − g(z)))          g(z) = (1 + b z² + z⁴)^(−1/4)      z = i / i_k
//! dφ/di  = 1 − a (1 − g (2 + b z²) / (2 (1 + b z² + z⁴)))
//! dλ/di  = L (1 − c + c dφ/di)
//! ```
//! Beside hysteresis, whose path is the same iron, dφ/di is that of both: `1 − c (1 − φ') − c' φ' d(lag)/di`, with c'
//! its share.
//!
//! | symbol | parameter | unit |
//! |---|---|---|
//! | a | `saturation_depth`, share of the slope that is lost at high current | 1 |
//! | i_k | `saturation_knee`, current at the knee | A |
//! | b | `saturation_softness`, 0 is a sharp knee (generalised Froelich, n = 4), 2 a soft one (n = 2) | 1 |
//! | c | `saturation_linked`, share of the inductance that belongs to the saturating path | 1 |
//!
//! With the softness the law follows arc tangent, Langevin, hyperbolic tangent and generalised Froelich curves with n
//! from 2 to 4 to about 0.1 % of the flux.
//!
//! Source: O. Froelich 1881 for the law i/(1 + i/i_k), in the generalised form i/(1 + (i/i_k)^n)^(1/n); here with n = 2
//! and n = 4 blended under the root, which needs a fourth root alone.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Motors, PhysicalEffect, Prior, Relative, Role,
    Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Flux that grows less than in proportion to the current.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Saturation<S> {
    /// a.
    pub depth: S,
    /// i_k, A.
    pub knee: S,
    /// b.
    pub softness: S,
    /// c.
    pub linked: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for Saturation<S> {
    const DESCRIPTION: Description = Description {
        name: "saturation of the main flux",
        equation: "K φ(i) ω and K φ(i) i with φ = i (1 − a (1 − g)), g = (1 + b z² + z⁴)^(−1/4), z = i/i_k; dλ/di = L (1 − c + c dφ/di)",
        acts: Acts::Both,
        motors: Motors::Series,
        parameters: &[
            EffectParameter {
                name: "saturation_depth",
                unit: "1",
                role: Role::Size,
                range: (0.0, 1.5),
                start: 0.8,
                relative: Relative::Absolute,
                meaning: "share of the flux's slope that is lost at high current",
            },
            EffectParameter {
                name: "saturation_knee",
                unit: "A",
                role: Role::Shape,
                range: (0.01, 1e4),
                start: 0.8,
                relative: Relative::Current,
                meaning: "current at the knee of the magnetisation curve",
            },
            EffectParameter {
                name: "saturation_softness",
                unit: "1",
                role: Role::Shape,
                range: (0.0, 30.0),
                start: 1.5,
                relative: Relative::Absolute,
                meaning: "0 is a sharp knee, 2 a soft one",
            },
            EffectParameter {
                name: "saturation_linked",
                unit: "1",
                role: Role::Linked,
                range: (0.0, 1.0),
                start: 0.6,
                relative: Relative::Absolute,
                meaning: "share of the inductance that saturates with the flux",
            },
        ],
        size_in_words: "{} of the slope of the flux is lost at high current",
        excited_by: &[Excitation::Current],
        prior: Prior::common("motors for the mains are built to run into it"),
        at_standstill: Some(EffectId::InductanceSaturation),
        overrated_beside: &[EffectId::InductanceSaturation],
        weakens_flux: true,
        why: "At large currents the iron cannot carry more flux. Back-EMF and torque then grow less than the current \
              does, and the inductance falls, so that the tops of the current's wave grow pointed.",
        noticed: "Pointed peaks of current at high load, and a torque that falls behind its square law. The motor \
                  runs faster at full voltage than the model of small currents says. Nothing is heard.",
        remedy: "It is no fault: motors for the mains are built to run into it. Name it first, since it is often the \
                 largest. Should it begin earlier than it did, look at the air gap, at shorted turns of the field, \
                 and at the type of the stack.",
        signature: "third harmonic in phase with the current, growing with speed and voltage; the base fit answers with a \
                    negative mu0 and too large a resistance",
        confused_with: &[
            EffectId::ArmatureReaction,
            EffectId::CurrentCompression,
            EffectId::BrushDrop,
            EffectId::InductanceSaturation,
        ],
        separated_by: &[
            Separation::locked_rotor("a locked rotor, where it vanishes from the voltage but for the inductance"),
            Separation::by("DC steps show φ(i) point by point"),
        ],
        source: "Froelich's law in its generalised form, with the exponents 2 and 4 blended",
        ..Description::usual(EffectId::Saturation)
    };
    fields!(depth, knee, softness, linked);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        let z = balance.magnetising.times(S::ONE / self.knee);
        let square = z * z;
        let soft = square.times(self.softness);
        let q = (soft + square * square).plus(S::ONE);
        let g = q.inverse_fourth_root();
        let left = S::ONE - self.depth;
        let slope = (g * soft.plus(S::constant(2.0)) / q).times(S::constant(0.5) * self.depth).plus(left);
        balance.flux = balance.flux * g.times(self.depth).plus(left);
        balance.flux_slope = balance.flux_slope * slope;
        // What hysteresis has taken of the path is passed on by the chain rule.
        let beside = balance.base_inductance * (S::ONE - self.linked);
        balance.inductance = balance.inductance * slope + slope.times(-beside).plus(beside);
    }
}
