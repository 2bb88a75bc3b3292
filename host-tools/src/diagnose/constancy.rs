//! Whether the parameters are constants: with time, and for the size of an effect with current and speed.
//!
//! A parameter p that varies adds a column to the balances, ∂r/∂p times what it varies with:
//!
//! ```text
//! r(t) ≈ r₀(t) + ∂r/∂p (δ + Δ f(t))      f = 1(t > τ), |i|/î, |ω|/ω̂
//! ```
//! A free parameter of the base may be another one from a border τ between blocks of validation on: in that recording,
//! or in those after it as well, which are taken in the order in which they are given. The size of an effect may go
//! with the current or the speed, which no law of the catalogue says of it: its law has another form then.
//!
//! The pair (p, f) that takes most of the squares with all parameters free to move is judged on data held out, like any
//! effect: by how much the error falls, by its significance for as many columns as were tried, and by decoys; and it
//! has to take most of what is left. The balances are linear in the base parameters and in most sizes, so that δ and Δ
//! are exact; what the load and the noise add is in the p-value by its correlation. A slow drift is told as a change in
//! the middle of it.
//!
//! Source: R. E. Quandt, The estimation of the parameters of a linear regression system obeying two separate regimes,
//! J. Am. Stat. Assoc. 53 (1958) 873–880; D. W. K. Andrews, Tests for parameter instability and structural change with
//! unknown change point, Econometrica 61 (1993) 821–856; T. Hastie and R. Tibshirani, Varying-coefficient models, J. R.
//! Stat. Soc. B 55 (1993) 757–796.

use std::sync::OnceLock;

use greyrig::effects::EffectId;
use nalgebra::DVector;
use rayon::prelude::*;

use super::completeness::{Completeness, Floor};
use super::criteria::{OVER_DECOYS, SIGNIFICANCE, SMALLEST_GAIN};
use super::screening::Complement;
use crate::identify::cross_validation::{held_out, p_value};
use crate::identify::equation_error::{Balance, EquationError};
use crate::identify::minimise::{Fit, Residuals, rms_of};
use crate::identify::space::Key;

/// Least part of a column that the parameters do not already explain.
const LEAST_OWN: f64 = 1e-2;

/// What a parameter varies with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum With {
    /// It is another one from a border between two blocks on.
    Time(Border),
    /// With the magnitude of the current, up to so many A.
    Current(f64),
    /// With the magnitude of the speed, up to so many rad/s.
    Speed(f64),
}

/// A border between two blocks of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Border {
    /// The recording, counted from zero.
    pub recording: usize,
    /// Whether the recordings after it count as later, too.
    pub lasts: bool,
    /// The last row before it, s.
    pub at_s: f64,
    /// Length of a block, s: how well the time of a change is known.
    pub within_s: f64,
}

/// A parameter that is no constant.
#[derive(Debug, Clone, PartialEq)]
pub struct Variation {
    /// The parameter.
    pub key: Key,
    /// Its name.
    pub name: String,
    /// What it varies with.
    pub with: With,
    /// Value before, or at zero, and afterwards, or at the largest current or speed, SI.
    pub values: [f64; 2],
    /// Fall of the error on data held out, sum of the logarithms of both balances.
    pub gain: f64,
}

impl Variation {
    /// The effect whose law has another form.
    pub fn of_law(&self) -> Option<EffectId> {
        match (self.with, self.key) {
            (With::Current(_) | With::Speed(_), Key::Effect(id, _)) => Some(id),
            _ => None,
        }
    }
}

/// What is tried: the place of a parameter among the free ones, and what it may vary with.
type Try = (usize, With);

