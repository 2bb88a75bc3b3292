//! Effects that no recording of voltage, current and speed could separate.

use greyrig::effects::EffectId;
use greyrig::motor::FluxLaw;

use crate::model::Kind;

/// A set of such effects.
#[derive(Debug, Clone, Copy)]
pub struct Class {
    /// The effects, the default member first.
    pub members: &'static [EffectId],
    /// The motors in which they are one, if not in all. A resistance and a weaker flux are the same voltage where the flux is
    /// the current; with magnets, two laws by which a resistance grows with the speed are.
    pub law: Option<FluxLaw>,
}

const CLASSES: &[Class] = &[
    Class { members: &[EffectId::Saturation, EffectId::ArmatureReaction], law: Some(FluxLaw::Series) },
    Class { members: &[EffectId::IronLossDrag, EffectId::StrayLoadTorque], law: None },
    Class { members: &[EffectId::CommutationDemagnetisation, EffectId::SkinEffect], law: Some(FluxLaw::Series) },
    Class { members: &[EffectId::CommutationResistance, EffectId::SkinEffect], law: Some(FluxLaw::PermanentMagnet) },
];

/// Effects of which any two can take the part of the third while the motor runs on a closed supply: their columns in the
/// voltage balance, K ω, R + K ω and 1, are linearly dependent. A locked rotor or an open supply takes one of them away.
pub const OFFSETS: [EffectId; 3] = [EffectId::Remanence, EffectId::CurrentOffset, EffectId::VoltageOffset];

/// Effects that are one while the rotor stands still, the first of which stands for the others: without a speed the flux shows in the
/// inductance alone, a lag fades by nothing, and a constant current is a constant voltage over R.
const AT_STANDSTILL: [&[EffectId]; 3] = [
    &[EffectId::InductanceSaturation, EffectId::Saturation, EffectId::ArmatureReaction],
    &[EffectId::EddyCurrent, EffectId::TransformerEmf],
    &[EffectId::VoltageOffset, EffectId::CurrentOffset],
];

/// Effects that are one with another while the rotor stands still, itself included.
pub fn at_standstill(id: EffectId) -> &'static [EffectId] {
    AT_STANDSTILL.iter().copied().find(|set| set.contains(&id)).unwrap_or(&[])
}

/// Torques whose law no two sources agree on (how Stribeck friction fades beyond its speed, with which power of the speed stray load grows),
/// and effects of which a little takes up the difference between two such laws.
const ROUNDED_OFF: [(&[EffectId], &[EffectId]); 2] = [
    (&[EffectId::Stribeck], &[EffectId::WindageExponent, EffectId::QuadraticLoad]),
    (&[EffectId::IronLossDrag, EffectId::StrayLoadTorque], &[EffectId::QuadraticLoad]),
];

/// Whether an effect may be the rest of the law of one that is `present`.
pub fn rounds_off(id: EffectId, present: &[EffectId]) -> bool {
    ROUNDED_OFF.iter().any(|(laws, rests)| rests.contains(&id) && laws.iter().any(|law| present.contains(law)))
}

/// Laws of the flux, and the effect that the linearised score overrates beside them: the law's shape parameters can absorb the same
/// residual non-linearly. Refit without it before keeping it. (Of a motor with saturation that runs steadily it scored a fifth of the whole
/// gain, and a refit gave none of that.)
const BENT_TOGETHER: (&[EffectId], EffectId) =
    (&[EffectId::Saturation, EffectId::ArmatureReaction], EffectId::InductanceSaturation);

/// Whether an effect may be the rest of a law of the flux that is `present`: whatever a linearisation says, a fit has to prove what it earns.
pub fn bends_with(id: EffectId, present: &[EffectId]) -> bool {
    let (laws, rest) = BENT_TOGETHER;
    id == rest && laws.iter().any(|law| present.contains(law))
}

/// An effect that is two others together.
#[derive(Debug, Clone, Copy)]
pub struct Sum {
    /// The one.
    pub one: EffectId,
    /// The two.
    pub two: [EffectId; 2],
    law: FluxLaw,
}

/// With magnets a constant error i₀ of the current is R i₀ of voltage and K i₀ of torque.
const SUMS: [Sum; 1] = [Sum {
    one: EffectId::CurrentOffset,
    two: [EffectId::VoltageOffset, EffectId::TorqueOffset],
    law: FluxLaw::PermanentMagnet,
}];

/// Effects of a kind of motor that are two others together.
pub fn sums(kind: Kind) -> impl Iterator<Item = Sum> {
    SUMS.into_iter().filter(move |sum| sum.law == kind.flux_law())
}

/// All classes.
pub fn all() -> &'static [Class] {
    CLASSES
}

/// The class of an effect in a kind of motor, if it shares one.
pub fn class_of(kind: Kind, id: EffectId) -> Option<&'static [EffectId]> {
    let here = |class: &&Class| class.law.is_none_or(|law| law == kind.flux_law());
    CLASSES.iter().filter(here).map(|class| class.members).find(|members| members.contains(&id))
}

/// Whether two effects are one in the data of a kind of motor.
pub fn same(kind: Kind, a: EffectId, b: EffectId) -> bool {
    a == b || class_of(kind, a).is_some_and(|class| class.contains(&b))
}
