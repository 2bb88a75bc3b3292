//! Magnetic hysteresis of the iron: the flux follows the current late by a fixed amount, whatever the frequency.
//!
//! The magnetising current is i − i_c z, where z runs from −1 to 1 with the history of the current alone (rate-independent):
//! ```text
//! dz/di = (1 − z sign(di/dt)) / (n i_c)
//! ```
//! which over a stretch of monotonic current is `z = s − (s − z₀) exp(−|i − i₀|/(n i_c))`, s = sign(i − i₀): exact for a
//! step of any size, so that no time step limits it. The inductive voltage of the share c of the inductance follows:
//! `dλ/di = L (1 − c i_c dz/di)`.
//!
//! Source: the Duhem model (P. Duhem 1897), of which this is the form of Bouc and Wen with exponent 1 and β = γ.

use super::{Acts, Description, EffectParameter, Memory, Motors, Passed, PhysicalEffect, Relative};
use crate::motor::{Balance, OperatingPoint, State};
use crate::scalar::Scalar;

/// Flux with a memory of the current's turning points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hysteresis<S> {
    /// i_c, A.
    pub coercive: S,
    /// n.
    pub width: S,
    /// c.
    pub linked: S,
}

/// Below this coercive current, A, the loop counts as closed; it keeps the width of the transition from zero.
const CLOSED: f64 = 1e-6;

impl<S: Scalar<Base = S>> Hysteresis<S> {
    /// z and dz/di at a current, from z₀ and i₀ in the memory.
    #[inline(always)]
    fn branch<N: Scalar<Base = S>>(&self, current: N, memory: &Memory<S>) -> (N, N) {
        let gone = current.plus(-memory[1]);
        let side = if gone.value() > S::ZERO {
            S::ONE
        } else if gone.value() < S::ZERO {
            -S::ONE
        } else {
            memory[2]
        };
        let steepness = S::ONE / (self.width * self.coercive + S::constant(CLOSED));
        let z = gone.times(-(side * steepness)).exp().times(memory[0] - side).plus(side);
        (z, z.times(-(side * steepness)).plus(steepness))
    }
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for Hysteresis<S> {
    const DESCRIPTION: Description = Description {
        id: "hysteresis",
        name: "magnetic hysteresis",
        equation: "φ(i − i_c z), dz/di = (1 − z sign(di/dt))/(n i_c); dλ/di = L (1 − c i_c dz/di)",
        acts: Acts::Both,
        motors: Motors::Series,
        parameters: &[
            EffectParameter {
                name: "hysteresis_coercive",
                unit: "A",
                range: (0.0, 100.0),
                start: 0.015,
                relative: Relative::Current,
                meaning: "coercive current: half the width of the loop",
            },
            EffectParameter {
                name: "hysteresis_width",
                unit: "1",
                range: (2.0, 10.0),
                start: 2.2,
                relative: Relative::Absolute,
                meaning: "current that a reversal takes, in coercive currents; at 2 the flux rests at first",
            },
            EffectParameter {
                name: "hysteresis_linked",
                unit: "1",
                range: (0.0, 1.0),
                start: 0.6,
                relative: Relative::Absolute,
                meaning: "share of the inductance that has the loop",
            },
        ],
        signature: "fundamental in quadrature with the current, nearly independent of the amplitude; a torque in quadrature to \
                    i²",
        confused_with: &["eddy_current", "channel_delay", "transformer_emf", "inductance_saturation"],
        separated_by: "slow DC ramps, where the loop stays and every lag in time vanishes; different amplitudes",
        source: "Duhem model; Bouc and Wen with exponent 1",
        remembers: true,
        ..Description::USUAL
    };
    fields!(coercive, width, linked);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, memory: &Memory<S>, balance: &mut Balance<N>) {
        let (z, rise) = self.branch(at.current, memory);
        balance.magnetising -= z.times(self.coercive);
        balance.flux_slope = balance.flux_slope * rise.times(-self.coercive).plus(S::ONE);
        balance.inductance = balance.inductance * rise.times(-(self.linked * self.coercive)).plus(S::ONE);
    }
    fn at_start(&self, state: State<S>) -> Memory<S> {
        [S::ZERO, state.current, S::ONE, S::ZERO]
    }
    #[inline(always)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        let current = passed.after.current;
        let gone = current - memory[1];
        if gone != S::ZERO {
            let (z, _) = self.branch(current, memory);
            *memory = [z, current, if gone > S::ZERO { S::ONE } else { -S::ONE }, S::ZERO];
        }
    }
}
