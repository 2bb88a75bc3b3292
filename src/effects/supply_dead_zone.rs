//! Dead zone of a converter or amplifier whose command is what is recorded.
//!
//! `u_motor = u − sign(u) min(|u|, w)`, w in V. Within ±w nothing reaches the motor, beyond it w is missing: two
//! saturation voltages or the dead time of a half-bridge.
//!
//! Source: dead time of a voltage-source inverter, in the mean over a switching period.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, PhysicalEffect, Prior, Relative, Role, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Voltage that is lost on the way from the command to the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupplyDeadZone<S> {
    /// w, V.
    pub width: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for SupplyDeadZone<S> {
    const DESCRIPTION: Description = Description {
        name: "dead zone of the supply",
        equation: "u_motor = u − sign(u) min(|u|, w)",
        acts: Acts::Electrical,
        bends_supply: true,
        of_supply: true,
        parameters: &[EffectParameter {
            name: "supply_dead_zone",
            unit: "V",
            role: Role::Size,
            range: (0.0, 1000.0),
            start: 0.01,
            relative: Relative::Voltage,
            meaning: "half width of the zone, which is the voltage that is lost outside it",
        }],
        size_in_words: "the first {} of the command do not reach the motor",
        excited_by: &[Excitation::Direct, Excitation::LowVoltage],
        prior: Prior::occasional("converters with a dead time whose command is recorded"),
        why: "Near zero the converter does nothing: the first volts of the command do not reach the motor. What is \
              recorded is the command, so that the model sees a voltage that was never there.",
        noticed: "No current at small commands. Around the zero crossing the motor hesitates; a servo growls or \
                  hunts there.",
        remedy: "Record the voltage at the motor's terminals instead of the command. Or let the converter compensate \
                 its dead time. Else name it.",
        signature: "third harmonic in phase with the voltage, independent of current and speed; no current at all at low \
                    voltage",
        confused_with: &[EffectId::BrushDrop, EffectId::CoulombFriction, EffectId::VoltageOffset],
        separated_by: &[
            Separation::by("the voltage at the motor's terminals"),
            Separation::by(
                "a load that shifts the current against the voltage, as the brushes follow the current's sign and the \
                 supply the command's",
            ),
            Separation::locked_rotor("currents at low voltage with a locked rotor"),
        ],
        source: "dead time of a voltage-source inverter",
        ..Description::usual(EffectId::SupplyDeadZone)
    };
    fields!(width);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        let width = N::lift(self.width);
        if balance.supply > width {
            balance.supply -= width;
        } else if balance.supply < -width {
            balance.supply += width;
        } else {
            balance.supply = N::ZERO;
        }
    }
}
