//! The catalogue of effects, asked by what a user has written.

use greyrig::effects::{Description, Effect};

use crate::error::{Error, Result};

/// The effect with an identifier.
///
/// # Errors
/// There is none.
pub fn effect(id: &str) -> Result<&'static Description> {
    Description::of(id).ok_or_else(|| Error::usage(format!("there is no effect {id}"), known_effects()))
}

/// All identifiers, as a remedy for one that is unknown.
pub fn known_effects() -> String {
    let ids: Vec<&str> = Effect::<f64>::CATALOGUE.iter().map(|d| d.id).collect();
    format!("known are {}", ids.join(", "))
}
