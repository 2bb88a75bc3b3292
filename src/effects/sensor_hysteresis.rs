//! Hysteresis of the current sensor: its core keeps a little of the last current's sign.
//!
//! `i_shown = i − c x`, where x follows the current with slope 1/w and stops at ±1 (a stop, the complement of a play):
//! while the current rises the sensor shows c less, while it falls c more, and w is the change of the current over
//! which it turns round. c and w in A. Independent of rate; x = 0 at the start of a run.
//!
//! Source: remanence in the error model of open-loop and closed-loop current transducers; stop operator of M. A.
//! Krasnosel'skii and A. V. Pokrovskii, Systems with Hysteresis, 1989.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Passed, PhysicalEffect, Prior, Relative, Role,
    Separation,
};
use crate::motor::State;
use crate::scalar::Scalar;

/// A current channel that is behind the current by a fixed amount.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorHysteresis<S> {
    /// c, A.
    pub half_width: S,
    /// w, A.
    pub turning: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for SensorHysteresis<S> {
    const DESCRIPTION: Description = Description {
        name: "hysteresis of the current sensor",
        equation: "i_shown = i − c x, dx/dt = (di/dt)/w within ±1",
        acts: Acts::Measuring,
        parameters: &[
            EffectParameter {
                name: "sensor_hysteresis",
                unit: "A",
                role: Role::Size,
                range: (0.0, 100.0),
                start: 0.01,
                relative: Relative::Current,
                meaning: "half the width of the loop",
            },
            EffectParameter {
                name: "sensor_turning",
                unit: "A",
                role: Role::Shape,
                range: (1e-4, 1e3),
                start: 0.1,
                relative: Relative::Current,
                meaning: "change of the current over which the sensor goes from the middle of the loop to its edge",
            },
        ],
        size_in_words: "the current channel is {} behind, whichever way the current goes",
        excited_by: &[Excitation::Alternating, Excitation::Current],
        prior: Prior::rare("transducers with a core keep 0.1 to 0.5 % of their range"),
        signature: "a loop of the current channel round zero, at standstill and on direct current, too",
        confused_with: &[EffectId::Hysteresis, EffectId::CurrentOffset, EffectId::ChannelDelay],
        separated_by: &[
            Separation::locked_rotor("a locked rotor on a slow ramp of the voltage, where the iron's loop shows nothing"),
            Separation::by("a shunt in series"),
        ],
        source: "remanence of a current transducer",
        remembers: true,
        ..Description::usual(EffectId::SensorHysteresis)
    };
    fields!(half_width, turning);
    #[inline(always)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        let moved = memory[1] + (passed.after.current - passed.before.current) / self.turning;
        let x = if moved > S::ONE {
            S::ONE
        } else if moved < -S::ONE {
            -S::ONE
        } else {
            moved
        };
        *memory = [self.half_width * x, x, S::ZERO, S::ZERO];
    }
    #[inline(always)]
    fn measure(&self, memory: &Memory<S>, reading: &mut State<S>) {
        reading.current -= memory[0];
    }
}
