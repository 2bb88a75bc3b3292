//! A number of several motors at once: the same operation on each lane, in one vector instruction where the processor
//! has one.
//!
//! Each lane gets the bits that the operation gives by itself. A comparison has one answer for all lanes; where they
//! disagree it gives that of the first, and [`disagreed`] tells so afterwards.

use std::array;
use std::cell::Cell;
use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use greyrig::scalar::Scalar;

/// Lanes that fill a vector register of common processors.
pub const LANES: usize = 4;

thread_local! {
    static DISAGREED: Cell<bool> = const { Cell::new(false) };
}

/// Whether lanes have disagreed in a comparison on this thread since this was last asked.
pub fn disagreed() -> bool {
    DISAGREED.take()
}

#[cold]
#[inline(never)]
fn disagree() {
    DISAGREED.set(true);
}

/// A number of each lane.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(32))]
pub struct Lanes(pub [f64; LANES]);

impl Lanes {
    /// The number that `of` gives for each lane.
    pub fn from_each(of: impl FnMut(usize) -> f64) -> Self {
        Self(array::from_fn(of))
    }

    // By loops over the arrays: the compiler makes one instruction of each, but not of `array::from_fn`.
    #[inline(always)]
    fn map(mut self, f: impl Fn(f64) -> f64) -> Self {
        for x in &mut self.0 {
            *x = f(*x);
        }
        self
    }

    #[inline(always)]
    fn zip(mut self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        for k in 0..LANES {
            self.0[k] = f(self.0[k], other.0[k]);
        }
        self
    }

    #[inline(always)]
    fn compare<T: PartialEq>(&self, other: &Self, f: impl Fn(&f64, &f64) -> T) -> T {
        let first = f(&self.0[0], &other.0[0]);
        let mut agreed = true;
        for k in 1..LANES {
            agreed &= f(&self.0[k], &other.0[k]) == first;
        }
        if !agreed {
            disagree();
        }
        first
    }
}

impl PartialEq for Lanes {
    #[inline(always)]
    fn eq(&self, other: &Self) -> bool {
        self.compare(other, f64::eq)
    }
}

impl PartialOrd for Lanes {
    #[inline(always)]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.compare(other, f64::partial_cmp)
    }
    #[inline(always)]
    fn lt(&self, other: &Self) -> bool {
        self.compare(other, f64::lt)
    }
    #[inline(always)]
    fn le(&self, other: &Self) -> bool {
        self.compare(other, f64::le)
    }
    #[inline(always)]
    fn gt(&self, other: &Self) -> bool {
        self.compare(other, f64::gt)
    }
    #[inline(always)]
    fn ge(&self, other: &Self) -> bool {
        self.compare(other, f64::ge)
    }
}

macro_rules! operator {
    ($($trait:ident $function:ident),*) => {
        $(impl $trait for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                self.zip(other, f64::$function)
            }
        })*
    };
}

operator!(Add add, Sub sub, Mul mul, Div div);

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(f64::neg)
    }
}

impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Lanes {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

macro_rules! functions {
    ($($function:ident),*) => {
        $(#[inline(always)]
        fn $function(self) -> Self {
            self.map(Scalar::$function)
        })*
    };
}

impl Scalar for Lanes {
    type Base = Self;
    #[inline(always)]
    fn lift(value: Self) -> Self {
        value
    }
    #[inline(always)]
    fn value(self) -> Self {
        self
    }
    const ZERO: Self = Self([0.0; LANES]);
    const ONE: Self = Self([1.0; LANES]);
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self([value; LANES])
    }
    #[inline(always)]
    fn times(self, factor: Self) -> Self {
        self * factor
    }
    #[inline(always)]
    fn plus(self, term: Self) -> Self {
        self + term
    }
    functions!(inverse, abs, exp, ln, tanh, atan, cos, sin, round);
    // The core's square root is the processor's, but of one number, hidden from the compiler. IEEE 754 rounds every
    // square root correctly, so that these bits are the core's.
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(f64::sqrt)
    }
    #[inline(always)]
    fn inverse_fourth_root(self) -> Self {
        self.sqrt().sqrt().inverse()
    }
    fn is_finite(self) -> bool {
        self.0.iter().all(|x| x.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Roots are computed by other instructions than the core's.
    #[test]
    fn roots_have_the_bits_of_the_core() {
        let mut x = f64::from_bits(1);
        while x.is_finite() {
            let four = [x, x * 1.1, x * 1.7, x * 0.3];
            let (root, fourth) = (Lanes(four).sqrt(), Lanes(four).inverse_fourth_root());
            for (k, one) in four.into_iter().enumerate() {
                assert_eq!(root.0[k].to_bits(), Scalar::sqrt(one).to_bits(), "{one:e}");
                assert_eq!(fourth.0[k].to_bits(), Scalar::inverse_fourth_root(one).to_bits(), "{one:e}");
            }
            x *= 1.37;
            x = if x < f64::MIN_POSITIVE { x + f64::MIN_POSITIVE / 64.0 } else { x };
        }
    }
}
