//! A parameter that jumps at an instant: a load that is put on, a winding that loses turns, a coupling that lets go.
//!
//! `p (1 + s)` from t_s on, p the base parameter with the number n: 1 R, 2 L, 3 K, 4 J, 5 μ0, 6 μ1, 7 μ2. s is
//! dimensionless, t_s in s since the start of the run. In the step that holds the instant the share of it that lies
//! behind counts. Neither t_s nor n is found by the slope of an error; both are looked for over time and parameters,
//! and then held.
//!
//! Source: two regimes of a regression, R. E. Quandt, J. Am. Stat. Assoc. 53 (1958) 873–880.

use super::memory::accumulate;
use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Passed, PhysicalEffect, Prior, Relative, Role,
    Seen, Separation,
};
use crate::motor::{Balance, OperatingPoint, State};
use crate::scalar::Scalar;

/// A base parameter that is another one from an instant on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterStep<S> {
    /// s.
    pub size: S,
    /// t_s, s.
    pub instant: S,
    /// n.
    pub parameter: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for ParameterStep<S> {
    const DESCRIPTION: Description = Description {
        name: "parameter that jumps",
        equation: "p (1 + s) from t_s on, p = R, L, K, J, μ0, μ1, μ2",
        acts: Acts::Both,
        seen: Seen::Course,
        parameters: &[
            EffectParameter {
                name: "step_size",
                unit: "1",
                role: Role::Size,
                range: (-0.95, 100.0),
                start: 0.2,
                relative: Relative::Absolute,
                meaning: "relative change of the parameter",
            },
            EffectParameter {
                name: "step_time",
                unit: "s",
                role: Role::Instant,
                range: (0.0, 1e6),
                start: 0.1,
                relative: Relative::Absolute,
                meaning: "instant, since the start of the run",
            },
            EffectParameter {
                name: "step_parameter",
                unit: "1",
                role: Role::Parameter,
                range: (1.0, 7.0),
                start: 1.0,
                relative: Relative::Absolute,
                meaning: "which parameter: 1 R, 2 L, 3 K, 4 J, 5 mu0, 6 mu1, 7 mu2",
            },
        ],
        size_in_words: "a parameter changes by a share of {}",
        excited_by: &[Excitation::Acceleration, Excitation::Current],
        prior: Prior::occasional("a load that is put on, a fault that begins, a set-up that is touched"),
        why: "From one moment on the motor is another one: a load was put on, a turn shorted, a screw came loose. A \
              model with constants can be right before or after, and not both.",
        noticed: "A jump of current or speed while the voltage stays; often a click, or a change of the sound at \
                  that instant.",
        remedy: "Ask what happened at the time that is told. Cut the recording there, and fit both halves. What \
                 comes back at the same time in a second recording is the motor's.",
        signature: "a model that is right before an instant, or after it, and not both",
        confused_with: &[EffectId::WindingTemperature, EffectId::BearingWarmup, EffectId::GainDrift],
        separated_by: &[
            Separation::by("the same once more: what comes back at the same time is the motor's, as where it warms up"),
            Separation::by("a longer recording: a jump stays, what warms up goes on"),
        ],
        source: "two regimes of a regression, R. E. Quandt, J. Am. Stat. Assoc. 53 (1958) 873–880",
        remembers: true,
        ..Description::usual(EffectId::ParameterStep)
    };
    fields!(size, instant, parameter);
    #[inline(never)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, memory: &Memory<S>, balance: &mut Balance<N>) {
        let factor = S::ONE + self.size * memory[2];
        let is_below = |limit: f64| self.parameter < S::constant(limit);
        if is_below(1.5) {
            balance.resistance = balance.resistance.times(factor);
        } else if is_below(2.5) {
            balance.inductance = balance.inductance.times(factor);
        } else if is_below(3.5) {
            balance.flux = balance.flux.times(factor);
        } else if is_below(4.5) {
            balance.inverse_inertia = balance.inverse_inertia / factor;
        } else if is_below(5.5) {
            balance.dry_friction = balance.dry_friction.times(factor);
        } else if is_below(6.5) {
            balance.viscous_friction = balance.viscous_friction.times(factor);
        } else {
            balance.turbulent_friction = balance.turbulent_friction.times(factor);
        }
    }
    fn at_start(&self, _: State<S>, elapsed: S) -> Memory<S> {
        let begun = if self.instant > elapsed { S::ZERO } else { S::ONE };
        [elapsed, S::ZERO, begun, begun]
    }
    /// The time, what rounding lost of it, and the shares of the step to come and of the half steps around this point
    /// that lie behind the instant.
    #[inline(never)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        accumulate(memory, passed.interval);
        let steps = (memory[0] - self.instant) / passed.interval;
        let share = |x: S| {
            if x > S::ONE {
                S::ONE
            } else if x < S::ZERO {
                S::ZERO
            } else {
                x
            }
        };
        (memory[2], memory[3]) = (share(steps + S::ONE), share(steps + S::constant(0.5)));
    }
    fn around_point(&self, memory: &Memory<S>) -> Memory<S> {
        [memory[0], memory[1], memory[3], memory[3]]
    }
}
