//! Names, symbols and units as they stand beside figures and axes.

use crate::compare::Signal;
use crate::recording::Motion;

/// A unit of the model file in print: `kg m2` becomes kg m².
pub fn printed_unit(unit: &str) -> String {
    match unit {
        "1" => String::new(),
        _ => unit.replace("ohm", "Ω").replace('2', "²").replace('3', "³"),
    }
}

/// Units and symbols of a signal.
#[derive(Debug, Clone, Copy)]
pub struct SignalText {
    /// Name in a sentence.
    pub name: &'static str,
    /// Symbol.
    pub symbol: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Column name of files.
    pub column: &'static str,
}

/// How a signal is called on a kind of drive.
pub fn signal(signal: Signal, motion: Motion) -> SignalText {
    let rotary = motion == Motion::Rotary;
    match signal {
        Signal::Current => SignalText { name: "current", symbol: "i", unit: "A", column: "i_a" },
        Signal::Speed if rotary => SignalText { name: "speed", symbol: "ω", unit: "rad/s", column: "omega_rad_s" },
        Signal::Speed => SignalText { name: "speed", symbol: "v", unit: "m/s", column: "v_m_s" },
        Signal::Torque if rotary => SignalText { name: "torque", symbol: "T", unit: "N m", column: "torque_n_m" },
        Signal::Torque => SignalText { name: "force", symbol: "F", unit: "N", column: "force_n" },
    }
}

/// What a profile is sorted by: name with symbol, and unit.
pub fn axis(axis: &str, motion: Motion) -> (String, &'static str) {
    let speed = signal(Signal::Speed, motion);
    match axis {
        "i_a" => ("current i".into(), "A"),
        "abs_i_a" => ("current magnitude |i|".into(), "A"),
        "omega_rad_s" => (format!("speed {}", speed.symbol), speed.unit),
        "u_v" => ("voltage u".into(), "V"),
        "di_dt_sign" => ("sign of di/dt".into(), ""),
        "mains_phase_deg" => ("mains phase".into(), "°"),
        "t_s" => ("time t".into(), "s"),
        other => (other.into(), ""),
    }
}

/// `name, unit` as it stands beside an axis.
pub fn axis_label(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name}, {unit}") }
}

/// A first letter in upper case.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
