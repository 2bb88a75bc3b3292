//! What is known of an effect besides its equation: what it is taken for, what excites it, how frequent it is.

use core::fmt;

use super::EffectId;
use crate::motor::FluxLaw;

/// An effect that stands for another one, since no recording of voltage, current and speed separates the two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Representative {
    /// The effect that is named.
    pub effect: EffectId,
    /// The motors in which the two are one, if not in all. A resistance and a weaker flux are the same voltage where
    /// the flux is the current; with magnets, two laws by which a resistance grows with the speed are.
    pub law: Option<FluxLaw>,
}

/// Two effects that together are a third.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sum {
    /// The two.
    pub two: [EffectId; 2],
    /// The motors in which they are.
    pub law: FluxLaw,
}

/// What a recording has to hold for an effect to show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Excitation {
    /// Currents from small to large.
    Current,
    /// Speeds from low to high.
    Speed,
    /// Motion near standstill.
    LowSpeed,
    /// Motion in both directions.
    BothDirections,
    /// Fast changes of the speed.
    Acceleration,
    /// Several turns, sampled well above the frequency of rotation.
    Rotation,
    /// An alternating or quickly changing voltage.
    Alternating,
    /// A direct voltage.
    Direct,
    /// Voltages near zero.
    LowVoltage,
    /// Time to warm up.
    Heating,
}

impl fmt::Display for Excitation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Current => "currents from small to large",
            Self::Speed => "speeds from low to high",
            Self::LowSpeed => "motion near standstill",
            Self::BothDirections => "motion in both directions",
            Self::Acceleration => "fast changes of the speed",
            Self::Rotation => "several turns, sampled well above the frequency of rotation",
            Self::Alternating => "an alternating or quickly changing voltage",
            Self::Direct => "a direct voltage",
            Self::LowVoltage => "voltages near zero",
            Self::Heating => "time to warm up",
        })
    }
}

/// On how many rigs an effect is large enough to see.
///
/// Orders of magnitude by judgement, not counted: to be replaced by what rigs have shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Share of rigs, 1.
    pub share: f64,
    /// Why, in words.
    pub because: &'static str,
}

impl Prior {
    /// On one rig in three.
    pub const fn common(because: &'static str) -> Self {
        Self { share: 0.3, because }
    }

    /// On one in ten.
    pub const fn occasional(because: &'static str) -> Self {
        Self { share: 0.1, because }
    }

    /// On one in thirty.
    pub const fn rare(because: &'static str) -> Self {
        Self { share: 0.03, because }
    }
}

/// A sentence with a place, `{}`, for a size.
#[derive(Debug, Clone, Copy)]
pub struct Sentence<'a, T>(pub &'a str, pub T);

impl<T: fmt::Display> fmt::Display for Sentence<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(sentence, size) = self;
        match sentence.split_once("{}") {
            Some((before, after)) => write!(f, "{before}{size}{after}"),
            None => f.write_str(sentence),
        }
    }
}
