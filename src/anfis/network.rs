//! The network as it is evaluated.

use super::kernel::Kernel;

/// What a network says about a point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Correction<S> {
    /// The output, faded to zero outside the trained box; zero where an input is NaN. Always finite.
    pub value: S,
    /// 1 inside the trained box, falling to 0 at the end of the margin; 0 where an input is NaN or infinite. Below 1
    /// the network is asked about what it has not seen.
    pub validity: S,
}

/// How a rule's memberships become its firing strength.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Firing {
    /// Their product. On a full grid the normalised strength is then a product, too, one factor for each input.
    #[default]
    Product,
    /// Their minimum. It does not factorise: every rule is compared, summed and divided, at some three times the cost.
    Minimum,
}

/// How memberships are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Exponent {
    Free,
    One,
    Two,
    Gaussian,
}

/// A membership function: z = scale · u + offset is (x − c)/a, with a free exponent 2^(1/4) times that.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Member<S> {
    pub scale: S,
    pub offset: S,
    pub power: S,
}

/// The linear function of a rule, of the coordinates within the box.
#[derive(Debug, Clone, Copy)]
pub(super) struct Consequent<S, const N: usize> {
    pub constant: S,
    pub slopes: [S; N],
}

/// A network ready to be evaluated; made by [`Settings::build`](super::Settings::build).
#[derive(Debug, Clone)]
pub struct Anfis<S, const N: usize, const M: usize, const RULES: usize> {
    pub(super) exponent: Exponent,
    pub(super) firing: Firing,
    pub(super) centre: [S; N],
    pub(super) scale: [S; N],
    pub(super) inverse_margin_squared: S,
    pub(super) members: [[Member<S>; M]; N],
    pub(super) consequents: [Consequent<S, N>; RULES],
    pub(super) lowest: S,
    pub(super) highest: S,
}

impl<S: Kernel, const N: usize, const M: usize, const RULES: usize> Anfis<S, N, M, RULES> {
    /// The network's output at a point, and how far it can be relied on.
    #[inline]
    pub fn correct(&self, inputs: [S; N]) -> Correction<S> {
        let mut u = [S::ZERO; N];
        // The squared distance from the box, in units in which the box reaches to ±BOX. A NaN stays one, and
        // an infinity stays infinite.
        let mut outside = S::ZERO;
        for i in 0..N {
            let there = (inputs[i] - self.centre[i]) * self.scale[i];
            u[i] = there.saturate();
            let excess = there - u[i];
            outside += excess * excess;
        }
        let value = match self.firing {
            Firing::Product => self.product(u),
            Firing::Minimum => self.minimum(u),
        };
        let value = if value < self.lowest { self.lowest } else { value };
        let value = if value > self.highest { self.highest } else { value };
        let left = S::ONE - outside * self.inverse_margin_squared;
        let left = if left > S::ZERO { left } else { S::ZERO };
        let validity = left * left;
        Correction { value: value * validity, validity }
    }

    /// Layer 1: 1/μ of each membership function, or the same multiple of all of them; at least 1.
    #[inline(always)]
    fn inverse_memberships(&self, u: [S; N]) -> [[S; M]; N] {
        let each = |inverse: fn(S, &Member<S>) -> S| {
            let mut d = [[S::ZERO; M]; N];
            for i in 0..N {
                for (d, member) in d[i].iter_mut().zip(&self.members[i]) {
                    let z = member.offset + u[i] * member.scale;
                    *d = inverse(z * z, member);
                }
            }
            d
        };
        match self.exponent {
            Exponent::One => each(|z2, _| S::ONE + z2),
            Exponent::Two => each(|z2, _| S::ONE + z2 * z2),
            Exponent::Free => {
                each(|z2, member| S::constant(S::UNIT) + (z2.log2_over_root_two() * member.power).scaled_exp2())
            }
            Exponent::Gaussian => each(|z2, member| (z2 * member.power).scaled_exp2()),
        }
    }

