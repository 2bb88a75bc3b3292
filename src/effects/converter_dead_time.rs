//! Dead time and on-state drop of a bridge whose command is recorded in place of the motor's voltage.
//!
//! `u_motor = u − V i/(|i| + i_0)`: in each half period of the carrier neither switch conducts for a moment, and the
//! current chooses which diode takes it, so that the mean voltage is short of the command by a constant with the sign
//! of the current; near zero, where the ripple changes the sign within a period, by less. V is the bus voltage times
//! the dead time times the carrier frequency, plus the on-state drop; i_0 is about the ripple.
//!
//! Source: dead time of a voltage-source inverter (S.-G. Jeong and M.-H. Park, IEEE Trans. Ind. Electron. 38 (1991)
//! 108–114).

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Representative,
    Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// A voltage that the converter keeps, with the sign of the current.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConverterDeadTime<S> {
    /// V, V.
    pub lost: S,
    /// i_0, A.
    pub ripple: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for ConverterDeadTime<S> {
    const DESCRIPTION: Description = Description {
        name: "dead time of the converter",
        equation: "u_motor = u − V i/(|i| + i_0)",
        acts: Acts::Electrical,
        of_supply: true,
        parameters: &[
            EffectParameter {
                name: "dead_time_drop",
                unit: "V",
                role: Role::Size,
                range: (0.0, 1000.0),
                start: 0.02,
                relative: Relative::Voltage,
                meaning: "voltage that is lost: bus voltage × dead time × carrier frequency, and the on-state drop",
            },
            EffectParameter {
                name: "dead_time_ripple",
                unit: "A",
                role: Role::Shape,
                range: (1e-5, 1e3),
                start: 0.02,
                relative: Relative::Current,
                meaning: "current at which half of it is lost, about the ripple",
            },
        ],
        size_in_words: "{} of the command do not reach the motor, whichever way the current flows",
        excited_by: &[Excitation::Current, Excitation::LowVoltage],
        prior: Prior::occasional("bridges whose command is recorded and whose dead time is not compensated"),
        represented_by: &[Representative { effect: EffectId::BrushDrop, law: None }],
        why: "Between two switches a bridge waits. During that time the current chooses the path, and takes a fixed \
              voltage off the command, against its own direction.",
        noticed: "A kink of the current at each zero crossing; at low speed the torque jerks twice a \
                  period, and it can be heard.",
        remedy: "Record the voltage at the terminals, or switch the converter's compensation on. At two bus voltages \
                 it tells itself apart from the brushes: it goes with the bus.",
        signature: "that of a contact drop of the brushes: a constant voltage with the sign of the current",
        confused_with: &[EffectId::BrushDrop, EffectId::SupplyDeadZone],
        separated_by: &[
            Separation::by("two bus voltages, with which the dead time's share goes and the brushes' does not"),
            Separation::by("the voltage at the motor's terminals, which knows of the brushes alone"),
        ],
        source: "dead time of a voltage-source inverter",
        ..Description::usual(EffectId::ConverterDeadTime)
    };
    fields!(lost, ripple);
    #[inline(never)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        balance.voltage += at.current.times(self.lost) / at.current.abs().plus(self.ripple);
    }
}
