//! Gains that drift while a recording runs: amplifiers that warm up, a supply of a sensor that sinks.
//!
//! `i_shown = (1 + a t) i` and `ω_shown = (1 + b t) ω`, a and b in 1/s, t in s since the start of the run, where the
//! gains are right. The increment of the time is kept whole by compensated summation.
//!
//! Source: temperature coefficient in the error model of an amplifier, to first order in time.

use super::memory::accumulate;
use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Passed, PhysicalEffect, Prior, Relative, Role,
    Separation,
};
use crate::motor::State;
use crate::scalar::Scalar;

/// Current and speed that are shown larger and larger, or smaller and smaller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainDrift<S> {
    /// a, 1/s.
    pub current: S,
    /// b, 1/s.
    pub speed: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for GainDrift<S> {
    const DESCRIPTION: Description = Description {
        name: "gains of the channels that drift",
        equation: "i_shown = (1 + a t) i, ω_shown = (1 + b t) ω",
        acts: Acts::Measuring,
        parameters: &[
            EffectParameter {
                name: "current_gain_drift",
                unit: "1/s",
                role: Role::Size,
                range: (-0.1, 0.1),
                start: 1e-3,
                relative: Relative::Absolute,
                meaning: "drift of the current channel's gain",
            },
            EffectParameter {
                name: "speed_gain_drift",
                unit: "1/s",
                role: Role::SecondSize,
                range: (-0.1, 0.1),
                start: 1e-3,
                relative: Relative::Absolute,
                meaning: "drift of the speed channel's gain",
            },
        ],
        size_in_words: "the current channel's gain drifts by {}",
        second_size_in_words: Some("the speed channel's gain drifts by {}"),
        excited_by: &[Excitation::Heating],
        prior: Prior::occasional("amplifiers and tachos that warm up during the test"),
        why: "An amplifier or a tacho warms up, and its gain wanders. All that is computed from it drifts with time, \
              whatever flows.",
        noticed: "Nothing at the motor. The first recording of the day does not fit the last one of the same motor.",
        remedy: "Switch the amplifiers on an hour before. Check the gain with a reference at the beginning and at \
                 the end. Name it for the recordings that exist.",
        signature: "resistance, flux and friction that drift together with time, whatever flows",
        confused_with: &[EffectId::WindingTemperature, EffectId::MagnetTemperature, EffectId::BearingWarmup],
        separated_by: &[
            Separation::by("the same recording with an amplifier that has been on for an hour"),
            Separation::by("a pause without current, which cools the motor and not the amplifier"),
        ],
        source: "error model of an amplifier",
        remembers: true,
        ..Description::usual(EffectId::GainDrift)
    };
    fields!(current, speed);
    fn at_start(&self, _: State<S>, elapsed: S) -> Memory<S> {
        [elapsed, S::ZERO, S::ZERO, S::ZERO]
    }
    #[inline(never)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        accumulate(memory, passed.interval);
    }
    #[inline(always)]
    fn measure(&self, memory: &Memory<S>, reading: &mut State<S>) {
        reading.current += reading.current * (self.current * memory[0]);
        reading.speed += reading.speed * (self.speed * memory[0]);
    }
}
