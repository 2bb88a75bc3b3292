//! Inertia of the air in the duct: half of the turbine's torque follows the flow q, τ dq/dt = ω − q, the other half the
//! speed.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, Torque};

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "fan_dynamics",
    what: "the air in the duct lags the fan",
    size: "time constant of the flow",
    unit: "s",
    forms: &[],
    universal: Sizes::new(0.15, 0.02, 1.0),
    pm_dc: None,
    install: |size, _, rig| {
        let half = 0.5 * rig.motor.mu2;
        rig.motor.mu2 -= half;
        rig.torques.push(Box::new(Duct { load: half, time_constant: size, flow: 0.0 }));
    },
};

struct Duct {
    load: f64,
    time_constant: f64,
    flow: f64,
}

impl Torque for Duct {
    fn torque(&self, _i: f64, omega: f64, _theta: f64, _air_gap: f64) -> f64 {
        -self.load * self.flow * omega.abs()
    }
    fn tick(&mut self, dt: f64, now: &Instant) {
        self.flow += dt / self.time_constant * (now.omega - self.flow);
    }
}
