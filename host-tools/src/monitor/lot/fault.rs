//! What can go wrong with a motor on a rig, as hypotheses about its balances.

use greyrig::detector::Kind;

use super::blocks::{RIPPLE, SPARKS};
use crate::model::lot::Fault;
use crate::numbers::figure;

/// How a fault goes on once it has begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Course {
    /// It is there at once and stays.
    Step,
    /// It grows in proportion to the time, s.
    Drift,
}

impl Fault {
    /// All of them: those that are parameters of the motor first, the frequent ones first of each kind.
    pub const ALL: [Self; 16] = [
        Self::Resistance,
        Self::Turns,
        Self::Contact,
        Self::DryFriction,
        Self::ViscousFriction,
        Self::Load,
        Self::Inertia,
        Self::VoltageGain,
        Self::CurrentGain,
        Self::SpeedGain,
        Self::CurrentOffset,
        Self::VoltageDrift,
        Self::CurrentDrift,
        Self::SpeedDrift,
        Self::Sparking,
        Self::Imbalance,
    ];
    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Resistance => "resistance",
            Self::Turns => "flux (shorted turns, magnets)",
            Self::Contact => "contact drop",
            Self::DryFriction => "dry friction (bearing)",
            Self::ViscousFriction => "viscous friction",
            Self::Load => "load (fan, duct)",
            Self::Inertia => "inertia",
            Self::VoltageGain => "gain of the voltage sensor",
            Self::CurrentGain => "gain of the current sensor",
            Self::SpeedGain => "gain of the speed sensor",
            Self::CurrentOffset => "offset of the current sensor",
            Self::VoltageDrift => "drifting gain of the voltage sensor",
            Self::CurrentDrift => "drifting gain of the current sensor",
            Self::SpeedDrift => "drifting gain of the speed sensor",
            Self::Sparking => "sparking brushes",
            Self::Imbalance => "imbalance (speed once a turn)",
        }
    }

    /// Where it sits.
    pub const fn kind(self) -> Kind {
        match self {
            Self::Resistance | Self::Turns | Self::Contact | Self::Sparking => Kind::Electrical,
            Self::DryFriction | Self::ViscousFriction | Self::Load | Self::Inertia | Self::Imbalance => {
                Kind::Mechanical
            }
            _ => Kind::Sensor,
        }
    }

    /// How it goes on.
    pub const fn course(self) -> Course {
        match self {
            Self::VoltageDrift | Self::CurrentDrift | Self::SpeedDrift => Course::Drift,
            _ => Course::Step,
        }
    }

    /// Unit of its size; none where that is relative, or the logarithm of what is watched.
    pub const fn unit(self) -> Option<&'static str> {
        match self {
            Self::Contact => Some("V"),
            Self::DryFriction | Self::ViscousFriction | Self::Load => Some("N m"),
            Self::CurrentOffset => Some("A"),
            Self::Imbalance => Some("rad/s"),
            _ => None,
        }
    }

    /// Whether its size is relative and there at once.
    pub fn is_relative_step(self) -> bool {
        self.unit().is_none() && self.own_row().is_none() && self.course() == Course::Step
    }

    /// The row that nothing else moves, of what is not told by the balances.
    pub const fn own_row(self) -> Option<usize> {
        match self {
            Self::Sparking => Some(SPARKS),
            Self::Imbalance => Some(RIPPLE),
            _ => None,
        }
    }

    /// Largest size up to which its column holds, if that is not as large as can be: a gain stands in the balances with
    /// powers of its own, and a relative size of a half is another motor.
    pub fn holds(self, size: f64) -> bool {
        self.unit().is_some() || self.own_row().is_some() || size.abs() <= 0.5
    }

    /// Whether it hardly ever goes that way: nothing takes friction off a bearing or ohms off a winding, and no flux
    /// grows.
    pub fn is_unlikely_by_sign(self, size: f64) -> bool {
        match self {
            Self::Resistance | Self::Contact | Self::DryFriction | Self::ViscousFriction => size < 0.0,
            Self::Turns => size > 0.0,
            _ => false,
        }
    }

    /// Whether a size is a fault at all: a rotor that runs rounder than the others and brushes that spark less are
    /// none.
    pub fn is_one_at(self, size: f64) -> bool {
        self.own_row().is_none() || size > 0.0
    }

    /// A size in words, with three digits: what is small on one motor is large on another.
    pub fn told(self, size: f64) -> String {
        let signed = |x: f64| format!("{}{}", if x < 0.0 { "" } else { "+" }, figure(x, 3));
        match (self.unit(), self.course()) {
            _ if self == Self::Sparking => format!("{} times the usual", figure(size.exp(), 3)),
            (Some(unit), _) => format!("{} {unit}", signed(size)),
            (None, Course::Drift) => format!("{} % a second", signed(100.0 * size)),
            (None, Course::Step) => format!("{} %", signed(100.0 * size)),
        }
    }

    /// What to look at on the bench.
    pub const fn look_at(self) -> &'static str {
        match self {
            Self::Resistance => {
                "measure the winding's resistance at the terminals, warm and cold; look at joints and leads"
            }
            Self::Turns => "compare the windings' resistances and inductances; growl the armature",
            Self::Contact => "look at brushes, springs and the commutator's film; tighten the terminals",
            Self::DryFriction => "turn the rotor by hand; look at the bearings and at what rubs",
            Self::ViscousFriction => "look at the bearings' grease and seals",
            Self::Load => "look at the duct, the filter and the fan's blades",
            Self::Inertia => "look at the coupling and at what is mounted on the shaft",
            Self::VoltageGain | Self::VoltageDrift => {
                "check the voltage channel against a meter (the golden motor shows it, too)"
            }
            Self::CurrentGain | Self::CurrentDrift | Self::CurrentOffset => {
                "check the current channel against a meter (the golden motor shows it, too)"
            }
            Self::SpeedGain | Self::SpeedDrift => {
                "check the speed channel against a stroboscope (the golden motor shows it, too)"
            }
            Self::Sparking => "look at the brushes' seat and wear and at the commutator's bars",
            Self::Imbalance => "balance the rotor; look at the bearings' play and the speed sensor's mounting",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_told_on_motors_of_any_size() {
        assert_eq!(Fault::DryFriction.told(9.8e-5), "+9.80e-5 N m");
        assert_eq!(Fault::DryFriction.told(-1.25), "-1.25 N m");
        assert_eq!(Fault::VoltageGain.told(4.1e-4), "+0.0410 %");
        assert_eq!(Fault::SpeedDrift.told(-0.006), "-0.600 % a second");
        assert_eq!(Fault::Sparking.told(2f64.ln()), "2.00 times the usual");
        assert_eq!(Fault::Imbalance.told(1.5), "+1.50 rad/s");
    }
}
