//! What a motor engineer would add to a verdict.

use crate::experiment::Experiment;
use crate::identify::flux::linkage;
use crate::identify::scales::Scales;
use crate::identify::space::Space;
use crate::report::numbers::figure;

/// Effects that take flux away where the current is large.
const LESS_FLUX: [&str; 2] = ["saturation", "armature_reaction"];
/// How far from one half a share of an interval is half of it.
const HALF_AN_INTERVAL: f64 = 0.1;

/// A speed this many times farther off than it differs by from one period to the next wanders.
const WANDERS: f64 = 3.0;

/// What no effect explains of the speed and passes for a load that fluctuates: it may as well be something slow that is missing.
/// `times` are those of [`super::completeness::wandering`].
pub fn wandering(times: f64) -> Option<String> {
    (times > WANDERS).then(|| {
        format!(
            "the speed is {times:.0} times as far off as it changes from one period to the next: it wanders, as with a load that \
             fluctuates. If this one is steady, something slow is missing, such as what warms up: record the same once more; what \
             comes back at the same time is not the load's"
        )
    })
}

/// A delay that is none of the current channel's.
pub fn held_voltage(space: &Space, found: &[&'static str], experiments: &[Experiment]) -> Option<String> {
    let delay = space.get("channel_delay").filter(|_| found.contains(&"channel_delay"))?;
    let is_half = |e: &Experiment| (delay.value / e.interval_s - 0.5).abs() < HALF_AN_INTERVAL;
    experiments.iter().all(is_half).then(|| {
        "the delay is half a sampling interval, as of a supply that holds its voltage from one sample to the next (or a simulation \
         that does): then it is no fault of the current channel"
            .to_owned()
    })
}

/// What effects of the flux come to: their parameters by themselves say little.
pub fn flux(space: &Space, found: &[&'static str], experiments: &[Experiment]) -> Option<String> {
    found.iter().find(|id| LESS_FLUX.contains(id))?;
    let current = Scales::of(space, experiments).current;
    let [left, linear] = [linkage(&space.motor().ok()?, current, 0.0), space.value("K") * current];
    Some(format!(
        "at the largest current, {} A, the flux is {:.0} % below the straight line of small currents",
        figure(current, 3),
        100.0 * (1.0 - left / linear)
    ))
}
