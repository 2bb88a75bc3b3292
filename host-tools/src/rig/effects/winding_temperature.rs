//! Resistance of copper that heats up: R (1 + 3.93e-3 ΔT), ΔT of two bodies that the copper loss heats, the winding
//! (70 % of the rise, 25 s) and the iron round it (30 %, 300 s). R is that of the cold motor.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{Instant, ResistanceRise};

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "winding_temperature",
    what: "resistance that rises as the winding heats up",
    size: "final rise at nominal current",
    unit: "K",
    forms: &[],
    universal: Sizes::new(60.0, 5.0, 150.0),
    pm_dc: Sizes::new(60.0, 5.0, 150.0),
    install: |size, _, rig| {
        let nominal = rig.motor.nameplate.rms_current_a;
        rig.rises.push(Box::new(Winding { size, nominal, copper: 0.0, iron: 0.0 }));
    },
};

/// Temperature coefficient of copper at 20 °C, 1/K.
const COPPER: f64 = 3.93e-3;

struct Winding {
    size: f64,
    nominal: f64,
    copper: f64,
    iron: f64,
}

impl ResistanceRise for Winding {
    fn rise(&self, _omega: f64) -> f64 {
        COPPER * (self.copper + self.iron)
    }
    fn tick(&mut self, dt: f64, now: &Instant) {
        let heat = self.size * (now.i / self.nominal).powi(2) * (1.0 + self.rise(now.omega));
        self.copper += dt / 25.0 * (0.7 * heat - self.copper);
        self.iron += dt / 300.0 * (0.3 * heat - self.iron);
    }
}
