//! Hysteresis of the current sensor: its core keeps a little of the last current's sign.
//!
//! `i_shown = i − c z`, where z is the mean of three stops: each follows the current with slope 1/w and rests at ±1,
//! with widths w, q w and q² w. While the current rises the sensor shows c less, while it falls c more; loops inside a
//! loop close. c and w in A, q dimensionless. Independent of rate; z = 0 at the start of a run.
//!
//! Source: remanence in the error model of open-loop and closed-loop current transducers; stops of Prandtl and
//! Ishlinskii, M. A. Krasnosel'skii and A. V. Pokrovskii, Systems with Hysteresis, 1989.

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
    /// q.
    pub spread: S,
}

/// A value within ±1.
#[inline(always)]
fn stopped<S: Scalar<Base = S>>(x: S) -> S {
    if x > S::ONE {
        S::ONE
    } else if x < -S::ONE {
        -S::ONE
    } else {
        x
    }
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for SensorHysteresis<S> {
    const DESCRIPTION: Description = Description {
        name: "hysteresis of the current sensor",
        equation: "i_shown = i − c (z_0 + z_1 + z_2)/3, dz_k/dt = (di/dt)/(q^k w) within ±1",
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
                meaning: "change of the current over which the slowest part goes from the middle of the loop to its edge",
            },
            EffectParameter {
                name: "sensor_spread",
                unit: "1",
                role: Role::Shape,
                range: (0.05, 1.0),
                start: 0.5,
                relative: Relative::Absolute,
                meaning: "how much quicker each other part is than the one before",
            },
        ],
        size_in_words: "the current channel is {} behind, whichever way the current goes",
        excited_by: &[Excitation::Alternating, Excitation::Current],
        prior: Prior::rare("transducers with a core keep 0.1 to 0.5 % of their range"),
        why: "The core of a current sensor keeps a little flux after a peak. The channel is behind by a fixed \
              amount, whichever way the current goes.",
        noticed: "After a large current the channel does not come back to zero, and shows the other sign after a \
                  current the other way.",
        remedy: "Demagnetise the sensor, or take one of the closed-loop kind, or a shunt. Name it for the recordings \
                 that exist.",
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
    fields!(half_width, turning, spread);
    #[inline(never)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        let step = (passed.after.current - passed.before.current) / self.turning;
        let quicker = S::ONE / self.spread;
        let slow = stopped(memory[1] + step);
        let middle = stopped(memory[2] + step * quicker);
        let quick = stopped(memory[3] + step * quicker * quicker);
        let shown = self.half_width * ((slow + middle + quick) * S::constant(1.0 / 3.0));
        *memory = [shown, slow, middle, quick];
    }
    #[inline(always)]
    fn measure(&self, memory: &Memory<S>, reading: &mut State<S>) {
        reading.current -= memory[0];
    }
}
