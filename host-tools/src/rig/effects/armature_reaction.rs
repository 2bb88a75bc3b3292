//! Armature reaction: the cross field saturates one pole tip more than it relieves the other,
//! g = 1 − 2 s x²/(1 + x²), x the current over the nominal peak.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "armature_reaction",
    what: "armature reaction: the cross field takes main flux away",
    size: "fraction of the flux lost at nominal peak current",
    unit: "",
    forms: &[],
    universal: Sizes::new(0.1, 0.01, 0.3),
    pm_dc: None,
    install: |size, _, rig| {
        let peak = rig.motor.nameplate.peak_current_a;
        rig.flux_laws.push(Box::new(move |x: f64| {
            let q = (x / peak).powi(2);
            1.0 - 2.0 * size * q / (1.0 + q)
        }));
    },
};
