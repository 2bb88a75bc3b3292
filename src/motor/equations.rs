//! The equations of motion: base model plus the contributions of the effects.

use crate::effects::Effect;
use crate::motor::parameters::{FluxLaw, ParameterError, Parameters};
use crate::scalar::Scalar;

/// Where the motor is: the arguments of every effect.
#[derive(Debug, Clone, Copy)]
pub struct OperatingPoint<N> {
    /// i, A.
    pub current: N,
    /// ω, rad/s.
    pub speed: N,
    /// Direction of motion, or at standstill of the incipient motion: −1, 0 (held by dry friction), 1.
    pub direction: N,
}

/// What effects act on; each starts as the base model has it and is changed by the effects in the catalogue's order.
#[derive(Debug, Clone, Copy)]
pub struct Balance<N> {
    /// Flux as an equivalent: i in a series motor (A), 1 with permanent magnets. Back-EMF is K·flux·ω, torque K·flux·i.
    pub flux: N,
    /// R, Ω.
    pub resistance: N,
    /// Incremental inductance dλ/di, H.
    pub inductance: N,
    /// Further voltage drop, V.
    pub voltage: N,
    /// Further driving torque, N m.
    pub torque: N,
    /// Dry friction, N m, as a magnitude that opposes motion.
    pub dry_friction: N,
    /// Friction that depends smoothly on the speed, N m, as the torque that it takes.
    pub friction: N,
}

/// Time derivatives of the states, and what the decision at standstill needs.
#[derive(Debug, Clone, Copy)]
pub struct Slopes<N> {
    /// di/dt, A/s.
    pub current: N,
    /// dω/dt, rad/s².
    pub speed: N,
    /// Incremental inductance, H.
    pub inductance: N,
}

/// A validated motor, ready to be stepped.
#[derive(Debug, Clone)]
pub struct Motor<S> {
    parameters: Parameters<S>,
    inverse_inertia: S,
    effects: heapless::Vec<Effect<S>, { crate::effects::MAX_EFFECTS }>,
}

impl<S: Scalar<Base = S>> Motor<S> {
    /// Validates the parameters.
    ///
    /// # Errors
    /// A value that is not finite or out of its range, or too many effects.
    pub fn build(parameters: Parameters<S>, effects: &[Effect<S>]) -> Result<Self, ParameterError> {
        parameters.validate()?;
        for effect in effects {
            effect.validate()?;
        }
        Ok(Self {
            parameters,
            inverse_inertia: S::ONE / parameters.inertia,
            effects: heapless::Vec::from_slice(effects).map_err(|_| ParameterError::TooManyEffects)?,
        })
    }

    /// The parameters of the base model.
    pub fn parameters(&self) -> &Parameters<S> {
        &self.parameters
    }

    /// The effects, in the order in which they act.
    pub fn effects(&self) -> &[Effect<S>] {
        &self.effects
    }

    /// All terms of the voltage and the torque balance at an operating point.
    #[inline(always)]
    pub fn balance<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>) -> Balance<N> {
        let p = &self.parameters;
        let mut balance = Balance {
            flux: match p.flux_law {
                FluxLaw::Series => at.current,
                FluxLaw::PermanentMagnet => N::ONE,
            },
            resistance: N::lift(p.resistance),
            inductance: N::lift(p.inductance),
            voltage: N::ZERO,
            torque: N::ZERO,
            dry_friction: N::lift(p.dry_friction),
            friction: (N::lift(p.viscous_friction) + N::lift(p.turbulent_friction) * at.speed.abs()) * at.speed,
        };
        for effect in &self.effects {
            effect.contribute(at, &mut balance);
        }
        balance
    }

    /// Equations 13 and 14 of Rakar & Juričić (2004), solved for the derivatives:
    /// `L di/dt = u − R i − K φ ω − v` and `J dω/dt = K φ i + τ − s μ0 − μ1 ω − μ2 ω|ω|`.
    #[inline(always)]
    pub fn slopes<N: Scalar<Base = S>>(&self, voltage: N, at: &OperatingPoint<N>) -> Slopes<N> {
        let b = self.balance(at);
        let linkage = N::lift(self.parameters.flux_coefficient) * b.flux;
        Slopes {
            current: (voltage - b.resistance * at.current - linkage * at.speed - b.voltage) / b.inductance,
            speed: (linkage * at.current + b.torque - at.direction * b.dry_friction - b.friction)
                * N::lift(self.inverse_inertia),
            inductance: b.inductance,
        }
    }

    /// The direction in which the motor moves or, at standstill, is about to move: the driving torque has to exceed
    /// the dry friction, else the rotor sticks and the answer is 0.
    #[inline(always)]
    pub fn direction(&self, current: S, speed: S) -> S {
        if speed > S::ZERO {
            return S::ONE;
        }
        if speed < S::ZERO {
            return -S::ONE;
        }
        let b = self.balance(&OperatingPoint { current, speed, direction: S::ZERO });
        let torque = self.parameters.flux_coefficient * b.flux * current + b.torque;
        if torque > b.dry_friction {
            S::ONE
        } else if torque < -b.dry_friction {
            -S::ONE
        } else {
            S::ZERO
        }
    }
}
