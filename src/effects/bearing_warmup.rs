//! Warm-up of bearings and grease: the friction of the base model is larger in the cold and falls while the motor runs.
//!
//! `μ0 (1 + a x)` and `μ1 (1 + a x)` with `dx/dt = −x/τ`, x = 1 at the start of a run, when the bearings count as cold;
//! a is dimensionless, τ in s. The change in one step is less than a rounding unit of `f32`, so that what rounding
//! loses is kept in the memory as well. Where nothing is remembered (a torque at a speed, without a run) the bearings
//! count as warm.
//!
//! Source: viscosity of grease, with one thermal time constant.

use super::memory::{accumulate, decay};
use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Passed, PhysicalEffect, Prior, Relative, Role,
    Separation,
};
use crate::motor::{Balance, OperatingPoint, State};
use crate::scalar::Scalar;

/// Friction that falls with time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BearingWarmup<S> {
    /// a.
    pub excess: S,
    /// τ, s.
    pub time: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for BearingWarmup<S> {
    const DESCRIPTION: Description = Description {
        name: "warm-up of the bearings",
        equation: "μ0 (1 + a x), μ1 (1 + a x), dx/dt = −x/τ, x = 1 at the start",
        acts: Acts::Mechanical,
        parameters: &[
            EffectParameter {
                name: "warmup_excess",
                unit: "1",
                role: Role::Size,
                range: (0.0, 10.0),
                start: 1.0,
                relative: Relative::Absolute,
                meaning: "relative excess of friction in the cold",
            },
            EffectParameter {
                name: "warmup_time",
                unit: "s",
                role: Role::Time,
                range: (0.5, 1000.0),
                start: 15.0,
                relative: Relative::Absolute,
                meaning: "time constant of warming up",
            },
        ],
        size_in_words: "friction is {} larger at the start than warm",
        excited_by: &[Excitation::Heating],
        prior: Prior::occasional("grease is stiff in the cold"),
        why: "Grease is stiff in the cold. Friction falls over the first minutes, so that the same voltage gives a \
              growing speed.",
        noticed: "The first run of the day is slower, and coasts shorter; the bearings grow warm and the sound gets \
                  softer.",
        remedy: "Run the motor warm before it is judged, or record cold and warm. If friction does not fall, or \
                 rises with warmth, the bearing is packed too full or runs dry.",
        signature: "a slow drift in the torque that does not depend on the current; the voltage balance is clean",
        confused_with: &[EffectId::WindageExponent, EffectId::WindingTemperature],
        separated_by: &[
            Separation::by("the same recording repeated warm"),
            Separation::by("a coast-down at the beginning and one at the end"),
        ],
        source: "viscosity of grease, one time constant",
        remembers: true,
        ..Description::usual(EffectId::BearingWarmup)
    };
    fields!(excess, time);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, memory: &Memory<S>, balance: &mut Balance<N>) {
        let factor = N::lift(S::ONE + self.excess * memory[0]);
        balance.dry_friction = balance.dry_friction * factor;
        balance.viscous_friction = balance.viscous_friction * factor;
    }
    fn at_start(&self, _: State<S>, elapsed: S) -> Memory<S> {
        let (cold, _) = decay(elapsed / self.time);
        [cold, S::ZERO, S::ZERO, S::ZERO]
    }
    #[inline(always)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        let (_, mean) = decay(passed.interval / self.time);
        accumulate(memory, -memory[0] * mean * (passed.interval / self.time));
    }
}
