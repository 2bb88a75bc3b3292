//! Lost sign of the speed: a pulse counter shows how fast, not which way.
//!
//! `ω_shown = ω + k (|ω| − ω)`, k dimensionless: 1 when the sign is lost, 0 when it is kept; values between have no
//! meaning but let a fit find the way.
//!
//! Source: counting of pulses on one track.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::State;
use crate::scalar::Scalar;

/// Speed that is shown without its sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedSignLost<S> {
    /// k.
    pub share: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for SpeedSignLost<S> {
    const DESCRIPTION: Description = Description {
        name: "speed without its sign",
        equation: "ω_shown = ω + k (|ω| − ω), k = 0 or 1",
        acts: Acts::Measuring,
        parameters: &[EffectParameter {
            name: "speed_sign_lost",
            unit: "1",
            role: Role::Size,
            range: (0.0, 1.0),
            start: 1.0,
            relative: Relative::Absolute,
            meaning: "1 when the sign is lost, 0 when it is kept",
        }],
        size_in_words: "{} of the sign of the speed is lost",
        excited_by: &[Excitation::BothDirections],
        prior: Prior::rare("counters of pulses without a second track"),
        on_speed_channel: true,
        of_data: true,
        why: "A counter with one track cannot tell the direction. The rotor turns back and the shown speed is \
              positive still, so that back-EMF and friction have the wrong sign.",
        noticed: "The shown speed touches zero and bounces off, while the current reverses.",
        remedy: "Take a sensor with two tracks, or record one direction at a time. Nothing is to be added to the \
                 model.",
        signature: "a speed that bounces off zero, with a back-EMF of the wrong sign thereafter; none as long as the motor \
                    turns forwards",
        confused_with: &[EffectId::AsymmetricFriction, EffectId::TorqueOffset],
        separated_by: &[Separation::by("the samples: a speed that is never negative although the current reverses")],
        source: "counting of pulses on one track",
        ..Description::usual(EffectId::SpeedSignLost)
    };
    fields!(share);
    #[inline(always)]
    fn measure(&self, _: &Memory<S>, reading: &mut State<S>) {
        reading.speed += self.share * (reading.speed.abs() - reading.speed);
    }
}
