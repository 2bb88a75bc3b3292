//! Grids of equally spaced values, and how one is found.

use crate::recording::SourceColumn;

/// Counts from −32,768 to 32,767.
const MOST: f64 = 65_535.0;
/// Decimals that a printed number is tried with.
const DECIMALS: i32 = 9;
/// Steps of Euclid's algorithm on two steps of a grid: a remainder is less than half of the number before the last, and
/// the quotient of two steps is below 2^16.
const EUCLID: usize = 40;
/// What is left of a division, against the divisor, that counts as nothing: rounding of some steps.
const NOTHING: f64 = 1e-6;

/// A grid: the value of a count is `(count + zero) · gain / divisor + offset`, computed in this order in doubles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Added to the count, a whole number: brings counts beyond 16 bits into them.
    pub zero: f64,
    /// Step, times the divisor.
    pub gain: f64,
    /// Power of ten where the values were printed with decimals; else one.
    pub divisor: f64,
    /// Added to the whole.
    pub offset: f64,
}

impl Grid {
    /// The value of a count.
    pub fn value(&self, count: i16) -> f64 {
        (f64::from(count) + self.zero) * self.gain / self.divisor + self.offset
    }

    /// The count of a value on the grid.
    pub fn count(&self, value: f64) -> Option<i16> {
        let count = self.position(value) - self.zero;
        let count = (f64::from(i16::MIN)..=f64::from(i16::MAX)).contains(&count).then_some(count as i16)?;
        same(self.value(count), value).then_some(count)
    }

    /// The nearest whole number of steps.
    fn position(&self, value: f64) -> f64 {
        ((value - self.offset) * self.divisor / self.gain).round()
    }

    /// A grid of this step with all values on it, if there is one.
    fn holding(gain: f64, divisor: f64, offset: f64, sorted: &[f64]) -> Option<Self> {
        if !(gain.is_finite() && gain != 0.0 && offset.is_finite()) {
            return None;
        }
        let grid = Self { zero: 0.0, gain, divisor, offset };
        let (a, b) = (grid.position(*sorted.first()?), grid.position(*sorted.last()?));
        let (low, high) = (a.min(b), a.max(b));
        // Whole numbers of that size are exact, and so is what is added to them.
        if !(high - low <= MOST && low.abs() < 2_f64.powi(52)) {
            return None;
        }
        let fits = low >= f64::from(i16::MIN) && high <= f64::from(i16::MAX);
        let grid = Self { zero: if fits { 0.0 } else { low - f64::from(i16::MIN) }, ..grid };
        sorted.iter().all(|x| grid.count(*x).is_some()).then_some(grid)
    }
}

/// Whether two numbers have the same bits: minus zero is not zero.
pub fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits()
}

/// A grid with all values on it. The values are distinct and rise.
pub fn of(sorted: &[f64], source: Option<&SourceColumn>) -> Option<Grid> {
    if sorted.len() > MOST as usize + 1 {
        return None;
    }
    let Some((first, last)) = sorted.first().zip(sorted.last()) else { return Grid::holding(1.0, 1.0, 0.0, &[0.0]) };
    let mapped = source.and_then(|s| Grid::holding(s.gain, 1.0, s.offset, sorted));
    if mapped.is_some() {
        return mapped;
    }
    for decimals in 0..=DECIMALS {
        let divisor = 10_f64.powi(decimals);
        if (last - first) * divisor > MOST {
            break;
        }
        if let Some(grid) = Grid::holding(1.0, divisor, 0.0, sorted) {
            return Some(grid);
        }
    }
    let step = step(sorted)?;
    // The step of many is known better than that of two, and a step that somebody chose has few digits.
    let steps = ((last - first) / step).round();
    let mean = (last - first) / steps.max(1.0);
    let short = |digits: usize| format!("{mean:.digits$e}").parse::<f64>().ok();
    let steps = [Some(step), Some(mean), short(3), short(5), short(7), short(9)];
    let nearest = sorted.iter().copied().min_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    let mut tried = steps.into_iter().flatten().flat_map(|gain| [(gain, 0.0), (gain, nearest), (gain, *first)]);
    tried.find_map(|(gain, offset)| Grid::holding(gain, 1.0, offset, sorted))
}

/// The largest step of which all differences are whole multiples, by Euclid's algorithm.
fn step(sorted: &[f64]) -> Option<f64> {
    let span = sorted.last()? - sorted.first()?;
    let least = span / MOST * 0.5;
    let mut step = 0.0_f64;
    for pair in sorted.windows(2) {
        let (mut a, mut b) = (pair[1] - pair[0], step);
        for _ in 0..EUCLID {
            if b <= NOTHING * a {
                break;
            }
            let rest = a % b;
            // Just below a multiple is a multiple, too.
            (a, b) = (b, rest.min(b - rest));
        }
        step = a;
        if step < least {
            return None;
        }
    }
    (step > 0.0).then_some(step)
}