/// Looks for a parameter that varies in what a fit of the balances leaves over, against its floor. `blocks` are those
/// of the rows, `decoy_gain` what a decoy gains at most.
pub fn find(
    fit: &Fit,
    problem: &EquationError<'_>,
    blocks: &[usize],
    floor: &Floor,
    decoy_gain: f64,
) -> Option<Variation> {
    let mean = |term: fn(f64, f64) -> f64| {
        let sum = |term: &(dyn Fn(f64, f64, f64) -> f64 + Sync)| {
            problem.column(Balance::Voltage, &term) + problem.column(Balance::Torque, &term)
        };
        let (values, ones) = (sum(&|i, w, _| term(i, w)), sum(&|_, _, _| 1.0));
        values.zip_map(&ones, |value, one| if one == 0.0 { 0.0 } else { (value / one).abs() })
    };
    let (current, speed) = (mean(|i, _| i.abs()), mean(|_, w| w.abs()));
    let rows = Rows { times: problem.times(), blocks, current, speed };
    rows.find(fit, problem.groups(), floor, decoy_gain)
}

/// The rows of the balances.
struct Rows<'a> {
    /// Recording and time, s.
    times: &'a [(usize, f64)],
    /// Block of validation.
    blocks: &'a [usize],
    /// Mean magnitude of the current, A.
    current: DVector<f64>,
    /// Mean magnitude of the speed, rad/s.
    speed: DVector<f64>,
}

impl Rows<'_> {
    fn find(&self, fit: &Fit, groups: &[u8], floor: &Floor, decoy_gain: f64) -> Option<Variation> {
        let entries: Vec<_> = fit.space.free().collect();
        let free = || (0..entries.len()).filter(|place| !entries[*place].rests_at_a_limit());
        let borders = self.borders();
        let of_base = free().filter(|place| entries[*place].key.base().is_some());
        let in_time = of_base.flat_map(|place| borders.iter().map(move |border| (place, With::Time(*border))));
        let state = [With::Current(self.current.max()), With::Speed(self.speed.max())];
        let of_effects = free().filter(|place| entries[*place].is_size());
        let in_state = of_effects.flat_map(|place| state.map(|with| (place, with)));
        let tries: Vec<Try> = in_time.chain(in_state).collect();
        let complement = Complement::of(&fit.jacobian);
        let taken = |(place, with): &Try| {
            let column = self.column(fit, *place, *with);
            let own = complement.project(&column);
            let square = own.norm_squared();
            let is_own = square > LEAST_OWN * LEAST_OWN * column.norm_squared();
            if is_own { own.dot(&fit.residuals).powi(2) / square } else { 0.0 }
        };
        let squares: Vec<f64> = tries.par_iter().map(taken).collect();
        let best = (0..tries.len()).max_by(|a, b| squares[*a].total_cmp(&squares[*b]))?;
        let (place, with) = tries[best];

        let (more, solved) = with_column(fit, &self.column(fit, place, with), groups)?;
        let (before, after) = (held_out(fit, groups, self.blocks), held_out(&more, groups, self.blocks));
        let gain = before.log_error() - after.log_error();
        let p = p_value(&before, &after, &more, groups, 1) * tries.len() as f64;
        let [was, left] = [fit, &more].map(|fit| Completeness::of(fit, floor));
        if gain < SMALLEST_GAIN.max(OVER_DECOYS * decoy_gain) || p > SIGNIFICANCE || left.leaves_most(&was) {
            return None;
        }
        let entry = entries[place];
        let slope = entry.slope(fit.space.coordinates()[place]);
        let first = entry.value - slope * solved[place];
        let values = [first, first - slope * solved[entries.len()]];
        Some(Variation { key: entry.key, name: entry.name.clone(), with, values, gain })
    }

    /// The column of a parameter that varies.
    fn column(&self, fit: &Fit, place: usize, with: With) -> DVector<f64> {
        let share = |k: usize| match with {
            With::Time(border) => match self.times[k] {
                (recording, t) if recording == border.recording => f64::from(t > border.at_s),
                (recording, _) => f64::from(border.lasts && recording > border.recording),
            },
            With::Current(largest) => self.current[k] / largest.max(f64::MIN_POSITIVE),
            With::Speed(largest) => self.speed[k] / largest.max(f64::MIN_POSITIVE),
        };
        let own = fit.jacobian.column(place);
        DVector::from_fn(own.len(), |k, _| own[k] * share(k))
    }

    /// The borders between the blocks of each recording.
    fn borders(&self) -> Vec<Border> {
        let count = self.blocks.iter().max().map_or(0, |b| b + 1);
        let mut extents: Vec<Option<(usize, f64, f64)>> = vec![None; count];
        for ((recording, t), block) in self.times.iter().zip(self.blocks) {
            let extent = extents[*block].get_or_insert((*recording, *t, *t));
            (extent.1, extent.2) = (extent.1.min(*t), extent.2.max(*t));
        }
        let extents: Vec<_> = extents.into_iter().flatten().collect();
        let last = extents.last().map_or(0, |extent| extent.0);
        let border = |two: &[(usize, f64, f64)], lasts| {
            let recording = two[0].0;
            let counts = recording == two[1].0 && !(lasts && recording == last);
            counts.then(|| Border { recording, lasts, at_s: two[0].2, within_s: two[1].1 - two[0].1 })
        };
        extents.windows(2).flat_map(|two| [false, true].map(|lasts| border(two, lasts))).flatten().collect()
    }
}

