//! A physical term of the user's own, as a small program for a stack machine that also runs on the microcontroller.
//!
//! A list of operations ([`Op`]) in reverse Polish order is checked once ([`Term::build`]); after that it is evaluated
//! without checks, panics, recursion or memory other than the stack of [`MAX_DEPTH`] numbers:
//!
//! ```
//! use greyrig::term::{Op, Target, Term};
//!
//! // k i |i| with k = 3 V/A², a further voltage drop.
//! let ops = [Op::Unknown(0), Op::Current, Op::Mul, Op::Current, Op::Abs, Op::Mul];
//! let term = Term::<f32>::build(Target::Voltage, &ops, [3.0, 0.0, 0.0, 0.0])?;
//! assert_eq!(term.value(-2.0_f32, 0.0, 0.0), -12.0);
//! # Ok::<(), greyrig::term::TermError>(())
//! ```
//!
//! # Equations
//! ```text
//! electrical   u = R i + K φ ω + L di/dt + v(i, ω, u)              Target::Voltage, v in V
//! mechanical   J dω/dt = K φ i − friction − τ(i, ω, u)             Target::Torque, τ in N m
//! ```
//! v stands on the side of R i, τ on that of the friction: with ω > 0, a positive τ brakes. A term that takes power has
//! v of the sign of i, or τ of the sign of ω.
//!
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | i, ω, u | current, speed, supply voltage | A, rad/s, V |
//! | v, τ | further voltage drop, further braking torque | V, N m |
//!
//! # At zero
//! sign 0 = 0, with slope 0. The slopes of √x and x^y, 0 < y < 1, are infinite at x = 0; there both count as constant,
//! lest a motor that starts at rest starts from NaN. What has no value, such as 1/0 or ln 0, gives an infinity or NaN,
//! and the term with it: that a term is finite wherever the motor gets is up to its author.

use core::fmt;

use crate::scalar::Scalar;

/// Most operations in a term.
pub const MAX_OPS: usize = 32;
/// Most numbers on the stack at a time. A power of two, since the stack pointer is masked rather than checked.
pub const MAX_DEPTH: usize = 8;
/// Most unknown constants in a term.
pub const MAX_UNKNOWNS: usize = 4;

/// Below this, 1/x or its products overflow `f32` on the way to the slope of x^y.
const NO_POWER_BELOW: f64 = 1e-30;

/// Which equation a term enters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Target {
    /// The voltage balance: a further voltage drop, V, on the side of R i.
    #[default]
    Voltage,
    /// The torque balance: a further braking torque, N m, on the side of the friction.
    Torque,
}

/// One operation. x is the top of the stack, or w, x with x on top; the result takes their place.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Op<S> {
    /// Pushes a literal constant.
    Constant(S),
    /// Pushes an unknown constant by its index, below [`MAX_UNKNOWNS`].
    Unknown(u8),
    /// Pushes i, A.
    Current,
    /// Pushes ω, rad/s.
    Speed,
    /// Pushes u, V.
    Voltage,
    /// w + x.
    Add,
    /// w − x.
    Sub,
    /// w x.
    Mul,
    /// w/x.
    Div,
    /// w^x = exp(x ln w) for w ≥ 0 and an x that depends on neither i, ω nor u; NaN for w < 0.
    Pow,
    /// −x.
    Neg,
    /// |x|.
    Abs,
    /// −1, 0 or 1, as x is negative, zero or positive.
    Sign,
    /// √x.
    Sqrt,
    /// e^x.
    Exp,
    /// Natural logarithm.
    Ln,
    /// Hyperbolic tangent.
    Tanh,
    /// Arc tangent, rad.
    Atan,
    /// Sine of x rad.
    Sin,
    /// Cosine of x rad.
    Cos,
    /// x².
    Square,
    /// x^n by repeated squaring, for an x of either sign; x^0 = 1.
    PowI(i8),
}

