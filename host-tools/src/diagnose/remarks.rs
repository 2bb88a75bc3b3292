//! What a motor engineer would add to a verdict.

use greyrig::effects::EffectId;
use greyrig::motor::BaseParameter;

use super::VerdictKind;
use super::holds::Holds;
use crate::experiment::Experiment;
use crate::identify::flux::linkage;
use crate::identify::space::{Key, Space};
use crate::numbers::figure;

/// How far from one half a share of an interval is half of it.
const HALF_AN_INTERVAL: f64 = 0.1;

/// A speed this many times farther off than it differs by from one period to the next wanders.
const WANDERS: f64 = 3.0;

/// How a speed wanders.
#[derive(Debug, Clone, Copy)]
pub struct Wandering {
    /// [`super::completeness::wandering`].
    pub times: f64,
    /// [`super::completeness::comes_back`].
    pub comes_back: Option<f64>,
}

/// What no effect explains of the speed and may be a load that fluctuates or something slow that is missing: recordings
/// of the same excitation tell.
pub fn wandering(verdict: VerdictKind, Wandering { times, comes_back }: Wandering) -> Option<String> {
    let wanders = format!("the speed is {times:.0} times as far off as it changes from one period to the next");
    let share = comes_back.map(|share| format!("{:.0} %", 100.0 * share.max(0.0)));
    match (verdict, share) {
        _ if times <= WANDERS => None,
        (VerdictKind::None, None) => Some(format!(
            "{wanders}: it wanders, as with a load that fluctuates. If this one is steady, something slow is missing, such as what \
             warms up: record the same once more; what comes back at the same time is not the load's"
        )),
        (VerdictKind::None, Some(share)) => Some(format!(
            "{wanders}: it wanders, and {share} of that comes back in the recording of the same excitation: the load fluctuates, or the \
             motor was not in the same state, as where it had not cooled down"
        )),
        (VerdictKind::OutsideCatalogue, Some(share)) => Some(format!(
            "{wanders}, and {share} of that comes back in the recording of the same excitation: what does is the motor's, and not of a \
             load that fluctuates"
        )),
        _ => None,
    }
}

/// What recordings without motion cannot show.
pub fn standstill(verdict: VerdictKind, holds: Holds) -> Option<String> {
    (verdict == VerdictKind::None && !holds.motion).then(|| {
        "the rotor stands still in these recordings, where flux, friction, load and the speed channel do not show: record the motor \
         while it turns, too"
            .to_owned()
    })
}

/// A delay that is none of the current channel's.
pub fn held_voltage(space: &Space, found: &[EffectId], experiments: &[Experiment]) -> Option<String> {
    let (id, words) = found.iter().find_map(|id| Some((*id, id.description().half_an_interval?)))?;
    let delay = space.get(Key::size_of(id))?;
    let is_half = |e: &Experiment| (delay.value / e.interval_s - 0.5).abs() < HALF_AN_INTERVAL;
    experiments.iter().all(is_half).then(|| words.to_owned())
}

/// What effects of the flux come to: their parameters by themselves say little.
pub fn flux(space: &Space, found: &[EffectId], experiments: &[Experiment]) -> Option<String> {
    found.iter().find(|id| id.description().weakens_flux)?;
    let current = space.scales(experiments).current;
    let [left, linear] = [linkage(&space.motor().ok()?, current, 0.0), space.value(BaseParameter::K) * current];
    Some(format!(
        "at the largest current, {} A, the flux is {:.0} % below the straight line of small currents",
        figure(current, 3),
        100.0 * (1.0 - left / linear)
    ))
}