/// A fit with one more column, by a linear step, and the step.
fn with_column(fit: &Fit, column: &DVector<f64>, groups: &[u8]) -> Option<(Fit, Vec<f64>)> {
    let last = fit.jacobian.ncols();
    let mut jacobian = fit.jacobian.clone().insert_column(last, 0.0);
    jacobian.set_column(last, column);
    let lengths: Vec<f64> = jacobian.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)).collect();
    let mut scaled = jacobian.clone();
    scaled.column_iter_mut().zip(&lengths).for_each(|(mut c, length)| c /= *length);
    let normal = scaled.tr_mul(&scaled).svd(true, true).solve(&scaled.tr_mul(&fit.residuals), 1e-12).ok()?;
    let residuals = &fit.residuals - scaled * &normal;
    let shrunk = rms_of(&residuals, groups);
    let rms = [0, 1].map(|g| fit.rms[g] * shrunk[g]);
    // Weighted by what they are now.
    let weigh = |k: usize| shrunk[usize::from(groups[k])].max(f64::MIN_POSITIVE);
    let residuals = DVector::from_fn(residuals.len(), |k, _| residuals[k] / weigh(k));
    let jacobian = nalgebra::DMatrix::from_fn(jacobian.nrows(), last + 1, |k, c| jacobian[(k, c)] / weigh(k));
    let solved = normal.iter().zip(&lengths).map(|(x, length)| x / length).collect();
    Some((
        Fit { space: fit.space.clone(), residuals, jacobian, rms, ended: fit.ended, known_held_out: OnceLock::new() },
        solved,
    ))
}

#[cfg(test)]
mod tests {
    use greyrig::motor::BaseParameter;
    use nalgebra::DMatrix;

    use super::*;
    use crate::identify::space::{Freedom, Space};
    use crate::model::{Base, Kind};

    /// Two recordings of 8 s, 100 rows a second, blocks of 1 s: recording and time, and block.
    fn times() -> (Vec<(usize, f64)>, Vec<usize>) {
        (0..1600).map(|k| ((k / 800, f64::from(k as u32 % 800) * 0.01), k / 100)).unzip()
    }

    /// A current, A, at a time.
    fn current(t: f64) -> f64 {
        2.0 + (0.9 * t).sin()
    }

