//! What the equations are written in: the state, the operating point, and the terms of both balances that effects
//! change.

use crate::scalar::Scalar;

/// Current and speed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State<S> {
    /// i, A.
    pub current: S,
    /// ω, rad/s.
    pub speed: S,
}

/// Where the motor is: the arguments of every effect.
#[derive(Debug, Clone, Copy)]
pub struct OperatingPoint<N: Scalar> {
    /// i, A.
    pub current: N,
    /// ω, rad/s.
    pub speed: N,
    /// u, the supply voltage as it is recorded, V.
    pub voltage: N,
}

impl<N: Scalar> OperatingPoint<N> {
    /// A point without a supply, as the mechanical side sees it.
    pub fn unsupplied(current: N, speed: N) -> Self {
        Self { current, speed, voltage: N::ZERO }
    }
}

/// What effects act on; each starts as the base model has it and is changed by the effects in the catalogue's order.
#[derive(Debug, Clone, Copy)]
pub struct Balance<N: Scalar> {
    /// Current that magnetises a series motor, A: i, changed by remanence and hysteresis.
    pub magnetising: N,
    /// Flux per magnetising current (series) or flux (permanent magnets), relative to the base model's: 1 without
    /// effects.
    pub flux: N,
    /// dφ/di of a series motor, relative to the base model's: 1 without effects.
    pub flux_slope: N,
    /// Time by which the flux lags, s.
    pub flux_lag: N,
    /// Voltage that reaches the motor, V.
    pub supply: N,
    /// R, Ω.
    pub resistance: N,
    /// Incremental inductance dλ/di, H.
    pub inductance: N,
    /// L without effects, of which the path of the flux has a share, H.
    pub base_inductance: N::Base,
    /// Further voltage drop, V.
    pub voltage: N,
    /// Further driving torque, N m.
    pub torque: N,
    /// One over the inertia that the torques accelerate, 1/(kg m²).
    pub inverse_inertia: N::Base,
    /// Dry friction, N m, as a magnitude that opposes motion.
    pub dry_friction: N,
    /// By how much dry friction is larger forwards, and smaller backwards, N m; at rest it is not.
    pub dry_asymmetry: N::Base,
    /// Viscous friction μ1, N m s/rad.
    pub viscous_friction: N,
    /// Turbulent friction μ2, N m s²/rad².
    pub turbulent_friction: N,
    /// Further friction that depends smoothly on the speed, N m, as the torque that it takes.
    pub friction: N,
}
