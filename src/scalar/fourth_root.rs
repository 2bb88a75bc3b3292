//! `x^(−1/4)` in single precision without square roots, which the Cortex-M4F has an instruction for but stable Rust no
//! word without an operating system: `libm` computes one in some fifty instructions.

/// `x^(−1/4)` of a positive normal number, within 2 ulp; 0 of infinity, NaN of NaN.
///
/// A quarter of the exponent, negated, is right within 3.2 %. Newton's step for `y^−4 = x`, `y ← y (5 − x y⁴)/4`, makes
/// of an error ε one of 2.5 ε²: 2.5·10⁻³, 1.6·10⁻⁵, and in the last step, which adds the correction so that its
/// rounding does not matter, the last digit.
#[inline]
pub(super) fn inverse(x: f32) -> f32 {
    /// Five quarters of the exponent's offset, less what makes the largest errors above and below alike.
    const START: u32 = 0x4f58_6000;
    if x > f32::MAX {
        return 0.0;
    }
    let mut y = f32::from_bits(START - (x.to_bits() >> 2));
    let quarter = 0.25 * x;
    for _ in 0..2 {
        let square = y * y;
        y *= 1.25 - quarter * (square * square);
    }
    let square = y * y;
    y + y * (0.25 * (1.0 - x * (square * square)))
}
