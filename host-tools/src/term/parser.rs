//! Recursive descent over the grammar of a term, to the operations that the core runs.

use greyrig::motor::BaseParameter;
use greyrig::term::{MAX_DEPTH, MAX_OPS, MAX_UNKNOWNS, Op, Target, Term, TermError};

use crate::error::{Error, Result};

/// Parentheses, signs and powers inside one another.
pub const MAX_NESTING: usize = 64;
/// Characters of a formula or of a piece of it that an error repeats.
const MAX_QUOTED: usize = 60;
/// Largest whole exponent.
const MAX_POWER: f64 = 127.0;

const FUNCTIONS: [(&str, Op<f64>); 9] = [
    ("abs", Op::Abs),
    ("sign", Op::Sign),
    ("sqrt", Op::Sqrt),
    ("exp", Op::Exp),
    ("ln", Op::Ln),
    ("tanh", Op::Tanh),
    ("atan", Op::Atan),
    ("sin", Op::Sin),
    ("cos", Op::Cos),
];
const VARIABLES: [(&str, Op<f64>); 4] =
    [("i", Op::Current), ("w", Op::Speed), ("omega", Op::Speed), ("u", Op::Voltage)];
const TARGETS: [(&str, Target); 2] = [("voltage", Target::Voltage), ("torque", Target::Torque)];

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Number(f64),
    Name(String),
    /// Operators and parentheses, and whatever else there is.
    Sign(char),
    End,
}

/// A formula that is being read.
pub struct Parser<'a> {
    text: &'a str,
    characters: Vec<char>,
    /// Of the next character.
    at: usize,
    nesting: usize,
    /// Names of the unknown constants so far.
    pub unknowns: Vec<String>,
    /// Operations so far.
    pub ops: Vec<Op<f64>>,
    /// Of each operation: where in the text it is from.
    places: Vec<usize>,
}

impl<'a> Parser<'a> {
    /// Reads a formula to its end.
    ///
    /// # Errors
    /// What does not follow the grammar, or does not fit the core.
    pub fn parse(text: &'a str) -> Result<(Target, Self)> {
        let mut parser = Self::new(text);
        let target = parser.target();
        parser.formula()?;
        Ok((target, parser))
    }

    fn new(text: &'a str) -> Self {
        let characters = text.chars().collect();
        Self { text, characters, at: 0, nesting: 0, unknowns: vec![], ops: vec![], places: vec![] }
    }

    fn error(&self, at: usize, what: impl AsRef<str>, remedy: impl Into<String>) -> Error {
        Error::usage(format!("term '{}', column {}: {}", quoted(self.text), at + 1, what.as_ref()), remedy)
    }

    fn target(&mut self) -> Target {
        for (name, target) in TARGETS {
            let rest = self.text.trim_start().strip_prefix(name).map(str::trim_start);
            if let Some(rest) = rest.and_then(|rest| rest.strip_prefix(':')) {
                self.at = self.characters.len() - rest.chars().count();
                return target;
            }
        }
        Target::default()
    }

    fn formula(&mut self) -> Result<()> {
        self.sum()?;
        let (at, token) = self.peek()?;
        match token {
            Token::End => self.check(),
            Token::Sign(')') => Err(self.error(at, "this parenthesis closes nothing", "remove it or open one before")),
            Token::Sign(c) if !"(+-*/^".contains(c) => Err(self.stray(at, c)),
            _ => Err(self.error(at, "an operator is missing here", "write +, -, *, / or ^, for example k*i")),
        }
    }

    fn sum(&mut self) -> Result<()> {
        self.product()?;
        while let Some((at, sign)) = self.take(&['+', '-'])? {
            self.product()?;
            self.apply(at, if sign == '+' { Op::Add } else { Op::Sub })?;
        }
        Ok(())
    }

    fn product(&mut self) -> Result<()> {
        self.unary()?;
        while let Some((at, sign)) = self.take(&['*', '/'])? {
            if let (power, Token::Sign('*')) = self.peek()? {
                return Err(self.error(power, "'**' is no operator", "write ^ for a power"));
            }
            self.unary()?;
            self.apply(at, if sign == '*' { Op::Mul } else { Op::Div })?;
        }
        Ok(())
    }

    /// All recursion passes through here.
    fn unary(&mut self) -> Result<()> {
        self.nesting += 1;
        if self.nesting > MAX_NESTING {
            let what = format!("more than {MAX_NESTING} parentheses, signs and powers inside one another");
            return Err(self.error(self.at, what, "write the formula with fewer"));
        }
        match self.take(&['-', '+'])? {
            Some((at, '-')) => {
                self.unary()?;
                self.apply(at, Op::Neg)?;
            }
            Some(_) => self.unary()?,
            None => self.power()?,
        }
        self.nesting -= 1;
        Ok(())
    }

