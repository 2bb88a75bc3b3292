//! `--term 'k*i*abs(i)'`: a physical term of the user's own, written as a formula.
//!
//! ```text
//! term     = ["voltage:" | "torque:"] sum            without prefix: voltage
//! sum      = product {("+" | "-") product}
//! product  = unary {("*" | "/") unary}
//! unary    = ("-" | "+") unary | power
//! power    = primary ["^" unary]                     -i^2 = -(i^2), 2^3^2 = 2^9
//! primary  = number | variable | unknown | function "(" sum ")" | "(" sum ")"
//! function = abs | sign | sqrt | exp | ln | tanh | atan | sin | cos
//! variable = "i" (A) | "w" or "omega" (rad/s) | "u" (V)
//! ```
//!
//! Every other name is an unknown constant that is to be identified. What the term does in the model, and how it
//! behaves at zero, is said in [`greyrig::term`].
//!
//! # Powers
//! An exponent is a constant: a number, an unknown, or an expression of these. Whole numbers from −127 to 127 are
//! multiplied out and take a base of either sign. All others are x^y = exp(y ln x), which needs x ≥ 0: write
//! `sign(w)*abs(w)^n`.

mod parser;
mod units;

use std::str::FromStr;

use greyrig::scalar::Scalar;
use greyrig::term::{MAX_UNKNOWNS, Op, Target, Term};
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use parser::Parser;

/// A formula that has been parsed. Files hold its text.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Formula {
    text: String,
    target: Target,
    unknowns: Vec<String>,
    ops: Vec<Op<f64>>,
}

impl Formula {
    /// Parses a formula.
    ///
    /// # Errors
    /// What does not follow the grammar; a name that is taken; a varying exponent; more unknowns, operations or
    /// intermediate values than a [`Term`] has room for; a constant that is no finite number in `f32`.
    pub fn parse(text: &str) -> Result<Self> {
        let (target, parser) = Parser::parse(text)?;
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        Ok(Self { text, target, unknowns: parser.unknowns, ops: parser.ops })
    }

    /// As written, prefix included, with single spaces for all white space; parses to an equal formula.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The equation it enters: drop in V, or braking torque in N m.
    pub fn target(&self) -> Target {
        self.target
    }

    /// Names of the unknown constants in the order in which they first appear.
    pub fn unknowns(&self) -> &[String] {
        &self.unknowns
    }

    /// The operations, for [`Term::build`].
    pub fn ops(&self) -> &[Op<f64>] {
        &self.ops
    }

    /// The term with values for [`Formula::unknowns`], in their order; those that are missing are zero.
    pub fn term<S: Scalar<Base = S>>(&self, values: &[f64]) -> Term<S> {
        let mut unknowns = [0.0; MAX_UNKNOWNS];
        for (slot, value) in unknowns.iter_mut().zip(values) {
            *slot = *value;
        }
        Term::build(self.target, &self.ops, unknowns).expect("the parser has built it before")
    }
}

impl FromStr for Formula {
    type Err = Error;
    fn from_str(text: &str) -> Result<Self> {
        Self::parse(text)
    }
}

impl TryFrom<String> for Formula {
    type Error = Error;
    fn try_from(text: String) -> Result<Self> {
        Self::parse(&text)
    }
}

impl From<Formula> for String {
    fn from(formula: Formula) -> Self {
        formula.text
    }
}

#[cfg(test)]
mod tests {
    use greyrig::motor::Gradient;
    use proptest::prelude::*;

    use super::parser::MAX_NESTING;
    use super::*;

    fn formula(text: &str) -> Formula {
        Formula::parse(text).unwrap_or_else(|e| panic!("{text}: {e}"))
    }

    /// At i = −2 A, ω = 10 rad/s, u = 24 V.
    fn value(text: &str, unknowns: &[f64]) -> f64 {
        formula(text).term::<f64>(unknowns).value(-2.0, 10.0, 24.0)
    }

    fn error(text: &str) -> String {
        let error = Formula::parse(text).expect_err(text).to_string();
        assert!(!error.contains('\n') && error.contains("column") && error.contains("; "), "{error}");
        error
    }

