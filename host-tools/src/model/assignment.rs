//! Parameters on the command line.

use std::str::FromStr;

/// `NAME=VALUE` of the command line.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// Left of the sign.
    pub name: String,
    /// Right of the sign, in SI units.
    pub value: f64,
}

impl FromStr for Assignment {
    type Err = String;
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let (name, value) =
            text.split_once('=').ok_or_else(|| format!("{text:?} is not NAME=VALUE, such as J=1.8e-4"))?;
        let value: f64 = value.trim().parse().map_err(|_| format!("{value:?} is not a number"))?;
        if !value.is_finite() {
            return Err(format!("{value} is not finite"));
        }
        Ok(Self { name: name.trim().to_owned(), value })
    }
}
