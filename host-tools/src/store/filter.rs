//! Which recordings of a store are meant: by line, type, day and serial number.

use std::collections::BTreeSet;
use std::str::FromStr;

use jiff::civil::Date;

use super::partition::Partition;
use crate::spelling;

/// Recordings that are meant; each condition that is given has to hold.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Filter {
    /// Production lines; empty: any.
    pub lines: BTreeSet<String>,
    /// Motor types; empty: any.
    pub motors: BTreeSet<String>,
    /// Serial numbers; empty: any.
    pub serials: BTreeSet<String>,
    /// First day.
    pub from: Option<Date>,
    /// Last day.
    pub to: Option<Date>,
}

impl Filter {
    /// Whether recordings of a folder can be meant.
    pub fn admits(&self, partition: &Partition) -> bool {
        let among = |set: &BTreeSet<String>, value: &Option<String>| {
            set.is_empty() || value.as_ref().is_some_and(|value| set.contains(value))
        };
        let since = self.from.is_none_or(|from| partition.day.is_some_and(|day| day >= from));
        let until = self.to.is_none_or(|to| partition.day.is_some_and(|day| day <= to));
        among(&self.lines, &partition.line) && among(&self.motors, &partition.motor) && since && until
    }

    /// Whether a motor is meant.
    pub fn admits_serial(&self, serial: Option<&str>) -> bool {
        self.serials.is_empty() || serial.is_some_and(|serial| self.serials.contains(serial))
    }
}

impl FromStr for Filter {
    type Err = String;

    /// `line=A,type=universal,from=2026-01-01,to=2026-01-31,serial=X`; several of one kind: any of them.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut filter = Self::default();
        for condition in text.split(',').map(str::trim).filter(|c| !c.is_empty()) {
            let (key, value) = condition.split_once('=').ok_or_else(|| {
                format!("{condition:?} is no condition; write line=…,type=…,from=2026-01-01,to=2026-12-31,serial=…")
            })?;
            let day = || value.parse::<Date>().map_err(|_| format!("{value:?} is no day; write it as 2026-01-31"));
            match key.trim() {
                "line" => drop(filter.lines.insert(value.to_owned())),
                "type" => drop(filter.motors.insert(value.to_owned())),
                "serial" => drop(filter.serials.insert(value.to_owned())),
                "from" => filter.from = Some(day()?),
                "to" => filter.to = Some(day()?),
                "day" => (filter.from, filter.to) = (Some(day()?), Some(day()?)),
                other => {
                    let known = ["line", "type", "day", "from", "to", "serial"];
                    return Err(format!(
                        "there is no condition {other:?}; {}",
                        spelling::advice(other, known, "known are")
                    ));
                }
            }
        }
        Ok(filter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_hold_together_and_days_are_inclusive() {
        let filter: Filter = "line=A, line=B,type=universal,from=2026-01-02,to=2026-01-03".parse().unwrap();
        let partition = |line: &str, day: Option<i8>| Partition {
            line: Some(line.into()),
            motor: Some("universal".into()),
            day: day.map(|day| jiff::civil::date(2026, 1, day)),
        };
        for (line, day, expected) in [
            ("A", Some(2), true),
            ("B", Some(3), true),
            ("A", Some(1), false),
            ("A", Some(4), false),
            ("C", Some(2), false),
            ("A", None, false),
        ] {
            assert_eq!(filter.admits(&partition(line, day)), expected, "{line} {day:?}");
        }
        assert!(Filter::default().admits(&partition("A", None)) && Filter::default().admits_serial(None));
        let serial: Filter = "serial=S1".parse().unwrap();
        assert!(serial.admits_serial(Some("S1")) && !serial.admits_serial(None) && !serial.admits_serial(Some("S2")));
        for wrong in ["line", "colour=red", "from=soon"] {
            assert!(wrong.parse::<Filter>().is_err(), "{wrong}");
        }
    }
}
