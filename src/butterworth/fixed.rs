//! The filter in fixed point: 32-bit samples and coefficients, products summed in 64 bits.
//!
//! The recurrences are those of the [module above](super). Formats:
//!
//! | quantity | type | one is | range |
//! | --- | --- | --- | --- |
//! | sample | `i32` | 2^28 ([`FULL_SCALE`]) | limited to ±1 on entry |
//! | α, β, γ | `i32` | 2^31 | 0 to 1 |
//! | s2 | `i64` | 2^59 | ±16 |
//! | s1 | `i64` | 2^58 | ±32 |
//!
//! The states keep 31 (30) bits below the sample's last one, and the sum of products goes into them unrounded: what
//! rounding takes from a sample stays in the state and comes back later. That is error feedback without an
//! instruction spent on it: quantisation does not accumulate, a constant input is reproduced exactly, and with a zero
//! input the filter comes to rest at zero and stays there.
//!
//! No input overflows: from any sequence of samples within ±1 no sum goes beyond ±5.5, up to a cut-off of
//! [`MAX_CUTOFF_RATIO`] (`internal_gains_stay_within_the_headroom` in the tests sums the magnitudes of the impulse
//! responses), and the format holds ±8.
//!
//! A 12-bit converter's counts, shifted up by 16, fill the range.

use super::MAX_SECTIONS;
use super::design::{self, Design};

/// The sample that stands for one.
pub const FULL_SCALE: i32 = 1 << 28;
/// Highest cut-off as a fraction of the sampling rate: above, the states need more headroom than the format has.
pub const MAX_CUTOFF_RATIO: f64 = 0.4;

/// What a filter is: shared by all channels that have the same settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Coefficients {
    first_order: Option<i32>,
    sections: [Section; MAX_SECTIONS],
    count: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Section {
    alpha: i32,
    beta: i32,
    gamma: i32,
}

/// What a channel remembers. A new one has seen nothing but zeros.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cascade {
    first_order: i64,
    sections: [[i64; 2]; MAX_SECTIONS],
}

/// Fraction bits of a coefficient, and bits of s2 below a sample's last one.
const FRACTION: u32 = 31;

impl Coefficients {
    pub(super) fn new(design: &Design) -> Self {
        let mut coefficients = Self {
            first_order: design.first_order().map(quantise),
            sections: [Section::default(); MAX_SECTIONS],
            count: 0,
        };
        for (section, designed) in coefficients.sections.iter_mut().zip(design.second_order()) {
            let design::Section { alpha, beta, gamma } = designed;
            *section = Section { alpha: quantise(alpha), beta: quantise(beta), gamma: quantise(gamma) };
            coefficients.count += 1;
        }
        coefficients
    }
}

/// Coefficients lie strictly between zero and one; the conversion saturates at the edge.
fn quantise(coefficient: f64) -> i32 {
    libm::round(coefficient * f64::from(1_u32 << FRACTION)) as i32
}

impl Cascade {
    /// Takes a sample, gives the filtered one; beyond ±[`FULL_SCALE`] the sample is limited.
    #[inline]
    pub fn process(&mut self, coefficients: &Coefficients, sample: i32) -> i32 {
        let mut x = sample.clamp(-FULL_SCALE, FULL_SCALE);
        if let Some(alpha) = coefficients.first_order {
            let d = product(alpha, x - rounded_down::<FRACTION>(self.first_order));
            let y = self.first_order + d;
            self.first_order = y + d;
            x = rounded_down::<FRACTION>(y);
        }
        for (section, [s1, s2]) in coefficients.sections.iter().zip(&mut self.sections).take(coefficients.count) {
            let s1_now = rounded_down::<{ FRACTION - 1 }>(*s1);
            let v = x - rounded_down::<FRACTION>(*s2);
            let d = product(section.alpha, s1_now) + product(section.beta, v);
            // In this state's format, with one fraction bit less, the sum counts twice: the 2 of the recurrence.
            *s1 += product(section.alpha, v) - product(section.gamma, s1_now);
            let y = *s2 + d;
            *s2 = y + d;
            x = rounded_down::<FRACTION>(y);
        }
        x
    }

    /// Puts the channel into the steady state of a constant input, so that a recording which starts there has no
    /// transient. Beyond ±[`FULL_SCALE`] the value is limited.
    pub fn reset_to(&mut self, value: i32) {
        let value = i64::from(value.clamp(-FULL_SCALE, FULL_SCALE)) << FRACTION;
        *self = Self { first_order: value, sections: [[0, value]; MAX_SECTIONS] };
    }
}

#[inline(always)]
fn product(coefficient: i32, value: i32) -> i64 {
    i64::from(coefficient) * i64::from(value)
}

/// The sample in a state: what is below its last bit stays in the state. It fits, see the module's doc.
#[inline(always)]
fn rounded_down<const BITS: u32>(state: i64) -> i32 {
    (state >> BITS) as i32
}
