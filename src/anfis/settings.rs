//! What the trainer hands over: a network in the units of its inputs and output.

use core::fmt;

use super::kernel::{BOX, Kernel};
use super::network::{Anfis, Consequent, Exponent, Firing, Member, differences};

/// Farthest that a point of the trained box may lie from the centre of a membership function, in widths a: there
/// the bell with b = 2 has fallen to 2^-32.
pub const MAX_WIDTHS: f64 = 256.0;
/// Largest exponent b of a bell.
pub const MAX_EXPONENT: f64 = 16.0;

/// Parameters of one membership function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Premise {
    /// Half the width at μ = 0.5 (bell), or the standard deviation (Gaussian); the input's unit; positive.
    pub a: f64,
    /// Exponent: the larger, the steeper the flanks. Of no meaning to a Gaussian.
    pub b: f64,
    /// Centre, the input's unit.
    pub c: f64,
}

/// Form of the membership functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Shape {
    /// Generalised bell: μ = 1/(1 + |(x − c)/a|^(2b)). If all b of a network are 1, or all are 2, no power is computed.
    #[default]
    Bell,
    /// Gaussian: μ = exp(−(x − c)²/(2a²)).
    Gaussian,
}

/// A trained network: N inputs with M membership functions each, and RULES = M^N rules.
///
/// Rules are in the order of their membership functions, that of the last input varying fastest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings<const N: usize, const M: usize, const RULES: usize> {
    /// Form of the membership functions.
    pub shape: Shape,
    /// Firing operator.
    pub firing: Firing,
    /// Premise parameters, by input.
    pub premise: [[Premise; M]; N],
    /// Consequent parameters p, q, …: of each rule, by input; the output's unit over the input's.
    pub slopes: [[f64; N]; RULES],
    /// Consequent parameter r of each rule, the output's unit.
    pub constants: [f64; RULES],
    /// The trained box, by input: smallest and largest value in the training data. Inputs are clamped to it.
    pub inputs: [(f64, f64); N],
    /// Smallest and largest target in the training data. The output is clamped to it.
    pub output: (f64, f64),
    /// How far outside the box the correction has faded to nothing, as a fraction of the box's width.
    pub margin: f64,
}

/// Settings that no network can be made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SettingsError {
    /// The parameter: a field of [`Settings`] or of [`Premise`].
    pub name: &'static str,
    /// The input that it belongs to, or the rule, from zero.
    pub index: usize,
    /// What it has to be.
    pub required: &'static str,
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, index, required } = self;
        write!(f, "{name} of number {index} has to be {required}")
    }
}

impl core::error::Error for SettingsError {}

/// 2^(1/4): z with it gives z² √2.
const FOURTH_ROOT_OF_TWO: f64 = 1.189_207_115_002_721;

fn check(ok: bool, name: &'static str, index: usize, required: &'static str) -> Result<(), SettingsError> {
    if ok { Ok(()) } else { Err(SettingsError { name, index, required }) }
}

/// Finite in `f32`, too.
fn finite(x: f64) -> bool {
    x.abs() <= 1e30
}

fn range((low, high): (f64, f64)) -> bool {
    finite(low) && finite(high) && low < high
}

impl<const N: usize, const M: usize, const RULES: usize> Settings<N, M, RULES> {
    /// The same with every number rounded to `f32`, as the microcontroller's flash holds it: what is built from these
    /// settings has the same bits on both sides.
    #[must_use]
    pub fn in_single_precision(&self) -> Self {
        let round = |x: f64| f64::from(x as f32);
        let pair = |(low, high): (f64, f64)| (round(low), round(high));
        Self {
            premise: self.premise.map(|input| input.map(|p| Premise { a: round(p.a), b: round(p.b), c: round(p.c) })),
            slopes: self.slopes.map(|rule| rule.map(round)),
            constants: self.constants.map(round),
            inputs: self.inputs.map(pair),
            output: pair(self.output),
            margin: round(self.margin),
            ..*self
        }
    }

