//! Figures as they are printed: rounded to what is known, copyable into a spreadsheet, never NaN.

use crate::compare::Signal;
use crate::recording::Motion;

/// Stands for a figure that does not apply.
pub const NONE: &str = "–";

/// A number with so many significant digits; the dash where it is not finite.
pub fn figure(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return NONE.to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = value.abs().log10().floor() as i32;
    let digits = digits.max(1);
    if (-3..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        let decimals = digits - 1;
        format!("{value:.decimals$e}")
    }
}

/// A setting, four digits at most and no zeros at the end: 250, 0.02.
pub fn rounded(value: f64) -> String {
    let text = figure(value, 4);
    if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// A number that may not apply, with its unit.
pub fn quantity(value: Option<f64>, unit: &str) -> String {
    match value.filter(|v| v.is_finite()) {
        Some(v) => format!("{} {unit}", figure(v, 3)),
        None => NONE.to_owned(),
    }
}

/// A ratio in per cent, three digits.
pub fn percent(ratio: Option<f64>) -> String {
    match ratio.filter(|v| v.is_finite()) {
        Some(v) => format!("{} %", figure(100.0 * v, 3)),
        None => NONE.to_owned(),
    }
}

/// A value and its interval, rounded alike: to two digits of the interval's half width.
pub fn with_interval(value: f64, interval: Option<[f64; 2]>) -> (String, String) {
    let Some([low, high]) = interval.filter(|[a, b]| a.is_finite() && b.is_finite()) else {
        return (figure(value, 4), NONE.to_owned());
    };
    let half = (high - low).abs() / 2.0;
    let digits = if half > 0.0 && value != 0.0 {
        // Beyond nine digits the interval is a formality, and at least two are shown however wide it is.
        ((value.abs().log10().floor() - half.log10().floor()) as i32 + 2).clamp(2, 9) as usize
    } else {
        4
    };
    (figure(value, digits), format!("{} … {}", figure(low, digits), figure(high, digits)))
}

/// Half the width of an interval in per cent of the value.
pub fn relative_width(value: f64, interval: Option<[f64; 2]>) -> String {
    match interval {
        Some([low, high]) if value != 0.0 => {
            let text = figure((50.0 * (high - low) / value).abs(), 2);
            if text == NONE { text } else { format!("± {text} %") }
        }
        _ => NONE.to_owned(),
    }
}

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
