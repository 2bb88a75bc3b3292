//! Powers and saturation, the two operations of which `f32` has a form of its own.
//!
//! # v^b in `f32`
//!
//! v^b = 2^(b log2 v). The exponent field of √2 v gives a whole number e, and its mantissa m in \[1, 2) the rest:
//!
//! ```text
//! log2 v = e + s (c0 + c1 s²)          s = (m − √2)/(m + √2), |s| < 0.172
//! U 2^p  = 2^⌊p⌋ q(1 + p − ⌊p⌋)        q of degree 4 on [1, 2), its leading coefficient 1
//! ```
//!
//! with the coefficients that make the largest error smallest (by iteratively reweighted least squares on Chebyshev
//! points, then rounded to `f32`). The factor √2 is in the scale of z, where it costs nothing; without it 1/2 would
//! have to be added to e.
//!
//! The error of t = v^b: |Δt/t| ≤ ln 2 (b ([`LOG2_ERROR`] + ε e) + ε |b log2 v|) + [`EXP2_ERROR`], ε = 2^-24 from the
//! rounding of the sum and of the product. Since μ = 1/(1 + t) and t/(1 + t)² ≤ 1/4, |Δμ| ≤ |Δt/t|/4: for b = 2 at most
//! 2.6e-6 and the rounding.
//!
//! No step branches, so that every argument takes the same time; conversions to integers saturate, which keeps 0 and
//! +∞ in range.

use core::f32::consts::SQRT_2;

use crate::scalar::Scalar;

/// Half the width of the trained box in the units that the network computes in: 2^24, so that an `f32` inside the box
/// keeps all its digits as an integer, and one saturating instruction clamps it.
pub(super) const BOX: f64 = 16_777_216.0;

/// Largest error of the polynomial for log2 in `f32`, rounding included.
pub const LOG2_ERROR: f64 = 5.8e-6;
/// Largest relative error of the polynomial for 2^p in `f32`, rounding included.
pub const EXP2_ERROR: f64 = 2.8e-6;

/// A number type that the network can be evaluated in.
pub trait Kernel: Scalar {
    /// What 1 in the exponent of 2 is, as [`Kernel::scaled_exp2`] wants it: 2^26 in `f32`.
    const EXPONENT: f64;
    /// The nearest number within ±2^24; NaN becomes 0, which the caller has to notice.
    fn saturate(self) -> Self;
    /// log2(v/√2) of v ≥ 0; for 0 some number below −126.
    fn log2_over_root_two(self) -> Self;
    /// U of [`Kernel::scaled_exp2`].
    const UNIT: f64;
    /// U 2^(p/[`Kernel::EXPONENT`]), within U 2^-32 to U 2^32: a factor that all memberships share drops out of the
    /// network.
    fn scaled_exp2(self) -> Self;
}

impl Kernel for f32 {
    /// A conversion to an integer then saturates at 2^±32.
    const EXPONENT: f64 = 67_108_864.0;
    const UNIT: f64 = 73.887_07;

    #[inline(always)]
    fn saturate(self) -> Self {
        (self as i32).clamp(-(1 << 24), (1 << 24) - 1) as Self
    }

    #[inline(always)]
    fn log2_over_root_two(self) -> Self {
        const WHOLE: f32 = 8_388_608.0;
        const OFFSET: f32 = WHOLE + 127.0;
        let bits = self.to_bits();
        let exponent = Self::from_bits(WHOLE.to_bits() | (bits >> MANTISSA_BITS)) - OFFSET;
        let m = Self::from_bits(with_mantissa_of(bits));
        let s = (m - SQRT_2) / (m + SQRT_2);
        exponent + s * (s * s * 0.983_534_5 + 2.885_228_6)
    }

    #[inline(always)]
    fn scaled_exp2(self) -> Self {
        let p = self as i32;
        let m = Self::from_bits(with_mantissa_of((p >> 3).cast_unsigned()));
        let q = (((m - 0.157_025_62) * m + 12.310_574) * m + 23.053_95) * m + 37.679_764;
        let whole = p >> (MANTISSA_BITS + 3);
        Self::from_bits(q.to_bits().wrapping_add((whole << MANTISSA_BITS).cast_unsigned()))
    }
}

const MANTISSA_BITS: u32 = 23;

/// The bits of the number in [1, 2) with the mantissa in these.
#[inline(always)]
fn with_mantissa_of(bits: u32) -> u32 {
    (bits & ((1 << MANTISSA_BITS) - 1)) | 1.0_f32.to_bits()
}

/// The reference: `libm` and comparisons.
impl Kernel for f64 {
    const EXPONENT: f64 = 1.0;
    const UNIT: f64 = 1.0;

    #[inline]
    fn saturate(self) -> Self {
        if self.is_nan() { 0.0 } else { self.clamp(-BOX, BOX) }
    }

    #[inline]
    fn log2_over_root_two(self) -> Self {
        libm::log2(self) - 0.5
    }

    #[inline]
    fn scaled_exp2(self) -> Self {
        libm::exp2(self.clamp(-32.0, 32.0))
    }
}