    fn power(&mut self) -> Result<()> {
        self.primary()?;
        let Some((at, _)) = self.take(&['^'])? else { return Ok(()) };
        let (start, first) = (self.peek()?.0, self.ops.len());
        self.unary()?;
        let &[Op::Constant(y)] = &self.ops[first..] else {
            if self.ops[first..].iter().any(|op| matches!(op, Op::Current | Op::Speed | Op::Voltage)) {
                return Err(self.error(
                    start,
                    "the exponent depends on i, w or u",
                    "use a number or an unknown constant, or write exp(y*ln(x)) for x^y",
                ));
            }
            return self.apply(at, Op::Pow);
        };
        if y.abs() > MAX_POWER {
            let what = format!("the exponent {y} is out of range");
            return Err(self.error(start, what, format!("use one between -{MAX_POWER} and {MAX_POWER}")));
        }
        let replacement = if y == 1.0 {
            None
        } else if y == 2.0 {
            Some(Op::Square)
        } else if y == 0.5 {
            Some(Op::Sqrt)
        } else if y.fract() == 0.0 {
            Some(Op::PowI(y as i8))
        } else {
            return self.apply(at, Op::Pow);
        };
        self.ops.truncate(first);
        self.places.truncate(first);
        replacement.map_or(Ok(()), |op| self.apply(at, op))
    }

    fn primary(&mut self) -> Result<()> {
        let (at, token) = self.next()?;
        match token {
            Token::Number(value) => self.apply(at, Op::Constant(value)),
            Token::Sign('(') => {
                self.sum()?;
                self.close(at)
            }
            Token::Name(name) => {
                if let Some(&(_, op)) = FUNCTIONS.iter().find(|(n, _)| *n == name) {
                    let (open, token) = self.next()?;
                    if token != Token::Sign('(') {
                        return Err(self.error(
                            at,
                            format!("the function {name} lacks its argument"),
                            format!("write it in parentheses, for example {name}(i)"),
                        ));
                    }
                    self.sum()?;
                    self.close(open)?;
                    return self.apply(at, op);
                }
                let op = match VARIABLES.iter().find(|(n, _)| *n == name) {
                    Some(&(_, op)) => op,
                    None => Op::Unknown(self.unknown(at, &name)?),
                };
                self.apply(at, op)
            }
            Token::End => Err(self.error(
                at,
                "the formula ends where a value is expected",
                "add a number, a name or an expression in parentheses, for example k*i*abs(i)",
            )),
            Token::Sign(c) if ")+-*/^".contains(c) => Err(self.error(
                at,
                format!("'{c}' stands where a value is expected"),
                "put a number, a name or an expression in parentheses before it",
            )),
            Token::Sign(c) => Err(self.stray(at, c)),
        }
    }

    fn close(&mut self, open: usize) -> Result<()> {
        let (at, token) = self.next()?;
        match token {
            Token::Sign(')') => Ok(()),
            Token::End => Err(self.error(open, "this parenthesis is never closed", "add ')'")),
            Token::Sign(',') => Err(self.error(at, "a function has one argument", "remove the comma and what follows")),
            Token::Sign(c) if !"(+-*/^".contains(c) => Err(self.stray(at, c)),
            _ => Err(self.error(at, "an operator is missing here", "write +, -, *, / or ^, for example k*i")),
        }
    }

    /// The index of an unknown, new or known.
    fn unknown(&mut self, at: usize, name: &str) -> Result<u8> {
        let shown = quoted(name);
        if let (_, Token::Sign('(')) = self.peek()? {
            let known: Vec<_> = FUNCTIONS.iter().map(|f| f.0).collect();
            return Err(self.error(
                at,
                format!("there is no function {shown}"),
                format!("use {}; or, to multiply, write {shown}*(", known.join(", ")),
            ));
        }
        if BaseParameter::of_name(name).is_some() {
            return Err(self.error(
                at,
                format!("the name {name} is taken by a parameter of the base model"),
                format!("give the constant another name, for example {name}_x"),
            ));
        }
        let index = self.unknowns.iter().position(|u| u == name).unwrap_or(self.unknowns.len());
        if index == MAX_UNKNOWNS {
            return Err(self.error(
                at,
                format!("{shown} is one unknown constant too many"),
                format!("use at most {MAX_UNKNOWNS} (so far {}), and numbers for the others", self.unknowns.join(", ")),
            ));
        }
        if index == self.unknowns.len() {
            self.unknowns.push(name.into());
        }
        Ok(index as u8)
    }

    /// Appends an operation. One on numbers alone becomes its result.
    fn apply(&mut self, at: usize, op: Op<f64>) -> Result<()> {
        let first = self.ops.len() - op.operands();
        let literal = op.operands() > 0 && self.ops[first..].iter().all(|op| matches!(op, Op::Constant(_)));
        self.ops.push(op);
        self.places.push(at);
        if literal {
            let value = Term::<f64>::build(Target::default(), &self.ops[first..], [0.0; MAX_UNKNOWNS])
                .map_or(f64::NAN, |term| term.value(0.0, 0.0, 0.0));
            self.ops.truncate(first);
            self.places.truncate(first);
            self.ops.push(Op::Constant(value));
            self.places.push(at);
        }
        if let Some(&Op::Constant(value)) = self.ops.last() {
            self.representable(at, value)?;
        }
        Ok(())
    }

