//! Inertia of the air: the flow through a fan and its duct lags the speed, and part of the torque follows the flow.
//!
//! `J dω/dt = … − (1 − b) μ2 ω|ω| − b μ2 q |ω|` with `τ dq/dt = ω − q`; q is the flow, in rad/s of the speed that would
//! drive it in the long run, and starts there. b is dimensionless, τ in s. The lag is solved exactly for a speed that
//! is straight within the step. Where nothing is remembered (a torque at a speed, without a run) the flow counts as
//! settled.
//!
//! Source: momentum of an air column in a duct, linearised; the shares follow the characteristic of a radial fan, whose
//! torque falls when the flow is throttled.

use super::memory::lagged;
use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Passed, PhysicalEffect, Prior, Relative, Role,
    Separation,
};
use crate::motor::{Balance, OperatingPoint, State};
use crate::scalar::Scalar;

/// Turbulent friction of which a part lags the speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FanDynamics<S> {
    /// b.
    pub share: S,
    /// τ, s.
    pub time: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for FanDynamics<S> {
    const DESCRIPTION: Description = Description {
        name: "inertia of the air in the duct",
        equation: "J dω/dt = … − (1 − b) μ2 ω|ω| − b μ2 q |ω|, τ dq/dt = ω − q",
        acts: Acts::Mechanical,
        parameters: &[
            EffectParameter {
                name: "fan_share",
                unit: "1",
                role: Role::Size,
                range: (0.0, 1.0),
                start: 0.5,
                relative: Relative::Absolute,
                meaning: "share of the torque that follows the flow",
            },
            EffectParameter {
                name: "fan_time",
                unit: "s",
                role: Role::Time,
                range: (0.005, 10.0),
                start: 0.15,
                relative: Relative::Absolute,
                meaning: "time constant of the flow",
            },
        ],
        size_in_words: "the air follows the fan {} later",
        excited_by: &[Excitation::Acceleration],
        prior: Prior::rare("only where the air in a duct is heavy beside the rotor"),
        why: "The column of air in a duct has inertia. After a change of the speed the load follows late, so that \
              the rotor overshoots and settles.",
        noticed: "After each step of the voltage the speed overshoots a little, and the rushing follows late.",
        remedy: "Name it where the fan has a long duct. Closing the duct takes it away, which proves it.",
        signature: "too little load while the speed rises, too much while it falls; none at constant speed",
        confused_with: &[EffectId::StrayLoadTorque, EffectId::WindageExponent, EffectId::IronLossDrag],
        separated_by: &[
            Separation::by("steps of the voltage at full speed against a steady run"),
            Separation::by("a coast-down with the duct closed"),
        ],
        source: "momentum of an air column, linearised",
        remembers: true,
        ..Description::usual(EffectId::FanDynamics)
    };
    fields!(share, time);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, memory: &Memory<S>, balance: &mut Balance<N>) {
        let turbulent = balance.turbulent_friction;
        let lagging = N::lift(self.share) * turbulent;
        let settled = memory[1] == S::ZERO;
        let flow = if settled { at.speed } else { N::lift(memory[0]) };
        balance.turbulent_friction = turbulent - lagging;
        balance.friction += lagging * flow * at.speed.abs();
    }
    fn at_start(&self, state: State<S>, _: S) -> Memory<S> {
        [state.speed, S::ONE, S::ZERO, S::ZERO]
    }
    #[inline(always)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        memory[0] = lagged(memory[0], passed.before.speed, passed.after.speed, passed.interval / self.time);
    }
}