    #[test]
    fn quadratic_drop() {
        let parsed = formula(" k*i * abs(i)\n");
        assert_eq!(parsed.text(), "k*i * abs(i)");
        assert_eq!((parsed.target(), parsed.unknowns()), (Target::Voltage, &["k".to_owned()][..]));
        assert_eq!(parsed.term::<f64>(&[3.0]).value(-2.0_f64, 10.0, 24.0), -12.0);
        assert_eq!(parsed.term::<f32>(&[3.0]).value(-2.0_f32, 10.0, 24.0), -12.0);
        assert_eq!(parsed.term::<f64>(&[]).value(-2.0_f64, 10.0, 24.0), 0.0);
    }

    #[test]
    fn values() {
        let cases: [(&str, f64); 33] = [
            ("i", -2.0),
            ("w", 10.0),
            ("omega", 10.0),
            ("u", 24.0),
            ("1 + 2*w", 21.0),
            ("(1 + 2)*w", 30.0),
            ("u - w - i", 16.0),
            ("u - (w - i)", 12.0),
            ("u/w/i", -1.2),
            ("u/(w/i)", -4.8),
            ("-i^2", -4.0),
            ("(-i)^2", 4.0),
            ("i^3", -8.0),
            ("i^-2", 0.25),
            ("i^0", 1.0),
            ("i^1", -2.0),
            ("2^3^2", 512.0),
            ("(2^3)^2", 64.0),
            ("2^-3^2", 1.0 / 512.0),
            ("2*-3 - -4", -2.0),
            ("+i", -2.0),
            ("--i", -2.0),
            ("abs(i)^0.5", std::f64::consts::SQRT_2),
            ("w^(1/2 + 1)", 31.622_776_601_683_793),
            ("sign(i)*abs(i)^1.5", -2.828_427_124_746_190_3),
            ("sqrt(4e2)", 20.0),
            ("exp(ln(w))", 10.0),
            ("tanh(0.5)", 0.462_117_157_260_009_8),
            ("4*atan(1)", std::f64::consts::PI),
            ("sin(0.5)", 0.479_425_538_604_203),
            ("cos(0.5)", 0.877_582_561_890_372_8),
            (".5*2.*1E+1", 10.0),
            ("voltage : u", 24.0),
        ];
        for (text, want) in cases {
            let got = value(text, &[]);
            assert!((got - want).abs() < 1e-14 * want.abs().max(1.0), "{text} = {got} instead of {want}");
        }
    }

    #[test]
    fn unknowns_and_targets() {
        let parsed = formula("torque: b_1*w + a*sign(w)*abs(w)^n + b_1*exp2");
        assert_eq!(parsed.unknowns(), ["b_1", "a", "n", "exp2"]);
        assert_eq!(parsed.target(), Target::Torque);
        assert_eq!(parsed.term::<f64>(&[0.0; 4]).target(), Target::Torque);
        let got = value(parsed.text(), &[2.0, 3.0, 0.5, 7.0]);
        assert!((got - (20.0 + 3.0 * 3.162_277_660_168_379_5 + 14.0)).abs() < 1e-13);
        // Without a colon it is a name like another, and capital letters are others.
        assert_eq!(formula("torque*w").unknowns(), ["torque"]);
        assert_eq!(formula("r*j*mu3*k").unknowns(), ["r", "j", "mu3", "k"]);
        // Constants need no unknown, and no variable.
        assert_eq!(formula("0.1*i").unknowns(), [""; 0]);
        assert_eq!(value("k", &[0.7]), 0.7);
        assert_eq!(value("0.7", &[]), 0.7);
        assert_eq!(value("omega2 + w_0", &[1.0, 2.0]), 3.0);
    }

