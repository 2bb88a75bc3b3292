//! Late commutation: the current of the commutating coils demagnetises, the more the faster.
//!
//! `K φ ω` and `K φ i` with φ reduced by `1 − κ |ω|`.
//!
//! Source: general machine theory (resistance and linear commutation).

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Flux that falls with the speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommutationDemagnetisation<S> {
    /// κ, s/rad.
    pub slope: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for CommutationDemagnetisation<S> {
    const DESCRIPTION: Description = Description {
        name: "demagnetisation by late commutation",
        equation: "φ (1 − κ |ω|) in back-EMF and torque",
        acts: Acts::Both,
        parameters: &[EffectParameter {
            name: "demagnetisation",
            unit: "s/rad",
            role: Role::Size,
            range: (0.0, 10.0),
            start: 0.05,
            relative: Relative::InverseSpeed,
            meaning: "relative loss of flux per speed",
        }],
        size_in_words: "a speed of 1 rad/s takes {} of the flux",
        excited_by: &[Excitation::Speed, Excitation::Current],
        prior: Prior::occasional("brushes that stand beside the neutral zone, or coils that turn over late"),
        why: "A coil that turns its current over late still pushes against the main field when it has left the \
              neutral zone. It takes flux away, the more the faster the commutator passes.",
        noticed: "A motor that runs a little faster than it should at high speed, often with sparks at one edge of \
                  the brush.",
        remedy: "Look whether the brushes stand in the neutral zone, and whether they are worn to a wider arc. \
                 Moving the brush holder by a few degrees changes it, and tells that it was this.",
        signature: "resistance that seems to fall with the square of the speed, and a torque that falls with it; no harmonics",
        confused_with: &[EffectId::SkinEffect, EffectId::IronLossDrag],
        separated_by: &[Separation::by(
            "nothing that is measured at the terminals, but for the sign: skin effect raises the resistance",
        )],
        source: "general machine theory",
        ..Description::usual(EffectId::CommutationDemagnetisation)
    };
    fields!(slope);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        let share = at.speed.abs().times(-self.slope).plus(S::ONE);
        balance.flux = balance.flux * share;
        balance.flux_slope = balance.flux_slope * share;
    }
}
