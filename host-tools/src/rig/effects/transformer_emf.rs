//! Damping by the coils that the brushes short: a loop that the main flux induces in. The shorter the short circuit
//! lasts, the less current builds up: τ = τ_0/(1 + |ω|/ω_t), ω_t = 1000 rad/s.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "transformer_emf",
    what: "damping of the flux by the coils that the brushes short, most at standstill",
    size: "time constant at standstill",
    unit: "s",
    forms: &[],
    universal: Sizes::new(150e-6, 80e-6, 1e-3),
    pm_dc: None,
    install: |size, _, rig| rig.flux_lags.push(Box::new(move |omega: f64| size / (1.0 + omega.abs() / 1000.0))),
};
