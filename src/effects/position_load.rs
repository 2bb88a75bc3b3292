//! A load that goes with the angle: a cam, an eccentric, a crank, a coupling or belt that runs hard at one place.
//!
//! `J dω/dt = … + c_1 cos θ + s_1 sin θ + c_2 cos 2θ + s_2 sin 2θ`, all in N m, θ in rad the angle since the start of
//! the run. The first two waves of a torque that repeats with every turn; an unbalanced rotor has the first alone
//! ([`EffectId::Imbalance`]), slots have one at their number ([`EffectId::TorqueRipple`]). The angle at the start is
//! not known, hence cosine and sine, and the effect is absent where all four are zero. The torque of the beginning of a
//! step holds throughout it.
//!
//! Source: Fourier series of a periodic load.

use super::memory::{AT_ZERO_ANGLE, turn};
use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Passed, PhysicalEffect, Prior, Relative, Role,
    Seen, Separation,
};
use crate::motor::{Balance, OperatingPoint, State};
use crate::scalar::Scalar;

/// Torque that repeats with every turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionLoad<S> {
    /// c_1, N m.
    pub cosine: S,
    /// s_1, N m.
    pub sine: S,
    /// c_2, N m.
    pub second_cosine: S,
    /// s_2, N m.
    pub second_sine: S,
}

/// One of the four amplitudes.
const fn amplitude(name: &'static str, role: Role, meaning: &'static str) -> EffectParameter {
    let range = (-1e4, 1e4);
    EffectParameter { name, unit: "N m", role, range, start: 0.3, relative: Relative::Friction, meaning }
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for PositionLoad<S> {
    const DESCRIPTION: Description = Description {
        name: "load that depends on the angle",
        equation: "J dω/dt = … + c_1 cos θ + s_1 sin θ + c_2 cos 2θ + s_2 sin 2θ",
        acts: Acts::Mechanical,
        seen: Seen::Orders,
        parameters: &[
            amplitude("position_cos", Role::Size, "amplitude of the cosine of the angle"),
            amplitude("position_sin", Role::SecondSize, "amplitude of the sine of the angle"),
            amplitude("position_cos2", Role::SecondSize, "amplitude of the cosine of twice the angle"),
            amplitude("position_sin2", Role::SecondSize, "amplitude of the sine of twice the angle"),
        ],
        size_in_words: "the load swings by {} as the shaft turns",
        excited_by: &[Excitation::Rotation],
        prior: Prior::occasional("cams, eccentrics, and belts with a joint"),
        why: "A cam, an eccentric or a joint in a belt loads the shaft at the same place in each turn. The speed \
              sags there and recovers.",
        noticed: "A thump once or twice a turn that slows down with the rotor. The current swings in the same beat.",
        remedy: "Often it is the machine's purpose. Record the angle, and it can be told. If it is new, look at \
                 belts, at a chain, and at something that touches once a turn.",
        signature: "lines at once and twice the frequency of rotation in the speed, the stronger the slower, and in the \
                    current",
        confused_with: &[EffectId::Imbalance, EffectId::TorqueRipple, EffectId::SpeedRipple],
        separated_by: &[
            Separation::by("the angle of the shaft, recorded"),
            Separation::by("order tracking over a slow run-up: two lines that belong together"),
        ],
        source: "Fourier series of a periodic load",
        remembers: true,
        ..Description::usual(EffectId::PositionLoad)
    };
    fields!(cosine, sine, second_cosine, second_sine);
    #[inline(never)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, memory: &Memory<S>, balance: &mut Balance<N>) {
        let [_, cos, sin, _] = *memory;
        let second = self.second_cosine * (cos * cos - sin * sin) + S::constant(2.0) * self.second_sine * (cos * sin);
        balance.torque = balance.torque.plus(self.cosine * cos + self.sine * sin + second);
    }
    fn at_start(&self, _: State<S>, _: S) -> Memory<S> {
        AT_ZERO_ANGLE.map(S::constant)
    }
    #[inline(never)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        turn(S::ONE, passed, memory);
    }
}
