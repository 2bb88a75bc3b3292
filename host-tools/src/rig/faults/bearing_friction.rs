//! A bad bearing: dry and viscous friction rise together.

use super::Fault;
use crate::rig::Sizes;
use crate::rig::parts::{DryFriction, Instant, Torque};

/// The fault.
pub const FAULT: Fault = Fault {
    id: "bearing_friction",
    what: "bad bearing: dry and viscous friction up",
    size: "relative rise of both",
    unit: "",
    universal: Sizes::new(1.0, 0.01, 20.0),
    pm_dc: Sizes::new(1.0, 0.01, 20.0),
    install: |size, onset_s, rig| {
        rig.dry.push(Box::new(Rise { base: rig.motor.mu0, size, onset_s, present: 0.0 }));
        rig.torques.push(Box::new(Rise { base: rig.motor.mu1, size, onset_s, present: 0.0 }));
    },
};

struct Rise {
    base: f64,
    size: f64,
    onset_s: f64,
    present: f64,
}

impl DryFriction for Rise {
    fn level(&self, _speed: f64, _direction: f64) -> f64 {
        self.base * self.present
    }
    fn tick(&mut self, _dt: f64, now: &Instant) {
        self.present = if now.t >= self.onset_s { self.size } else { 0.0 };
    }
}

impl Torque for Rise {
    fn torque(&self, _i: f64, omega: f64, _theta: f64, _air_gap: f64) -> f64 {
        -self.base * self.present * omega
    }
    fn tick(&mut self, _dt: f64, now: &Instant) {
        self.present = if now.t >= self.onset_s { self.size } else { 0.0 };
    }
}
