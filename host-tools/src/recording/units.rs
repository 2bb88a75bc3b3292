//! Units of measured quantities and their factors to SI.
//!
//! Factors follow from the definitions of the units (BIPM, The International System of Units, 9th edition, 2019):
//! 1 rev = 2 pi rad, 1 deg = pi/180 rad, 1 min = 60 s.

use std::f64::consts::PI;

/// What a unit measures. Rotary and linear quantities are kept apart, because they decide on the kind of drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// s
    Time,
    /// V
    Voltage,
    /// A
    Current,
    /// rad/s
    AngularSpeed,
    /// m/s
    LinearSpeed,
    /// rad
    Angle,
    /// m
    Length,
    /// N m
    Torque,
    /// N
    Force,
    /// degrees Celsius
    Temperature,
    /// Hz: a speed in revolutions per second where the column is a speed by its name
    Frequency,
}

/// A unit: SI value = value in the file * `factor` + `offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// What it measures.
    pub quantity: Quantity,
    /// Factor to SI.
    pub factor: f64,
    /// Offset to SI (degrees Celsius for temperatures).
    pub offset: f64,
}

/// Spelling in files (after [`canonical`]), quantity, factor. The first spelling of each quantity's unit is the one
/// shown.
const UNITS: &[(&str, Quantity, f64)] = &[
    ("s", Quantity::Time, 1.0),
    ("ms", Quantity::Time, 1e-3),
    ("us", Quantity::Time, 1e-6),
    ("ns", Quantity::Time, 1e-9),
    ("min", Quantity::Time, 60.0),
    ("h", Quantity::Time, 3600.0),
    ("V", Quantity::Voltage, 1.0),
    ("mV", Quantity::Voltage, 1e-3),
    ("uV", Quantity::Voltage, 1e-6),
    ("kV", Quantity::Voltage, 1e3),
    ("A", Quantity::Current, 1.0),
    ("mA", Quantity::Current, 1e-3),
    ("uA", Quantity::Current, 1e-6),
    ("kA", Quantity::Current, 1e3),
    ("rad/s", Quantity::AngularSpeed, 1.0),
    ("rpm", Quantity::AngularSpeed, PI / 30.0),
    ("1/min", Quantity::AngularSpeed, PI / 30.0),
    ("krpm", Quantity::AngularSpeed, 1e3 * PI / 30.0),
    ("rad/min", Quantity::AngularSpeed, 1.0 / 60.0),
    ("rev/s", Quantity::AngularSpeed, 2.0 * PI),
    ("1/s", Quantity::AngularSpeed, 2.0 * PI),
    ("deg/s", Quantity::AngularSpeed, PI / 180.0),
    ("m/s", Quantity::LinearSpeed, 1.0),
    ("mm/s", Quantity::LinearSpeed, 1e-3),
    ("cm/s", Quantity::LinearSpeed, 1e-2),
    ("um/s", Quantity::LinearSpeed, 1e-6),
    ("m/min", Quantity::LinearSpeed, 1.0 / 60.0),
    ("mm/min", Quantity::LinearSpeed, 1e-3 / 60.0),
    ("rad", Quantity::Angle, 1.0),
    ("mrad", Quantity::Angle, 1e-3),
    ("deg", Quantity::Angle, PI / 180.0),
    ("rev", Quantity::Angle, 2.0 * PI),
    ("m", Quantity::Length, 1.0),
    ("mm", Quantity::Length, 1e-3),
    ("cm", Quantity::Length, 1e-2),
    ("um", Quantity::Length, 1e-6),
    ("Nm", Quantity::Torque, 1.0),
    ("mNm", Quantity::Torque, 1e-3),
    ("uNm", Quantity::Torque, 1e-6),
    ("kNm", Quantity::Torque, 1e3),
    ("Ncm", Quantity::Torque, 1e-2),
    ("Nmm", Quantity::Torque, 1e-3),
    ("N", Quantity::Force, 1.0),
    ("mN", Quantity::Force, 1e-3),
    ("kN", Quantity::Force, 1e3),
    ("degC", Quantity::Temperature, 1.0),
    ("K", Quantity::Temperature, 1.0),
    ("degF", Quantity::Temperature, 5.0 / 9.0),
    ("Hz", Quantity::Frequency, 2.0 * PI),
    ("kHz", Quantity::Frequency, 2e3 * PI),
];

