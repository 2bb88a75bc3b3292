//! Offset of the voltage channel.
//!
//! `u_recorded = u + U₀`, U₀ in V, so that `u − U₀` of the record reaches the motor.
//!
//! Source: error model of an amplifier (offset and gain).

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Voltage that is shown too large by a constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VoltageOffset<S> {
    /// U₀, V.
    pub offset: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for VoltageOffset<S> {
    const DESCRIPTION: Description = Description {
        name: "offset of the voltage channel",
        equation: "u_recorded = u + U₀",
        acts: Acts::Electrical,
        parameters: &[EffectParameter {
            name: "voltage_offset",
            unit: "V",
            role: Role::Size,
            range: (-1000.0, 1000.0),
            start: 0.006,
            relative: Relative::Voltage,
            meaning: "voltage that is shown when there is none",
        }],
        size_in_words: "the voltage channel shows {} where there is none",
        excited_by: &[Excitation::Direct],
        prior: Prior::common("every amplifier has an offset, and few are zeroed before each run"),
        two_make_it: Some([EffectId::Remanence, EffectId::CurrentOffset]),
        why: "The voltmeter shows something when there is nothing. The model is then driven by a voltage that the \
              motor never saw: a constant one, whatever flows.",
        noticed: "Before the supply is switched on the recorded voltage is not zero. Nothing of it is at the motor.",
        remedy: "Zero the channel before each run, or record a second of nothing and take it off: `--map \
                 u_v=u_v-0.4`. Name it where neither can be done any more.",
        signature: "a direct voltage that depends on neither current nor speed",
        confused_with: &[EffectId::CurrentOffset, EffectId::Remanence],
        separated_by: &[
            Separation::by("the record before switching on"),
            Separation::open_supply("an open circuit, where a current offset still shows a current"),
            Separation::by("several speeds against remanence, which grows with the speed"),
        ],
        source: "error model of an amplifier",
        ..Description::usual(EffectId::VoltageOffset)
    };
    fields!(offset);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        balance.supply = balance.supply.plus(-self.offset);
    }
}
