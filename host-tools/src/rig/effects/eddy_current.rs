//! Eddy currents in the iron: the flux follows the current with a lag, τ dφ/dt = f(ξ) − φ.
//!
//! A solid-iron path of one time constant; 17 µs classical in 0.65 mm sheet, several times that with burrs and excess
//! loss.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "eddy_current",
    what: "eddy currents in the iron: the flux lags in time",
    size: "time constant",
    unit: "s",
    forms: &[],
    universal: Sizes::new(80e-6, 20e-6, 1e-3),
    pm_dc: None,
    install: |size, _, rig| rig.flux_lags.push(Box::new(move |_: f64| size)),
};