    #[test]
    fn derivatives() {
        let slopes = |text, unknowns: &[f64]| {
            let g = formula(text).term::<f64>(unknowns).value(
                Gradient::current(-2.0),
                Gradient::speed(10.0),
                <Gradient<f64> as Scalar>::lift(24.0),
            );
            [g.by_current, g.by_speed]
        };
        assert_eq!(slopes("k*i*abs(i)", &[3.0]), [12.0, 0.0]);
        assert_eq!(slopes("k*i^2*w", &[3.0]), [-120.0, 12.0]);
        let [by_current, by_speed] = slopes("a*tanh(w/b)/(1 + i^2)", &[5.0, 20.0]);
        let tanh = 0.462_117_157_260_009_8;
        assert!((by_current - 5.0 * tanh * 4.0 / 25.0).abs() < 1e-14);
        assert!((by_speed - 0.25 * (1.0 - tanh * tanh) / 5.0).abs() < 1e-15);
    }

    #[test]
    fn numbers_are_folded() {
        assert_eq!(formula("-2^2*i").ops(), [Op::Constant(-4.0), Op::Current, Op::Mul]);
        assert_eq!(formula("i^(3 - 1)").ops(), [Op::Current, Op::Square]);
        assert_eq!(formula(&format!("{}i", "1+".repeat(500))).ops(), [Op::Constant(500.0), Op::Current, Op::Add]);
        let ops = [Op::Unknown(0), Op::Constant(6.0), Op::Current, Op::PowI(-3), Op::Mul, Op::Add];
        assert_eq!(formula("k + 2*3*i^-3").ops(), ops);
    }

    #[test]
    fn errors_name_the_column() {
        let cases = [
            ("", 1, "ends where a value"),
            ("  ", 3, "ends where a value"),
            ("torque:", 8, "ends where a value"),
            ("k*i*abs(i", 8, "never closed"),
            ("k*(i", 3, "never closed"),
            ("k*i)", 4, "closes nothing"),
            ("k i", 3, "operator is missing"),
            ("2i", 2, "operator is missing"),
            ("2e", 2, "operator is missing"),
            ("(k)(i)", 4, "operator is missing"),
            ("abs(k i)", 7, "operator is missing"),
            ("k*", 3, "ends where a value"),
            ("*k", 1, "'*' stands where"),
            ("k*/i", 3, "'/' stands where"),
            ("()", 2, "')' stands where"),
            ("i**2", 3, "write ^ for a power"),
            ("abs i", 1, "abs(i)"),
            ("abs", 1, "abs(i)"),
            ("abs(i, w)", 6, "one argument"),
            ("sgn(i)", 1, "no function sgn; use abs, sign"),
            ("k(i + 1)", 1, "k*("),
            ("k*R*i", 3, "the name R is taken"),
            ("torque: mu0*w", 9, "the name mu0 is taken"),
            ("a*b*c*d*e", 9, "at most 4 (so far a, b, c, d)"),
            ("2^i", 3, "exponent depends on i, w or u"),
            ("2^(k*w)", 3, "exponent depends on i, w or u"),
            ("i^128", 3, "between -127 and 127"),
            ("i^-1e9", 3, "between -127 and 127"),
            ("1/0", 2, "out of range"),
            ("0/0", 2, "not a number"),
            ("ln(-1)", 1, "not a number"),
            ("1e39*i", 1, "out of range"),
            ("1e999*i", 1, "out of range"),
            ("1e-50*i", 1, "out of range"),
            ("k*ω", 3, "write w or omega"),
            ("0,5*i", 2, "decimals with a point"),
            ("speed: k", 6, "voltage: or torque:"),
            ("k*[i]", 3, "write ( and )"),
            ("k*i·i", 4, "* to multiply"),
            ("k*|i|", 3, "abs(x)"),
            ("k*.", 3, "'.' has no meaning"),
            ("1.2.3", 4, "operator is missing"),
            ("k\u{7}", 2, "has no meaning"),
        ];
        for (text, column, words) in cases {
            let error = error(text);
            assert!(error.contains(&format!("column {column}:")) && error.contains(words), "{error}");
        }
    }

