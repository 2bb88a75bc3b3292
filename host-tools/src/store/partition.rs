//! Where in the store a recording belongs: folders by line, motor type and day, as Hive names them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use jiff::civil::{Date, DateTime};
use serde::Serialize;

/// What Hive calls a folder of rows that do not have the value; readers take it for NULL.
const NONE: &str = "__HIVE_DEFAULT_PARTITION__";
/// Bytes that the name of a folder may have in the usual file systems.
const LONGEST: usize = 255;

/// A folder of recordings: `line=A3/type=universal/day=2026-11-30`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct Partition {
    /// Production line or test rig.
    pub line: Option<String>,
    /// Motor type.
    #[serde(rename = "type")]
    pub motor: Option<String>,
    /// Day of the recording, where it was made.
    pub day: Option<Date>,
}

/// A value that makes no folder: it is too long.
#[derive(Debug, thiserror::Error)]
#[error("the name {0:?} is too long for a folder of the store")]
pub struct TooLong(String);

impl Partition {
    /// The folder, relative to that of the table.
    ///
    /// # Errors
    /// A value too long for the name of a folder.
    pub fn folder(&self) -> Result<PathBuf, TooLong> {
        let day = self.day.map(|day| day.to_string());
        let parts = [("line", &self.line), ("type", &self.motor), ("day", &day)];
        parts.into_iter().map(|(key, value)| folder(key, value.as_deref())).collect()
    }

    /// Of a folder relative to that of the table; none: it is no partition's.
    pub fn of(folder: &Path) -> Option<Self> {
        let mut names = folder.iter().map(|name| name.to_str());
        let mut next = |key: &str| value(names.next()??.strip_prefix(key)?.strip_prefix('=')?);
        let (line, motor, day) = (next("line")?, next("type")?, next("day")?);
        let day = match day {
            Some(day) => Some(day.parse().ok()?),
            None => None,
        };
        names.next().is_none().then_some(Self { line, motor, day })
    }
}

/// A folder of one key.
///
/// # Errors
/// A value too long for it.
pub fn folder(key: &str, value: Option<&str>) -> Result<String, TooLong> {
    let mut name = format!("{key}=");
    match value {
        None => name += NONE,
        Some(value) => {
            for byte in value.bytes() {
                // What no file system gives a meaning; the rest as in an address, which Hive's readers undo.
                if byte.is_ascii_alphanumeric() || b"_.-".contains(&byte) {
                    name.push(char::from(byte));
                } else {
                    // Writing to text does not fail.
                    let _ = write!(name, "%{byte:02X}");
                }
            }
        }
    }
    if name.len() > LONGEST { Err(TooLong(value.unwrap_or_default().to_owned())) } else { Ok(name) }
}

/// The value of a folder's name, behind the equals sign; the outer `None`: no value can be written so.
fn value(text: &str) -> Option<Option<String>> {
    if text == NONE {
        return Some(None);
    }
    let mut bytes = Vec::new();
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(if byte == b'%' {
            let digits = [rest.next()?, rest.next()?];
            u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?
        } else {
            byte
        });
    }
    Some(Some(String::from_utf8(bytes).ok()?))
}

/// The time that a recording tells as its `date`: `2026-11-30`, `2026-11-30T06:15:00`, `2026-11-30 06:15:00+01:00`. It
/// is the time on the clock where the motor was tested; how far that is from UTC is left out.
pub fn time(text: &str) -> Option<DateTime> {
    let text = text.trim();
    text.strip_suffix(['Z', 'z']).unwrap_or(text).parse().ok()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_folder_is_named_as_hive_has_it() {
        let day = Some(jiff::civil::date(2026, 11, 30));
        let partition = Partition { line: Some("A 3".into()), motor: Some("universal".into()), day };
        assert_eq!(partition.folder().unwrap(), Path::new("line=A%203/type=universal/day=2026-11-30"));
        let unknown = Partition { line: None, motor: None, day: None };
        let none = "__HIVE_DEFAULT_PARTITION__";
        assert_eq!(unknown.folder().unwrap(), PathBuf::from(format!("line={none}/type={none}/day={none}")));
        assert!(Partition { line: Some("x".repeat(300)), ..unknown }.folder().is_err());
        for stranger in [
            "",
            "line=A",
            "line=A/type=B/day=soon",
            "line=A/type=B/day=2026-11-30/more",
            "line=%4/type=B/day=2026-11-30",
        ] {
            assert_eq!(Partition::of(Path::new(stranger)), None, "{stranger}");
        }
    }

    #[test]
    fn dates_are_those_on_the_clock() {
        for (text, expected) in [
            ("2026-11-30", "2026-11-30T00:00:00"),
            (" 2026-11-30 06:15:07.5 ", "2026-11-30T06:15:07.5"),
            ("2026-11-30T23:30:00+01:00", "2026-11-30T23:30:00"),
            ("2026-11-30T06:15:00Z", "2026-11-30T06:15:00"),
        ] {
            assert_eq!(time(text).unwrap_or_else(|| panic!("{text}")).to_string(), expected);
        }
        for text in ["", "yesterday", "2026-13-01", "30.11.2026"] {
            assert_eq!(time(text), None, "{text}");
        }
    }

    proptest! {
        /// Whatever a file tells, no folder leads out of the store, and the value comes back.
        #[test]
        fn any_value_makes_one_folder(line in ".{0,40}", motor in "[./\\\\%=]{0,12}") {
            let partition = Partition { line: Some(line), motor: Some(motor), day: None };
            if let Ok(folder) = partition.folder() {
                prop_assert_eq!(folder.components().count(), 3);
                prop_assert!(folder.components().all(|c| matches!(c, std::path::Component::Normal(_))));
                prop_assert_eq!(Partition::of(&folder), Some(partition));
            }
        }
    }
}
