//! Slotting: the air-gap torque varies with the angle of the rotor, twelve times a turn.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "torque_ripple",
    what: "torque that varies with the angle, 12 slots",
    size: "amplitude relative to the air-gap torque",
    unit: "",
    forms: &[],
    universal: Sizes::new(0.1, 0.005, 0.5),
    pm_dc: Sizes::new(0.1, 0.005, 0.5),
    install: |size, _, rig| {
        rig.torques
            .push(Box::new(move |_: f64, _: f64, theta: f64, air_gap: f64| size * air_gap * (12.0 * theta).cos()))
    },
};
