//! The exponential, without divisions, and without branches where arguments usually are: it is the dearest function of
//! the model's smooth steps and of the stepper, and most of a diagnosis went into that of `libm`.
//!
//! `e^x = 2^n · e^r` with `n` the whole number nearest to `x / ln 2`, so that `|r| ≤ ½ ln 2`; `ln 2` is taken off in
//! two parts, of which `n` times the first is exact (Cody and Waite, *Software Manual for the Elementary Functions*,
//! 1980, chapter 6). In double precision `2^n` is multiplied in as two halves, so that results below the smallest
//! normal number and beyond the largest come out as IEEE 754 rounds them; in single precision it is added to the
//! exponent, and results below the smallest normal number are zero. NaN stays NaN.

use core::f32::consts::{LN_2, LOG2_E};

/// Adding and subtracting 1.5 · 2^52 rounds to a whole number, which then stands in the low bits.
const ROUND_F64: f64 = 6_755_399_441_055_744.0;
/// The same for single precision: 1.5 · 2^23.
const ROUND_F32: f32 = 12_582_912.0;

/// `e^x` in double precision, within 1 ulp. The series to `r^13 / 13!` leaves 4·10⁻¹⁸; it is summed in pairs (Estrin),
/// which a processor can overlap.
#[inline(always)]
pub(super) fn double(x: f64) -> f64 {
    /// `ln 2`, the first 33 bits.
    const FIRST: f64 = 6.931_471_803_691_238e-1;
    /// `ln 2` less `FIRST`.
    const REST: f64 = 1.908_214_929_270_587_7e-10;
    let x = x.clamp(-746.0, 710.0);
    let shifted = x * core::f64::consts::LOG2_E + ROUND_F64;
    let n = shifted - ROUND_F64;
    let r = (x - n * FIRST) - n * REST;
    let r2 = r * r;
    let r4 = r2 * r2;
    let low = (1.0 / 2.0 + r * (1.0 / 6.0)) + r2 * (1.0 / 24.0 + r * (1.0 / 120.0));
    let middle = (1.0 / 720.0 + r * (1.0 / 5_040.0)) + r2 * (1.0 / 40_320.0 + r * (1.0 / 362_880.0));
    let high =
        (1.0 / 3_628_800.0 + r * (1.0 / 39_916_800.0)) + r2 * (1.0 / 479_001_600.0 + r * (1.0 / 6_227_020_800.0));
    let series = 1.0 + (r + r2 * (low + r4 * (middle + r4 * high)));
    let n = shifted.to_bits() as i32;
    let half = n >> 1;
    series * power_of_two_f64(half) * power_of_two_f64(n - half)
}

/// `e^x` in single precision, within 1 ulp: a polynomial of degree 6 whose largest relative error is 7.9·10⁻⁸ with the
/// rounding of its evaluation (`2^-24` is 6.0·10⁻⁸).
#[inline]
pub(super) fn single(x: f32) -> f32 {
    /// `ln 2`, the first 9 bits.
    const FIRST: f32 = 355.0 / 512.0;
    /// `ln 2` less `FIRST`.
    const REST: f32 = -2.121_944_4e-4;
    const C: [f32; 5] = [0.499_999_94, 0.166_665_12, 0.041_668_393, 0.008_368_781, 0.001_381_446_6];
    // From 2^-126 to 2^128.
    if (x - LN_2).abs() < 127.0 * LN_2 {
        let shifted = x * LOG2_E + ROUND_F32;
        let n = shifted - ROUND_F32;
        let r = (x - n * FIRST) - n * REST;
        let series = 1.0 + (r + r * r * (C[0] + r * (C[1] + r * (C[2] + r * (C[3] + r * C[4])))));
        f32::from_bits(series.to_bits().wrapping_add(shifted.to_bits() << 23))
    } else if x < 0.0 {
        0.0
    } else {
        x * f32::INFINITY
    }
}

/// `2^n`, `|n| ≤ 1,022`.
#[inline(always)]
fn power_of_two_f64(n: i32) -> f64 {
    f64::from_bits((i64::from(n + 1_023) as u64) << 52)
}
