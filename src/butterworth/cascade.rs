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

/// What a number of channels remember that are filtered alike, all at once. New ones have seen nothing but zeros.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bank<S, const CHANNELS: usize> {
    held: [S; CHANNELS],
    first_order: [S; CHANNELS],
    sections: [[[S; CHANNELS]; 2]; MAX_SECTIONS],
}

/// A single channel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cascade<S: Scalar>(Bank<S, 1>);

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

impl<S: Scalar, const CHANNELS: usize> Default for Bank<S, CHANNELS> {
    fn default() -> Self {
        let zeros = [S::ZERO; CHANNELS];
        Self { held: zeros, first_order: zeros, sections: [[zeros; 2]; MAX_SECTIONS] }
    }
}

impl<S: Scalar, const CHANNELS: usize> Bank<S, CHANNELS> {
    /// Takes a sample of each channel, gives what was filtered and the filtered ones. A sample that is not finite, or
    /// above 1e30 in magnitude, counts as a repetition of the one before.
    #[inline(always)]
    pub fn process(
        &mut self,
        coefficients: &Coefficients<S>,
        samples: [S; CHANNELS],
    ) -> ([S; CHANNELS], [S; CHANNELS]) {
        // One comparison for all of them; only if it fails, it matters which.
        let mut magnitude = S::ZERO;
        for sample in samples {
            magnitude += sample.abs();
        }
        let mut held = samples;
        if magnitude <= S::constant(MAX_MAGNITUDE) {
            self.held = samples;
        } else {
            self.hold_usable(samples);
            held = self.held;
        }
        let mut x = held;
        // By places: `zip`s of three arrays stay calls where programs are not optimised as a whole.
        if let Some(alpha) = coefficients.first_order {
            let s = &mut self.first_order;
            for n in 0..CHANNELS {
                let d = alpha * (x[n] - s[n]);
                x[n] = s[n] + d;
                s[n] = x[n] + d;
            }
        }
        for (k, [s1, s2]) in self.sections.iter_mut().enumerate() {
            if k == coefficients.count {
                break;
            }
            let section = &coefficients.sections[k];
            for n in 0..CHANNELS {
                let v = x[n] - s2[n];
                let d = section.alpha * s1[n] + section.beta * v;
                let e = section.alpha * v - section.gamma * s1[n];
                x[n] = s2[n] + d;
                s1[n] = s1[n] + e + e;
                s2[n] = x[n] + d;
            }
        }
        (held, x)
    }

    #[cold]
    fn hold_usable(&mut self, samples: [S; CHANNELS]) {
        for (held, sample) in self.held.iter_mut().zip(samples) {
            if usable(sample) {
                *held = sample;
            }
        }
    }

    /// Puts the channels into the steady state of constant inputs, so that a recording which starts there has no
    /// transient. A value that [`Bank::process`] would not accept counts as zero.
    pub fn reset_to(&mut self, values: [S; CHANNELS]) {
        let values = values.map(|value| if usable(value) { value } else { S::ZERO });
        *self = Self { held: values, first_order: values, sections: [[[S::ZERO; CHANNELS], values]; MAX_SECTIONS] };
    }
}

impl<S: Scalar> Cascade<S> {
    /// As [`Bank::process`].
    #[inline]
    pub fn process(&mut self, coefficients: &Coefficients<S>, sample: S) -> S {
        let (_, [filtered]) = self.0.process(coefficients, [sample]);
        filtered
    }

    /// As [`Bank::reset_to`].
    pub fn reset_to(&mut self, value: S) {
        self.0.reset_to([value]);
    }
}

/// A comparison with a NaN is false.
#[inline(always)]
fn usable<S: Scalar>(sample: S) -> bool {
    sample.abs() <= S::constant(MAX_MAGNITUDE)
}
