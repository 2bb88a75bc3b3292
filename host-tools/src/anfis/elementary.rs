//! Logarithm and exponential of whole columns. Without branches and calls, the loops become vector instructions, which
//! the standard library's functions, called number by number, do not.

use std::f64::consts::LOG2_E;

/// The bits of 1/√2, where the mantissa's interval begins.
const START: u64 = 0x3fe6_a09e_667f_3bcd;
const MANTISSA: u64 = (1 << 52) - 1;
/// Added to the exponent so that it is positive.
const LIFT: u64 = 1024;
/// The bits of 2^52: with a whole number below as its last bits it is 2^52 plus that.
const WHOLE: u64 = 0x4330_0000_0000_0000;
/// 1.5 · 2^52: what is added to it is rounded to a whole number.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// ln 2 in two parts, the first with 21 zeros at its end, so that its multiples are exact.
const LN_2_HIGH: f64 = 0.693_147_180_369_123_8;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// ln of positive normal numbers: e ln 2 + 2 artanh((m − 1)/(m + 1)), the series up to s^19 with |s| < 0.172.
#[inline(always)]
pub fn ln(values: &mut [f64]) {
    for v in values {
        let bits = v.to_bits();
        let m = f64::from_bits((bits.wrapping_sub(START) & MANTISSA) + START);
        let lifted = bits.wrapping_sub(START).wrapping_add(LIFT << 52) >> 52;
        let e = f64::from_bits(lifted | WHOLE) - ((1_u64 << 52) + LIFT) as f64;
        let s = (m - 1.0) / (m + 1.0);
        let q = s * s;
        let series = [19.0, 17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0].iter().fold(0.0, |sum, k| (sum + 1.0 / k) * q);
        *v = e * LN_2_HIGH + (2.0 * s * (1.0 + series) + e * LN_2_LOW);
    }
}

/// e^x of numbers within ±700: 2^n e^r, the series up to r^12 with |r| < 0.347.
#[inline(always)]
pub fn exp(values: &mut [f64]) {
    for v in values {
        let rounded = *v * LOG2_E + ROUND;
        let n = rounded - ROUND;
        let r = (*v - n * LN_2_HIGH) - n * LN_2_LOW;
        let series = [12.0, 11.0, 10.0, 9.0, 8.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0]
            .iter()
            .fold(1.0, |sum: f64, k: &f64| 1.0 + sum * r * (1.0 / k));
        *v = series * f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::LN_2;

    use super::{LN_2_HIGH, LN_2_LOW, exp, ln};

    #[test]
    fn agree_with_the_standard_library() {
        assert_eq!(LN_2_HIGH + LN_2_LOW, LN_2);
        let mut values: Vec<f64> = (0..200_000).map(|k| (f64::from(k) / 145.0 - 690.0).exp()).collect();
        let logarithms: Vec<f64> = values.iter().map(|v| v.ln()).collect();
        ln(&mut values);
        for (own, expected) in values.iter().zip(&logarithms) {
            // Some roundings of either.
            assert!((own - expected).abs() <= 4e-16 * expected.abs().max(1.0), "{own} {expected}");
        }
        let mut powers = logarithms.clone();
        exp(&mut powers);
        for (own, x) in powers.iter().zip(&logarithms) {
            // The same, and the last digit of x itself.
            assert!((own / x.exp() - 1.0).abs() < 1e-15 + 1e-16 * x.abs(), "{x}");
        }
    }
}
