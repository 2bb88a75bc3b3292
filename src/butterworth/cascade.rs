//! The filter in floating point; equations in the [module above](super).

use super::MAX_SECTIONS;
use super::design::Design;
use crate::scalar::Scalar;

/// Magnitudes above this are treated like infinities: no state can then overflow, because no section amplifies by
/// more than a hundred (`no_sample_can_poison_the_filter` in the tests).
const MAX_MAGNITUDE: f64 = 1e30;

/// What a filter is: shared by all channels that have the same settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients<S> {
    first_order: Option<S>,
    sections: [Section<S>; MAX_SECTIONS],
    count: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Section<S> {
    alpha: S,
    beta: S,
    gamma: S,
}

/// What a channel remembers. A new one has seen nothing but zeros.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cascade<S> {
    held: S,
    first_order: S,
    sections: [[S; 2]; MAX_SECTIONS],
}

impl<S: Scalar> Coefficients<S> {
    pub(super) fn new(design: &Design) -> Self {
        let mut coefficients = Self {
            first_order: design.first_order().map(S::constant),
            sections: [Section::default(); MAX_SECTIONS],
            count: 0,
        };
        for (section, designed) in coefficients.sections.iter_mut().zip(design.second_order()) {
            *section = Section {
                alpha: S::constant(designed.alpha),
                beta: S::constant(designed.beta),
                gamma: S::constant(designed.gamma),
            };
            coefficients.count += 1;
        }
        coefficients
    }
}

impl<S: Scalar> Cascade<S> {
    /// Takes a sample, gives the filtered one. A sample that is not finite, or above 1e30 in magnitude, counts as a
    /// repetition of the one before.
    #[inline]
    pub fn process(&mut self, coefficients: &Coefficients<S>, sample: S) -> S {
        if usable(sample) {
            self.held = sample;
        }
        let mut x = self.held;
        if let Some(alpha) = coefficients.first_order {
            let d = alpha * (x - self.first_order);
            x = self.first_order + d;
            self.first_order = x + d;
        }
        for (section, [s1, s2]) in coefficients.sections.iter().zip(&mut self.sections).take(coefficients.count) {
            let v = x - *s2;
            let d = section.alpha * *s1 + section.beta * v;
            let e = section.alpha * v - section.gamma * *s1;
            x = *s2 + d;
            *s1 = *s1 + e + e;
            *s2 = x + d;
        }
        x
    }

    /// Puts the channel into the steady state of a constant input, so that a recording which starts there has no
    /// transient. A value that [`Cascade::process`] would not accept counts as zero.
    pub fn reset_to(&mut self, value: S) {
        let value = if usable(value) { value } else { S::ZERO };
        *self = Self { held: value, first_order: value, sections: [[S::ZERO, value]; MAX_SECTIONS] };
    }
}

/// A comparison with a NaN is false.
#[inline(always)]
fn usable<S: Scalar>(sample: S) -> bool {
    sample.abs() <= S::constant(MAX_MAGNITUDE)
}
