//! The shared exponential against `libm`'s, whose results lie within 1 ulp of the true ones: two good results may be 2
//! apart.

use greyrig::scalar::{Scalar, root};

const ULPS: u64 = 2;

#[test]
fn the_exponential_in_single_precision() {
    // Every 997th of all numbers, infinities and NaN included: 4.3 million.
    for bits in (0..=u32::MAX).step_by(997) {
        let x = f32::from_bits(bits);
        let (expected, found) = (libm::exp(f64::from(x)) as f32, Scalar::exp(x));
        // Below the smallest normal number it is zero.
        let expected = if expected < f32::MIN_POSITIVE { 0.0 } else { expected };
        assert!(
            (expected.is_nan() && found.is_nan()) || u64::from(found.to_bits().abs_diff(expected.to_bits())) <= ULPS,
            "exp({x:e}) = {found:e}, not {expected:e}"
        );
    }
}

#[test]
fn the_exponential_in_double_precision() {
    let mut x = -750.0_f64;
    while x < 715.0 {
        let (expected, found) = (libm::exp(x), Scalar::exp(x));
        assert!(found.to_bits().abs_diff(expected.to_bits()) <= ULPS, "exp({x}) = {found:e}, not {expected:e}");
        x += 0.000_713;
    }
}

#[test]
fn the_inverse_fourth_root() {
    // Every 997th of the positive normal numbers.
    for bits in (f32::MIN_POSITIVE.to_bits()..f32::INFINITY.to_bits()).step_by(997) {
        let x = f32::from_bits(bits);
        let (expected, found) = (f64::from(x).powf(-0.25) as f32, x.inverse_fourth_root());
        assert!(u64::from(found.to_bits().abs_diff(expected.to_bits())) <= ULPS, "{x:e}: {found:e}, not {expected:e}");
        let double = f64::from(x).inverse_fourth_root();
        assert!((double / f64::from(x).powf(-0.25) - 1.0).abs() < 4.0 * f64::EPSILON, "{x:e}: {double:e}");
    }
    assert_eq!(f32::INFINITY.inverse_fourth_root(), 0.0);
    assert!(f32::NAN.inverse_fourth_root().is_nan());
}

#[test]
fn the_root() {
    // Every 997th of the positive normal numbers.
    for bits in (f32::MIN_POSITIVE.to_bits()..f32::INFINITY.to_bits()).step_by(997) {
        let x = f32::from_bits(bits);
        let (expected, found) = (x.sqrt(), root(x));
        assert!(found.to_bits().abs_diff(expected.to_bits()) <= 1, "{x:e}: {found:e}, not {expected:e}");
    }
    assert_eq!((root(0.0), root(f32::MAX), root(f32::INFINITY)), (0.0, f32::MAX.sqrt(), f32::INFINITY));
    assert_eq!(root(-1.0), 0.0);
    // Any NaN, with its sign set or not: processors make the one of 0/0 with it.
    for bits in [0x7FC0_0000, 0x7F80_0001, 0x7FFF_FFFF, 0xFFC0_0000, 0xFF80_0001, 0xFFFF_FFFF] {
        assert!(root(f32::from_bits(bits)).is_nan(), "{bits:#x}");
        assert!(f32::from_bits(bits).inverse_fourth_root().is_nan(), "{bits:#x}");
    }
}

#[test]
fn the_ends_of_the_numbers() {
    assert!(Scalar::exp(f64::NAN).is_nan() && Scalar::exp(f32::NAN).is_nan());
    assert_eq!((Scalar::exp(f64::INFINITY), Scalar::exp(f32::INFINITY)), (f64::INFINITY, f32::INFINITY));
    assert_eq!((Scalar::exp(f64::NEG_INFINITY), Scalar::exp(f32::NEG_INFINITY)), (0.0, 0.0));
    for tiny in [0.0, -0.0, 1e-300, -1e-300, f64::MIN_POSITIVE] {
        assert_eq!(Scalar::exp(tiny), 1.0);
    }
}
