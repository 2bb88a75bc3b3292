//! Forward-mode differentiation with respect to the two states, current and speed.
//!
//! A [`Gradient`] carries a value and its derivatives ∂/∂i and ∂/∂ω. Evaluating the equations of motion in gradients
//! yields the exact 2 × 2 Jacobian that the implicit stepper needs, for the base model and for every effect alike,
//! without a derivative written by hand anywhere.

use core::cmp::Ordering;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use crate::scalar::Scalar;

/// A number with its derivatives by current and by speed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Gradient<S> {
    /// The value.
    pub value: S,
    /// ∂/∂i.
    pub by_current: S,
    /// ∂/∂ω.
    pub by_speed: S,
}

impl<S: Scalar<Base = S>> Gradient<S> {
    /// The current itself, as an independent variable.
    #[inline(always)]
    pub fn current(value: S) -> Self {
        Self { value, by_current: S::ONE, by_speed: S::ZERO }
    }
    /// The speed itself, as an independent variable.
    #[inline(always)]
    pub fn speed(value: S) -> Self {
        Self { value, by_current: S::ZERO, by_speed: S::ONE }
    }
    /// A function of this number with the given value and slope there (chain rule).
    #[inline(always)]
    fn through(self, value: S, slope: S) -> Self {
        Self { value, by_current: self.by_current * slope, by_speed: self.by_speed * slope }
    }
}

impl<S: Scalar<Base = S>> PartialOrd for Gradient<S> {
    #[inline(always)]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl<S: Scalar<Base = S>> Add for Gradient<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self {
            value: self.value + o.value,
            by_current: self.by_current + o.by_current,
            by_speed: self.by_speed + o.by_speed,
        }
    }
}

impl<S: Scalar<Base = S>> Sub for Gradient<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self {
            value: self.value - o.value,
            by_current: self.by_current - o.by_current,
            by_speed: self.by_speed - o.by_speed,
        }
    }
}

impl<S: Scalar<Base = S>> Mul for Gradient<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self {
            value: self.value * o.value,
            by_current: self.by_current * o.value + self.value * o.by_current,
            by_speed: self.by_speed * o.value + self.value * o.by_speed,
        }
    }
}

impl<S: Scalar<Base = S>> Div for Gradient<S> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        let inverse = S::ONE / o.value;
        let value = self.value * inverse;
        Self {
            value,
            by_current: (self.by_current - value * o.by_current) * inverse,
            by_speed: (self.by_speed - value * o.by_speed) * inverse,
        }
    }
}

impl<S: Scalar<Base = S>> Neg for Gradient<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { value: -self.value, by_current: -self.by_current, by_speed: -self.by_speed }
    }
}

impl<S: Scalar<Base = S>> AddAssign for Gradient<S> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<S: Scalar<Base = S>> SubAssign for Gradient<S> {
    #[inline(always)]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

impl<S: Scalar<Base = S>> Scalar for Gradient<S> {
    type Base = S;
    #[inline(always)]
    fn lift(value: S) -> Self {
        Self { value, by_current: S::ZERO, by_speed: S::ZERO }
    }
    #[inline(always)]
    fn value(self) -> S {
        self.value
    }
    const ZERO: Self = Self { value: S::ZERO, by_current: S::ZERO, by_speed: S::ZERO };
    const ONE: Self = Self { value: S::ONE, by_current: S::ZERO, by_speed: S::ZERO };
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::lift(S::constant(value))
    }
    #[inline(always)]
    fn times(self, factor: S) -> Self {
        self.through(self.value * factor, factor)
    }
    #[inline(always)]
    fn plus(self, term: S) -> Self {
        Self { value: self.value + term, ..self }
    }
    #[inline(always)]
    fn inverse(self) -> Self {
        let value = S::ONE / self.value;
        self.through(value, -(value * value))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.through(self.value.abs(), if self.value < S::ZERO { -S::ONE } else { S::ONE })
    }
    #[inline]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.through(root, S::constant(0.5) / root)
    }
    #[inline]
    fn inverse_fourth_root(self) -> Self {
        let root = self.value.inverse_fourth_root();
        let square = root * root;
        self.through(root, S::constant(-0.25) * root * (square * square))
    }
    #[inline]
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.through(value, value)
    }
    #[inline]
    fn ln(self) -> Self {
        self.through(self.value.ln(), S::ONE / self.value)
    }
    #[inline]
    fn tanh(self) -> Self {
        let value = self.value.tanh();
        self.through(value, S::ONE - value * value)
    }
    #[inline]
    fn atan(self) -> Self {
        self.through(self.value.atan(), S::ONE / (S::ONE + self.value * self.value))
    }
    #[inline]
    fn cos(self) -> Self {
        self.through(self.value.cos(), -self.value.sin())
    }
    #[inline]
    fn sin(self) -> Self {
        self.through(self.value.sin(), self.value.cos())
    }
    #[inline]
    fn round(self) -> Self {
        Self::lift(self.value.round())
    }
    #[inline(always)]
    fn is_finite(self) -> bool {
        self.value.is_finite() && self.by_current.is_finite() && self.by_speed.is_finite()
    }
}
