//! Ripple of a tacho that runs out of true: the speed shown varies once per turn.
//!
//! `ω_shown = ω (1 + c cos θ + s sin θ)`, c and s dimensionless, θ in rad the angle since the start of the run. The
//! angle at the start is not known, hence cosine and sine; the effect is absent when both are zero.
//!
//! Source: geometry of an eccentric disc or magnet, to first order in the eccentricity.

use super::memory::{AT_ZERO_ANGLE, turn};
use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Passed, PhysicalEffect, Prior, Relative, Role,
    Seen, Separation,
};
use crate::motor::State;
use crate::scalar::Scalar;

/// Speed that is shown with a line at the frequency of rotation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedRipple<S> {
    /// c.
    pub cosine: S,
    /// s.
    pub sine: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for SpeedRipple<S> {
    const DESCRIPTION: Description = Description {
        name: "ripple of the tacho",
        equation: "ω_shown = ω (1 + c cos θ + s sin θ)",
        acts: Acts::Measuring,
        seen: Seen::Orders,
        parameters: &[
            EffectParameter {
                name: "speed_ripple_cos",
                unit: "1",
                role: Role::Size,
                range: (-0.5, 0.5),
                start: 0.01,
                relative: Relative::Absolute,
                meaning: "relative amplitude of the cosine of the angle",
            },
            EffectParameter {
                name: "speed_ripple_sin",
                unit: "1",
                role: Role::SecondSize,
                range: (-0.5, 0.5),
                start: 0.01,
                relative: Relative::Absolute,
                meaning: "relative amplitude of the sine of the angle",
            },
        ],
        size_in_words: "the speed channel swings by {} as the rotor turns",
        excited_by: &[Excitation::Rotation],
        prior: Prior::common("no tachometer and no coupling runs true"),
        on_speed_channel: true,
        why: "A disc or a coupling that runs out of true makes the tacho show a speed that swings once a turn while \
              the rotor does not.",
        noticed: "A wave of the speed once a turn that grows with the speed, and that the current knows nothing of.",
        remedy: "Align the tacho and its coupling. It does no harm to a fit, which filters it; do not take it for an \
                 imbalance.",
        signature: "a line at the frequency of rotation in the speed, in proportion to the speed, and none in the current",
        confused_with: &[EffectId::Imbalance, EffectId::TorqueRipple],
        separated_by: &[Separation::by(
            "order tracking over a coast-down: it grows with the speed, that of an imbalance falls",
        )],
        source: "geometry of an eccentric disc",
        remembers: true,
        ..Description::usual(EffectId::SpeedRipple)
    };
    fields!(cosine, sine);
    fn at_start(&self, _: State<S>, _: S) -> Memory<S> {
        AT_ZERO_ANGLE.map(S::constant)
    }
    #[inline(always)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        turn(S::ONE, passed, memory);
    }
    #[inline(always)]
    fn measure(&self, memory: &Memory<S>, reading: &mut State<S>) {
        reading.speed = reading.speed * (S::ONE + self.cosine * memory[1] + self.sine * memory[2]);
    }
}