    /// Layer 4's linear function of a rule.
    #[inline(always)]
    fn consequent(&self, rule: usize, u: [S; N]) -> S {
        let Consequent { constant, slopes } = &self.consequents[rule];
        let mut f = *constant;
        for i in 0..N {
            f += slopes[i] * u[i];
        }
        f
    }

    /// Layers 2 to 5 for the product. The normalised firing strength of a rule is the product of its memberships, each
    /// normalised within its input, so the sum over all rules is taken input by input, from the last to the first. The
    /// consequents are [differences](differences).
    #[inline(always)]
    fn product(&self, u: [S; N]) -> S {
        const { assert!(N <= 4, "a level of the sum for each input") };
        let strengths = self.inverse_memberships(u).map(normalised);
        let from_last = |k: usize| N.checked_sub(k).map(|input| strengths[input]);
        let sum = |rule: usize| self.consequent(rule, u);
        let sum = summed(from_last(1), 1, sum);
        let sum = summed(from_last(2), M, sum);
        let sum = summed(from_last(3), M * M, sum);
        let sum = summed(from_last(4), M * M * M, sum);
        sum(0)
    }

    /// Layers 2 to 5 for the minimum.
    #[inline(never)]
    fn minimum(&self, u: [S; N]) -> S {
        let inverse = self.inverse_memberships(u);
        let (mut sum, mut total) = (S::ZERO, S::ZERO);
        for rule in 0..RULES {
            // The smallest membership has the largest inverse.
            let mut largest = S::ONE;
            let mut rest = rule;
            for i in (0..N).rev() {
                let d = inverse[i][rest % M];
                rest /= M;
                if d > largest {
                    largest = d;
                }
            }
            let strength = S::ONE / largest;
            sum += strength * self.consequent(rule, u);
            total += strength;
        }
        sum / total
    }
}

/// μ_j/Σ μ from the inverses d_j = 1/μ_j, by one division: the product of the other d over the sum of such
/// products. With more than four functions those products might overflow, and each is divided.
#[inline(always)]
fn normalised<S: Kernel, const M: usize>(inverse: [S; M]) -> [S; M] {
    let mut mu = [S::ONE; M];
    if M <= 4 {
        let mut before = S::ONE;
        for j in 0..M {
            mu[j] = before;
            before = before * inverse[j];
        }
        let mut after = S::ONE;
        for j in (0..M).rev() {
            mu[j] = mu[j] * after;
            after = after * inverse[j];
        }
    } else {
        for j in 0..M {
            mu[j] = S::ONE / inverse[j];
        }
    }
    let mut total = mu[0];
    for mu in &mu[1..] {
        total += *mu;
    }
    let share = S::ONE / total;
    mu.map(|mu| mu * share)
}

/// The sum over an input whose membership functions are `stride` rules apart, of what the sum over the inputs behind it
/// gives from a rule on.
#[inline(always)]
fn summed<S: Kernel, const M: usize>(
    strengths: Option<[S; M]>,
    stride: usize,
    behind: impl Fn(usize) -> S,
) -> impl Fn(usize) -> S {
    move |rule| {
        let mut sum = behind(rule);
        if let Some(strengths) = strengths {
            #[expect(
                clippy::needless_range_loop,
                reason = "an iterator that skips is not unrolled: twice the instructions"
            )]
            for j in 1..M {
                sum += behind(rule + j * stride) * strengths[j];
            }
        }
        sum
    }
}

/// A value for each rule as differences along each input from that of the first membership function. As an input's
/// normalised memberships ν add to one, Σ ν_j f_j = f_0 + Σ_j>0 ν_j (f_j − f_0), which spares ν_0 and a multiplication
/// for each sum.
pub(super) fn differences<const RULES: usize>(values: &mut [f64; RULES], functions: usize) {
    let mut stride = 1;
    while stride < RULES {
        for rule in (0..RULES).rev() {
            if !(rule / stride).is_multiple_of(functions) {
                values[rule] -= values[rule - rule / stride % functions * stride];
            }
        }
        stride *= functions;
    }
}
