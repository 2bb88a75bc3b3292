//! Windage with another exponent than 2: fans between the radial and the axial form, leaking or blocked ducts.
//!
//! `J dω/dt = … − μ2 ω|ω| (|ω|/ω_r + ε)^δ`, δ = p − 2 for a torque in proportion to |ω|^p, ω_r in rad/s, ε = 10⁻³. At
//! ω_r the torque is that of the base model, so that μ2 keeps its meaning; ε keeps the power finite at standstill. ω_r
//! and μ2 say the same twice, so that a fit can find one of them only.
//!
//! Source: Modelica Standard Library, Machines.Losses.Friction, with an exponent of 1.5 for axial and 2 for radial
//! ventilation.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Turbulent friction with an exponent of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindageExponent<S> {
    /// δ.
    pub excess: S,
    /// ω_r, rad/s.
    pub reference: S,
}

/// ε: share of the reference speed below which the exponent fades out.
const FADES_BELOW: f64 = 1e-3;

impl<S: Scalar<Base = S>> PhysicalEffect<S> for WindageExponent<S> {
    const DESCRIPTION: Description = Description {
        name: "windage with another exponent",
        equation: "J dω/dt = … − μ2 ω|ω| (|ω|/ω_r + 10⁻³)^δ, exponent p = 2 + δ",
        acts: Acts::Mechanical,
        parameters: &[
            EffectParameter {
                name: "windage_excess",
                unit: "1",
                role: Role::Size,
                range: (-1.5, 2.0),
                start: 0.3,
                relative: Relative::Absolute,
                meaning: "exponent of the speed in the torque, less 2",
            },
            EffectParameter {
                name: "windage_reference",
                unit: "rad/s",
                role: Role::Shape,
                range: (1e-3, 1e5),
                start: 1.0,
                relative: Relative::Speed,
                meaning: "speed at which the torque is that of the base model",
            },
        ],
        size_in_words: "the exponent of the load is 2 and {} more",
        excited_by: &[Excitation::Speed],
        prior: Prior::occasional("air in ducts and gaps follows the square only roughly"),
        why: "A turbine's load does not go exactly with the square of the speed: between laminar and turbulent flow, \
              and with a system of hoses, the exponent is another one.",
        noticed: "At the lowest and the highest speeds the model errs in opposite directions. The sound is that of a \
                  fan as ever.",
        remedy: "Name it, and take the exponent as fitted. If it has changed, what the air goes through has: a \
                 filter, a hose, a flap.",
        signature: "a torque error that bends over the speed range; mu0, mu1 and mu2 of the base fit hide most of it and \
                    turn negative",
        confused_with: &[EffectId::Stribeck, EffectId::BearingWarmup, EffectId::QuadraticLoad, EffectId::FanDynamics],
        separated_by: &[Separation::open_supply("a coast-down over the whole range of speeds")],
        source: "Modelica Standard Library, Machines.Losses.Friction",
        ..Description::usual(EffectId::WindageExponent)
    };
    fields!(excess, reference);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        let ratio = at.speed.abs().times(S::ONE / self.reference).plus(S::constant(FADES_BELOW));
        balance.turbulent_friction = balance.turbulent_friction * ratio.ln().times(self.excess).exp();
    }
}
