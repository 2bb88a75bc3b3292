//! Units of a formula's unknown constants, from what the formula has to come to.
//!
//! Each value on the stack has a dimension: powers of V, A, the unit of the speed and that of the torque, and powers of
//! the unknowns' own dimensions, which are sought. Sums, exponents and the arguments of functions demand that
//! dimensions agree or vanish, and the whole that it is V or N m; what these linear equations determine is the unit. A
//! plain number has no unit, unless it is added to something that has one whatever the unknowns are: that one it takes.
//! So it does in the argument of a function that holds no unknown.

use greyrig::term::{Op, Target};

use super::Formula;

/// What V, A, speed and torque are in the list of powers.
const VOLTAGE: usize = 0;
const CURRENT: usize = 1;
const SPEED: usize = 2;
const TORQUE: usize = 3;
const BASES: usize = 4;
/// Powers below this are rounding.
const NOTHING: f64 = 1e-9;

/// A value on the stack.
#[derive(Debug, Clone, PartialEq)]
struct Dimension {
    /// Powers of the bases, and of what has a power that is sought itself.
    powers: Vec<f64>,
    /// Powers of the unknowns' dimensions.
    unknowns: Vec<f64>,
    /// Made of numbers alone.
    number: bool,
    /// The number, if it is one.
    value: Option<f64>,
    /// The unknown, if it is one by itself.
    name: Option<usize>,
}

impl Dimension {
    fn none(unknowns: usize) -> Self {
        Self { powers: vec![0.0; BASES], unknowns: vec![0.0; unknowns], number: false, value: None, name: None }
    }

    fn of_base(base: usize, unknowns: usize) -> Self {
        let mut dimension = Self::none(unknowns);
        dimension.powers[base] = 1.0;
        dimension
    }

    /// a + factor b, power by power.
    fn plus(mut self, other: &Self, factor: f64) -> Self {
        self.powers.resize(self.powers.len().max(other.powers.len()), 0.0);
        self.powers.iter_mut().zip(&other.powers).for_each(|(a, b)| *a += factor * b);
        self.unknowns.iter_mut().zip(&other.unknowns).for_each(|(a, b)| *a += factor * b);
        Self { number: self.number && other.number, value: None, name: None, ..self }
    }

    fn times(mut self, factor: f64) -> Self {
        self.powers.iter_mut().chain(&mut self.unknowns).for_each(|a| *a *= factor);
        Self { value: None, name: None, ..self }
    }
}

/// A formula whose dimensions are being worked out.
struct Equations<'a> {
    formula: &'a Formula,
    is_linear: bool,
    /// What has to vanish.
    demands: Vec<Dimension>,
    /// Powers that are sought themselves, as units: `(rad/s)^n`.
    sought: Vec<String>,
}

impl Formula {
    /// The SI unit of an unknown, as `V/A2`, in a rotary drive or a linear one; none where the formula does not
    /// determine it.
    pub fn unit(&self, unknown: usize, is_linear: bool) -> Option<String> {
        let mut equations = Equations { formula: self, is_linear, demands: Vec::new(), sought: Vec::new() };
        let whole = equations.run()?;
        let target = match self.target {
            Target::Voltage => VOLTAGE,
            Target::Torque => TORQUE,
        };
        equations.agree(whole, Dimension::of_base(target, self.unknowns.len()));
        let powers = equations.solve(unknown)?;
        Some(written(&powers, &equations.sought, is_linear))
    }
}

