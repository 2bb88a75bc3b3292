//! What tells an effect from those that look like it.

use core::fmt;

/// A recording that a set may hold already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Recording {
    /// Currents through a rotor that is held.
    LockedRotor,
    /// A motor that coasts with the supply open.
    OpenSupply,
    /// Motion in both directions.
    BothDirections,
}

/// One way to tell an effect from those that look like it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Separation {
    /// In words.
    pub words: &'static str,
    /// The recording that it asks for, where a set that holds one has all that it asks for.
    pub asks_for: Option<Recording>,
}

impl Separation {
    /// By something else.
    pub const fn by(words: &'static str) -> Self {
        Self { words, asks_for: None }
    }

    /// By currents through a rotor that is held.
    pub const fn locked_rotor(words: &'static str) -> Self {
        Self { words, asks_for: Some(Recording::LockedRotor) }
    }

    /// By a motor that coasts with the supply open.
    pub const fn open_supply(words: &'static str) -> Self {
        Self { words, asks_for: Some(Recording::OpenSupply) }
    }

    /// By motion in both directions.
    pub const fn both_directions(words: &'static str) -> Self {
        Self { words, asks_for: Some(Recording::BothDirections) }
    }
}

/// Several ways, in words.
#[derive(Debug, Clone, Copy)]
pub struct InWords<'a>(pub &'a [Separation]);

impl fmt::Display for InWords<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().enumerate().try_for_each(|(k, way)| write!(f, "{}{}", if k > 0 { "; " } else { "" }, way.words))
    }
}
