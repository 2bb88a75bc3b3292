//! Imbalance or eccentricity: a torque once per turn.
//!
//! `J dω/dt = … + c cos θ + s sin θ`, c and s in N m, θ in rad the angle since the start of the run: gravity on an
//! unbalanced rotor with a horizontal shaft, a belt or a coupling that runs out of true. The angle at the start is not
//! known, hence cosine and sine, and the effect is absent when both are zero. The torque of the beginning of a step
//! holds throughout it.
//!
//! Source: mechanics of a pendulum that turns.

use super::memory::{AT_ZERO_ANGLE, turn};
use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Passed, PhysicalEffect, Prior, Relative, Role,
    Seen, Separation,
};
use crate::motor::{Balance, OperatingPoint, State};
use crate::scalar::Scalar;

/// Torque once per turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Imbalance<S> {
    /// c, N m.
    pub cosine: S,
    /// s, N m.
    pub sine: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for Imbalance<S> {
    const DESCRIPTION: Description = Description {
        name: "imbalance",
        equation: "J dω/dt = … + c cos θ + s sin θ",
        acts: Acts::Mechanical,
        seen: Seen::Orders,
        parameters: &[
            EffectParameter {
                name: "imbalance_cos",
                unit: "N m",
                role: Role::Size,
                range: (-1e4, 1e4),
                start: 0.3,
                relative: Relative::Friction,
                meaning: "amplitude of the cosine of the angle",
            },
            EffectParameter {
                name: "imbalance_sin",
                unit: "N m",
                role: Role::SecondSize,
                range: (-1e4, 1e4),
                start: 0.3,
                relative: Relative::Friction,
                meaning: "amplitude of the sine of the angle",
            },
        ],
        size_in_words: "the torque swings by {} once a turn",
        excited_by: &[Excitation::Rotation],
        prior: Prior::occasional("rotors that are balanced roughly or have a bent shaft"),
        why: "The rotor's centre of mass lies beside its axis. In a rig that gives way, or with the axis level, its \
              weight pulls once up and once down each turn.",
        noticed: "The housing shakes at the frequency of rotation; it can be felt by hand, and it is worst where the \
                  bench resonates.",
        remedy: "Balance the rotor. Look for a bent shaft, a coupling out of true, a blade that is missing, or dirt \
                 on the fan.",
        signature: "a line at the frequency of rotation in the speed, the stronger the slower, and in the current",
        confused_with: &[EffectId::TorqueRipple, EffectId::SpeedRipple],
        separated_by: &[Separation::by(
            "order tracking over a coast-down: the line in the speed falls with the speed, that of a tacho out of \
                 true grows with it",
        )],
        source: "mechanics",
        remembers: true,
        ..Description::usual(EffectId::Imbalance)
    };
    fields!(cosine, sine);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, memory: &Memory<S>, balance: &mut Balance<N>) {
        balance.torque = balance.torque.plus(self.cosine * memory[1] + self.sine * memory[2]);
    }
    fn at_start(&self, _: State<S>, _: S) -> Memory<S> {
        AT_ZERO_ANGLE.map(S::constant)
    }
    #[inline(always)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        turn(S::ONE, passed, memory);
    }
}
