//! What effects that remember have in common: slow changes, lags, and the angle of the rotor.

use super::{Memory, Passed};
use crate::scalar::Scalar;
use core::f64::consts::TAU;

/// Below this ratio of step to time constant [`decay`] takes the power series, which does not cancel.
const SHORT: f64 = 0.02;

/// The memory of [`turn`] at the angle zero.
pub const AT_ZERO_ANGLE: Memory<f64> = [0.0, 1.0, 0.0, 0.0];

/// Adds to the first value of a memory an increment that may be less than a rounding unit; what rounding loses is kept in
/// the second (Kahan's compensated summation).
#[inline(always)]
pub fn accumulate<S: Scalar<Base = S>>(memory: &mut Memory<S>, increment: S) {
    let corrected = increment - memory[1];
    let next = memory[0] + corrected;
    memory[1] = (next - memory[0]) - corrected;
    memory[0] = next;
}

/// exp(−x) and its mean from 0 to x, (1 − exp(−x))/x, for a step of x time constants.
#[inline(always)]
pub fn decay<S: Scalar<Base = S>>(x: S) -> (S, S) {
    if x < S::constant(SHORT) {
        let mean = S::ONE - x * (S::constant(1.0 / 2.0) - x * (S::constant(1.0 / 6.0) - x * S::constant(1.0 / 24.0)));
        (S::ONE - x * mean, mean)
    } else {
        let left = (-x).exp();
        (left, (S::ONE - left) / x)
    }
}

/// A first-order lag after a step of x time constants in which its input went straight from `before` to `after`.
#[inline(always)]
pub fn lagged<S: Scalar<Base = S>>(lag: S, before: S, after: S, x: S) -> S {
    let (left, mean) = decay(x);
    after - (after - before) * mean - (before - lag) * left
}

/// Turns the angle in the first value of a memory, in rad and wrapped to ±π, by `order` times that of the rotor in a
/// step; its cosine and sine are the second and third value.
#[inline(always)]
pub fn turn<S: Scalar<Base = S>>(order: S, passed: &Passed<S>, memory: &mut Memory<S>) {
    let speed = S::constant(0.5) * (passed.before.speed + passed.after.speed);
    let angle = memory[0] + order * speed * passed.interval;
    let angle = angle - S::constant(TAU) * (angle * S::constant(1.0 / TAU)).round();
    *memory = [angle, angle.cos(), angle.sin(), S::ZERO];
}