impl<S> Op<S> {
    /// How many numbers it takes from the stack. Each puts one back.
    pub const fn operands(&self) -> usize {
        match self {
            Self::Constant(_) | Self::Unknown(_) | Self::Current | Self::Speed | Self::Voltage => 0,
            Self::Add | Self::Sub | Self::Mul | Self::Div | Self::Pow => 2,
            _ => 1,
        }
    }

    /// The same operation on another number type.
    pub fn map<T>(self, convert: impl FnOnce(S) -> T) -> Op<T> {
        match self {
            Self::Constant(value) => Op::Constant(convert(value)),
            Self::Unknown(index) => Op::Unknown(index),
            Self::Current => Op::Current,
            Self::Speed => Op::Speed,
            Self::Voltage => Op::Voltage,
            Self::Add => Op::Add,
            Self::Sub => Op::Sub,
            Self::Mul => Op::Mul,
            Self::Div => Op::Div,
            Self::Pow => Op::Pow,
            Self::Neg => Op::Neg,
            Self::Abs => Op::Abs,
            Self::Sign => Op::Sign,
            Self::Sqrt => Op::Sqrt,
            Self::Exp => Op::Exp,
            Self::Ln => Op::Ln,
            Self::Tanh => Op::Tanh,
            Self::Atan => Op::Atan,
            Self::Sin => Op::Sin,
            Self::Cos => Op::Cos,
            Self::Square => Op::Square,
            Self::PowI(power) => Op::PowI(power),
        }
    }
}

/// Operations that no term can be made from; `at` is the index of the first at fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TermError {
    /// No operation at all.
    Empty,
    /// More than [`MAX_OPS`].
    TooLong,
    /// The stack holds fewer numbers than the operation takes.
    Underflow {
        /// Index of the operation.
        at: usize,
    },
    /// More than [`MAX_DEPTH`] numbers on the stack.
    Overflow {
        /// Index of the operation.
        at: usize,
    },
    /// More than one number is left at the end.
    Leftover {
        /// How many are.
        results: usize,
    },
    /// An unknown of an index from [`MAX_UNKNOWNS`].
    UnknownIndex {
        /// Index of the operation.
        at: usize,
    },
    /// The exponent of a [`Op::Pow`] depends on i, ω or u.
    VaryingExponent {
        /// Index of the operation.
        at: usize,
    },
    /// A literal constant that is NaN or infinite in the number type of the term.
    NotFinite {
        /// Index of the operation.
        at: usize,
    },
}

impl fmt::Display for TermError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "the term has no operations"),
            Self::TooLong => write!(f, "the term has more than {MAX_OPS} operations"),
            Self::Underflow { at } => write!(f, "operation {at} lacks an operand"),
            Self::Overflow { at } => write!(f, "operation {at} needs more than {MAX_DEPTH} numbers on the stack"),
            Self::Leftover { results } => write!(f, "the term leaves {results} results instead of one"),
            Self::UnknownIndex { at } => write!(f, "operation {at} asks for an unknown beyond the {MAX_UNKNOWNS}"),
            Self::VaryingExponent { at } => write!(f, "operation {at} has an exponent that is not constant"),
            Self::NotFinite { at } => write!(f, "operation {at} holds a constant that is not a finite number"),
        }
    }
}

impl core::error::Error for TermError {}

/// A checked term, ready to be evaluated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term<S> {
    target: Target,
    /// The first `length` count, the others are as [`Term::build`] fills them.
    ops: [Op<S>; MAX_OPS],
    length: u8,
    unknowns: [S; MAX_UNKNOWNS],
}