    /// What is found in `u = p c + noise` of 0.3 V, of which a fit takes p for a constant; `column` is c, A or 1, by
    /// the current, `size` is p by recording, time and current.
    fn found(key: Key, column: fn(f64) -> f64, size: impl Fn(usize, f64, f64) -> f64) -> Option<Variation> {
        let (times, blocks) = times();
        let noise = |k: usize| 0.3 * ((k as f64 * 12.9898).sin() * 43_758.545).fract();
        let mut space = Space::new(Kind::PmDc, Base::Full, &[EffectId::VoltageOffset]);
        let all: Vec<Key> = space.free().map(|entry| entry.key).collect();
        space.hold(all.into_iter().filter(|other| *other != key), Freedom::Pinned);
        let rows = DVector::from_fn(1600, |k, _| column(current(times[k].1)));
        let u = DVector::from_fn(1600, |k, _| size(times[k].0, times[k].1, current(times[k].1)) * rows[k] + noise(k));
        let fitted = rows.dot(&u) / rows.norm_squared();
        space.get_mut(key).unwrap().value = fitted;
        let slope = space.get(key).unwrap().slope(space.coordinates()[0]);
        let residuals = &rows * fitted - u;
        let rms = (residuals.norm_squared() / 1600.0).sqrt();
        let fit = Fit {
            space,
            jacobian: DMatrix::from_columns(&[&rows * (slope / rms)]),
            residuals: residuals / rms,
            rms: [rms, f64::NAN],
            ended: true,
            known_held_out: OnceLock::new(),
        };
        let currents = DVector::from_fn(1600, |k, _| current(times[k].1));
        let rows = Rows { times: &times, blocks: &blocks, current: currents, speed: DVector::zeros(1600) };
        rows.find(&fit, &[0; 1600], &Floor::UNKNOWN, 0.0)
    }

    #[test]
    fn a_resistance_that_changes_is_told_with_the_time_and_both_values() {
        let changes = |recording, t, _| if recording == 1 && t > 3.5 { 2.4 } else { 2.0 };
        let change = found(BaseParameter::R.into(), |i| i, changes).expect("0.8 V of 0.17 V of noise");
        let With::Time(border) = change.with else { panic!("{change:?}") };
        assert_eq!((change.name.as_str(), border.recording), ("R", 1));
        // The change lies within a block of 1 s, whose half is counted wrong: the borders beside it are as good.
        assert!((2.9..=4.1).contains(&border.at_s), "{change:?}");
        // Of 1,150 rows before, 50 at most are wrong by 0.4 Ω; of 450 after, as many: 0.02 and 0.05 Ω.
        let [before, after] = change.values;
        assert!((before - 2.0).abs() < 0.03 && (after - 2.4).abs() < 0.06, "{change:?}");
        assert_eq!(change.of_law(), None);
    }

    #[test]
    fn a_change_lasts_for_the_recordings_after_it() {
        let change = found(
            BaseParameter::R.into(),
            |i| i,
            |recording, t, _| {
                if recording == 1 || t > 5.0 { 2.4 } else { 2.0 }
            },
        );
        let With::Time(border) = change.expect("a change").with else { panic!("a change in time") };
        assert!(border.lasts && border.recording == 0 && (border.at_s - 5.0).abs() < 0.02, "{border:?}");
    }

    #[test]
    fn a_size_that_goes_with_the_current_is_another_form_of_its_law() {
        let size = Key::size_of(EffectId::VoltageOffset);
        let grows = found(size, |_| 1.0, |_, _, i| 2.0 + 0.4 * i).expect("0.8 V of 0.17 V of noise");
        assert_eq!(grows.of_law(), Some(EffectId::VoltageOffset));
        // At zero and at the largest current, 3 A. The noise leaves 0.17/√1600 of a constant, and twice that of the
        // slope at the ends, which lie at one and three standard deviations of the current from its mean.
        let [at_zero, at_most] = grows.values;
        assert!((at_zero - 2.0).abs() < 0.05 && (at_most - 3.2).abs() < 0.05, "{grows:?}");
    }

    #[test]
    fn noise_is_no_change() {
        assert_eq!(found(BaseParameter::R.into(), |i| i, |_, _, _| 2.0), None);
        assert_eq!(found(Key::size_of(EffectId::VoltageOffset), |_| 1.0, |_, _, _| 2.0), None);
    }
}
