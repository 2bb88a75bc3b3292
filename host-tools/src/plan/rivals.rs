//! Which effects are to be told apart.

use greyrig::effects::{Description, EffectId, InWords, Seen};

use crate::diagnose::classes;
use crate::error::{Error, Result};
use crate::model::Kind;

/// Rivals that are known of old.
const CLASSIC: [[EffectId; 2]; 5] = [
    [EffectId::EddyCurrent, EffectId::ChannelDelay],
    [EffectId::Remanence, EffectId::CurrentOffset],
    [EffectId::Saturation, EffectId::CurrentCompression],
    [EffectId::Hysteresis, EffectId::EddyCurrent],
    [EffectId::BrushDrop, EffectId::Saturation],
];

/// The pairs that are known of old, for a kind of motor.
pub fn classic(kind: Kind) -> Vec<[&'static Description; 2]> {
    let pairs: Vec<[EffectId; 2]> = match kind {
        Kind::Universal => CLASSIC.to_vec(),
        Kind::PmDc => {
            vec![
                [EffectId::CoulombFriction, EffectId::Stribeck],
                [EffectId::BrushDrop, EffectId::SupplyDeadZone],
                [EffectId::CurrentOffset, EffectId::VoltageOffset],
            ]
        }
    };
    pairs.into_iter().map(|pair| pair.map(EffectId::description)).collect()
}

/// Pairs among the rivals that the catalogue knows as confused; all pairs, where it knows none; the rivals of a single
/// one.
pub fn pairs(kind: Kind, rivals: &[EffectId]) -> Result<Vec<[&'static Description; 2]>> {
    let mut named = Vec::new();
    for id in rivals {
        let d = id.description();
        match d.seen_with(kind.flux_law()) {
            Seen::FreeRun if d.fits(kind.flux_law()) => named.push(d),
            Seen::FreeRun => return Err(Error::usage(format!("a {kind} motor cannot have {id}"), "leave it out")),
            Seen::Invisible(needed) | Seen::InvisibleInSeries(needed) => {
                return Err(Error::usage(
                    format!("no recording of voltage, current and speed shows {id}"),
                    format!("it takes {needed}"),
                ));
            }
            _ => {
                return Err(Error::usage(
                    format!("{id} does not show in the error of a free run"),
                    format!("it is told by {}", InWords(d.separated_by)),
                ));
            }
        }
    }
    if let [only] = named[..] {
        let others = only.confused_with.iter().map(|id| id.description());
        named.extend(others.filter(|d| d.seen_with(kind.flux_law()) == Seen::FreeRun && d.fits(kind.flux_law())));
        named.dedup_by_key(|d| d.id);
        return different(kind, named[1..].iter().map(|other| [only, other]).collect());
    }
    let all: Vec<[&'static Description; 2]> =
        named.iter().enumerate().flat_map(|(k, a)| named[k + 1..].iter().map(move |b| [*a, *b])).collect();
    let confused =
        |p: &&[&Description; 2]| p[0].confused_with.contains(&p[1].id) || p[1].confused_with.contains(&p[0].id);
    let known: Vec<_> = all.iter().filter(confused).copied().collect();
    different(kind, if known.is_empty() { all } else { known })
}

/// Leaves out pairs that are one in the data.
fn different(kind: Kind, pairs: Vec<[&'static Description; 2]>) -> Result<Vec<[&'static Description; 2]>> {
    let same = |p: &&[&Description; 2]| classes::same(kind, p[0].id, p[1].id);
    let left: Vec<_> = pairs.iter().filter(|p| !same(p)).copied().collect();
    if let (true, Some([a, b])) = (left.is_empty(), pairs.iter().find(same)) {
        return Err(Error::usage(
            format!("no recording of voltage, current and speed tells {} from {}", a.id, b.id),
            "in the model one stands for the other; leave one out",
        ));
    }
    if left.is_empty() {
        return Err(Error::usage(
            "these rivals are no pair",
            "give two effects or more, such as --rivals saturation,brush_drop",
        ));
    }
    Ok(left)
}
