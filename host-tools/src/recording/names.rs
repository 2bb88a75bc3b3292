//! Which quantity a column holds, by its name: the names of the interface and those that rigs commonly use.

use super::Channel;
use super::units::{Quantity, Unit};

/// What a column may be used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Role {
    /// The time axis (`t_s`).
    Time,
    /// A channel of the models.
    Channel(Channel),
    /// Marks samples at which the rotor is held (`rotor_locked`).
    RotorLocked,
    /// Marks samples at which the supply is open (`supply_open`).
    SupplyOpen,
    /// Marks samples that may be used (`valid`).
    Valid,
    /// Temperature (`temp_c`), carried along.
    Temperature,
}

impl Role {
    /// The column name of the interface.
    pub const fn column(self) -> &'static str {
        match self {
            Self::Time => "t_s",
            Self::Channel(channel) => channel.column(),
            Self::RotorLocked => "rotor_locked",
            Self::SupplyOpen => "supply_open",
            Self::Valid => "valid",
            Self::Temperature => "temp_c",
        }
    }

    /// Targets of `--map`, the interface's names first.
    pub const TARGETS: [(&'static str, Self); 13] = [
        ("t_s", Self::Time),
        ("u_v", Self::Channel(Channel::Voltage)),
        ("i_a", Self::Channel(Channel::Current)),
        ("omega_rad_s", Self::Channel(Channel::Speed)),
        ("angle_rad", Self::Channel(Channel::Angle)),
        ("torque_n_m", Self::Channel(Channel::Torque)),
        ("rotor_locked", Self::RotorLocked),
        ("supply_open", Self::SupplyOpen),
        ("valid", Self::Valid),
        ("temp_c", Self::Temperature),
        // The same channels of a linear drive.
        ("v_m_s", Self::Channel(Channel::Speed)),
        ("q_m", Self::Channel(Channel::Angle)),
        ("force_n", Self::Channel(Channel::Torque)),
    ];

    /// The quantities that its unit may have; empty for 0/1 columns.
    pub const fn quantities(self) -> &'static [Quantity] {
        match self {
            Self::Time => &[Quantity::Time],
            Self::Channel(Channel::Voltage) => &[Quantity::Voltage],
            Self::Channel(Channel::Current) => &[Quantity::Current],
            Self::Channel(Channel::Speed) => &[Quantity::AngularSpeed, Quantity::LinearSpeed, Quantity::Frequency],
            Self::Channel(Channel::Angle) => &[Quantity::Angle, Quantity::Length],
            Self::Channel(Channel::Torque) => &[Quantity::Torque, Quantity::Force],
            Self::Temperature => &[Quantity::Temperature],
            Self::RotorLocked | Self::SupplyOpen | Self::Valid => &[],
        }
    }

    /// What it is called in messages.
    pub const fn noun(self) -> &'static str {
        match self {
            Self::Time => "the time",
            Self::Channel(Channel::Voltage) => "the voltage",
            Self::Channel(Channel::Current) => "the current",
            Self::Channel(Channel::Speed) => "the speed",
            Self::Channel(Channel::Angle) => "the angle",
            Self::Channel(Channel::Torque) => "the torque",
            Self::RotorLocked => "the rotor_locked mark",
            Self::SupplyOpen => "the supply_open mark",
            Self::Valid => "the valid mark",
            Self::Temperature => "the temperature",
        }
    }
}

/// How sure the unit of a recognised column is when the file does not state one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bare {
    /// The name implies SI (`u`, `omega`).
    Si,
    /// SI is likely, and said in a warning (`speed`).
    Assumed,
    /// Several units are common: the user must say (`n`).
    Ask,
    /// The name is itself the unit (`rpm`).
    Unit(&'static str),
}

/// A column header, taken apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// The name without its unit.
    pub base: String,
    /// The unit in the header, as written.
    pub unit: Option<String>,
    /// The role, if the name is a known one.
    pub role: Option<Role>,
    /// What a missing unit means.
    pub bare: Bare,
    /// Exactly a name of the interface: it wins over other names.
    pub exact: bool,
}

const SPEED: Role = Role::Channel(Channel::Speed);
const VOLTAGE: Role = Role::Channel(Channel::Voltage);
const CURRENT: Role = Role::Channel(Channel::Current);
const ANGLE: Role = Role::Channel(Channel::Angle);
const TORQUE: Role = Role::Channel(Channel::Torque);

