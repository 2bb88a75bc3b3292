//! Eddy currents in laminations and poles: the flux lags in time.
//!
//! `T dφ/dt = F(i) − φ`: with g, which follows di/dt with the lag T, φ is F(i − T g), to first order in T g, in
//! back-EMF and torque, and of the inductive voltage the share χ is χ L g.
//!
//! Source: classical eddy-current loss as a resistance parallel to the magnetising inductance; field form
//! σ d²/12 dB/dt in the Modelica Standard Library, Magnetic.FluxTubes.

use super::memory::{around_point, follow_rate, lag_flux};
use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Motors, Passed, PhysicalEffect, Prior, Relative,
    Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Flux that lags the current in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EddyCurrent<S> {
    /// T, s.
    pub lag: S,
    /// χ.
    pub linked: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for EddyCurrent<S> {
    const DESCRIPTION: Description = Description {
        name: "eddy currents in the iron (flux lag)",
        equation: "T dφ/dt = F(i) − φ in K φ ω and K φ i; λ lags likewise with its share χ",
        acts: Acts::Both,
        motors: Motors::Series,
        lags_flux: true,
        parameters: &[
            EffectParameter {
                name: "eddy_lag",
                unit: "s",
                role: Role::Size,
                range: (0.0, 2e-3),
                start: 8e-5,
                relative: Relative::Absolute,
                meaning: "time constant of the flux",
            },
            EffectParameter {
                name: "eddy_linked",
                unit: "1",
                role: Role::Linked,
                range: (0.0, 1.0),
                start: 0.6,
                relative: Relative::Absolute,
                meaning: "share of the inductance that lags",
            },
        ],
        size_in_words: "the flux follows {} after the current",
        excited_by: &[Excitation::Alternating],
        prior: Prior::occasional("solid yokes have it, laminated ones hardly"),
        why: "A changing flux drives currents in solid iron, which oppose the change. The flux then follows the \
              current late: a little at mains frequency, not at all on direct current.",
        noticed: "A yoke that warms up on AC and stays cool on DC. The torque's swing at twice the mains frequency \
                  is a little smaller. Hardly anything can be heard.",
        remedy: "Laminated iron hardly has it. If it has grown, look for sheets that touch: burrs, a welded seam, a \
                 rivet, a rub of the rotor that smeared the teeth.",
        signature: "fundamental in quadrature with the current, in proportion to amplitude and speed, without a third \
                    harmonic; the opposite sign of a late current channel",
        confused_with: &[EffectId::ChannelDelay, EffectId::TransformerEmf, EffectId::Hysteresis],
        separated_by: &[
            Separation::by("a resistor in place of the motor, which shows the delay of the channels alone"),
            Separation::by("slow DC ramps against hysteresis"),
            Separation::locked_rotor("a locked rotor against the transformer EMF"),
        ],
        source: "Modelica Standard Library, Magnetic.FluxTubes (dynamic hysteresis)",
        remembers: true,
        ..Description::usual(EffectId::EddyCurrent)
    };
    fields!(lag, linked);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, memory: &Memory<S>, balance: &mut Balance<N>) {
        lag_flux(N::lift(self.lag), self.linked, memory, balance);
    }
    #[inline(always)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        follow_rate(self.lag, passed, memory);
    }
    #[inline(always)]
    fn around_point(&self, memory: &Memory<S>) -> Memory<S> {
        around_point(memory)
    }
}
