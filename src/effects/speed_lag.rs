//! Lag of the speed channel: the filter of a tacho or of a frequency-to-voltage converter.
//!
//! `τ dω_s/dt = ω − ω_s`, τ in s, solved exactly for a speed that is straight within the step; at τ = 0 there is no
//! lag. What is added to the reading is the change ω_s − ω, so that what the earlier parts of the chain show is kept.
//!
//! Source: first-order low-pass filter.

use super::memory::lagged;
use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Passed, PhysicalEffect, Prior, Relative, Role,
    Separation,
};
use crate::motor::State;
use crate::scalar::Scalar;

/// Speed that is shown with a first-order lag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedLag<S> {
    /// τ, s.
    pub time: S,
}

/// Shorter time constants count as this one, s.
const NO_LAG: f64 = 1e-9;

impl<S: Scalar<Base = S>> PhysicalEffect<S> for SpeedLag<S> {
    const DESCRIPTION: Description = Description {
        name: "lag of the speed channel",
        equation: "τ dω_shown/dt = ω − ω_shown",
        acts: Acts::Measuring,
        parameters: &[EffectParameter {
            name: "speed_lag",
            unit: "s",
            role: Role::Size,
            range: (0.0, 1.0),
            start: 10e-3,
            relative: Relative::Absolute,
            meaning: "time constant",
        }],
        size_in_words: "the speed channel is {} behind",
        excited_by: &[Excitation::Acceleration],
        prior: Prior::common("tachometers and counters of pulses smooth what they show"),
        on_speed_channel: true,
        why: "The tacho, or the counter behind it, smooths what it shows. The speed comes late and its swing is too \
              small, so that the torque balance seems wrong at each change.",
        noticed: "Nothing at the motor. After a step the shown speed follows the current late.",
        remedy: "Shorten the window of the counter, or the filter of the tacho. Name it for the recordings that \
                 exist, or say how the speed was measured.",
        signature: "speed ripple at twice the mains frequency that is too small and late; a torque error in proportion to \
                    d²ω/dt²",
        confused_with: &[EffectId::ChannelDelay, EffectId::FanDynamics],
        separated_by: &[
            Separation::by("a coast-down or run-up with steps of the voltage"),
            Separation::open_supply("the back-EMF of the open motor against the speed shown"),
        ],
        source: "first-order low-pass filter",
        remembers: true,
        ..Description::usual(EffectId::SpeedLag)
    };
    fields!(time);
    fn at_start(&self, state: State<S>, _: S) -> Memory<S> {
        [state.speed, state.speed, S::ZERO, S::ZERO]
    }
    #[inline(always)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        let shortest = S::constant(NO_LAG);
        let time = if self.time > shortest { self.time } else { shortest };
        let (before, after) = (passed.before.speed, passed.after.speed);
        (memory[0], memory[1]) = (lagged(memory[0], before, after, passed.interval / time), after);
    }
    #[inline(always)]
    fn measure(&self, memory: &Memory<S>, reading: &mut State<S>) {
        if self.time > S::ZERO {
            reading.speed += memory[0] - memory[1];
        }
    }
}
