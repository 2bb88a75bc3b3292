//! Winding temperature: the resistance rises as the copper heats up.
//!
//! `R (1 + r)` with `dr/dt = g (1 + r) i² − r/τ`, since the warm resistance heats more than the cold one; r = 0 at the
//! start of a run, when the winding counts as cold. r is relative to R, so that neither the temperature nor the
//! temperature coefficient (0.0039 per kelvin for copper) has to be known: 60 K are r = 0.23. g in 1/(A² s), τ in s.
//! The square of the current is averaged over the step as if the current were straight within it. The rise in one step
//! is less than a rounding unit of `f32`, so that what rounding loses is kept in the memory as well.
//!
//! Source: one thermal body with the temperature coefficient of copper of the Modelica Standard Library,
//! Machines.Thermal.Constants.

use super::memory::{accumulate, mean_square};
use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Passed, PhysicalEffect, Prior, Relative, Role,
    Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Resistance that grows with the heat of the winding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindingTemperature<S> {
    /// g, 1/(A² s).
    pub heating: S,
    /// τ, s.
    pub time: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for WindingTemperature<S> {
    const DESCRIPTION: Description = Description {
        name: "resistance that rises as the winding heats up",
        equation: "R (1 + r), dr/dt = g (1 + r) i² − r/τ",
        acts: Acts::Electrical,
        parameters: &[
            EffectParameter {
                name: "winding_heating",
                unit: "1/(A² s)",
                role: Role::Size,
                range: (0.0, 1e4),
                start: 0.03,
                relative: Relative::InverseHeat,
                meaning: "relative rise of the cold resistance per time and square of the current, without cooling",
            },
            EffectParameter {
                name: "winding_time",
                unit: "s",
                role: Role::Time,
                range: (1.0, 3000.0),
                start: 40.0,
                relative: Relative::Absolute,
                meaning: "time constant of the winding's temperature",
            },
        ],
        size_in_words: "1 A² s of heat raises the resistance by {}",
        excited_by: &[Excitation::Heating],
        prior: Prior::common("copper gains 0.39 % of resistance per kelvin, and every run heats it"),
        why: "Copper gains resistance as it warms. The same voltage then drives less current, so that speed and \
              torque sink over the run.",
        noticed: "Current and speed sag over minutes, most under load; the motor smells warm. An ohmmeter right \
                  after the stop shows more than before the start.",
        remedy: "It is no fault as such. Record a cold and a warm run. If it rises more than it did, look at cooling \
                 air, filters, load and duty.",
        signature: "a voltage in phase with the current that grows over the run with the integral of i²; none in a short \
                    run",
        confused_with: &[EffectId::SupplyImpedance, EffectId::BrushDrop, EffectId::BearingWarmup],
        separated_by: &[
            Separation::by("a long run"),
            Separation::by("the same recording cold and warm"),
            Separation::by("an ohmmeter right after the stop"),
        ],
        source: "one thermal body; temperature coefficient of copper of Modelica, Machines.Thermal.Constants",
        remembers: true,
        ..Description::usual(EffectId::WindingTemperature)
    };
    fields!(heating, time);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, memory: &Memory<S>, balance: &mut Balance<N>) {
        balance.resistance = balance.resistance.times(S::ONE + memory[0]);
    }
    #[inline(always)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        let heat = self.heating * (S::ONE + memory[0]) * mean_square(passed);
        accumulate(memory, (heat - memory[0] / self.time) * passed.interval);
    }
}
