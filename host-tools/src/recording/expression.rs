//! Arithmetic on columns: `duty_cycle*input_voltage`, `(a-b)/2`, `ddt(angle[deg])`.

use super::table::Column;

/// What is computed, sample by sample.
#[derive(Debug, Clone, PartialEq)]
pub enum Expression {
    /// A number.
    Number(f64),
    /// A column, in SI by the unit in brackets, else by its own.
    Column {
        /// Its index.
        index: usize,
        /// The unit in brackets.
        unit: Option<String>,
    },
    /// The sum of two.
    Sum(Box<Self>, Box<Self>),
    /// The second taken from the first.
    Difference(Box<Self>, Box<Self>),
    /// The product of two.
    Product(Box<Self>, Box<Self>),
    /// The first over the second.
    Quotient(Box<Self>, Box<Self>),
    /// The rate of change per second.
    Rate(Box<Self>),
}

/// Why a text is no expression: what is wrong.
pub type Fault = String;

/// The values of a column, by its place, in the unit that is told or its own.
type Columns<'a, E> = dyn Fn(usize, Option<&str>) -> Result<Vec<f64>, E> + 'a;

impl Expression {
    /// Reads an expression. `find` tells which column a name is, if any.
    ///
    /// # Errors
    /// What stands where a column, a number or a bracket should.
    pub fn parse(text: &str, columns: &[Column], find: &dyn Fn(&str) -> Option<usize>) -> Result<Self, Fault> {
        let mut parser = Parser { rest: text.trim(), columns, find };
        let expression = parser.sum(0)?;
        match parser.rest {
            "" => Ok(expression),
            rest => Err(format!("'{rest}' is not understood")),
        }
    }

    /// The columns that it takes in, in their order.
    pub fn columns(&self) -> Vec<usize> {
        match self {
            Self::Number(_) => Vec::new(),
            Self::Column { index, .. } => vec![*index],
            Self::Rate(of) => of.columns(),
            Self::Sum(a, b) | Self::Difference(a, b) | Self::Product(a, b) | Self::Quotient(a, b) => {
                [a.columns(), b.columns()].concat()
            }
        }
    }

    /// The values, from those of the columns in SI and the sampling interval, s.
    ///
    /// # Errors
    /// What `column` refuses.
    pub fn values<E>(&self, column: &Columns<'_, E>, rows: usize, interval_s: f64) -> Result<Vec<f64>, E> {
        let both = |a: &Self, b: &Self, join: fn(f64, f64) -> f64| {
            let (a, b) = (a.values(column, rows, interval_s)?, b.values(column, rows, interval_s)?);
            Ok(a.into_iter().zip(b).map(|(a, b)| join(a, b)).collect())
        };
        match self {
            Self::Number(x) => Ok(vec![*x; rows]),
            Self::Column { index, unit } => column(*index, unit.as_deref()),
            Self::Sum(a, b) => both(a, b, |a, b| a + b),
            Self::Difference(a, b) => both(a, b, |a, b| a - b),
            Self::Product(a, b) => both(a, b, |a, b| a * b),
            Self::Quotient(a, b) => both(a, b, |a, b| a / b),
            Self::Rate(of) => {
                let mut values = of.values(column, rows, interval_s)?;
                unwrap_turns(&mut values);
                Ok(rate(&values, interval_s))
            }
        }
    }
}

/// Central differences, one-sided at the ends.
fn rate(values: &[f64], interval_s: f64) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    let at = |k: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
        if a == b { 0.0 } else { (values[b] - values[a]) / ((b - a) as f64 * interval_s) }
    };
    (0..values.len()).map(at).collect()
}

/// Lets an angle in rad that begins anew at each turn go on instead; whether it did.
///
/// It begins anew if it stays within one turn and jumps by nearly one. (An angle that goes on leaves the turn.)
pub fn unwrap_turns(angle: &mut [f64]) -> bool {
    use std::f64::consts::TAU;
    /// Shortest jump that is one over the end, turns: between two samples the rotor turns by less than the rest.
    const JUMP: f64 = 0.6;
    let finite = || angle.iter().copied().filter(|x| x.is_finite());
    let (least, most) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
    // A sensor of few steps a turn ends a step before it; rounding puts it a little beyond.
    if !((JUMP * TAU..=1.001 * TAU).contains(&(most - least))) {
        return false;
    }
    let (mut turns, mut last, mut unwrapped) = (0.0, f64::NAN, false);
    for x in angle {
        if !x.is_finite() {
            continue;
        }
        let step = *x - last;
        if step.abs() > JUMP * TAU {
            turns -= step.signum();
            unwrapped = true;
        }
        last = *x;
        *x += turns * TAU;
    }
    unwrapped
}

struct Parser<'a> {
    rest: &'a str,
    columns: &'a [Column],
    find: &'a dyn Fn(&str) -> Option<usize>,
}

/// Brackets nest; a text of brackets alone nests without end.
const DEEPEST: usize = 32;

