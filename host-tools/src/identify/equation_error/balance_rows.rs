//! The rows of both balances of a recording, formed while the slopes of its samples pass by: of what goes by at the
//! sampling rate nothing is kept but a running sum, so that it stays in the processor's nearest memory.

use greyrig::butterworth::{Cascade, Coefficients};
use greyrig::scalar::Scalar;

use crate::identify::regression::SlidingMean;

/// Values that take effect at some samples.
struct AtSamples<S> {
    /// Samples, in their order, and values.
    all: Vec<(usize, S)>,
    /// How many of them have been passed.
    passed: usize,
}

impl<S: Copy> AtSamples<S> {
    fn new(all: Vec<(usize, S)>) -> Self {
        debug_assert!(all.is_sorted_by_key(|(at, _)| *at));
        Self { all, passed: 0 }
    }

    /// The next value, if it is one of this sample.
    #[inline(always)]
    fn next_at(&mut self, n: usize) -> Option<S> {
        let (_, value) = self.all.get(self.passed).filter(|(at, _)| *at == n)?;
        self.passed += 1;
        Some(*value)
    }
}

/// What the voltage balance leaves over, V, through the filter.
///
/// At a sample that is dλ/di, H, times the central difference of the measured current less the rate that the balance
/// wants, A/s. The central difference is the mean rate over two intervals, and so has to be the model's: Simpson's rule
/// leaves (h R/L)⁴/180 of the voltage of the inductance, the rate at the sample alone (h R/L)²/6.
pub struct VoltageRows<'a, S: Scalar> {
    measured_rates: &'a [f64],
    too_much: AtSamples<S>,
    coefficients: Coefficients<S>,
    cascade: Cascade<S>,
    samples: &'a [usize],
    rows: Vec<S>,
    /// Samples that have passed by.
    passed: usize,
    /// Inductance at the last of them, the rate there, and that before it.
    inductance: S,
    rate: S,
    before: S,
}

impl<'a, S: Scalar> VoltageRows<'a, S> {
    /// From the central differences of the measured current, A/s, and what is left `too_much` at some samples, V, in
    /// their order; there is a row at each of `samples`.
    pub fn new(
        measured_rates: &'a [f64],
        too_much: Vec<(usize, S)>,
        coefficients: Coefficients<S>,
        samples: &'a [usize],
    ) -> Self {
        Self {
            measured_rates,
            too_much: AtSamples::new(too_much),
            coefficients,
            cascade: Cascade::default(),
            samples,
            rows: Vec::with_capacity(samples.len()),
            passed: 0,
            inductance: S::ZERO,
            rate: S::ZERO,
            before: S::ZERO,
        }
    }

    /// Takes inductance, H, and rate, A/s, at the next sample.
    #[inline(always)]
    pub fn take(&mut self, inductance: S, rate: S) {
        // Beyond its ends a signal stays as it is.
        self.before = if self.passed == 0 { rate } else { self.form(rate) };
        (self.inductance, self.rate) = (inductance, rate);
        self.passed += 1;
    }

    /// Forms the sample that has passed by last, from the rate after it, and tells the rate there.
    #[inline(always)]
    fn form(&mut self, after: S) -> S {
        let n = self.passed - 1;
        let modelled_rate = simpson(self.before, self.rate, after);
        let mut left = self.inductance * (S::constant(self.measured_rates[n]) - modelled_rate);
        while let Some(too_much) = self.too_much.next_at(n) {
            left -= too_much;
        }
        if n == 0 {
            self.cascade.reset_to(left);
        }
        let filtered = self.cascade.process(&self.coefficients, left);
        if self.samples.get(self.rows.len()) == Some(&n) {
            self.rows.push(filtered);
        }
        self.rate
    }

    /// The rows, once all samples have passed by.
    pub fn finish(mut self) -> Vec<S> {
        if self.passed > 0 {
            self.form(self.rate);
        }
        self.rows
    }
}

/// Integral of the torque, N m s, from the beginning to each sample by the trapezium rule, and what that lacks.
pub struct Impulse<S> {
    interval: S,
    lacking: AtSamples<S>,
    lacks: S,
    n: usize,
    last: S,
    integral: S,
    sums: Vec<S>,
}

impl<S: Scalar> Impulse<S> {
    /// Over so many samples, `interval` seconds apart; `lacking` tells what the rule lacks, N m s, from some samples
    /// on, in their order.
    pub fn new(samples: usize, interval: S, lacking: Vec<(usize, S)>) -> Self {
        let mut sums = Vec::with_capacity(samples + 1);
        sums.push(S::ZERO);
        Self {
            interval,
            lacking: AtSamples::new(lacking),
            lacks: S::ZERO,
            n: 0,
            last: S::ZERO,
            integral: S::ZERO,
            sums,
        }
    }

    /// Takes the torque, N m, at the next sample.
    #[inline(always)]
    pub fn take(&mut self, torque: S) {
        self.integral += S::constant(0.5) * (self.last + torque) * self.interval;
        self.last = torque;
        while let Some(lacks) = self.lacking.next_at(self.n) {
            self.lacks = lacks;
        }
        self.sums.push(self.sums[self.n] + (self.integral + self.lacks));
        self.n += 1;
    }

    /// Its mean over so many samples.
    pub fn mean_over(self, window: usize) -> SlidingMean<S> {
        SlidingMean::of_sums(self.sums, window)
    }
}

/// Mean over two intervals.
#[inline(always)]
pub fn simpson<S: Scalar>(before: S, at: S, after: S) -> S {
    (before + S::constant(4.0) * at + after) / S::constant(6.0)
}