impl Equations<'_> {
    /// Goes through the operations; the dimension of the whole.
    fn run(&mut self) -> Option<Dimension> {
        let formula = self.formula;
        let n = formula.unknowns.len();
        let mut stack: Vec<Dimension> = Vec::new();
        for &op in &formula.ops {
            let x = if op.operands() > 0 { stack.pop()? } else { Dimension::none(n) };
            let w = if op.operands() > 1 { stack.pop()? } else { Dimension::none(n) };
            stack.push(match op {
                Op::Constant(value) => Dimension { number: true, value: Some(value), ..x },
                Op::Unknown(k) => {
                    let mut dimension = Dimension { name: Some(usize::from(k)), ..x };
                    *dimension.unknowns.get_mut(usize::from(k))? = 1.0;
                    dimension
                }
                Op::Current => Dimension::of_base(CURRENT, n),
                Op::Speed => Dimension::of_base(SPEED, n),
                Op::Voltage => Dimension::of_base(VOLTAGE, n),
                Op::Add | Op::Sub => self.agree(w, x),
                Op::Mul => w.plus(&x, 1.0),
                Op::Div => w.plus(&x, -1.0),
                Op::Pow => self.power(w, &x)?,
                Op::Neg | Op::Abs => Dimension { value: None, name: None, ..x },
                Op::Sign => Dimension { number: x.number, ..Dimension::none(n) },
                Op::Sqrt => x.times(0.5),
                Op::Square => x.times(2.0),
                Op::PowI(power) => x.times(f64::from(power)),
                Op::Exp | Op::Ln | Op::Tanh | Op::Atan | Op::Sin | Op::Cos => {
                    let number = x.number;
                    // Without an unknown there is nothing to learn: in tanh(i/4) the number has a unit, 4 A.
                    if x.unknowns.iter().any(|power| power.abs() > NOTHING) {
                        self.demands.push(x);
                    }
                    Dimension { number, ..Dimension::none(n) }
                }
            });
        }
        stack.pop()
    }

    /// Two values that are added.
    fn agree(&mut self, a: Dimension, b: Dimension) -> Dimension {
        let plain = |d: Dimension| Dimension { value: None, name: None, ..d };
        if a.number || b.number {
            let other = if a.number { b } else { a };
            if other.unknowns.iter().all(|power| power.abs() < NOTHING) {
                return plain(other);
            }
            self.demands.push(other);
            return Dimension::none(self.formula.unknowns.len());
        }
        self.demands.push(a.clone().plus(&b, -1.0));
        plain(a)
    }

    fn power(&mut self, base: Dimension, exponent: &Dimension) -> Option<Dimension> {
        if !exponent.number {
            self.demands.push(exponent.clone());
        }
        if let Some(value) = exponent.value {
            return Some(base.times(value));
        }
        if base.number || base.powers.iter().chain(&base.unknowns).all(|power| power.abs() < NOTHING) {
            return Some(Dimension { number: base.number && exponent.number, ..base });
        }
        // A power that is sought: a unit of its own.
        let name = self.formula.unknowns.get(exponent.name?)?;
        if base.unknowns.iter().any(|power| *power != 0.0) {
            return None;
        }
        let unit = written(&base.powers, &self.sought, self.is_linear);
        let unit = if unit.contains([' ', '/']) { format!("({unit})^{name}") } else { format!("{unit}^{name}") };
        let place = self.sought.iter().position(|known| *known == unit).unwrap_or_else(|| {
            self.sought.push(unit);
            self.sought.len() - 1
        });
        let mut dimension = Dimension::none(self.formula.unknowns.len());
        dimension.powers.resize(BASES + place + 1, 0.0);
        dimension.powers[BASES + place] = 1.0;
        Some(dimension)
    }

    /// The powers of an unknown's unit, by elimination (Gauss and Jordan); none where they are not determined, or where
    /// the demands contradict one another.
    fn solve(&self, unknown: usize) -> Option<Vec<f64>> {
        let (n, bases) = (self.formula.unknowns.len(), BASES + self.sought.len());
        // Σ cₖ xₖ = −a, a row for each demand.
        let row = |d: &Dimension| {
            let own = (0..bases).map(|k| -d.powers.get(k).copied().unwrap_or(0.0));
            d.unknowns.iter().copied().chain(own).collect::<Vec<f64>>()
        };
        let mut rows: Vec<Vec<f64>> = self.demands.iter().map(row).collect();
        let mut pivots = Vec::new();
        for column in 0..n {
            let done = pivots.len();
            let Some(best) =
                (done..rows.len()).max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()))
            else {
                break;
            };
            if rows[best][column].abs() < NOTHING {
                continue;
            }
            rows.swap(done, best);
            let pivot = rows[done][column];
            rows[done].iter_mut().for_each(|a| *a /= pivot);
            let pivot = rows[done].clone();
            for (_, row) in rows.iter_mut().enumerate().filter(|(k, _)| *k != done) {
                let factor = row[column];
                row.iter_mut().zip(&pivot).for_each(|(a, b)| *a -= factor * b);
            }
            pivots.push(column);
        }
        if rows[pivots.len()..].iter().flat_map(|row| &row[n..]).any(|a| a.abs() > NOTHING) {
            return None;
        }
        let row = &rows[pivots.iter().position(|column| *column == unknown)?];
        let alone = row[..n].iter().enumerate().all(|(k, a)| k == unknown || a.abs() < NOTHING);
        alone.then(|| row[n..].to_vec())
    }
}