impl Parser<'_> {
    fn takes(&mut self, sign: char) -> bool {
        match self.rest.strip_prefix(sign) {
            Some(rest) => {
                self.rest = rest.trim_start();
                true
            }
            None => false,
        }
    }

    fn sum(&mut self, depth: usize) -> Result<Expression, Fault> {
        let mut left = self.product(depth)?;
        loop {
            if self.takes('+') {
                left = Expression::Sum(Box::new(left), Box::new(self.product(depth)?));
            } else if self.takes('-') {
                left = Expression::Difference(Box::new(left), Box::new(self.product(depth)?));
            } else {
                return Ok(left);
            }
        }
    }

    fn product(&mut self, depth: usize) -> Result<Expression, Fault> {
        let mut left = self.factor(depth)?;
        loop {
            if self.takes('*') {
                left = Expression::Product(Box::new(left), Box::new(self.factor(depth)?));
            } else if self.takes('/') {
                left = Expression::Quotient(Box::new(left), Box::new(self.factor(depth)?));
            } else {
                return Ok(left);
            }
        }
    }

    fn factor(&mut self, depth: usize) -> Result<Expression, Fault> {
        if depth > DEEPEST {
            return Err("there are too many brackets".into());
        }
        if let Some(index) = self.column() {
            let unit = match self.rest.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
                Some((unit, rest)) => {
                    self.rest = rest.trim_start();
                    Some(unit.trim().to_owned())
                }
                None => None,
            };
            return Ok(Expression::Column { index, unit });
        }
        if let Some(number) = self.number() {
            return Ok(Expression::Number(number));
        }
        if self.takes('-') {
            let inner = self.factor(depth + 1)?;
            return Ok(Expression::Product(Box::new(Expression::Number(-1.0)), Box::new(inner)));
        }
        let rate = self.rest.starts_with("ddt(");
        if rate {
            self.rest = &self.rest[3..];
        }
        if self.takes('(') {
            let inner = self.sum(depth + 1)?;
            if !self.takes(')') {
                return Err("a bracket is not closed".into());
            }
            return Ok(if rate { Expression::Rate(Box::new(inner)) } else { inner });
        }
        let end = self.rest.find(['*', '/', '+', '-', '(', ')', '[']).unwrap_or(self.rest.len());
        let token = self.rest[..end].trim();
        Err(if token.is_empty() { "a column is missing".into() } else { format!("there is no column '{token}'") })
    }

    /// The longest name of a column here, up to a sign.
    fn column(&mut self) -> Option<usize> {
        let ends = |at: usize| self.rest[at..].trim_start().chars().next().is_none_or(|c| "*/+-()[".contains(c));
        let longest = self.columns.iter().map(|c| c.name.len()).max().unwrap_or(0).min(self.rest.len());
        let at = (1..=longest).rev().filter(|at| self.rest.is_char_boundary(*at) && ends(*at));
        let (at, index) = at.filter_map(|at| Some((at, (self.find)(self.rest[..at].trim_end())?))).next()?;
        self.rest = self.rest[at..].trim_start();
        Some(index)
    }

    fn number(&mut self) -> Option<f64> {
        let digits = |c: char| c.is_ascii_digit() || c == '.';
        let mut end = self.rest.find(|c| !digits(c)).unwrap_or(self.rest.len());
        if end == 0 {
            return None;
        }
        if let Some(exponent) = self.rest[end..].strip_prefix(['e', 'E']) {
            let signed = exponent.strip_prefix(['+', '-']).unwrap_or(exponent);
            let length = signed.find(|c: char| !c.is_ascii_digit()).unwrap_or(signed.len());
            if length > 0 {
                end += 1 + (exponent.len() - signed.len()) + length;
            }
        }
        let number = self.rest[..end].parse().ok()?;
        self.rest = self.rest[end..].trim_start();
        Some(number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Result<Vec<f64>, Fault> {
        let columns: Vec<Column> = ["a", "b", "a-b", "x y"].map(|n| Column::new(n, vec![])).into();
        let find = |name: &str| columns.iter().position(|c| c.name == name);
        let numbers = [vec![1.0, 2.0, 4.0], vec![2.0, 4.0, 8.0], vec![7.0; 3], vec![5.0; 3]];
        let expression = Expression::parse(text, &columns, &find)?;
        expression.values(&|k, _| Ok(numbers[k].clone()), 3, 0.5)
    }

    #[test]
    fn expressions_are_computed() {
        for (text, expected) in [
            ("a*b", [2.0, 8.0, 32.0]),
            ("b/a", [2.0, 2.0, 2.0]),
            ("a * b * 0.5 + 1", [2.0, 5.0, 17.0]),
            ("-(a+b)*2e-1", [-0.6, -1.2, -2.4]),
            // A name is taken as it stands before its signs are read as operations.
            ("a-b", [7.0, 7.0, 7.0]),
            ("(a)-b", [-1.0, -2.0, -4.0]),
            ("x y*2", [10.0, 10.0, 10.0]),
            // Differences over one or two intervals of 0.5 s.
            ("ddt(a)", [2.0, 3.0, 4.0]),
        ] {
            let got = value(text).expect(text);
            for (x, y) in got.iter().zip(expected) {
                assert!((x - y).abs() < 1e-15, "{text}: {got:?}");
            }
        }
        for (text, fault) in
            [("a*c", "no column 'c'"), ("a*", "missing"), ("(a", "not closed"), ("a)", "not understood")]
        {
            assert!(value(text).expect_err(text).contains(fault), "{text}");
        }
    }

    #[test]
    fn an_angle_goes_on_after_a_turn() {
        let true_angle: Vec<f64> = (0..100).map(|k| 0.3 * f64::from(k)).collect();
        let mut wrapped: Vec<f64> = true_angle.iter().map(|x| x.rem_euclid(std::f64::consts::TAU)).collect();
        assert!(unwrap_turns(&mut wrapped));
        for (a, b) in wrapped.iter().zip(&true_angle) {
            // Rounding of up to five turns.
            assert!((a - b).abs() < 1e-13);
        }
        let mut steady = true_angle.clone();
        assert!(!unwrap_turns(&mut steady) && steady == true_angle);
    }
}
