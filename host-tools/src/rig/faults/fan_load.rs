//! Another load by the fan: less with a blocked duct (a radial fan that moves no air needs less torque), more without
//! its hood.

use super::Fault;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, Torque};

/// The fault.
pub const FAULT: Fault = Fault {
    id: "fan_load",
    what: "load of the fan: less with a blocked duct, more without its hood",
    size: "relative change of the turbulent torque",
    unit: "",
    universal: Sizes::new(-0.2, -0.9, 2.0),
    pm_dc: None,
    install: |size, onset_s, rig| {
        rig.torques.push(Box::new(Load { base: rig.motor.mu2, size, onset_s, present: 0.0 }));
    },
};

struct Load {
    base: f64,
    size: f64,
    onset_s: f64,
    present: f64,
}

impl Torque for Load {
    fn torque(&self, _i: f64, omega: f64, _theta: f64, _air_gap: f64) -> f64 {
        -self.base * self.present * omega * omega.abs()
    }
    fn tick(&mut self, _dt: f64, now: &Instant) {
        self.present = if now.t >= self.onset_s { self.size } else { 0.0 };
    }
}
