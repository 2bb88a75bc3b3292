//! Friction that is larger backwards: half of the excess dry, half growing with the speed.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "asymmetric_friction",
    what: "friction that is larger backwards than forwards",
    size: "excess at nominal speed",
    unit: "N m",
    forms: &[],
    universal: None,
    pm_dc: Sizes::new(8e-3, 5e-4, 0.1),
    install: |size, _, rig| {
        let nominal = rig.motor.nameplate.speed_rad_s;
        rig.dry.push(Box::new(
            move |speed: f64, direction: f64| {
                if direction < 0.0 { 0.5 * size * (1.0 + speed / nominal) } else { 0.0 }
            },
        ));
    },
};