    /// Checks the settings and puts them into the form that is computed with, in `f64` whatever `S` is.
    ///
    /// # Errors
    /// The first parameter that is out of its range, among them a membership function so narrow or so far away
    /// that a point of the box lies more than [`MAX_WIDTHS`] from it.
    pub fn build<S: Kernel>(&self) -> Result<Anfis<S, N, M, RULES>, SettingsError> {
        const { assert!(N > 0 && M > 0 && RULES == super::rules(N, M), "RULES has to be M to the power of N") };
        check(range(self.output), "output", 0, "finite, the lower end below the upper one")?;
        check(self.margin >= 1e-3 && self.margin <= 10.0, "margin", 0, "between 0.001 and 10")?;
        for (index, inputs) in self.inputs.iter().enumerate() {
            check(range(*inputs), "inputs", index, "finite, the lower end below the upper one")?;
        }
        let exponent = self.exponent();
        // Its square is what `Kernel::log2_over_root_two` wants.
        let unit = if exponent == Exponent::Free { FOURTH_ROOT_OF_TWO } else { 1.0 };
        // Box coordinates: x = centre + u · half / BOX.
        let centre = self.inputs.map(|(low, high)| 0.5 * (low + high));
        let half = self.inputs.map(|(low, high)| 0.5 * (high - low));
        let mut members = [[Member::default(); M]; N];
        for (index, premise) in self.premise.iter().enumerate() {
            for (member, p) in members[index].iter_mut().zip(premise) {
                check(p.a > 0.0 && finite(p.a), "a", index, "positive and finite")?;
                check(finite(p.c), "c", index, "finite")?;
                let farthest = ((p.c - centre[index]).abs() + half[index]) / p.a;
                check(farthest <= MAX_WIDTHS, "a", index, "at least 1/256 of the way to the farthest end of the box")?;
                let bell = self.shape == Shape::Bell;
                check(!bell || (p.b > 0.0 && p.b <= MAX_EXPONENT), "b", index, "positive and at most 16")?;
                *member = Member {
                    scale: S::constant(unit * half[index] / BOX / p.a),
                    offset: S::constant(unit * (centre[index] - p.c) / p.a),
                    power: S::constant(match self.shape {
                        Shape::Bell => p.b * S::EXPONENT,
                        // exp(−z²/2) = 2^(−z²/(2 ln 2))
                        Shape::Gaussian => 0.5 * core::f64::consts::LOG2_E * S::EXPONENT,
                    }),
                };
            }
        }
        let mut constants = self.constants;
        for (index, constant) in constants.iter_mut().enumerate() {
            let slopes = &self.slopes[index];
            check(slopes.iter().all(|p| finite(*p)), "slopes", index, "finite")?;
            check(finite(*constant), "constants", index, "finite")?;
            // At the centre of the box.
            *constant = slopes.iter().zip(&centre).fold(*constant, |sum, (p, c)| sum + p * c);
        }
        let mut consequents = [Consequent { constant: S::ZERO, slopes: [S::ZERO; N] }; RULES];
        let coded = |mut values: [f64; RULES]| {
            if self.firing == Firing::Product {
                differences(&mut values, M);
            }
            values
        };
        for (consequent, constant) in consequents.iter_mut().zip(coded(constants)) {
            consequent.constant = S::constant(constant);
        }
        for (index, half) in half.iter().enumerate() {
            for (consequent, slope) in consequents.iter_mut().zip(coded(self.slopes.map(|slopes| slopes[index]))) {
                consequent.slopes[index] = S::constant(slope * half / BOX);
            }
        }
        for (index, consequent) in consequents.iter().enumerate() {
            let finite_in_box = consequent.constant.is_finite() && consequent.slopes.iter().all(|p| p.is_finite());
            check(finite_in_box, "slopes", index, "such that the rule's output is finite in the box")?;
        }
        // The margin is a fraction of the whole width, 2 BOX.
        let inverse_margin = 1.0 / (2.0 * BOX * self.margin);
        Ok(Anfis {
            exponent,
            firing: self.firing,
            centre: centre.map(S::constant),
            scale: half.map(|half| S::constant(BOX / half)),
            inverse_margin_squared: S::constant(inverse_margin * inverse_margin),
            members,
            consequents,
            lowest: S::constant(self.output.0),
            highest: S::constant(self.output.1),
        })
    }

    /// The cheapest way to the memberships.
    fn exponent(&self) -> Exponent {
        let all = |b: f64| self.premise.iter().flatten().all(|p| p.b == b);
        match self.shape {
            Shape::Gaussian => Exponent::Gaussian,
            Shape::Bell if all(1.0) => Exponent::One,
            Shape::Bell if all(2.0) => Exponent::Two,
            Shape::Bell => Exponent::Free,
        }
    }
}