/// Common names (lower case, words joined by `_`). Sources: the data sets and tools named in docs/file-formats.md.
const NAMES: &[(&[&str], Role, Bare)] = &[
    (
        &[
            "t",
            "time",
            "zeit",
            "timestamp",
            "time_stamp",
            "timestamps",
            "seconds",
            "elapsed",
            "elapsed_time",
            "datetime",
            "date_time",
            "x_value",
            "x_axis",
            "temps",
            "tiempo",
            "tempo",
        ],
        Role::Time,
        Bare::Si,
    ),
    (
        &[
            "u",
            "v",
            "voltage",
            "volt",
            "spannung",
            "ua",
            "u_a",
            "va",
            "u_mot",
            "u_motor",
            "v_mot",
            "v_motor",
            "voltage_motor",
            "motor_voltage",
            "armature_voltage",
            "ankerspannung",
            "motorspannung",
            "terminal_voltage",
            "tension",
            "tensión",
            "voltaje",
            "tensione",
        ],
        VOLTAGE,
        Bare::Si,
    ),
    (
        &[
            "i",
            "current",
            "curr",
            "strom",
            "ia",
            "i_mot",
            "i_motor",
            "current_motor",
            "motor_current",
            "armature_current",
            "ankerstrom",
            "motorstrom",
            "ampere",
            "courant",
            "corriente",
            "corrente",
        ],
        CURRENT,
        Bare::Si,
    ),
    (
        &["w", "omega", "angular_velocity", "angular_speed", "winkelgeschwindigkeit", "omega_m", "w_m", "wm", "ω"],
        SPEED,
        Bare::Si,
    ),
    (
        &["speed", "vel", "velocity", "motor_speed", "shaft_speed", "rotor_speed", "geschwindigkeit", "dq", "qd"],
        SPEED,
        Bare::Assumed,
    ),
    (&["vitesse", "velocidad", "velocità"], SPEED, Bare::Ask),
    (&["n", "drehzahl", "motordrehzahl", "rotational_speed", "rev"], SPEED, Bare::Ask),
    (&["rpm", "erpm_mech"], SPEED, Bare::Unit("rpm")),
    (&["angle", "theta", "winkel", "phi", "angle_mech", "θ", "φ"], ANGLE, Bare::Assumed),
    (&["pos", "position", "q", "rotor_position", "shaft_angle", "lage", "weg"], ANGLE, Bare::Assumed),
    (&["torque", "tau", "drehmoment", "moment", "motor_torque", "shaft_torque"], TORQUE, Bare::Assumed),
    (&["couple", "coppia"], TORQUE, Bare::Assumed),
    (&["force", "kraft"], TORQUE, Bare::Unit("N")),
    (&["temp", "temperature", "temperatur", "t_wdg", "winding_temperature", "t_winding"], Role::Temperature, Bare::Si),
    (&["rotor_locked", "locked"], Role::RotorLocked, Bare::Si),
    (&["supply_open"], Role::SupplyOpen, Bare::Si),
    (&["valid"], Role::Valid, Bare::Si),
];

/// Names of a voltage that may be the supply's, ahead of a converter: nobody but the user can tell.
const SUPPLIES: [&str; 8] =
    ["input_voltage", "supply_voltage", "battery_voltage", "bus_voltage", "dc_link_voltage", "v_in", "vbat", "vbus"];

/// Names of a share of the time that a converter is switched on.
const DUTIES: [&str; 5] = ["duty_cycle", "duty", "pwm", "dutycycle", "duty_ratio"];

/// Whether a name is that of a voltage that may be the supply's.
pub fn is_supply(base: &str) -> bool {
    SUPPLIES.contains(&key(base).as_str())
}

/// Whether a name is that of a duty cycle.
pub fn is_duty(base: &str) -> bool {
    DUTIES.contains(&key(base).as_str())
}

/// Words behind a name that say "measured", and change nothing.
const MEASURED: [&str; 8] = ["meas", "measured", "act", "actual", "ist", "fbk", "feedback", "mess"];

/// Takes a header apart: `Speed [rpm]`, `i (mA)`, `U / V`, `Zeit in s`, `speed_rpm`, `omega_rad_s`.
pub fn header(label: &str) -> Header {
    let label = label.trim();
    // The interface's names hold their unit already, in a group of a file, too (`sig.u_v`).
    let own = label.rsplit_once(['.', '/']).map_or(label, |(_, own)| own);
    if let Some(&(name, role)) = Role::TARGETS.iter().find(|(n, _)| *n == own) {
        let unit = match name {
            "v_m_s" => Some("m/s"),
            "q_m" => Some("m"),
            "force_n" => Some("N"),
            _ => None,
        };
        return Header {
            base: name.into(),
            unit: unit.map(Into::into),
            role: Some(role),
            bare: Bare::Si,
            exact: unit.is_none() && own == label,
        };
    }
    let (base, unit) = split_unit(label);
    let quantity = unit.as_deref().and_then(Unit::parse).map(|u| u.quantity);
    let found = match (base.as_str(), quantity) {
        // Letters that stand for two things are told apart by their unit, and a bare capital T is not guessed.
        ("v" | "V", Some(Quantity::LinearSpeed)) => Some((SPEED, Bare::Assumed)),
        ("t" | "T", Some(Quantity::Temperature)) => Some((Role::Temperature, Bare::Si)),
        ("T", q) if q != Some(Quantity::Time) => None,
        _ => lookup(&base),
    };
    match found {
        Some((role, bare)) => Header { base, unit, role: Some(role), bare, exact: false },
        // `t_wdg` and the like end in something that is no unit; `current_A` does.
        None => match Unit::split_suffix(&base) {
            Some((rest, suffix)) if unit.is_none() => {
                let known = lookup(rest);
                let bare = known.map_or(Bare::Si, |k| k.1);
                Header { base: rest.into(), unit: Some(suffix.into()), role: known.map(|k| k.0), bare, exact: false }
            }
            _ => Header { base, unit, role: None, bare: Bare::Si, exact: false },
        },
    }
}