    #[test]
    fn limits() {
        // 21 operands and 20 sums.
        let long = vec!["i"; 20].join("+") + "+1";
        assert!(error(&long).contains("41 numbers, names and operations"));
        assert!(error(&vec!["i"; 17].join("+")).contains("33 numbers"));
        assert_eq!(formula(&vec!["i"; 16].join("+")).ops().len(), 31);
        let right = |n: usize| format!("{}i{}", "w*(i+".repeat(n), ")".repeat(n));
        assert!(Formula::parse(&right(3)).is_ok());
        assert!(error(&right(4)).contains("column 21: more than 8 intermediate"));
        let deep = |n: usize| format!("{}i{}", "(".repeat(n), ")".repeat(n));
        assert!(Formula::parse(&deep(MAX_NESTING - 1)).is_ok());
        for bomb in [deep(MAX_NESTING), deep(1_000_000), "(".repeat(1_000_000), "-".repeat(1_000_000)] {
            assert!(error(&bomb).contains("inside one another"));
        }
        assert!(error(&"i^".repeat(100_000)).contains("inside one another"));
        assert!(error(&"abs(".repeat(100_000)).contains("inside one another"));
        assert!(error(&"x".repeat(1_000_000).replace("xx", "i+")).len() < 400);
        assert!(error(&format!("{}(", "x".repeat(100_000))).len() < 500);
    }

    #[test]
    fn files_hold_the_text() {
        for text in ["k*i*abs(i)", "torque: k*sign(w) \t* abs(w)^n", "voltage:0.5*i"] {
            let parsed = formula(text);
            let json = serde_json::to_string(&parsed).expect("text");
            assert_eq!(json, serde_json::to_string(parsed.text()).expect("text"));
            assert_eq!(serde_json::from_str::<Formula>(&json).expect("a formula"), parsed);
        }
        assert!(serde_json::from_str::<Formula>("\"k*\"").is_err());
    }

    proptest! {
        #[test]
        fn bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            usable_or_one_line(&String::from_utf8_lossy(&bytes))?;
        }

        #[test]
        fn almost_formulas_never_panic(pieces in prop::collection::vec(prop::sample::select(vec![
            "i", "w", "u", "k", "n", "c_2", "+", "-", "*", "/", "^", "(", ")", "abs(", "ln(", "exp(", "2", "0.5", "1e9",
            "-3", "0", " ", "e", "torque:", ".", "é", "200",
        ]), 0..24)) {
            usable_or_one_line(&pieces.concat())?;
        }

        /// Sums and products of random shape against their values, computed while they are made.
        #[test]
        fn shapes((text, want) in shape()) {
            if let Ok(parsed) = Formula::parse(&text) {
                let got: f64 = parsed.term::<f64>(&[]).value(-2.0, 10.0, 24.0);
                prop_assert_eq!(got.to_bits(), want.to_bits(), "{} = {}, {}", text, got, want);
            } else {
                prop_assert!(error(&text).contains("numbers, names") || error(&text).contains("intermediate"));
            }
        }
    }

    fn shape() -> impl Strategy<Value = (String, f64)> {
        let leaf = prop_oneof![
            Just(("i".to_owned(), -2.0)),
            Just(("w".into(), 10.0)),
            Just(("u".into(), 24.0)),
            Just(("1.5".into(), 1.5))
        ];
        leaf.prop_recursive(5, 24, 2, |inner| {
            (inner.clone(), inner, 0..5).prop_map(|((a, x), (b, y), op)| match op {
                0 => (format!("({a}+{b})"), x + y),
                1 => (format!("({a} - {b})"), x - y),
                2 => (format!("({a}*{b})"), x * y),
                3 => (format!("(-{a}^2*{b})"), -(x * x) * y),
                _ => (format!("abs({a})"), f64::abs(x)),
            })
        })
    }

    fn usable_or_one_line(text: &str) -> std::result::Result<(), TestCaseError> {
        match Formula::parse(text) {
            Ok(parsed) => {
                let _ =
                    parsed.term::<f32>(&[1.0; 9]).value(Gradient::current(0.5), Gradient::speed(-1.0), Gradient::ZERO);
                prop_assert_eq!(Formula::parse(parsed.text()).expect("parsed before"), parsed);
            }
            Err(e) => prop_assert!(!e.to_string().contains(['\n', '\r']), "{}", e),
        }
        Ok(())
    }
}
