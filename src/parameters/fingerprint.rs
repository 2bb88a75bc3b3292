//! A number that two programs share if they mean the same by a block.

use super::tag::Tag;
use crate::effects::{EffectId, MAX_EFFECT_PARAMETERS, MAX_EFFECTS};
use crate::motor::MAX_TERMS;
use crate::term::{MAX_OPS, MAX_UNKNOWNS};

/// Digest of the sections with their versions, the catalogue of effects with the names of their parameters, and the
/// limits. The host writes no block to a microcontroller whose fingerprint is another.
pub const FINGERPRINT: u32 = fingerprint();

// FNV-1a, 32 bits (Fowler, Noll and Vo): offset basis and prime.
const BASIS: u32 = 0x811c_9dc5;
const PRIME: u32 = 0x0100_0193;

const fn fingerprint() -> u32 {
    let mut digest = BASIS;
    let mut n = 0;
    while n < Tag::ALL.len() {
        let (tag, version) = Tag::ALL[n];
        digest = byte(digest, tag as u8);
        digest = byte(digest, if let Some(version) = version { version } else { 0 });
        n += 1;
    }
    let limits = [MAX_EFFECTS, MAX_EFFECT_PARAMETERS, MAX_TERMS, MAX_OPS, MAX_UNKNOWNS, super::MAX_TEXT];
    let mut n = 0;
    while n < limits.len() {
        digest = byte(digest, limits[n] as u8);
        n += 1;
    }
    let mut n = 0;
    while n < EffectId::ALL.len() {
        digest = text(digest, EffectId::ALL[n].id());
        let parameters = EffectId::ALL[n].description().parameters;
        let mut m = 0;
        while m < parameters.len() {
            digest = text(digest, parameters[m].name);
            m += 1;
        }
        n += 1;
    }
    digest
}

const fn byte(digest: u32, byte: u8) -> u32 {
    (digest ^ byte as u32).wrapping_mul(PRIME)
}

/// With its end, so that "ab", "c" is not "a", "bc".
const fn text(mut digest: u32, text: &str) -> u32 {
    let bytes = text.as_bytes();
    let mut n = 0;
    while n < bytes.len() {
        digest = byte(digest, bytes[n]);
        n += 1;
    }
    byte(digest, 0)
}
