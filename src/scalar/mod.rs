//! The number type of the model: `f32` on the microcontroller, `f64` where the host fits parameters.
//!
//! Exponential, fourth root and [`root`] are our own (`exponential.rs`, `fourth_root.rs`, `root.rs`), all other
//! functions are those of the pure-Rust `libm`, so that the same input gives the same bits on every machine. `f32::exp`
//! and its kin of the standard library call the system's C library and are not used anywhere in the core.

mod exponential;
mod fourth_root;
mod root;

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

pub use root::root;

/// A real number that the model can be evaluated in.
pub trait Scalar:
    Copy
    + Debug
    + Default
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// The plain number behind this one: itself, or the value type of a [`Gradient`](crate::motor::Gradient).
    type Base: Scalar<Base = Self::Base>;
    /// A plain number as one of this type.
    fn lift(value: Self::Base) -> Self;
    /// The plain number that this one stands for.
    fn value(self) -> Self::Base;
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// The nearest number to a constant.
    fn constant(value: f64) -> Self;
    /// This number times a plain one.
    fn times(self, factor: Self::Base) -> Self;
    /// This number and a plain one.
    fn plus(self, term: Self::Base) -> Self;
    /// One by this number.
    fn inverse(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// `x^(−1/4)` of a positive number.
    fn inverse_fourth_root(self) -> Self;
    /// Exponential.
    fn exp(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
    /// Arc tangent.
    fn atan(self) -> Self;
    /// Cosine of an angle in radians.
    fn cos(self) -> Self;
    /// Sine of an angle in radians.
    fn sin(self) -> Self;
    /// The nearest whole number, halves away from zero.
    fn round(self) -> Self;
    /// Whether the number is neither infinite nor NaN.
    fn is_finite(self) -> bool;
}

macro_rules! scalar {
    ($type:ty, $fourth_root:expr, $sqrt:ident, $exp:ident, $ln:ident, $tanh:ident, $atan:ident, $cos:ident, $sin:ident, $round:ident) => {
        impl Scalar for $type {
            type Base = Self;
            #[inline(always)]
            fn lift(value: Self) -> Self {
                value
            }
            #[inline(always)]
            fn value(self) -> Self {
                self
            }
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            #[inline(always)]
            fn constant(value: f64) -> Self {
                value as $type
            }
            #[inline(always)]
            fn times(self, factor: Self) -> Self {
                self * factor
            }
            #[inline(always)]
            fn plus(self, term: Self) -> Self {
                self + term
            }
            #[inline(always)]
            fn inverse(self) -> Self {
                1.0 / self
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$type>::abs(self)
            }
            #[inline]
            fn sqrt(self) -> Self {
                libm::$sqrt(self)
            }
            #[inline(always)]
            fn inverse_fourth_root(self) -> Self {
                $fourth_root(self)
            }
            #[inline(always)]
            fn exp(self) -> Self {
                exponential::$exp(self)
            }
            #[inline]
            fn ln(self) -> Self {
                libm::$ln(self)
            }
            #[inline]
            fn tanh(self) -> Self {
                libm::$tanh(self)
            }
            #[inline]
            fn atan(self) -> Self {
                libm::$atan(self)
            }
            #[inline]
            fn cos(self) -> Self {
                libm::$cos(self)
            }
            #[inline]
            fn sin(self) -> Self {
                libm::$sin(self)
            }
            #[inline]
            fn round(self) -> Self {
                libm::$round(self)
            }
            #[inline(always)]
            fn is_finite(self) -> bool {
                <$type>::is_finite(self)
            }
        }
    };
}

scalar!(f32, fourth_root::inverse, sqrtf, single, logf, tanhf, atanf, cosf, sinf, roundf);
scalar!(f64, |x: f64| 1.0 / libm::sqrt(libm::sqrt(x)), sqrt, double, log, tanh, atan, cos, sin, round);
