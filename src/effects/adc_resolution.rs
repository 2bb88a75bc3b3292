//! Resolution of the converter: readings are whole multiples of a step.
//!
//! `i_shown = q_i round(i/q_i)` and `ω_shown = q_ω round(ω/q_ω)`, q_i in A and q_ω in rad/s; 0 stands for no steps. For
//! a signal that crosses many steps this is white noise with the variance q²/12.
//!
//! Source: B. Widrow 1956 (theory of quantisation).

use super::{
    Acts, Description, EffectId, EffectParameter, Memory, PhysicalEffect, Prior, Relative, Role, Seen, Separation,
};
use crate::motor::State;
use crate::scalar::Scalar;

/// Readings in whole steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdcResolution<S> {
    /// q_i, A; 0: none.
    pub current: S,
    /// q_ω, rad/s; 0: none.
    pub speed: S,
}

/// The nearest multiple of a step; without one, the value itself.
#[inline(always)]
fn stepped<S: Scalar<Base = S>>(value: S, step: S) -> S {
    if step > S::ZERO { (value / step).round() * step } else { value }
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for AdcResolution<S> {
    const DESCRIPTION: Description = Description {
        name: "resolution of the converter",
        equation: "i_shown = q_i round(i/q_i), ω_shown = q_ω round(ω/q_ω)",
        acts: Acts::Measuring,
        seen: Seen::Samples,
        parameters: &[
            EffectParameter {
                name: "resolution_current",
                unit: "A",
                role: Role::Size,
                range: (0.0, 1e3),
                start: 0.004,
                relative: Relative::Current,
                meaning: "step of the current; 0: none",
            },
            EffectParameter {
                name: "resolution_speed",
                unit: "rad/s",
                role: Role::SecondSize,
                range: (0.0, 1e3),
                start: 0.0,
                relative: Relative::Speed,
                meaning: "step of the speed; 0: none",
            },
        ],
        size_in_words: "the current channel shows steps of {}",
        prior: Prior::common("converters of ten bits and fewer, and counters"),
        of_data: true,
        why: "The converter has few steps. What lies between two of them is noise that no model explains.",
        noticed: "The signal is a stair when you zoom in: all differences are multiples of one step.",
        remedy: "Use more of the range, or a converter of more bits. `greyrig check` tells it; nothing is to be \
                 added to the model.",
        signature: "white noise of the variance q²/12, whatever current and speed are",
        confused_with: &[EffectId::BrushArcing],
        separated_by: &[Separation::by("the samples: all differences are multiples of one step")],
        source: "Widrow's theory of quantisation",
        ..Description::usual(EffectId::AdcResolution)
    };
    fields!(current, speed);
    #[inline(always)]
    fn measure(&self, _: &Memory<S>, reading: &mut State<S>) {
        reading.current = stepped(reading.current, self.current);
        reading.speed = stepped(reading.speed, self.speed);
    }
}