impl<S: Scalar<Base = S>> Term<S> {
    /// Checks the operations and rounds constants and unknowns to `S`. Unknowns that no operation asks for do not
    /// count.
    ///
    /// # Errors
    /// The first operation that cannot be executed, or a program that is empty, too long, or leaves several results.
    pub fn build(target: Target, ops: &[Op<f64>], unknowns: [f64; MAX_UNKNOWNS]) -> Result<Self, TermError> {
        if ops.is_empty() {
            return Err(TermError::Empty);
        }
        if ops.len() > MAX_OPS {
            return Err(TermError::TooLong);
        }
        let mut program = [Op::Constant(S::ZERO); MAX_OPS];
        // Of each number on the stack, whether it depends on i, ω or u.
        let mut varies = heapless::Vec::<bool, MAX_DEPTH>::new();
        for (at, (op, slot)) in ops.iter().zip(&mut program).enumerate() {
            *slot = op.map(S::constant);
            let mut result = match *slot {
                Op::Constant(value) if !value.is_finite() => return Err(TermError::NotFinite { at }),
                Op::Unknown(index) if usize::from(index) >= MAX_UNKNOWNS => {
                    return Err(TermError::UnknownIndex { at });
                }
                Op::Current | Op::Speed | Op::Voltage => true,
                _ => false,
            };
            for taken in 0..op.operands() {
                let operand = varies.pop().ok_or(TermError::Underflow { at })?;
                if operand && taken == 0 && matches!(op, Op::Pow) {
                    return Err(TermError::VaryingExponent { at });
                }
                result |= operand;
            }
            varies.push(result).map_err(|_| TermError::Overflow { at })?;
        }
        if varies.len() > 1 {
            return Err(TermError::Leftover { results: varies.len() });
        }
        Ok(Self { target, ops: program, length: ops.len() as u8, unknowns: unknowns.map(S::constant) })
    }

    /// Which equation it enters.
    pub fn target(&self) -> Target {
        self.target
    }

    /// Its operations.
    pub fn ops(&self) -> impl Iterator<Item = Op<S>> + '_ {
        self.ops.iter().copied().take(usize::from(self.length))
    }

    /// The values of the unknown constants.
    pub fn unknowns(&self) -> [S; MAX_UNKNOWNS] {
        self.unknowns
    }

    /// The same term with other values of the unknown constants.
    #[must_use]
    pub fn with_unknowns(&self, unknowns: [S; MAX_UNKNOWNS]) -> Self {
        Self { unknowns, ..*self }
    }

    /// v in V or τ in N m at a current in A, a speed in rad/s and a supply voltage in V. Evaluated in
    /// [`Gradient`](crate::motor::Gradient)s it comes with its exact derivatives.
    #[inline]
    pub fn value<N: Scalar<Base = S>>(&self, current: N, speed: N, voltage: N) -> N {
        const MASK: usize = MAX_DEPTH - 1;
        // `top` is x. `build` has shown that the masks, which spare the panic of an index, never change an index.
        let mut stack = [N::ZERO; MAX_DEPTH];
        let mut top = MASK;
        for op in self.ops.iter().take(usize::from(self.length)) {
            let operands = op.operands();
            let x = stack[top & MASK];
            let w = stack[top.wrapping_sub(1) & MASK];
            let result = match *op {
                Op::Constant(value) => N::lift(value),
                Op::Unknown(index) => N::lift(self.unknowns[usize::from(index) & (MAX_UNKNOWNS - 1)]),
                Op::Current => current,
                Op::Speed => speed,
                Op::Voltage => voltage,
                Op::Add => w + x,
                Op::Sub => w - x,
                Op::Mul => w * x,
                Op::Div => w / x,
                Op::Pow => power(w, x.value()),
                Op::Neg => -x,
                Op::Abs => x.abs(),
                Op::Sign => sign(x),
                Op::Sqrt => square_root(x),
                Op::Exp => x.exp(),
                Op::Ln => x.ln(),
                Op::Tanh => x.tanh(),
                Op::Atan => x.atan(),
                Op::Sin => x.sin(),
                Op::Cos => x.cos(),
                Op::Square => x * x,
                Op::PowI(n) => integer_power(x, n),
            };
            top = top.wrapping_add(1).wrapping_sub(operands) & MASK;
            stack[top] = result;
        }
        stack[top & MASK]
    }
}

const _: () = assert!(MAX_DEPTH.is_power_of_two() && MAX_UNKNOWNS.is_power_of_two() && MAX_OPS <= u8::MAX as usize);

/// NaN stays NaN.
#[inline]
fn sign<N: Scalar>(x: N) -> N {
    let value = x.value();
    if value > N::Base::ZERO {
        N::ONE
    } else if value < N::Base::ZERO {
        -N::ONE
    } else {
        N::lift(value)
    }
}

