//! Effects that no recording of voltage, current and speed could separate, as their descriptions say.

use greyrig::effects::{Description, EffectId, Sum};
use greyrig::motor::FluxLaw;

use crate::model::Kind;

/// A set of such effects.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Class {
    /// The effects, the one that is named first.
    pub members: Vec<EffectId>,
    /// The motors in which they are one, if not in all.
    pub law: Option<FluxLaw>,
}

/// All classes.
pub fn all() -> Vec<Class> {
    let mut classes: Vec<Class> = Vec::new();
    for d in Description::all() {
        for named in d.represented_by {
            match classes.iter_mut().find(|class| class.members[0] == named.effect && class.law == named.law) {
                Some(class) => class.members.push(d.id),
                None => classes.push(Class { members: vec![named.effect, d.id], law: named.law }),
            }
        }
    }
    classes
}

/// The class of an effect in a kind of motor, the one that is named first; none, if it shares none.
pub fn class_of(kind: Kind, id: EffectId) -> Option<Vec<EffectId>> {
    let law = kind.flux_law();
    let first = id.description().named_as(law);
    let others = Description::all().filter(|d| d.id != first && d.named_as(law) == first).map(|d| d.id);
    let class: Vec<EffectId> = std::iter::once(first).chain(others).collect();
    (class.len() > 1).then_some(class)
}

/// Whether two effects are one in the data of a kind of motor.
pub fn same(kind: Kind, a: EffectId, b: EffectId) -> bool {
    let named = |id: EffectId| id.description().named_as(kind.flux_law());
    named(a) == named(b)
}

/// Effects that are one with another while the rotor stands still, itself included; the first of them stands for the
/// others.
pub fn at_standstill(id: EffectId) -> Vec<EffectId> {
    let first = id.description().at_standstill.unwrap_or(id);
    let others = Description::all().filter(|d| d.at_standstill == Some(first)).map(|d| d.id);
    std::iter::once(first).chain(others).collect()
}

/// Whether an effect may be the rest of the law of one that is `present`.
pub fn rounds_off(id: EffectId, present: &[EffectId]) -> bool {
    present.iter().any(|law| law.description().rest_of_law.contains(&id))
}

/// Whether an effect may be the rest of a law of the flux that is `present`: whatever a linearisation says, a fit has
/// to prove what it earns.
pub fn bends_with(id: EffectId, present: &[EffectId]) -> bool {
    present.iter().any(|law| law.description().overrated_beside.contains(&id))
}

/// Effects of a kind of motor that are two others together, with these.
pub fn sums(kind: Kind) -> impl Iterator<Item = (EffectId, Sum)> {
    let sums = Description::all().filter_map(|d| Some((d.id, d.sum_of?)));
    sums.filter(move |(_, sum)| sum.law == kind.flux_law())
}

#[cfg(test)]
mod tests {
    use super::*;

    // The classes of the contract with users, by hand.

    #[test]
    fn a_class_is_named_by_the_first_of_its_members() {
        let class = |kind, id: &str| class_of(kind, id.parse().unwrap());
        for id in ["saturation", "armature_reaction"] {
            assert_eq!(class(Kind::Universal, id).unwrap(), ["saturation", "armature_reaction"]);
            assert_eq!(class(Kind::PmDc, id), None);
        }
        for kind in [Kind::Universal, Kind::PmDc] {
            assert_eq!(class(kind, "stray_load_torque").unwrap(), ["iron_loss_drag", "stray_load_torque"]);
            assert_eq!(class(kind, "converter_dead_time").unwrap(), ["brush_drop", "converter_dead_time"]);
            assert_eq!(class(kind, "speed_lag"), None);
        }
        let skin = ["commutation_demagnetisation", "commutation_resistance"];
        for (kind, first) in [Kind::Universal, Kind::PmDc].into_iter().zip(skin) {
            assert_eq!(class(kind, "skin_effect").unwrap(), [first, "skin_effect"]);
        }
        assert!(same(Kind::Universal, EffectId::Saturation, EffectId::ArmatureReaction));
        assert!(!same(Kind::PmDc, EffectId::Saturation, EffectId::ArmatureReaction));
        assert_eq!(all().len(), 5);
    }

    #[test]
    fn without_a_speed_more_effects_are_one() {
        let all = ["inductance_saturation", "saturation", "armature_reaction"];
        assert_eq!(at_standstill(EffectId::ArmatureReaction), all);
        assert_eq!(at_standstill(EffectId::CurrentOffset), ["voltage_offset", "current_offset"]);
        assert_eq!(at_standstill(EffectId::BrushDrop), ["brush_drop"]);
    }
}
