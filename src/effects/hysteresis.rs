//! Magnetic hysteresis of the iron: the flux follows the current late by a fixed amount, whatever the frequency.
//!
//! The magnetising current is i − i_c z, where z runs from −1 to 1 with the history of the current alone (rate-independent):
//! ```text
//! dz/di = r (1 + e − z s)/((2 + e) i_c)  up to z = s,  s = sign(di/dt)
//! ```
//! which over a stretch of monotonic current is `z = s (1 + e) − (s (1 + e) − z₀) exp(−r |i − i₀|/((2 + e) i_c))`, ended at z = s:
//! exact for a step of any size, so that no time step limits it. At a reversal from saturation the share r of the flux rests; then
//! it follows the slower the nearer saturation is, with e = 0 for ever, else until a current at which the branch closes. This is
//! what plays (Prandtl–Ishlinskii) do whose widths are distributed exponentially, with e up to a largest one; a large e is one
//! play. The inductive voltage of the share c of the inductance follows: `dλ/di = L (1 − c i_c dz/di)`.
//!
//! Source: the Duhem model (P. Duhem 1897), of which e = 0 is the form of Bouc and Wen with exponent 1 and β = γ; plays as in
//! M. A. Krasnosel'skii and A. V. Pokrovskii, Systems with Hysteresis, 1989.

use super::{Acts, Description, EffectParameter, Memory, Motors, Passed, PhysicalEffect, Relative};
use crate::motor::{Balance, OperatingPoint, State};
use crate::scalar::Scalar;

/// Flux with a memory of the current's turning points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hysteresis<S> {
    /// i_c, A.
    pub coercive: S,
    /// r.
    pub resting: S,
    /// e.
    pub closing: S,
    /// c.
    pub linked: S,
}

/// Below this coercive current, A, the loop counts as closed; it keeps the way of a reversal from zero.
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
        let aim = self.closing + S::ONE;
        let steepness = self.resting / ((aim + S::ONE) * (self.coercive + S::constant(CLOSED)));
        let z = gone.times(-(side * steepness)).exp().times(memory[0] - side * aim).plus(side * aim);
        // What is closed stays so; rounding must not open it.
        if z.value() * side > S::ONE || memory[0] * side >= S::ONE {
            return (N::lift(side), N::ZERO);
        }
        (z, z.times(-(side * steepness)).plus(steepness * aim))
    }
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for Hysteresis<S> {
    const DESCRIPTION: Description = Description {
        id: "hysteresis",
        name: "magnetic hysteresis",
        equation: "φ(i − i_c z), dz/di = r (1 + e − z s)/((2 + e) i_c) up to z = s, s = sign(di/dt); dλ/di = L (1 − c i_c dz/di)",
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
                name: "hysteresis_resting",
                unit: "1",
                range: (0.2, 1.0),
                start: 0.9,
                relative: Relative::Absolute,
                meaning: "share of the flux that rests at first when the current turns round",
            },
            EffectParameter {
                name: "hysteresis_closing",
                unit: "1",
                range: (0.0, 4.0),
                start: 0.5,
                relative: Relative::Absolute,
                meaning: "how straight a branch comes to its end: 0 never quite, 1 after 3.3 coercive currents, 4 after 2.4 (r = 1)",
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
        source: "Duhem model; Bouc and Wen with exponent 1; plays of Prandtl and Ishlinskii",
        remembers: true,
        ..Description::USUAL
    };
    fields!(coercive, resting, closing, linked);
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