/// Other spellings of the units above.
const ALIASES: &[(&str, &str)] = &[
    ("sec", "s"),
    ("second", "s"),
    ("seconds", "s"),
    ("sekunden", "s"),
    ("msec", "ms"),
    ("millisecond", "ms"),
    ("milliseconds", "ms"),
    ("microsecond", "us"),
    ("microseconds", "us"),
    ("nanosecond", "ns"),
    ("nanoseconds", "ns"),
    ("minutes", "min"),
    ("hours", "h"),
    ("usec", "us"),
    ("volt", "V"),
    ("volts", "V"),
    ("amp", "A"),
    ("amps", "A"),
    ("ampere", "A"),
    ("amperes", "A"),
    ("r/min", "rpm"),
    ("rev/min", "rpm"),
    ("u/min", "rpm"),
    ("tr/min", "rpm"),
    ("giri/min", "rpm"),
    ("upm", "rpm"),
    ("min-1", "1/min"),
    ("min^-1", "1/min"),
    ("s-1", "1/s"),
    ("s^-1", "1/s"),
    ("rps", "rev/s"),
    ("r/s", "rev/s"),
    ("u/s", "rev/s"),
    ("rads-1", "rad/s"),
    ("rads^-1", "rad/s"),
    ("rad/sec", "rad/s"),
    ("deg/sec", "deg/s"),
    ("dps", "deg/s"),
    ("ms-1", "m/s"),
    ("ms^-1", "m/s"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("radian", "rad"),
    ("radians", "rad"),
    ("turn", "rev"),
    ("turns", "rev"),
    ("newton", "N"),
    ("meter", "m"),
    ("metre", "m"),
    ("celsius", "degC"),
    ("kelvin", "K"),
    ("c", "degC"),
];

/// Units as they appear behind an underscore in a name (`i_mA`, `speed_rad_s`).
const SUFFIXES: &[(&str, &str)] = &[
    ("rad_s", "rad/s"),
    ("rads", "rad/s"),
    ("radps", "rad/s"),
    ("rad_per_s", "rad/s"),
    ("deg_s", "deg/s"),
    ("rev_s", "rev/s"),
    ("rev_min", "rpm"),
    ("1_min", "1/min"),
    ("m_s", "m/s"),
    ("mps", "m/s"),
    ("mm_s", "mm/s"),
    ("n_m", "Nm"),
    ("mn_m", "mNm"),
    ("n_cm", "Ncm"),
    ("c", "degC"),
    ("degc", "degC"),
];

/// The spelling by which units are looked up: no blanks, brackets, dots or raised signs; micro is `u`, degree is `deg`.
fn canonical(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.trim().chars() {
        match c {
            'µ' | 'μ' => out.push('u'),
            '°' | 'º' => out.push_str("deg"),
            '\u{2103}' => out.push_str("degC"),
            '⁻' => out.push('-'),
            '¹' => out.push('1'),
            '·' | '⋅' | '*' | '.' | '\u{2219}' | '\u{2022}' => {}
            c if c.is_whitespace() => {}
            c => out.push(c),
        }
    }
    out
}

impl Unit {
    /// Recognises a unit. Upper and lower case count where they tell units apart (`mA`, `MA`), and are forgiven where
    /// not.
    pub fn parse(text: &str) -> Option<Self> {
        // `milliseconds since 2026-03-01`, as NetCDF has it: counts of a unit of time.
        let key = canonical(text.split(" since ").next().unwrap_or(text));
        if key.is_empty() || key.len() > 16 {
            return None;
        }
        let lower = key.to_lowercase();
        let name = UNITS.iter().map(|u| u.0).find(|n| *n == key).or_else(|| {
            let alias = ALIASES.iter().find(|(a, _)| *a == lower).map(|(_, n)| *n);
            alias.or_else(|| {
                let mut same = UNITS.iter().map(|u| u.0).filter(|n| n.to_lowercase() == lower);
                // A capital M would be mega, which no motor recording holds: milli is not guessed from it.
                let mega = key.starts_with('M') && key.len() > 1 && lower != "min";
                same.next().filter(|_| same.next().is_none() && !mega)
            })
        })?;
        let (_, quantity, factor) = *UNITS.iter().find(|u| u.0 == name)?;
        let offset = match name {
            "K" => -273.15,
            "degF" => -160.0 / 9.0,
            _ => 0.0,
        };
        Some(Self { quantity, factor, offset })
    }

    /// The longest unit at the end of a name with underscores: `i_mA` gives (`i`, `mA`).
    pub fn split_suffix(name: &str) -> Option<(&str, &'static str)> {
        for (at, _) in name.char_indices().filter(|&(i, c)| c == '_' && i > 0) {
            let (base, suffix) = (&name[..at], &name[at + 1..]);
            let lower = suffix.to_lowercase();
            if let Some((_, unit)) = SUFFIXES.iter().find(|(s, _)| *s == lower) {
                return Some((base, unit));
            }
            if suffix.contains('_') || lower == "h" || lower == "k" {
                continue;
            }
            if let Some(unit) = Self::parse(suffix) {
                let name = UNITS.iter().find(|u| u.1 == unit.quantity && u.2 == unit.factor)?.0;
                return Some((base, name));
            }
        }
        None
    }

    /// The spellings known for a quantity, for messages.
    pub fn known(quantities: &[Quantity]) -> String {
        let names: Vec<_> = UNITS.iter().filter(|u| quantities.contains(&u.1)).map(|u| u.0).collect();
        names.join(", ")
    }
}

impl Quantity {
    /// The SI unit in which recordings hold it.
    pub const fn si(self) -> &'static str {
        match self {
            Self::Time => "s",
            Self::Voltage => "V",
            Self::Current => "A",
            Self::AngularSpeed | Self::Frequency => "rad/s",
            Self::LinearSpeed => "m/s",
            Self::Angle => "rad",
            Self::Length => "m",
            Self::Torque => "N m",
            Self::Force => "N",
            Self::Temperature => "degC",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings_of_the_field_are_known() {
        // Expected factors from the definitions: 1 rpm = 0.104719755 rad/s, 1 deg = 0.0174532925 rad.
        for (text, quantity, factor) in [
            ("rpm", Quantity::AngularSpeed, 0.104_719_755_119_659_77),
            ("RPM", Quantity::AngularSpeed, 0.104_719_755_119_659_77),
            ("U/min", Quantity::AngularSpeed, 0.104_719_755_119_659_77),
            ("min⁻¹", Quantity::AngularSpeed, 0.104_719_755_119_659_77),
            ("1/min", Quantity::AngularSpeed, 0.104_719_755_119_659_77),
            ("rad s^-1", Quantity::AngularSpeed, 1.0),
            ("°/s", Quantity::AngularSpeed, 0.017_453_292_519_943_295),
            ("mA", Quantity::Current, 1e-3),
            ("µA", Quantity::Current, 1e-6),
            ("μs", Quantity::Time, 1e-6),
            ("mN·m", Quantity::Torque, 1e-3),
            ("N·cm", Quantity::Torque, 1e-2),
            ("N m", Quantity::Torque, 1.0),
            ("kN", Quantity::Force, 1e3),
            ("Volt", Quantity::Voltage, 1.0),
            ("°C", Quantity::Temperature, 1.0),
        ] {
            let unit = Unit::parse(text).unwrap_or_else(|| panic!("{text} is not known"));
            assert_eq!((unit.quantity, unit.factor), (quantity, factor), "{text}");
        }
        for text in ["", "furlong", "%", "counts", "MV", "MNm"] {
            assert_eq!(Unit::parse(text), None, "{text}");
        }
    }

    #[test]
    fn suffixes_split_off() {
        for (name, base, unit) in [
            ("i_mA", "i", "mA"),
            ("vel_rad_s", "vel", "rad/s"),
            ("torque_meas_Nm", "torque_meas", "Nm"),
            ("time_us", "time", "us"),
            ("q_m", "q", "m"),
            ("torque_n_m", "torque", "Nm"),
            ("force_N", "force", "N"),
            ("speed_rpm", "speed", "rpm"),
        ] {
            assert_eq!(Unit::split_suffix(name), Some((base, unit)), "{name}");
        }
        assert_eq!(Unit::split_suffix("voltage"), None);
        assert_eq!(Unit::split_suffix("pos_ref"), None);
    }
}
