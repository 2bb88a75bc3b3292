//! Late commutation: the current of the shorted coils opposes the main flux, K φ (1 − κ |ω|/ω_n).

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "commutation_demagnetisation",
    what: "late commutation weakens the flux at speed",
    size: "fraction of the flux lost at nominal speed",
    unit: "",
    forms: &[],
    universal: Sizes::new(0.05, 0.005, 0.3),
    pm_dc: Sizes::new(0.05, 0.005, 0.3),
    install: |size, _, rig| {
        let nominal = rig.motor.nameplate.speed_rad_s;
        rig.flux_shares.push(Box::new(move |_: f64, omega: f64| 1.0 - size * (omega.abs() / nominal).min(2.0)));
    },
};
