//! Inductance that falls with the current while back-EMF and torque stay linear: leakage iron.
//!
//! dλ/di = L [1 − c (1 − exp(−(i/i_0)²))], i_0 = 0.6 nominal peak currents: a bell with a floor.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "inductance_saturation",
    what: "inductance that falls with the current, by itself",
    size: "fraction of dλ/di lost at nominal peak current",
    unit: "",
    forms: &[],
    universal: Sizes::new(0.5, 0.05, 0.9),
    pm_dc: Sizes::new(0.3, 0.05, 0.9),
    install: |size, _, rig| {
        let i_0 = 0.6 * rig.motor.nameplate.peak_current_a;
        let c = size / (1.0 - (-(1.0_f64 / 0.6).powi(2)).exp());
        rig.inductance_laws.push(Box::new(move |i: f64| 1.0 - c * (1.0 - (-(i / i_0).powi(2)).exp())));
    },
};
