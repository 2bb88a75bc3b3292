//! An eccentric that presses a spring: its lift is r (1 − cos θ)/2, so that the torque is that of sin θ − ½ sin 2θ.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "position_load",
    what: "load of an eccentric that presses a spring",
    size: "amplitude of its first wave",
    unit: "N m",
    forms: &[],
    universal: Sizes::new(0.03, 0.001, 0.2),
    pm_dc: Sizes::new(6e-3, 2e-4, 0.05),
    install: |size, _, rig| {
        rig.torques.push(Box::new(move |_: f64, _: f64, theta: f64, _: f64| {
            -size * (theta.sin() - 0.5 * (2.0 * theta).sin())
        }));
    },
};
