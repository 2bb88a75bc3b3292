//! Grease that warms up: viscous and dry friction are (1 + a exp(−t/15 s)) times those of the warm motor.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{DryFriction, Instant, Torque};

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "bearing_warmup",
    what: "friction that falls as the bearings warm up",
    size: "relative excess of friction in the cold",
    unit: "",
    forms: &[],
    universal: Sizes::new(1.0, 0.1, 3.0),
    pm_dc: Sizes::new(1.0, 0.1, 3.0),
    install: |size, _, rig| {
        rig.dry.push(Box::new(Grease { base: rig.motor.mu0, size, excess: size }));
        rig.torques.push(Box::new(Grease { base: rig.motor.mu1, size, excess: size }));
    },
};

/// Time constant of warming up, s.
const WARM_UP_S: f64 = 15.0;

struct Grease {
    base: f64,
    size: f64,
    excess: f64,
}

impl DryFriction for Grease {
    fn level(&self, _speed: f64, _direction: f64) -> f64 {
        self.base * self.excess
    }
    fn tick(&mut self, _dt: f64, now: &Instant) {
        self.excess = self.size * (-now.t / WARM_UP_S).exp();
    }
}

impl Torque for Grease {
    fn torque(&self, _i: f64, omega: f64, _theta: f64, _air_gap: f64) -> f64 {
        -self.base * self.excess * omega
    }
    fn tick(&mut self, _dt: f64, now: &Instant) {
        self.excess = self.size * (-now.t / WARM_UP_S).exp();
    }
}
