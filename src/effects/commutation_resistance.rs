//! Reactance voltage of the commutation: a series resistance that grows with the speed and gives no torque.
//!
//! `(R + r |ω|) i`, r in Ω s/rad. The energy of the leakage field of every commutating coil is lost in the brush, once
//! per bar. In a series motor r ω i has the form of the back-EMF K i ω: K of the voltage balance becomes larger than K
//! of the torque balance, and inertia and friction scale with it, so that recordings of voltage, current and speed
//! cannot show it.
//!
//! Source: general machine theory (energy of the commutating coils).

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Seen,
    Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Series resistance in proportion to the speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommutationResistance<S> {
    /// r, Ω s/rad.
    pub slope: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for CommutationResistance<S> {
    const DESCRIPTION: Description = Description {
        name: "resistance of delayed commutation",
        equation: "(R + r |ω|) i",
        acts: Acts::Electrical,
        seen: Seen::InvisibleInSeries("the inertia J, from a pendulum test or a known disc"),
        parameters: &[EffectParameter {
            name: "commutation_resistance",
            unit: "Ω s/rad",
            role: Role::Size,
            range: (0.0, 100.0),
            start: 0.1,
            relative: Relative::ImpedancePerSpeed,
            meaning: "resistance per speed",
        }],
        size_in_words: "the resistance rises by {} with the speed",
        excited_by: &[Excitation::Speed],
        prior: Prior::occasional("coils that turn over at speed take a voltage in proportion to current and speed"),
        why: "Each coil that turns over gives its stored energy away once a bar. That costs a voltage in proportion \
              to current and speed, as a resistance would that grows with the speed.",
        noticed: "Sparks at the trailing edge of the brushes that grow with speed and load; warm bars.",
        remedy: "In a series motor the other parameters take its place, and the curves say nothing. With magnets, \
                 name it. Brushes, springs and the state of the commutator decide its size.",
        signature: "none in a series motor: K, J and the friction take its place; with known inertia K of the voltage \
                    exceeds K of the torque. In a magnet motor a resistance that rises in proportion to the speed",
        confused_with: &[EffectId::VoltageGain, EffectId::SkinEffect],
        separated_by: &[
            Separation::by("a known inertia: K from the voltage balance against K from the torque balance"),
            Separation::by("with magnets different loads at one speed"),
        ],
        source: "general machine theory",
        ..Description::usual(EffectId::CommutationResistance)
    };
    fields!(slope);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        balance.resistance += at.speed.abs().times(self.slope);
    }
}
