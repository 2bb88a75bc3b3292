//! Compression by the current sensor: the core of a Hall sensor or current transformer saturates.
//!
//! `i_shown = i/√(1 + 2 γ i²)`, γ in 1/A²: at first `i (1 − γ i²)`, in the end the constant 1/√(2γ).
//!
//! Source: general theory of current sensors (magnetisation curve of the core).

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::State;
use crate::scalar::Scalar;

/// High currents that are shown too small.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurrentCompression<S> {
    /// γ, 1/A².
    pub strength: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for CurrentCompression<S> {
    const DESCRIPTION: Description = Description {
        name: "compression by the current sensor",
        equation: "i_shown = i/√(1 + 2 γ i²)",
        acts: Acts::Measuring,
        parameters: &[EffectParameter {
            name: "current_compression",
            unit: "1/A²",
            role: Role::Size,
            range: (0.0, 1e4),
            start: 0.05,
            relative: Relative::InverseCurrentSquared,
            meaning: "relative loss per square of the current, at low current",
        }],
        size_in_words: "1 A² takes {} of what the current channel shows",
        excited_by: &[Excitation::Current],
        prior: Prior::rare("sensors near the end of their range"),
        why: "The core of a current sensor saturates near its limit. Peaks are shown smaller than they are, and the \
              model seems to draw too much current.",
        noticed: "Nothing at the motor. Peaks of the current look rounded where those of a second meter are pointed.",
        remedy: "Take a sensor with a larger range, or fewer turns through it. Name it for the recordings that exist.",
        signature: "third harmonic in phase with the current, of the opposite sign of saturation, in resistance, back-EMF \
                    and inductance alike",
        confused_with: &[
            EffectId::Saturation,
            EffectId::ArmatureReaction,
            EffectId::AdcClipping,
            EffectId::InductanceSaturation,
        ],
        separated_by: &[
            Separation::locked_rotor("a locked rotor, where saturation leaves the resistance alone"),
            Separation::by("the sign of the third harmonic"),
            Separation::by("a resistor in place of the motor"),
        ],
        source: "magnetisation curve of the sensor's core",
        ..Description::usual(EffectId::CurrentCompression)
    };
    fields!(strength);
    #[inline(always)]
    fn measure(&self, _: &Memory<S>, reading: &mut State<S>) {
        let i = reading.current;
        reading.current = i / (S::ONE + S::constant(2.0) * self.strength * i * i).sqrt();
    }
}
