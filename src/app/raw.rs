//! A sample as the converter gave it, on its way to the host.

use super::ring::Words;
use crate::units::Counts;

/// A raw sample with its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Raw {
    /// Samples before it since the start.
    pub number: u32,
    /// What the converter gave.
    pub counts: Counts,
}

impl Words<3> for Raw {
    fn to_words(&self) -> [u32; 3] {
        let Counts { voltage, current, speed } = self.counts;
        [self.number, u32::from(voltage) | u32::from(current) << 16, speed.into()]
    }

    fn from_words([number, pair, speed]: [u32; 3]) -> Self {
        Self { number, counts: Counts { voltage: pair as u16, current: (pair >> 16) as u16, speed: speed as u16 } }
    }
}
