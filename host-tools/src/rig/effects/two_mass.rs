//! A load on a belt: part of the inertia hangs behind a spring whose stiffness falls by a tenth at large twists, with
//! some damping. The motor and the load together have the inertia of the nameplate.

use std::f64::consts::TAU;

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, Torque};

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "two_mass",
    what: "part of the inertia behind a spring",
    size: "its share",
    unit: "",
    forms: &["25Hz", "10Hz", "60Hz"],
    universal: Sizes::new(0.5, 0.05, 0.8),
    pm_dc: Sizes::new(0.5, 0.05, 0.8),
    install: |size, form, rig| {
        let hertz = match form {
            "10Hz" => 10.0,
            "60Hz" => 60.0,
            _ => 25.0,
        };
        let inertia = size * rig.motor.j;
        rig.motor.j -= inertia;
        let own = TAU * hertz;
        let spring = Spring { stiffness: inertia * own * own, damping: 2.0 * 0.06 * own * inertia };
        rig.torques.push(Box::new(Load { inertia, spring, twist: 0.0, omega: 0.0, before: 0.0 }));
    },
};

struct Spring {
    /// N m/rad.
    stiffness: f64,
    /// N m s/rad.
    damping: f64,
}

impl Spring {
    /// Torque, N m, of a twist, rad, and its rate, rad/s.
    fn torque(&self, twist: f64, rate: f64) -> f64 {
        self.stiffness * twist * (1.0 - 0.1 * twist * twist / (0.01 + twist * twist)) + self.damping * rate
    }
}

struct Load {
    /// kg m².
    inertia: f64,
    spring: Spring,
    /// rad.
    twist: f64,
    /// rad/s.
    omega: f64,
    /// The motor's speed at the end of the last step, rad/s.
    before: f64,
}

impl Torque for Load {
    fn torque(&self, _i: f64, omega: f64, _theta: f64, _air_gap: f64) -> f64 {
        -self.spring.torque(self.twist, omega - self.omega)
    }
    fn tick(&mut self, dt: f64, now: &Instant) {
        self.omega += dt / self.inertia * self.spring.torque(self.twist, now.omega - self.omega);
        self.twist += dt * (0.5 * (self.before + now.omega) - self.omega);
        self.before = now.omega;
    }
}
