//! The catalogue of effects, asked by what a user has written.

use greyrig::effects::EffectId;

use crate::error::{Error, Result};

/// The effect with an identifier.
///
/// # Errors
/// There is none.
pub fn effect(id: &str) -> Result<EffectId> {
    id.parse().map_err(|_| Error::unknown("effect", id, EffectId::ALL.iter().map(|id| id.id()), "known are"))
}

/// Effects by their identifiers.
pub fn joined(effects: &[EffectId], between: &str) -> String {
    effects.iter().map(|id| id.id()).collect::<Vec<_>>().join(between)
}

/// The effects with some identifiers.
///
/// # Errors
/// The first one that there is not.
pub fn effects(ids: &[String]) -> Result<Vec<EffectId>> {
    ids.iter().map(|id| effect(id)).collect()
}
