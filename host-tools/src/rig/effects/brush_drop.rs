//! Contact drop of the brushes, V i/√(i² + i_0²), i_0 = 3 % of the nominal peak current. Both brushes together:
//! 1–3 V for electrographite, up to 5 V for resin-bonded brushes.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "brush_drop",
    what: "contact drop of the brushes",
    size: "drop of both brushes",
    unit: "V",
    forms: &[],
    universal: Sizes::new(2.5, 0.1, 10.0),
    pm_dc: Sizes::new(1.0, 0.05, 5.0),
    install: |size, _, rig| {
        let i_0 = 0.03 * rig.motor.nameplate.peak_current_a;
        rig.drops.push(Box::new(move |i: f64, _: f64| size * i / (i * i + i_0 * i_0).sqrt()));
    },
};
