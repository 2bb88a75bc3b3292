//! Inductance that falls with the current, by itself: saturation of leakage paths.
//!
//! Incremental form, `dλ/di = L (1 − a z²/(1 + z²))`, z = i/i_k, which belongs to the flux linkage
//! `λ = L (i − a (i − i_k atan z))`. (The chord inductance λ/i in place of dλ/di is a classical mistake.)
//!
//! Source: arc-tangent flux of the SaturatingInductor of the Modelica Standard Library.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Incremental inductance that depends on the current.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InductanceSaturation<S> {
    /// a.
    pub depth: S,
    /// i_k, A.
    pub knee: S,
    /// Weight of z⁴ in the knee.
    pub sharpness: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for InductanceSaturation<S> {
    const DESCRIPTION: Description = Description {
        name: "current-dependent inductance",
        equation: "dλ/di = L (1 − a q/(1 + q)), q = z² + n z⁴, z = i/i_k",
        acts: Acts::Electrical,
        parameters: &[
            EffectParameter {
                name: "inductance_depth",
                unit: "1",
                role: Role::Size,
                range: (0.0, 0.95),
                start: 0.5,
                relative: Relative::Absolute,
                meaning: "share of dλ/di that is lost at high current",
            },
            EffectParameter {
                name: "inductance_knee",
                unit: "A",
                role: Role::Shape,
                range: (0.01, 1e4),
                start: 0.6,
                relative: Relative::Current,
                meaning: "current of the knee",
            },
            EffectParameter {
                name: "inductance_sharpness",
                unit: "1",
                role: Role::Shape,
                range: (0.0, 5.0),
                start: 0.5,
                relative: Relative::Absolute,
                meaning: "0 is the soft knee of an arc-tangent flux",
            },
        ],
        size_in_words: "{} of the inductance is lost at high current",
        excited_by: &[Excitation::Current, Excitation::Alternating],
        prior: Prior::occasional("leakage paths and chokes saturate by themselves"),
        why: "Leakage paths, or a choke in the line, saturate by themselves: inductance falls where the current is \
              large, while the main flux goes on in proportion.",
        noticed: "The current rises more steeply near its peak, at any speed and with the rotor held, too. Torque \
                  and speed show nothing.",
        remedy: "Find out what is in the circuit besides the motor: an interference-suppression choke is the usual \
                 one. Measure inductance at two currents. A larger choke mends it; the model takes it as it is.",
        signature: "third harmonic in quadrature with the current, at any speed; nothing in the torque",
        confused_with: &[EffectId::Hysteresis, EffectId::Saturation, EffectId::CurrentCompression],
        separated_by: &[Separation::by("a locked rotor at two or three amplitudes")],
        source: "Modelica Standard Library, SaturatingInductor (arc-tangent flux)",
        ..Description::usual(EffectId::InductanceSaturation)
    };
    fields!(depth, knee, sharpness);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        let z = at.current.times(S::ONE / self.knee);
        let square = z * z;
        let q = square * square.times(self.sharpness).plus(S::ONE);
        balance.inductance = balance.inductance * (q / q.plus(S::ONE)).times(-self.depth).plus(S::ONE);
    }
}