/// Powers as a unit: `V s/(rad A)`, and `1` without any.
fn written(powers: &[f64], sought: &[String], is_linear: bool) -> String {
    let (angle, torque) = if is_linear { ("m", &["N"][..]) } else { ("rad", &["N", "m"][..]) };
    let power = |k: usize| powers.get(k).copied().unwrap_or(0.0);
    let mut parts: Vec<(&str, f64)> = vec![("V", power(VOLTAGE))];
    parts.extend(torque.iter().map(|unit| (*unit, power(TORQUE))));
    parts.extend([("s", -power(SPEED)), (angle, power(SPEED)), ("A", power(CURRENT))]);
    parts.extend(sought.iter().enumerate().map(|(k, unit)| (unit.as_str(), power(BASES + k))));
    let side = |sign: f64| -> Vec<String> {
        let there = parts.iter().filter(|(_, power)| sign * power > NOTHING);
        there.map(|(unit, power)| raised(unit, sign * power)).collect()
    };
    let (above, below) = (side(1.0), side(-1.0));
    let above = if above.is_empty() { "1".to_owned() } else { above.join(" ") };
    match &below[..] {
        [] => above,
        [one] => format!("{above}/{one}"),
        several => format!("{above}/({})", several.join(" ")),
    }
}

/// A unit to a power: `A2`, `A^0.5`.
fn raised(unit: &str, power: f64) -> String {
    if (power - 1.0).abs() < NOTHING {
        unit.to_owned()
    } else if (power - power.round()).abs() < NOTHING && unit.chars().all(char::is_alphabetic) {
        format!("{unit}{power:.0}")
    } else {
        format!("{unit}^{}", crate::numbers::rounded(power))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn units(text: &str) -> Vec<Option<String>> {
        let formula = Formula::parse(text).unwrap_or_else(|e| panic!("{text}: {e}"));
        (0..formula.unknowns().len()).map(|k| formula.unit(k, false)).collect()
    }

    #[test]
    fn units_follow_from_what_a_formula_comes_to() {
        let cases: [(&str, &[&str]); 15] = [
            ("k*i*abs(i)", &["V/A2"]),
            ("k*i", &["V/A"]),
            ("k", &["V"]),
            ("k*i*w", &["V s/(rad A)"]),
            ("torque: k*w", &["N m s/rad"]),
            ("torque: k*w*abs(w)", &["N m s2/rad2"]),
            ("torque: k*sign(w)", &["N m"]),
            ("torque: a*tanh(w/b)", &["N m", "rad/s"]),
            ("k*sign(i)*sqrt(abs(i))", &["V/A^0.5"]),
            ("k*u", &["1"]),
            ("k*w*tanh(i/4)", &["V s/rad"]),
            ("a*i/(b + abs(i))", &["V", "A"]),
            ("a*i/(1 + c*i^2)", &["V/A", "1/A2"]),
            ("torque: a*sign(w)*abs(w)^n", &["N m/(rad/s)^n", "1"]),
            ("a*i + b*w", &["V/A", "V s/rad"]),
        ];
        for (text, expected) in cases {
            let found = units(text);
            assert_eq!(found, expected.iter().map(|unit| Some((*unit).to_owned())).collect::<Vec<_>>(), "{text}");
        }
    }

    #[test]
    fn what_no_formula_determines_has_no_unit() {
        // Only the product has one.
        assert_eq!(units("a*b*i"), [None, None]);
        assert_eq!(units("k*(i + w)"), [None]);
    }

    #[test]
    fn of_a_linear_drive() {
        let formula = Formula::parse("torque: k*w").expect("a formula");
        assert_eq!(formula.unit(0, true), Some("N s/m".to_owned()));
    }
}
