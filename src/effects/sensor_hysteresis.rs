//! Hysteresis of the current sensor: its core keeps a little of the last current's sign.
//!
//! `i_shown = i − c z`, where z runs from −1 to 1 with the history of the current alone: while the current rises the
//! sensor shows c less, while it falls c more, and w is the change of the current over which it turns round at first,
//! slower the nearer the edge with e = 0, at the same rate to the end with a large e:
//! ```text
//! dz/di = (1 + e − z s)/((1 + e) w)  up to z = s,  s = sign(di/dt)
//! ```
//! solved exactly for a step of any size. c and w in A. z = 0 at the start of a run.
//!
//! Source: remanence in the error model of open-loop and closed-loop current transducers; the Duhem model, of which e =
//! 0 is the form of Bouc and Wen with exponent 1.

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
    /// e.
    pub closing: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for SensorHysteresis<S> {
    const DESCRIPTION: Description = Description {
        name: "hysteresis of the current sensor",
        equation: "i_shown = i − c z, dz/di = (1 + e − z s)/((1 + e) w) up to z = s, s = sign(di/dt)",
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
                meaning: "change of the current over which the sensor would go from the middle of the loop to its edge",
            },
            EffectParameter {
                name: "sensor_closing",
                unit: "1",
                role: Role::Shape,
                range: (0.0, 4.0),
                start: 0.5,
                relative: Relative::Absolute,
                meaning: "how straight it goes there: 0 ever slower, 4 nearly straight",
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
    fields!(half_width, turning, closing);
    #[inline(always)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        let step = passed.after.current - passed.before.current;
        let side = if step < S::ZERO { -S::ONE } else { S::ONE };
        let aim = side * (S::ONE + self.closing);
        let left = (-(step.abs() / ((S::ONE + self.closing) * self.turning))).exp();
        let z = aim - (aim - memory[1]) * left;
        let z = if z * side > S::ONE { side } else { z };
        *memory = [self.half_width * z, z, S::ZERO, S::ZERO];
    }
    #[inline(always)]
    fn measure(&self, memory: &Memory<S>, reading: &mut State<S>) {
        reading.current -= memory[0];
    }
}