    /// The microcontroller computes in `f32`.
    fn representable(&self, at: usize, value: f64) -> Result<()> {
        if value == 0.0 || (f64::from(f32::MIN_POSITIVE)..=f64::from(f32::MAX)).contains(&value.abs()) {
            return Ok(());
        }
        let what = if value.is_nan() {
            "the result is not a number".into()
        } else {
            format!("the number {value:e} is out of range")
        };
        Err(self.error(at, what, format!("use numbers from {:e} to {:e}", f32::MIN_POSITIVE, f32::MAX)))
    }

    fn check(&self) -> Result<()> {
        let Err(error) = Term::<f32>::build(Target::default(), &self.ops, [0.0; MAX_UNKNOWNS]) else { return Ok(()) };
        let place = |at: usize| self.places.get(at).copied().unwrap_or(0);
        Err(match error {
            TermError::TooLong => self.error(
                place(MAX_OPS),
                format!("{} numbers, names and operations are too many for the microcontroller", self.ops.len()),
                format!("use at most {MAX_OPS}; multiply constants together, or factor common terms out"),
            ),
            TermError::Overflow { at } => self.error(
                place(at),
                format!("more than {MAX_DEPTH} intermediate results at a time"),
                "put the longest parenthesis first, as in (a + b*i)*w rather than w*(a + b*i)",
            ),
            other => self.error(0, other.to_string(), "report this as a fault of greyrig"),
        })
    }

    fn stray(&self, at: usize, c: char) -> Error {
        let shown = quoted(&c.to_string());
        let remedy = match c {
            '[' | ']' | '{' | '}' => "write ( and )",
            '\u{b7}' | '\u{d7}' => "write * to multiply",
            '\u{2212}' | '\u{2013}' => "write the minus sign as -",
            '|' => "write abs(x) for an absolute value",
            ',' => "write decimals with a point",
            'ω' => "write w or omega",
            ':' => "begin with voltage: or torque:, or leave the prefix out",
            _ => "use numbers, names of the letters a to z, digits and _, and + - * / ^ ( )",
        };
        self.error(at, format!("'{shown}' has no meaning here"), remedy)
    }

    /// The next token, if it is one of some signs.
    fn take(&mut self, signs: &[char]) -> Result<Option<(usize, char)>> {
        match self.peek()? {
            (at, Token::Sign(c)) if signs.contains(&c) => {
                self.at = at + 1;
                Ok(Some((at, c)))
            }
            _ => Ok(None),
        }
    }

    fn peek(&mut self) -> Result<(usize, Token)> {
        let before = self.at;
        let token = self.next();
        self.at = before;
        token
    }

    /// The next token and where it begins.
    fn next(&mut self) -> Result<(usize, Token)> {
        self.skip(|c| c.is_whitespace());
        let at = self.at;
        let Some(&c) = self.characters.get(at) else { return Ok((at, Token::End)) };
        if c.is_ascii_digit() || (c == '.' && self.digit(at + 1)) {
            return Ok((at, Token::Number(self.number(at)?)));
        }
        if c.is_ascii_alphabetic() || c == '_' {
            self.skip(|c| c.is_ascii_alphanumeric() || c == '_');
            return Ok((at, Token::Name(self.characters[at..self.at].iter().collect())));
        }
        self.at += 1;
        Ok((at, Token::Sign(c)))
    }

    fn number(&mut self, at: usize) -> Result<f64> {
        self.skip(|c| c.is_ascii_digit());
        if self.characters.get(self.at) == Some(&'.') {
            self.at += 1;
            self.skip(|c| c.is_ascii_digit());
        }
        if matches!(self.characters.get(self.at), Some('e' | 'E')) {
            let signed = matches!(self.characters.get(self.at + 1), Some('+' | '-'));
            let digits = self.at + 1 + usize::from(signed);
            if self.digit(digits) {
                self.at = digits;
                self.skip(|c| c.is_ascii_digit());
            }
        }
        let text: String = self.characters[at..self.at].iter().collect();
        text.parse().map_err(|_| {
            self.error(at, format!("'{}' is not a number", quoted(&text)), "write it like 0.5, 20 or 1.5e-3")
        })
    }

    fn digit(&self, at: usize) -> bool {
        self.characters.get(at).is_some_and(char::is_ascii_digit)
    }

    fn skip(&mut self, wanted: impl Fn(char) -> bool) {
        while self.characters.get(self.at).is_some_and(|&c| wanted(c)) {
            self.at += 1;
        }
    }
}

/// The begin of a text, fit for a line.
fn quoted(text: &str) -> String {
    let shown = text.chars().take(MAX_QUOTED).map(|c| if c.is_whitespace() { ' ' } else { c });
    let mut shown: String = shown.map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }).collect();
    if text.chars().nth(MAX_QUOTED).is_some() {
        shown.push('…');
    }
    shown
}
