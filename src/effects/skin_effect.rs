//! Skin and proximity effect: the current in the armature bars alternates with the rotation and is crowded out of part
//! of the copper.
//!
//! `R (1 + k ω²)`, k in s²/rad²: the first term of the expansion in the frequency, which holds while the conductor is
//! thinner than the skin depth.
//!
//! Source: general machine theory (eddy currents in the conductor, low-frequency expansion).

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Representative,
    Role, Separation,
};
use crate::motor::{Balance, FluxLaw, OperatingPoint};
use crate::scalar::Scalar;

/// Resistance that grows with the square of the speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkinEffect<S> {
    /// k, s²/rad².
    pub rise: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for SkinEffect<S> {
    const DESCRIPTION: Description = Description {
        name: "skin and proximity effect",
        equation: "R (1 + k ω²)",
        acts: Acts::Electrical,
        parameters: &[EffectParameter {
            name: "skin_effect",
            unit: "s²/rad²",
            role: Role::Size,
            range: (0.0, 1e3),
            start: 0.1,
            relative: Relative::InverseSpeedSquared,
            meaning: "relative rise of the resistance per square of the speed",
        }],
        size_in_words: "the resistance rises by {} with the square of the frequency",
        excited_by: &[Excitation::Speed, Excitation::Alternating],
        prior: Prior::rare("thick wires at a high frequency of rotation only"),
        represented_by: &[
            Representative { effect: EffectId::CommutationDemagnetisation, law: Some(FluxLaw::Series) },
            Representative { effect: EffectId::CommutationResistance, law: Some(FluxLaw::PermanentMagnet) },
        ],
        why: "At a high frequency of rotation the current in the armature's wires is crowded to their edges. \
              Resistance then rises with the square of the frequency.",
        noticed: "Nothing can be seen or heard but a winding that is warmer at high speed than its current explains.",
        remedy: "Rarely anything. Thinner wires, or several in parallel, make it less. Rule out late commutation \
                 first, which is more frequent and of the opposite sign.",
        signature: "resistance that seems to rise with the square of the speed; nothing in the torque, no harmonics",
        confused_with: &[EffectId::CommutationDemagnetisation, EffectId::CommutationResistance],
        separated_by: &[Separation::by(
            "nothing that is measured at the terminals, but for the sign: late commutation lowers the resistance \
                 that seems to be there",
        )],
        source: "general machine theory",
        ..Description::usual(EffectId::SkinEffect)
    };
    fields!(rise);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        let rise = at.speed.times(self.rise) * at.speed;
        balance.resistance = balance.resistance * (N::ONE + rise);
    }
}
