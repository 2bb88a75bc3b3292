//! Stribeck friction: more friction at low speed, before the lubricant carries.
//!
//! `J dω/dt = … − T exp(−(|ω|/ω_s)^δ) sign(ω)`, T in N m, ω_s in rad/s, δ from 0.5 to 2 according to the lubrication;
//! at rest it adds to the torque that holds the rotor.
//!
//! Source: R. Stribeck 1902, in the exponential form of B. Armstrong-Hélouvry and C. Canudas de Wit, as in Simscape,
//! Rotational Friction.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Excess of dry friction at low speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stribeck<S> {
    /// T, N m.
    pub torque: S,
    /// ω_s, rad/s.
    pub speed: S,
    /// δ.
    pub exponent: S,
}

/// Keeps the logarithm finite at rest, in units of ω_s.
const AT_REST: f64 = 1e-6;

impl<S: Scalar<Base = S>> PhysicalEffect<S> for Stribeck<S> {
    const DESCRIPTION: Description = Description {
        name: "Stribeck friction",
        equation: "J dω/dt = … − T exp(−(|ω|/ω_s)^δ) sign(ω)",
        acts: Acts::Mechanical,
        parameters: &[
            EffectParameter {
                name: "stribeck_torque",
                unit: "N m",
                role: Role::Size,
                range: (0.0, 1e4),
                start: 1.0,
                relative: Relative::Friction,
                meaning: "excess at standstill",
            },
            EffectParameter {
                name: "stribeck_speed",
                unit: "rad/s",
                role: Role::Shape,
                range: (1e-4, 1e5),
                start: 0.04,
                relative: Relative::Speed,
                meaning: "speed over which it fades",
            },
            EffectParameter {
                name: "stribeck_exponent",
                unit: "1",
                role: Role::Shape,
                range: (0.4, 3.0),
                start: 1.3,
                relative: Relative::Absolute,
                meaning: "how sharply it fades",
            },
        ],
        size_in_words: "{} more friction at a crawl than at speed",
        excited_by: &[Excitation::LowSpeed],
        prior: Prior::occasional("lubricated bearings at a crawl, and gears"),
        rest_of_law: &[EffectId::WindageExponent, EffectId::QuadraticLoad],
        why: "A lubricated contact holds most at rest. As the film builds up the friction falls, and only then rises \
              with speed. The model starts too early, and is wrong at low speed alone.",
        noticed: "The rotor breaks loose with a jerk. At creeping speed it sticks and slips, which squeaks or \
                  chatters.",
        remedy: "Name it where low speeds matter. Another grease, a little dither on the command, or less preload \
                 make it smaller.",
        signature: "a braking torque at the start and at the end of a coast-down only",
        confused_with: &[EffectId::WindageExponent, EffectId::CoulombFriction],
        separated_by: &[
            Separation::open_supply("a coast-down to standstill"),
            Separation::by("slow motion at several speeds"),
        ],
        source: "exponential form as in Simscape, Rotational Friction",
        ..Description::usual(EffectId::Stribeck)
    };
    fields!(torque, speed, exponent);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        let ratio = at.speed.abs().times(S::ONE / self.speed).plus(S::constant(AT_REST));
        let faded = ratio.ln().times(self.exponent).exp();
        balance.dry_friction += (-faded).exp().times(self.torque);
    }
}
