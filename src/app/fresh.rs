//! How a test begins: model, filters and detector as after a start. In a module by itself, so that what happens once
//! per test takes no room in the fast memory of the interrupt.

use crate::motor::State;
use crate::parameters::Active;
use crate::units::{Counts, Sample};

/// Makes what runs as new, but that the model starts from what a sample shows.
#[inline(never)]
pub fn begin(active: &mut Option<Active>, fresh: &Option<Active>, counts: Counts) {
    active.clone_from(fresh);
    if let Some(active) = active {
        let Sample { current, speed, .. } = active.calibration.sample(counts);
        active.tick.start_from(State { current: current.0, speed: speed.0 });
    }
}
