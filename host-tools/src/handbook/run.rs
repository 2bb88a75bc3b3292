//! The same run of the virtual rig, without an effect and with it.

use greyrig::effects::{Description, Excitation};

use super::difference::Difference;
use crate::context::Context;
use crate::error::Result;
use crate::rig::{EFFECTS, Effect, Kind, Setup, Sizes};

/// An excitation under which an effect shows, and how long it lasts, s: no longer than a figure needs.
struct Excited {
    profile: &'static str,
    seconds: f64,
}

/// What a run has to be for an effect to be seen. What shows near standstill or on direct voltage alone comes first,
/// since alternating currents are in most runs.
fn excited(excited_by: &[Excitation]) -> Excited {
    let asks_for = |wanted: &[Excitation]| excited_by.iter().any(|it| wanted.contains(it));
    let (profile, seconds) = if asks_for(&[Excitation::Heating]) {
        ("steady", 20.0)
    } else if asks_for(&[Excitation::Direct, Excitation::BothDirections, Excitation::LowVoltage]) {
        ("dc-steps", 4.0)
    } else if asks_for(&[Excitation::Acceleration, Excitation::LowSpeed, Excitation::Rotation]) {
        ("coast-down", 6.0)
    } else {
        ("staircase", 3.0)
    };
    Excited { profile, seconds }
}

/// The motor that has an effect of the rig, and its sizes there: the universal one, where both can.
pub fn sizes(effect: &Effect) -> Option<(Kind, Sizes)> {
    [Kind::Universal, Kind::PmDc].into_iter().find_map(|kind| Some((kind, effect.sizes(kind)?)))
}

/// The effect of the virtual rig that stands behind one of the catalogue.
pub fn on_the_rig(d: &Description) -> Option<&'static Effect> {
    EFFECTS.iter().find(|effect| effect.id == d.id.id())
}

/// Runs both; none where the rig has no such effect. Neither channels nor load are noisy, so that all that differs is
/// the effect's.
///
/// # Errors
/// An interrupt.
pub fn with_and_without(d: &Description, ctx: &Context) -> Result<Option<Difference>> {
    let Some((effect, (kind, sizes))) = on_the_rig(d).and_then(|effect| Some((effect, sizes(effect)?))) else {
        return Ok(None);
    };
    let Excited { profile, seconds } = excited(d.excited_by);
    let mut setup = Setup::new(kind).profile(profile)?.seconds(seconds).noise(0.0);
    setup.turbulence = 0.0;
    let without = setup.run_in(ctx)?.recording;
    let size = sizes.default;
    let with = setup.effect(&format!("{}={size}", effect.id))?.run_in(ctx)?.recording;
    let command = format!(
        "greyrig simulate --kind {kind} --profile {profile} --seconds {seconds} --noise 0 --turbulence 0 --effect \
         {}={size} --out with.csv",
        effect.id
    );
    Ok(Some(Difference::between(&without, &with, command)))
}
