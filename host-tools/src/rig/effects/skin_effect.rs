//! Skin and proximity effect in the armature bars, whose current alternates at the frequency of rotation:
//! R (1 + k q²/(1 + 0.2 q²)), q = ω/ω_n; quadratic at first, then slower.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "skin_effect",
    what: "resistance that rises with the frequency of rotation",
    size: "relative rise at nominal speed",
    unit: "",
    forms: &[],
    universal: Sizes::new(0.1, 0.01, 0.5),
    pm_dc: Sizes::new(0.1, 0.01, 0.5),
    install: |size, _, rig| {
        let nominal = rig.motor.nameplate.speed_rad_s;
        rig.rises.push(Box::new(move |omega: f64| {
            let q = (omega / nominal).powi(2);
            1.2 * size * q / (1.0 + 0.2 * q)
        }));
    },
};
