//! Torque ripple by slots and commutator bars, and cogging.
//!
//! `J dω/dt = … + c cos nθ + s sin nθ`, c and s in N m, n waves per turn, θ in rad the angle since the start of the
//! run. The angle at the start is not known, hence cosine and sine: the amplitude is √(c² + s²), and the effect is
//! absent when both are zero. The phase nθ is remembered, wrapped to ±π; the torque of the beginning of a step holds
//! throughout it.
//!
//! Source: general machine theory (slot harmonics).

use super::memory::{AT_ZERO_ANGLE, turn};
use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Passed, PhysicalEffect, Prior, Relative, Role,
    Seen, Separation,
};
use crate::motor::{Balance, OperatingPoint, State};
use crate::scalar::Scalar;

/// Torque that varies with the angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueRipple<S> {
    /// c, N m.
    pub cosine: S,
    /// s, N m.
    pub sine: S,
    /// n.
    pub order: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for TorqueRipple<S> {
    const DESCRIPTION: Description = Description {
        name: "torque ripple",
        equation: "J dω/dt = … + c cos nθ + s sin nθ",
        acts: Acts::Mechanical,
        seen: Seen::Orders,
        parameters: &[
            EffectParameter {
                name: "ripple_cos",
                unit: "N m",
                role: Role::Size,
                range: (-1e4, 1e4),
                start: 0.3,
                relative: Relative::Friction,
                meaning: "amplitude of the cosine of the angle",
            },
            EffectParameter {
                name: "ripple_sin",
                unit: "N m",
                role: Role::SecondSize,
                range: (-1e4, 1e4),
                start: 0.3,
                relative: Relative::Friction,
                meaning: "amplitude of the sine of the angle",
            },
            EffectParameter {
                name: "ripple_order",
                unit: "1",
                role: Role::Shape,
                range: (1.0, 200.0),
                start: 12.0,
                relative: Relative::Absolute,
                meaning: "waves per turn: slots, or bars (twice as many when their number is odd)",
            },
        ],
        size_in_words: "the torque swings by {} as the rotor turns",
        excited_by: &[Excitation::Rotation],
        prior: Prior::common("slots and commutator bars"),
        why: "The pull changes from slot to slot. The speed swings with it, many times a turn, slow turns most.",
        noticed: "The rotor clicks from one position to the next when it is turned by hand without a current. At low \
                  speed it hums, with a tone that goes with the speed.",
        remedy: "It is above the filter of a fit and does no harm there. If the tone has grown, look at the air gap, \
                 at a bar or a coil that is missing, and at the bearings' play.",
        signature: "lines at n times the frequency of rotation in speed and current, above the filter but at low speed; \
                    folded at high speed",
        confused_with: &[EffectId::Imbalance, EffectId::SpeedRipple],
        separated_by: &[Separation::by("order tracking over a slow run-up or coast-down")],
        source: "general machine theory",
        remembers: true,
        ..Description::usual(EffectId::TorqueRipple)
    };
    fields!(cosine, sine, order);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, memory: &Memory<S>, balance: &mut Balance<N>) {
        balance.torque = balance.torque.plus(self.cosine * memory[1] + self.sine * memory[2]);
    }
    fn at_start(&self, _: State<S>, _: S) -> Memory<S> {
        AT_ZERO_ANGLE.map(S::constant)
    }
    #[inline(always)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        turn(self.order, passed, memory);
    }
}