/// √x, constant at zero.
#[inline]
fn square_root<N: Scalar>(x: N) -> N {
    if x.value() == N::Base::ZERO { N::ZERO } else { x.sqrt() }
}

/// w^y = exp(y ln w), constant at zero.
#[inline]
fn power<N: Scalar>(w: N, y: N::Base) -> N {
    let base = w.value();
    if y == N::Base::ZERO {
        N::ONE
    } else if y > N::Base::ZERO && base >= N::Base::ZERO && base < N::Base::constant(NO_POWER_BELOW) {
        N::ZERO
    } else {
        (N::lift(y) * w.ln()).exp()
    }
}

/// x^n by repeated squaring; the last square is not taken, since it might overflow for nothing.
#[inline]
fn integer_power<N: Scalar>(x: N, n: i8) -> N {
    let (mut rest, mut square, mut result) = (n.unsigned_abs(), x, N::ONE);
    while rest > 0 {
        if rest & 1 == 1 {
            result = result * square;
        }
        rest >>= 1;
        if rest > 0 {
            square = square * square;
        }
    }
    if n < 0 { N::ONE / result } else { result }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motor::Gradient;
    use Op::*;

    fn voltage(ops: &[Op<f64>], unknowns: [f64; 4]) -> Term<f64> {
        Term::build(Target::Voltage, ops, unknowns).expect("a term")
    }

    /// Value, ∂/∂i, ∂/∂ω at i, ω, u.
    fn slopes(ops: &[Op<f64>], unknowns: [f64; 4], i: f64, w: f64, u: f64) -> [f64; 3] {
        let g =
            voltage(ops, unknowns).value(Gradient::current(i), Gradient::speed(w), <Gradient<f64> as Scalar>::lift(u));
        [g.value, g.by_current, g.by_speed]
    }

    fn close(got: f64, want: f64) {
        assert!((got - want).abs() <= 1e-13 * want.abs().max(1.0), "{got} instead of {want}");
    }

    #[test]
    fn quadratic_drop() {
        let ops = [Unknown(0), Current, Mul, Current, Abs, Mul];
        assert_eq!(voltage(&ops, [3.0, 0.0, 0.0, 0.0]).value(-2.0, 5.0, 7.0), -12.0);
        // d(k i |i|)/di = 2 k |i|.
        assert_eq!(slopes(&ops, [3.0, 0.0, 0.0, 0.0], -2.0, 5.0, 7.0), [-12.0, 12.0, 0.0]);
        let single = Term::<f32>::build(Target::Torque, &ops, [3.0, 0.0, 0.0, 0.0]).expect("a term");
        assert_eq!(single.value(-2.0_f32, 0.0, 0.0), -12.0);
        assert_eq!(single.target(), Target::Torque);
        assert_eq!(single.with_unknowns([0.5, 0.0, 0.0, 0.0]).value(4.0_f32, 0.0, 0.0), 8.0);
        assert_eq!(single.unknowns(), [3.0, 0.0, 0.0, 0.0]);
        assert!(single.ops().eq(ops.map(|op| op.map(|v| v as f32))));
    }

    #[test]
    fn order_of_operands() {
        for (op, want) in [(Add, 9.0), (Sub, 5.0), (Mul, 14.0), (Div, 3.5), (Pow, 49.0)] {
            close(voltage(&[Current, Constant(2.0), op], [0.0; 4]).value(7.0, 0.0, 0.0), want);
        }
        assert_eq!(voltage(&[Voltage, Speed, Sub], [0.0; 4]).value(1.0, 2.0, 10.0), 8.0);
        let four = [Unknown(3), Unknown(2), Unknown(1), Unknown(0), Sub, Sub, Sub];
        assert_eq!(voltage(&four, [1.0, 10.0, 100.0, 1000.0]).value(0.0, 0.0, 0.0), 1000.0 - (100.0 - (10.0 - 1.0)));
    }

    #[test]
    fn functions_and_their_derivatives() {
        // By hand at x = i = 0.7: value and slope, to 16 digits from tables of the functions.
        let cases = [
            (Neg, -0.7, -1.0),
            (Abs, 0.7, 1.0),
            (Sign, 1.0, 0.0),
            (Sqrt, 0.836_660_026_534_075_5, 0.597_614_304_667_196_8),
            (Exp, 2.013_752_707_470_476_6, 2.013_752_707_470_476_6),
            (Ln, -0.356_674_943_938_732_4, 1.428_571_428_571_428_6),
            (Tanh, 0.604_367_777_117_163_4, 0.634_739_589_982_459_3),
            (Atan, 0.610_725_964_389_208_6, 0.671_140_939_597_315_4),
            (Sin, 0.644_217_687_237_691, 0.764_842_187_284_488_5),
            (Cos, 0.764_842_187_284_488_5, -0.644_217_687_237_691),
            (Square, 0.49, 1.4),
            (PowI(0), 1.0, 0.0),
            (PowI(3), 0.343, 1.47),
            (PowI(7), 0.082_354_3, 0.823_543),
            (PowI(-2), 2.040_816_326_530_612, -5.830_903_790_087_463),
        ];
        for (op, value, slope) in cases {
            let got = slopes(&[Current, op], [0.0; 4], 0.7, 3.0, 1.0);
            close(got[0], value);
            close(got[1], slope);
            assert_eq!(got[2], 0.0);
        }
        assert_eq!(voltage(&[Current, PowI(3)], [0.0; 4]).value(-2.0, 0.0, 0.0), -8.0);
        assert_eq!(voltage(&[Current, PowI(127)], [0.0; 4]).value(-1.0, 0.0, 0.0), -1.0);
        assert_eq!(voltage(&[Current, PowI(-128)], [0.0; 4]).value(-1.0, 0.0, 0.0), 1.0);
    }

    #[test]
    fn quotient_and_power_in_both_states() {
        // f = ω/(i + 2): ∂/∂i = −ω/(i + 2)², ∂/∂ω = 1/(i + 2).
        let got = slopes(&[Speed, Current, Constant(2.0), Add, Div], [0.0; 4], 3.0, 10.0, 0.0);
        for (got, want) in got.into_iter().zip([2.0, -0.4, 0.2]) {
            close(got, want);
        }
        // |ω|^1.5 sign ω at −4: −8, slope 1.5 · 2.
        let ops = [Speed, Abs, Unknown(0), Pow, Speed, Sign, Mul];
        let got = slopes(&ops, [1.5, 0.0, 0.0, 0.0], 0.0, -4.0, 0.0);
        close(got[0], -8.0);
        close(got[2], 3.0);
    }

    #[test]
    fn at_zero_all_is_finite() {
        let unknowns = [1.5, 0.5, 0.0, 0.0];
        let programs: [&[Op<f64>]; 6] = [
            &[Current, Sign],
            &[Current, Abs, Sqrt],
            &[Current, Abs, Unknown(0), Pow],
            &[Current, Abs, Unknown(1), Pow],
            &[Current, PowI(3)],
            &[Current, Current, Abs, Mul],
        ];
        for ops in programs {
            for tiny in [0.0, -0.0, 1e-45, 1e-40, -1e-38, 1e-31, 1e-29] {
                let g = voltage(ops, unknowns).value(Gradient::current(tiny), Gradient::speed(0.0), Gradient::ZERO);
                assert!(g.is_finite() && g.value.abs() < 2.0, "{ops:?} {g:?}");
                if tiny == 0.0 {
                    assert_eq!(g.value, 0.0, "{ops:?}");
                }
                let single = Term::<f32>::build(Target::Voltage, ops, unknowns).expect("a term");
                let g = single.value(Gradient::current(tiny as f32), Gradient::speed(0.0), Gradient::ZERO);
                assert!(g.is_finite() && g.value.abs() < 2.0, "{ops:?} {tiny} {g:?}");
            }
        }
        assert_eq!(voltage(&[Current, Unknown(2), Pow], unknowns).value(0.0, 0.0, 0.0), 1.0);
        assert!(voltage(&[Current, Unknown(0), Pow], unknowns).value(-1.0_f64, 0.0, 0.0).is_nan());
        assert!(voltage(&[Current, Sign], unknowns).value(f64::NAN, 0.0, 0.0).is_nan());
    }

    #[test]
    fn what_cannot_be_built() {
        let error = |ops: &[Op<f64>]| Term::<f32>::build(Target::Voltage, ops, [0.0; 4]).expect_err("no term");
        assert_eq!(error(&[]), TermError::Empty);
        assert_eq!(error(&[Current, Mul]), TermError::Underflow { at: 1 });
        assert_eq!(error(&[Neg]), TermError::Underflow { at: 0 });
        assert_eq!(error(&[Current; 2]), TermError::Leftover { results: 2 });
        assert_eq!(error(&[Current; MAX_DEPTH + 1]), TermError::Overflow { at: MAX_DEPTH });
        assert_eq!(error(&[Current; MAX_OPS + 1]), TermError::TooLong);
        assert_eq!(error(&[Unknown(4)]), TermError::UnknownIndex { at: 0 });
        assert_eq!(error(&[Current, Constant(1e39)]), TermError::NotFinite { at: 1 });
        assert_eq!(error(&[Constant(2.0), Current, Neg, Pow]), TermError::VaryingExponent { at: 3 });
    }

    #[test]
    fn the_stack_may_be_full() {
        let mut ops = [Add; 2 * MAX_DEPTH - 1];
        for (k, op) in ops[..MAX_DEPTH].iter_mut().enumerate() {
            *op = Constant((k + 1) as f64);
        }
        assert_eq!(voltage(&ops, [0.0; 4]).value(0.0, 0.0, 0.0), 36.0);
        let mut ops = [Neg; MAX_OPS];
        ops[0] = Current;
        assert_eq!(voltage(&ops, [0.0; 4]).value(2.0, 0.0, 0.0), -2.0);
    }

    /// Arbitrary programs against a plain evaluation on a vector that grows and checks.
    #[test]
    fn arbitrary_programs() {
        let pool = [
            Constant(0.3),
            Constant(-1.7),
            Unknown(1),
            Unknown(5),
            Current,
            Speed,
            Voltage,
            Add,
            Sub,
            Mul,
            Div,
            Neg,
            Abs,
            Square,
            Pow,
            Sqrt,
        ];
        let (mut seed, mut built) = (1_u64, 0);
        let mut next = |below: usize| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as usize % below
        };
        for _ in 0..200_000 {
            let mut ops = heapless::Vec::<Op<f64>, MAX_OPS>::new();
            for _ in 0..=next(MAX_OPS) {
                let _ = ops.push(pool[next(pool.len())]);
            }
            let unknowns = [0.0, 2.5, 0.0, 0.0];
            let Ok(term) = Term::<f64>::build(Target::Voltage, &ops, unknowns) else { continue };
            built += 1;
            let mut stack = heapless::Vec::<f64, 64>::new();
            for op in &ops {
                let x = if op.operands() > 0 { stack.pop().expect("an operand") } else { 0.0 };
                let w = if op.operands() > 1 { stack.pop().expect("an operand") } else { 0.0 };
                let result = match op {
                    Constant(value) => *value,
                    Unknown(index) => unknowns[usize::from(*index)],
                    Current => -0.9,
                    Speed => 4.0,
                    Voltage => 11.0,
                    Add => w + x,
                    Sub => w - x,
                    Mul => w * x,
                    Div => w / x,
                    Neg => -x,
                    Abs => x.abs(),
                    Square => x * x,
                    Sqrt => square_root(x),
                    _ => power(w, x),
                };
                stack.push(result).expect("room");
            }
            let got: f64 = term.value(-0.9, 4.0, 11.0);
            assert!(got.to_bits() == stack[0].to_bits() || (got.is_nan() && stack[0].is_nan()), "{ops:?}");
        }
        assert!(built > 1000, "{built}");
    }
}
