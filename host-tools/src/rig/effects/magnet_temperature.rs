//! Magnets that weaken with heat: K (1 − 2e-3 ΔT), as of ferrite. The copper loss heats the winding (20 s), and that
//! the magnets (80 s): they follow late.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{FluxShare, Instant};

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "magnet_temperature",
    what: "magnets that weaken as they heat up",
    size: "final rise at nominal current",
    unit: "K",
    forms: &[],
    universal: None,
    pm_dc: Sizes::new(50.0, 5.0, 150.0),
    install: |size, _, rig| {
        let nominal = rig.motor.nameplate.rms_current_a;
        rig.flux_shares.push(Box::new(Magnets { size, nominal, winding: 0.0, magnets: 0.0 }));
    },
};

/// Temperature coefficient of the remanence of ferrite, 1/K.
const FERRITE: f64 = -2e-3;

struct Magnets {
    size: f64,
    nominal: f64,
    winding: f64,
    magnets: f64,
}

impl FluxShare for Magnets {
    fn factor(&self, _i: f64, _omega: f64) -> f64 {
        1.0 + FERRITE * self.magnets
    }
    fn tick(&mut self, dt: f64, now: &Instant) {
        let heat = self.size * (now.i / self.nominal).powi(2);
        self.winding += dt / 20.0 * (heat - self.winding);
        self.magnets += dt / 80.0 * (self.winding - self.magnets);
    }
}
