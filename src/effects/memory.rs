//! What effects that remember have in common: slow changes, lags, and the angle of the rotor.

use super::{Memory, Passed};
use crate::motor::Balance;
use crate::scalar::Scalar;
use core::f64::consts::TAU;

/// Below this ratio of step to time constant [`decay`] takes the power series, which does not cancel.
const SHORT: f64 = 0.02;

/// How far a lag is behind, in the unit of its input (A/s, rad/s), below which it has arrived. It would fade on in
/// subnormal numbers while the input rests, which a desktop's processor is slow with.
const ARRIVED: f64 = 1e-30;

/// The memory of [`turn`] at the angle zero.
pub const AT_ZERO_ANGLE: Memory<f64> = [0.0, 1.0, 0.0, 0.0];

/// Adds to the first value of a memory an increment that may be less than a rounding unit; what rounding loses is kept
/// in the second (Kahan's compensated summation).
#[inline(always)]
pub fn accumulate<S: Scalar<Base = S>>(memory: &mut Memory<S>, increment: S) {
    let corrected = increment - memory[1];
    let next = memory[0] + corrected;
    memory[1] = (next - memory[0]) - corrected;
    memory[0] = next;
}

/// Mean square of the current over a step in which it goes straight, A².
#[inline(always)]
pub fn mean_square<S: Scalar<Base = S>>(passed: &Passed<S>) -> S {
    let (before, after) = (passed.before.current, passed.after.current);
    (before * before + before * after + after * after) * S::constant(1.0 / 3.0)
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

/// What is left of how far a lag is behind.
#[inline(always)]
fn still_behind<S: Scalar<Base = S>>(distance: S) -> S {
    if distance.abs() < S::constant(ARRIVED) { S::ZERO } else { distance }
}

/// A first-order lag after a step of x time constants in which its input went straight from `before` to `after`.
#[inline(always)]
pub fn lagged<S: Scalar<Base = S>>(lag: S, before: S, after: S, x: S) -> S {
    let (left, mean) = decay(x);
    after - (after - before) * mean - still_behind(before - lag) * left
}

/// Lets the rate of the current, di/dt, be followed with a lag of T, s: g of `T dg/dt = di/dt − g`, A/s.
///
/// A memory holds g at the end of the step, the weight of g at the begin of a step in its mean over the step, and g in
/// the middle of the step that has passed. The lag is solved exactly for a current that is straight within the step.
#[inline(never)]
pub fn follow_rate<S: Scalar<Base = S>>(lag: S, passed: &Passed<S>, memory: &mut Memory<S>) {
    if lag <= S::ZERO {
        return;
    }
    let rate = (passed.after.current - passed.before.current) / passed.interval;
    let half = S::constant(0.5);
    let (left, mean) = decay(half * passed.interval / lag);
    let behind = still_behind(memory[0] - rate);
    *memory = [rate + behind * left * left, half * (S::ONE + left) * mean, rate + behind * left, S::ZERO];
}

/// What [`follow_rate`] remembers, as of the half step before and after the present point.
#[inline(always)]
pub fn around_point<S: Scalar<Base = S>>(memory: &Memory<S>) -> Memory<S> {
    [memory[2], memory[1], memory[2], S::ZERO]
}

/// Flux that lags a series motor's current by T, s, and with it a share χ of the inductance, as means over the step
/// ahead; the memory is that of [`follow_rate`].
///
/// With `T dφ/dt = F(i) − φ` and g as there, φ = F(i − T g) to first order in T g, and the voltage of the lagging
/// inductance is χ L g. Within a step of constant di/dt, g has the mean m g + (1 − m) di/dt, of which the second part
/// belongs to the coefficient of di/dt: an inductance of (1 − χ m) L, and a lag of (1 − m) T that is left to
/// [`crate::motor::Motor::slopes`].
#[inline(never)]
pub fn lag_flux<N: Scalar>(lag: N, linked: N::Base, memory: &Memory<N::Base>, balance: &mut Balance<N>) {
    let [rate, weight, ..] = *memory;
    balance.flux_lag += lag.times(N::Base::ONE - weight);
    balance.magnetising -= lag.times(weight * rate) * balance.flux_slope / balance.flux;
    balance.voltage += balance.inductance.times(linked * weight * rate);
    balance.inductance = balance.inductance.times(N::Base::ONE - linked * weight);
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
