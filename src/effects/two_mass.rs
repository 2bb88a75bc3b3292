//! A load behind a spring: belt, coupling, long shaft.
//!
//! `(1 − s) J dω/dt = … − s J a` with `a = dω_2/dt = ω_a² δ + 2 ζ ω_a v`, `dδ/dt = v = ω − ω_2`: δ is the twist, s the
//! share of the inertia J that hangs behind the spring, ω_a = 2π f_a = √(k/(s J)) the antiresonance, at which the load
//! stands against the motor, and ζ = d/(2 √(k s J)) its damping. The motor resonates at f_a/√(1 − s). J is the inertia
//! of motor and load together, which slow motion shows whatever the share. s and ζ are dimensionless, f_a in Hz.
//!
//! The load is moved on by the trapezoidal rule, which neither damps nor excites it, with a speed of the motor that is
//! straight within the step; the twist that the torque sees is that in the middle of the step.
//!
//! Source: two-mass model of a drive, R. Isermann, Mechatronic Systems, 2005.

use core::f64::consts::TAU;

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Passed, PhysicalEffect, Prior, Relative, Role,
    Separation,
};
use crate::motor::{Balance, OperatingPoint, State};
use crate::scalar::Scalar;

/// An inertia that hangs on the motor by a spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoMass<S> {
    /// s.
    pub share: S,
    /// f_a, Hz.
    pub frequency: S,
    /// ζ.
    pub damping: S,
}

impl<S: Scalar<Base = S>> TwoMass<S> {
    /// ω_a² in 1/s² and 2 ζ ω_a in 1/s.
    #[inline(always)]
    fn spring(&self) -> (S, S) {
        let own = S::constant(TAU) * self.frequency;
        (own * own, S::constant(2.0) * self.damping * own)
    }
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for TwoMass<S> {
    const DESCRIPTION: Description = Description {
        name: "load behind a spring",
        equation: "(1 − s) J dω/dt = … − s J dω_2/dt, dω_2/dt = ω_a² δ + 2 ζ ω_a (ω − ω_2), dδ/dt = ω − ω_2, ω_a = 2π f_a",
        acts: Acts::Mechanical,
        parameters: &[
            EffectParameter {
                name: "load_share",
                unit: "1",
                role: Role::Size,
                range: (0.0, 0.98),
                start: 0.3,
                relative: Relative::Absolute,
                meaning: "share of the inertia that hangs behind the spring",
            },
            EffectParameter {
                name: "load_frequency",
                unit: "Hz",
                role: Role::Frequency,
                range: (1.0, 1000.0),
                start: 30.0,
                relative: Relative::Absolute,
                meaning: "antiresonance: the load's own frequency while the motor is held",
            },
            EffectParameter {
                name: "load_damping",
                unit: "1",
                role: Role::Shape,
                range: (1e-3, 2.0),
                start: 0.05,
                relative: Relative::Absolute,
                meaning: "damping ratio of that motion",
            },
        ],
        size_in_words: "a share of {} of the inertia hangs behind a spring",
        excited_by: &[Excitation::Acceleration],
        prior: Prior::occasional("belts, couplings and long shafts"),
        why: "The load hangs on a belt, a coupling or a long shaft. At each step the rotor runs ahead, is pulled \
              back, and swings, while the model with one inertia goes straight.",
        noticed: "A swing of the speed after each step, which can be seen on a belt; a clatter of the coupling; a \
                  tone at one frequency when a controller excites it.",
        remedy: "Name it, and keep a controller below its frequency. If the frequency fell, a coupling or belt got \
                 softer: look for cracks and slack.",
        signature: "a swing of the speed after each step that decays; in the frequency response of ω over i a notch at the \
                    load's own frequency and a peak above it; on slow profiles nothing but inertia",
        confused_with: &[EffectId::SpeedLag, EffectId::FanDynamics],
        separated_by: &[
            Separation::by("steps or a pseudo-random binary voltage, recorded at ten times the frequency of the swing"),
            Separation::by("the same with the load taken off"),
        ],
        source: "two-mass model of a drive, R. Isermann, Mechatronic Systems, 2005",
        remembers: true,
        ..Description::usual(EffectId::TwoMass)
    };
    fields!(share, frequency, damping);
    #[inline(never)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, memory: &Memory<S>, balance: &mut Balance<N>) {
        let [twist, speed, half_step, _] = *memory;
        let (stiffness, damping) = self.spring();
        let drawn = at.speed.plus(-speed).times(stiffness * half_step + damping).plus(stiffness * twist);
        // In the middle of the step the damping has taken part of the load along.
        let weight = self.share / (balance.inverse_inertia * (S::ONE + damping * half_step));
        balance.torque -= drawn.times(weight);
        balance.inverse_inertia = balance.inverse_inertia / (S::ONE - self.share);
    }
    fn at_start(&self, state: State<S>, _: S) -> Memory<S> {
        [S::ZERO, state.speed, S::ZERO, S::ZERO]
    }
    #[inline(never)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        let [twist, speed, ..] = *memory;
        let half = S::constant(0.5) * passed.interval;
        let (stiffness, damping) = self.spring();
        let before = passed.before.speed - speed;
        let drawn = half * (damping + half * stiffness);
        let pushed = passed.after.speed - passed.before.speed - passed.interval * stiffness * twist;
        let after = (before * (S::ONE - drawn) + pushed) / (S::ONE + drawn);
        *memory = [twist + half * (before + after), passed.after.speed - after, half, S::ZERO];
    }
    fn around_point(&self, memory: &Memory<S>) -> Memory<S> {
        [memory[0], memory[1], S::ZERO, S::ZERO]
    }
}
