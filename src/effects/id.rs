//! Names of the effects: text in files and on the command line, a type everywhere else.

use core::fmt;
use core::str::FromStr;

use super::{Description, EffectId};

/// A text that names no effect of the catalogue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnknownEffect;

impl fmt::Display for UnknownEffect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the catalogue has no effect with this identifier")
    }
}

impl core::error::Error for UnknownEffect {}

impl FromStr for EffectId {
    type Err = UnknownEffect;
    fn from_str(text: &str) -> Result<Self, UnknownEffect> {
        Self::ALL.iter().copied().find(|id| id.id() == text).ok_or(UnknownEffect)
    }
}

impl fmt::Display for EffectId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.id())
    }
}

/// As in files and on the command line.
impl fmt::Debug for EffectId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}

#[cfg(feature = "serde")]
impl serde::Serialize for EffectId {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.id())
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for EffectId {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Text;
        impl serde::de::Visitor<'_> for Text {
            type Value = EffectId;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the identifier of an effect")
            }
            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<EffectId, E> {
                text.parse().map_err(|_| E::custom(format_args!("there is no effect {text}; known are {Identifiers}")))
            }
        }
        deserializer.deserialize_str(Text)
    }
}

/// All identifiers, with commas: the remedy for one that is unknown.
#[derive(Debug, Clone, Copy)]
pub struct Identifiers;

impl fmt::Display for Identifiers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        EffectId::ALL.iter().enumerate().try_for_each(|(k, id)| write!(f, "{}{id}", if k > 0 { ", " } else { "" }))
    }
}

impl Description {
    /// Of all effects, in the order of the catalogue.
    pub fn all() -> impl Iterator<Item = &'static Self> + Clone {
        EffectId::ALL.iter().map(|id| id.description())
    }
}

/// With an identifier.
impl PartialEq<&str> for EffectId {
    fn eq(&self, id: &&str) -> bool {
        self.id() == *id
    }
}
