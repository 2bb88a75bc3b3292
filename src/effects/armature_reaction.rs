//! Armature reaction: cross-magnetisation by the armature's own current takes main flux away.
//!
//! `φ(i) = i (1 − a z²/(1 + z²))`, z = i/i_k: the same function of the same current in back-EMF and torque, as for
//! saturation, from which terminal data cannot tell it apart; the two are one class.
//!
//! Source: general machine theory (cross-magnetising field of a motor without compensating winding).

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Motors, PhysicalEffect, Prior, Relative,
    Representative, Role, Separation,
};
use crate::motor::{Balance, FluxLaw, OperatingPoint};
use crate::scalar::Scalar;

/// Main flux lost to the cross field of the armature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmatureReaction<S> {
    /// a.
    pub depth: S,
    /// i_k, A.
    pub knee: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for ArmatureReaction<S> {
    const DESCRIPTION: Description = Description {
        name: "armature reaction (cross-magnetisation)",
        equation: "K φ(i) ω and K φ(i) i with φ = i (1 − a z²/(1 + z²)), z = i/i_k",
        acts: Acts::Both,
        motors: Motors::Series,
        parameters: &[
            EffectParameter {
                name: "reaction_depth",
                unit: "1",
                role: Role::Size,
                range: (0.0, 0.9),
                start: 0.2,
                relative: Relative::Absolute,
                meaning: "share of the flux that is lost at high current",
            },
            EffectParameter {
                name: "reaction_knee",
                unit: "A",
                role: Role::Shape,
                range: (0.01, 1e4),
                start: 1.0,
                relative: Relative::Current,
                meaning: "current at which half of that is lost",
            },
        ],
        size_in_words: "{} of the flux is lost to the cross field at high current",
        excited_by: &[Excitation::Current],
        prior: Prior::common("small motors have no compensating winding"),
        represented_by: &[Representative { effect: EffectId::Saturation, law: Some(FluxLaw::Series) }],
        at_standstill: Some(EffectId::InductanceSaturation),
        overrated_beside: &[EffectId::InductanceSaturation],
        weakens_flux: true,
        why: "The armature's own field stands across the main field. It crowds the flux into one edge of the pole, \
              which saturates, and so takes flux away as the current grows.",
        noticed: "Brushes spark more under load, as the neutral zone moves with the current. In the curves it is \
                  what saturation is, a little softer.",
        remedy: "It is no fault. No recording at the terminals tells it from saturation: name either. If sparks \
                 under load are the trouble, move the brushes against the rotation within what the maker allows.",
        signature: "that of saturation, with a softer curve",
        confused_with: &[EffectId::Saturation],
        separated_by: &[Separation::by("nothing that is measured at the terminals")],
        source: "general machine theory",
        ..Description::usual(EffectId::ArmatureReaction)
    };
    fields!(depth, knee);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        let z = balance.magnetising.times(S::ONE / self.knee);
        let square = z * z;
        let inverse = N::ONE / (N::ONE + square);
        let share = square * inverse;
        let depth = N::lift(self.depth);
        balance.flux = balance.flux * (N::ONE - depth * share);
        balance.flux_slope = balance.flux_slope * (N::ONE - depth * share * (N::ONE + N::constant(2.0) * inverse));
    }
}
