//! Magnet temperature: the flux of permanent magnets falls as they heat up.
//!
//! `φ = 1/(1 + m)` with `dm/dt = g i² − m/τ`; m = 0 at the start of a run, when the magnets count as cold. Neither
//! their temperature nor their temperature coefficient (−0.2 % per kelvin for ferrite, −0.1 % for NdFeB) has to be
//! known: to first order m is the share of the flux that is lost, and φ stays positive whatever m. g in 1/(A² s), τ in
//! s. The square of the current is averaged over the step as if the current were straight within it. Back-EMF and
//! torque weaken alike.
//!
//! Source: reversible temperature coefficient of the remanence (IEC 60404-8-1); one thermal body.

use super::memory::{accumulate, mean_square};
use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Motors, Passed, PhysicalEffect, Prior, Relative,
    Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Flux that falls with the heat of the magnets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MagnetTemperature<S> {
    /// g, 1/(A² s).
    pub heating: S,
    /// τ, s.
    pub time: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for MagnetTemperature<S> {
    const DESCRIPTION: Description = Description {
        name: "magnets that weaken with heat",
        equation: "K/(1 + m), dm/dt = g i² − m/τ",
        acts: Acts::Both,
        motors: Motors::Magnets,
        parameters: &[
            EffectParameter {
                name: "magnet_heating",
                unit: "1/(A² s)",
                role: Role::Size,
                range: (0.0, 1e4),
                start: 0.01,
                relative: Relative::InverseHeat,
                meaning: "share of the flux that is lost per time and square of the current, without cooling",
            },
            EffectParameter {
                name: "magnet_time",
                unit: "s",
                role: Role::Time,
                range: (1.0, 3000.0),
                start: 60.0,
                relative: Relative::Absolute,
                meaning: "time constant of the magnets' temperature",
            },
        ],
        size_in_words: "1 A² s of heat takes {} of the flux",
        excited_by: &[Excitation::Heating],
        prior: Prior::common("ferrite loses 0.2 % of its flux per kelvin, and long runs heat it"),
        weakens_flux: true,
        why: "Magnets lose flux when they are hot. Back-EMF per speed and torque per current fall together, so that \
              a hot motor runs faster at no load and pulls less.",
        noticed: "No-load speed and current creep up over minutes, at the same voltage. The housing is hot. It comes \
                  back when the motor has cooled; if it does not, the magnets were hotter than they may be.",
        remedy: "Let it cool and record once more. If the flux stays away, the magnets are damaged for good. Shorten \
                 runs, cool better, or take magnets of a higher class; the model takes the warm-up as it is.",
        signature: "a back-EMF per speed and a torque per current that fall together over the run, with the integral of \
                    i²; none in a short run",
        confused_with: &[EffectId::WindingTemperature, EffectId::BearingWarmup],
        separated_by: &[
            Separation::by("a long run"),
            Separation::open_supply("the open motor's voltage at one speed, cold and warm"),
        ],
        source: "temperature coefficient of the remanence, IEC 60404-8-1; one thermal body",
        remembers: true,
        ..Description::usual(EffectId::MagnetTemperature)
    };
    fields!(heating, time);
    #[inline(never)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, memory: &Memory<S>, balance: &mut Balance<N>) {
        balance.flux = balance.flux.times(S::ONE / (S::ONE + memory[0]));
    }
    #[inline(never)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        let heat = self.heating * mean_square(passed);
        accumulate(memory, (heat - memory[0] / self.time) * passed.interval);
    }
}
