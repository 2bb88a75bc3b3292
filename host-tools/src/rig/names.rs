//! Names that users type: the message for one that is not known.

use crate::error::Error;

/// An unknown name: one line that lists the known ones, the nearest first.
pub fn unknown(what: &str, given: &str, known: impl Iterator<Item = &'static str>, advice: &str) -> Error {
    let mut known: Vec<&str> = known.collect();
    known.sort_by(|a, b| strsim::jaro_winkler(given, b).total_cmp(&strsim::jaro_winkler(given, a)));
    Error::usage(format!("no {what} is called `{given}`"), format!("known are {}; {advice}", known.join(", ")))
}
