//! Powers and saturation, the two operations of which `f32` has a form of its own.
//!
//! # v^b in `f32`
//!
//! v^b = 2^(b log2 v). The exponent field of v gives the whole part e, and the mantissa m in \[1/√2, √2) the rest:
//!
//! ```text
//! log2 v = e + s (c0 + c1 s²)          s = (m − 1)/(m + 1), |s| < 0.172
//! 2^p    = 2^⌊p⌋ q(1 + p − ⌊p⌋)        q of degree 4 on [1, 2)
//! ```
//!
//! with the coefficients that make the largest error smallest (by iteratively reweighted least squares on Chebyshev points,
//! then rounded to `f32`).
//!
//! The error of t = v^b: |Δt/t| ≤ ln 2 (b ([`LOG2_ERROR`] + ε e) + ε |b log2 v|) + [`EXP2_ERROR`], ε = 2^-24 from the rounding
//! of the sum and of the product. Since μ = 1/(1 + t) and t/(1 + t)² ≤ 1/4, |Δμ| ≤ |Δt/t|/4: for b = 2 at most
//! 2.6e-6 and the rounding.
//!
//! No step branches, so that every argument takes the same time; conversions to integers saturate, which keeps 0 and
//! +∞ in range.

use crate::scalar::Scalar;

/// Half the width of the trained box in the units that the network computes in: 2^24, so that an `f32` inside the box keeps
/// all its digits as an integer, and one saturating instruction clamps it.
pub(super) const BOX: f64 = 16_777_216.0;

/// Largest error of the polynomial for log2 in `f32`, rounding included.
pub const LOG2_ERROR: f64 = 5.8e-6;
/// Largest relative error of the polynomial for 2^p in `f32`, rounding included.
pub const EXP2_ERROR: f64 = 2.8e-6;

/// A number type that the network can be evaluated in.
pub trait Kernel: Scalar {
    /// What 1 in the exponent of 2 is, as [`Kernel::exp2`] wants it: 2^23 in `f32`.
    const EXPONENT: f64;
    /// The nearest number within ±2^24; NaN becomes 0, which the caller has to notice.
    fn saturate(self) -> Self;
    /// log2 v of v ≥ 0; for 0 some number below −126.
    fn log2(self) -> Self;
    /// 2^(p/[`Kernel::EXPONENT`]), within 2^-32 to 2^32.
    fn exp2(self) -> Self;
}

impl Kernel for f32 {
    const EXPONENT: f64 = 8_388_608.0;

    #[inline(always)]
    fn saturate(self) -> Self {
        (self as i32).clamp(-(1 << 24), (1 << 24) - 1) as Self
    }

    #[inline(always)]
    fn log2(self) -> Self {
        /// The bits of 1/√2, where the mantissa's interval begins.
        const START: i32 = 0x3f35_04f3;
        let offset = self.to_bits().cast_signed() - START;
        let m = Self::from_bits(((offset & 0x007f_ffff) + START).cast_unsigned());
        let s = (m - 1.0) / (m + 1.0);
        (offset >> 23) as Self + s * (s * s * 0.983_534_5 + 2.885_228_6)
    }

    #[inline(always)]
    fn exp2(self) -> Self {
        const MANTISSA: i32 = 0x007f_ffff;
        const ONE: i32 = 0x3f80_0000;
        let p = (self as i32).clamp(-(1 << 28), (1 << 28) - 1);
        let m = Self::from_bits(((p & MANTISSA) | ONE).cast_unsigned());
        let q = (((m * 0.013_534_168 - 0.002_125_211) * m + 0.166_613_39) * m + 0.312_016_04) * m + 0.509_964_2;
        Self::from_bits(q.to_bits().wrapping_add((p & !MANTISSA).cast_unsigned()))
    }
}

/// The reference: `libm` and comparisons.
impl Kernel for f64 {
    const EXPONENT: f64 = 1.0;

    #[inline]
    fn saturate(self) -> Self {
        if self.is_nan() { 0.0 } else { self.clamp(-BOX, BOX) }
    }

    #[inline]
    fn log2(self) -> Self {
        libm::log2(self)
    }

    #[inline]
    fn exp2(self) -> Self {
        libm::exp2(self.clamp(-32.0, 32.0))
    }
}
