//! Offset of the current channel.
//!
//! `i_shown = i + I₀`, I₀ in A.
//!
//! Source: error model of a current-sensing amplifier (offset and gain).

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role,
    Separation, Sum,
};
use crate::motor::{FluxLaw, State};
use crate::scalar::Scalar;

/// Current that is shown too large by a constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurrentOffset<S> {
    /// I₀, A.
    pub offset: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for CurrentOffset<S> {
    const DESCRIPTION: Description = Description {
        name: "offset of the current channel",
        equation: "i_shown = i + I₀",
        acts: Acts::Measuring,
        parameters: &[EffectParameter {
            name: "current_offset",
            unit: "A",
            role: Role::Size,
            range: (-100.0, 100.0),
            start: 0.006,
            relative: Relative::Current,
            meaning: "current that is shown when there is none",
        }],
        size_in_words: "the current channel shows {} where there is none",
        excited_by: &[Excitation::Direct],
        prior: Prior::common("Hall sensors drift at zero, and few are zeroed before each run"),
        at_standstill: Some(EffectId::VoltageOffset),
        two_make_it: Some([EffectId::Remanence, EffectId::VoltageOffset]),
        sum_of: Some(Sum { two: [EffectId::VoltageOffset, EffectId::TorqueOffset], law: FluxLaw::PermanentMagnet }),
        why: "The ammeter shows a current when there is none. On AC the model then lacks a direct voltage that grows \
              with the speed, since a current that is not there makes no back-EMF.",
        noticed: "Before the supply is switched on the recorded current is not zero. Nothing of it is in the motor.",
        remedy: "Zero the sensor before each run, or take it off: `--map i_a=i_a-0.12`. Hall sensors want it warm. \
                 Name it where neither can be done any more.",
        signature: "a direct voltage that grows with the speed, from R at standstill; a torque at mains frequency",
        confused_with: &[EffectId::Remanence, EffectId::VoltageOffset],
        separated_by: &[
            Separation::by("the record before switching on, where it shows a current without a voltage"),
            Separation::locked_rotor("a locked rotor, where remanence gives nothing"),
        ],
        source: "error model of a current-sensing amplifier",
        ..Description::usual(EffectId::CurrentOffset)
    };
    fields!(offset);
    #[inline(always)]
    fn measure(&self, _: &Memory<S>, reading: &mut State<S>) {
        reading.current += self.offset;
    }
}
