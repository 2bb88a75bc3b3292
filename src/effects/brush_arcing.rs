//! Arcs between brush and commutator: at random bar passages a voltage of at least the minimum of an arc is lost.
//!
//! `V min(|i|/i_n, 1) sign(i)` is what they take in the mean, V in V and i_n in A: arcs become more frequent with the
//! current until every passage has one. The mean hides in the resistance (below i_n it is exactly V/i_n); what shows is
//! the variance, which follows |i| ω and rises twice per mains period. The model has the mean alone, since a random
//! part cannot be predicted.
//!
//! Source: general machine theory (minimum arc voltage, 12 to 20 V).

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Seen,
    Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Mean voltage drop of the arcs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrushArcing<S> {
    /// V, V.
    pub drop: S,
    /// i_n, A.
    pub current: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for BrushArcing<S> {
    const DESCRIPTION: Description = Description {
        name: "arcing of the brushes",
        equation: "u = … + V min(|i|/i_n, 1) sign(i) in the mean",
        acts: Acts::Electrical,
        seen: Seen::Variance,
        parameters: &[
            EffectParameter {
                name: "arcing_drop",
                unit: "V",
                role: Role::Size,
                range: (0.0, 100.0),
                start: 0.005,
                relative: Relative::Voltage,
                meaning: "mean drop at high current",
            },
            EffectParameter {
                name: "arcing_current",
                unit: "A",
                role: Role::Shape,
                range: (1e-4, 1e3),
                start: 0.5,
                relative: Relative::Current,
                meaning: "current from which every passage has its arc",
            },
        ],
        size_in_words: "arcs take {} in the mean",
        excited_by: &[Excitation::Current, Excitation::Speed],
        prior: Prior::occasional("worn brushes and a rough commutator"),
        why: "Where a bar leaves the brush and the current is not over yet, it goes on through the air: a short \
              burst of some ten volts, at some of the bars. In the mean that is a resistance, in the single sample \
              it is noise.",
        noticed: "Blue sparks, a crackle in a radio nearby, the smell of ozone, black marks on bars. In the \
                  recording bursts above 1 kHz that go with the current.",
        remedy: "Look at the commutator: round, clean, mica below the bars; brushes free in their holders, with \
                 force enough. Bars marked in a pattern speak for a coil or a joint.",
        signature: "variance of the residual that follows |i| ω, with bursts; the mean passes for resistance",
        confused_with: &[EffectId::BrushDrop, EffectId::AdcResolution],
        separated_by: &[Separation::by(
            "the variance above the filter against |i| ω: noise and steps of the converter do not follow it",
        )],
        source: "general machine theory",
        ..Description::usual(EffectId::BrushArcing)
    };
    fields!(drop, current);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        let share = at.current * N::lift(S::ONE / self.current);
        let drop = N::lift(self.drop);
        if share > N::ONE {
            balance.voltage += drop;
        } else if share < -N::ONE {
            balance.voltage -= drop;
        } else {
            balance.voltage += drop * share;
        }
    }
}