/// The unit in brackets, behind a slash with blanks, or behind " in ".
fn split_unit(label: &str) -> (String, Option<String>) {
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}'), ('<', '>')] {
        if let (Some(a), true) = (label.rfind(open), label.ends_with(close))
            && a > 0
            && a + 1 < label.len()
        {
            let unit = label[a + 1..label.len() - 1].trim();
            // `i(1)` is a channel number, not a unit.
            let base = label[..a].trim();
            if !unit.is_empty() && !unit.chars().all(|c| c.is_ascii_digit()) {
                return (base.to_owned(), Some(unit.to_owned()));
            }
        }
    }
    for separator in [" / ", " in ", "/"] {
        if let Some((base, unit)) = label.split_once(separator)
            && !base.trim().is_empty()
            && Unit::parse(unit).is_some()
        {
            return (base.trim().to_owned(), Some(unit.trim().to_owned()));
        }
    }
    if let Some((base, unit)) = label.rsplit_once(' ')
        && lookup(base).is_some()
        && Unit::parse(unit).is_some()
    {
        return (base.trim().to_owned(), Some(unit.to_owned()));
    }
    (label.to_owned(), None)
}

fn words(base: &str) -> Vec<String> {
    let lower = base.to_lowercase();
    lower.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).map(str::to_owned).collect()
}

fn key(base: &str) -> String {
    words(base).join("_")
}

/// Whether a name speaks of a quantity, though not of the motor's for certain: a column that may be proposed.
pub fn hints_at(base: &str, channel: Channel) -> bool {
    let hints: &[&str] = match channel {
        Channel::Voltage => &["u", "v", "volt", "volts", "voltage", "spannung", "duty", "pwm"],
        Channel::Current => &["i", "a", "amp", "amps", "ampere", "curr", "current", "strom"],
        Channel::Speed => &["w", "omega", "speed", "vel", "velocity", "rpm", "erpm", "drehzahl", "n"],
        Channel::Angle => &["angle", "pos", "position", "theta", "enc", "encoder", "winkel"],
        Channel::Torque => &["torque", "moment", "force", "drehmoment", "kraft"],
    };
    words(base).iter().any(|word| hints.contains(&word.as_str()))
}

fn lookup(base: &str) -> Option<(Role, Bare)> {
    let mut words = words(base);
    if words.len() > 1 && words.last().is_some_and(|w| MEASURED.contains(&w.as_str())) {
        words.pop();
    }
    let key = words.join("_");
    let named = NAMES.iter().find(|(names, ..)| names.contains(&key.as_str()))?;
    Some((named.1, named.2))
}

/// Columns that only number the rows.
pub fn is_row_index(label: &str, values: &[f64]) -> bool {
    let lower = label.trim().to_lowercase();
    let named = lower.is_empty()
        || lower.starts_with("unnamed")
        || ["index", "idx", "row", "sample", "samples", "nr", "no", "#", "__index_level_0__"].contains(&lower.as_str());
    named && values.windows(2).all(|w| w[1] - w[0] == 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn common_headers_are_recognised() {
        for (label, role, unit) in [
            ("Time [s]", Role::Time, Some("s")),
            ("Zeit in ms", Role::Time, Some("ms")),
            ("t_ms", Role::Time, Some("ms")),
            ("U / V", VOLTAGE, Some("V")),
            ("voltage_V", VOLTAGE, Some("V")),
            ("Motor Voltage (mV)", VOLTAGE, Some("mV")),
            ("i (mA)", CURRENT, Some("mA")),
            ("i_mA", CURRENT, Some("mA")),
            ("current_A", CURRENT, Some("A")),
            ("Drehzahl [1/min]", SPEED, Some("1/min")),
            ("speed_rpm", SPEED, Some("rpm")),
            ("n/rpm", SPEED, Some("rpm")),
            ("vel_rad_s", SPEED, Some("rad/s")),
            ("speed_rad_s", SPEED, Some("rad/s")),
            ("w [rad/s]", SPEED, Some("rad/s")),
            ("pos_rad", ANGLE, Some("rad")),
            ("torque_meas_Nm", TORQUE, Some("Nm")),
            ("force_N", TORQUE, Some("N")),
            ("omega_rad_s", SPEED, None),
            ("sig.omega_rad_s", SPEED, None),
            ("temps (s)", Role::Time, Some("s")),
            ("tension (V)", VOLTAGE, Some("V")),
            ("courant (A)", CURRENT, Some("A")),
            ("vitesse (tr/min)", SPEED, Some("tr/min")),
            ("x-axis", Role::Time, None),
        ] {
            let h = header(label);
            assert_eq!((h.role, h.unit.as_deref()), (Some(role), unit), "{label}");
        }
        for label in ["q_ref_m", "pos_ref_rad", "torque_in_Nm", "drive_V", "pulses_N", "VoltageCh1", "z1"] {
            assert_eq!(header(label).role, None, "{label}");
        }
    }
}
