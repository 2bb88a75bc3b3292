//! A higher resistance of the circuit: a bad joint, worn brushes.

use super::Fault;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, ResistanceRise};

/// The fault.
pub const FAULT: Fault = Fault {
    id: "resistance_up",
    what: "higher resistance of the circuit: bad joint, worn brush",
    size: "relative rise of R",
    unit: "",
    universal: Sizes::new(0.10, 0.001, 2.0),
    pm_dc: Sizes::new(0.10, 0.001, 2.0),
    install: |size, onset_s, rig| rig.rises.push(Box::new(Step { size, onset_s, rise: 0.0 })),
};

struct Step {
    size: f64,
    onset_s: f64,
    rise: f64,
}

impl ResistanceRise for Step {
    fn rise(&self, _omega: f64) -> f64 {
        self.rise
    }
    fn tick(&mut self, _dt: f64, now: &Instant) {
        self.rise = if now.t >= self.onset_s { self.size } else { 0.0 };
    }
}
