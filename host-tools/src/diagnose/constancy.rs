//! Whether the parameters are constants: with time, and for the size of an effect with current and speed.
//!
//! A parameter p that varies adds a column to the balances, ∂r/∂p times what it varies with:
//!
//! ```text
//! r(t) ≈ r₀(t) + ∂r/∂p (δ + Δ f(t))      f = 1(t > τ), t/T, |i|/î, |ω|/ω̂
//! ```
//! A free parameter of the base may be another one from an instant τ on: in that recording, or in those after it as
//! well, which are taken in the order in which they are given. τ is a border between blocks of validation at first, and
//! looked for ever more closely then. Or it may drift from the begin of each recording on, the longest of which takes
//! T. The size of an effect may go with the current or the speed, which no law of the catalogue says of it: its law has
//! another form then.
//!
//! The pair (p, f) that takes most of the squares with all parameters free to move is judged on data held out, like any
//! effect: by how much the error falls, by its significance for as many columns as were tried, and by decoys; and it
//! has to take most of what is left. The balances are linear in the base parameters and in most sizes, so that δ and Δ
//! are exact; what the load and the noise add is in the p-value by its correlation.
//!
//! Source: R. E. Quandt, The estimation of the parameters of a linear regression system obeying two separate regimes,
//! J. Am. Stat. Assoc. 53 (1958) 873–880; D. W. K. Andrews, Tests for parameter instability and structural change with
//! unknown change point, Econometrica 61 (1993) 821–856; T. Hastie and R. Tibshirani, Varying-coefficient models, J. R.
//! Stat. Soc. B 55 (1993) 757–796.

use greyrig::effects::{Description, EffectId, Seen};
use nalgebra::DVector;
use rayon::prelude::*;

use super::completeness::{Completeness, Floor};
use super::criteria::{LEAST_INDEPENDENT, OVER_DECOYS, SIGNIFICANCE, SMALLEST_GAIN};
use super::screening::Complement;
use crate::identify::cross_validation::{held_out, p_value};
use crate::identify::equation_error::{Balance, EquationError};
use crate::identify::minimise::{Fit, Residuals, rms_of};
use crate::identify::space::Key;

/// Blocks by which a parameter has to be told on either side of a border: (Σ e)²/Σ e² of its part e of the squares in
/// each. With one a change would be the difference between a run-up and all the rest.
const FEWEST_BLOCKS: f64 = 2.0;

/// How closely the instant of a change is looked for, s: no load is put on, and no coupling lets go, within less.
const FINEST_S: f64 = 1e-3;
/// By how much more closely each time.
const CLOSER: f64 = 8.0;

/// What a parameter varies with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum With {
    /// It is another one from a border between two blocks on.
    Time(Border),
    /// With the time since a recording began, of which the longest takes so many s.
    Drift(f64),
    /// With the magnitude of the current, up to so many A.
    Current(f64),
    /// With the magnitude of the speed, up to so many rad/s.
    Speed(f64),
}

/// The effect that is a parameter which jumps.
pub fn jump() -> Option<&'static Description> {
    Description::all().find(|d| d.seen == Seen::Course)
}

/// A border between two blocks of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Border {
    /// The recording, counted from zero.
    pub recording: usize,
    /// Whether the recordings after it count as later, too.
    pub lasts: bool,
    /// When, s since the first sample.
    pub at_s: f64,
    /// Length of a block, s: how well the time of a change is known.
    pub within_s: f64,
}

impl Border {
    /// Whether it lies before a row of a recording at a time, s.
    fn is_before(&self, (recording, t): (usize, f64)) -> bool {
        if recording == self.recording { t > self.at_s } else { self.lasts && recording > self.recording }
    }
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
    /// Its significance, over the number of changes tried.
    pub p_value: f64,
    /// The logarithm of the error on data held out, with it.
    pub log_error: f64,
    /// Whether nearly nothing is left with it.
    pub explains: bool,
}

impl Variation {
    /// The effect whose law has another form.
    pub fn of_law(&self) -> Option<EffectId> {
        match (self.with, self.key) {
            (With::Current(_) | With::Speed(_), Key::Effect(id, _)) => Some(id),
            _ => None,
        }
    }

    /// Whether a change in time shows in another fit of the same model as well, which has rows of these groups, times
    /// and blocks: on data held out, and in the same direction. The balances take noise of the speed for acceleration,
    /// so that their inertia is smaller where nothing accelerates; the free run does not. (There the state at the
    /// border is taken to follow the parameter at once.)
    pub fn shows_in(&self, fit: &Fit, groups: &[u8], times: &[(usize, f64)], blocks: &[usize]) -> bool {
        let Some(place) = fit.space.free().position(|entry| entry.key == self.key) else { return false };
        let column = match self.with {
            With::Time(border) => later(fit, place, border, times),
            With::Drift(longest) => drifting(fit, place, longest, times),
            With::Current(_) | With::Speed(_) => return true,
        };
        let complement = Complement::of(&fit.jacobian);
        let Some((more, step)) = complement.with_column(fit, &column, LEAST_INDEPENDENT) else { return false };
        let gain = held_out(fit, groups, blocks).fall_to(&held_out(&more, groups, blocks));
        gain > SMALLEST_GAIN && step * (self.values[1] - self.values[0]) > 0.0
    }
}

/// The column of a parameter by its place among the free ones, behind a border.
fn later(fit: &Fit, place: usize, border: Border, times: &[(usize, f64)]) -> DVector<f64> {
    let own = fit.jacobian.column(place);
    DVector::from_fn(own.len(), |k, _| if border.is_before(times[k]) { own[k] } else { 0.0 })
}

/// The column of a parameter by its place among the free ones that drifts while the longest recording runs, s.
fn drifting(fit: &Fit, place: usize, longest: f64, times: &[(usize, f64)]) -> DVector<f64> {
    let own = fit.jacobian.column(place);
    DVector::from_fn(own.len(), |k, _| own[k] * times[k].1 / longest)
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

/// Looks for a parameter that changes in time in what a fit of the free run leaves over, against its floor; its rows
/// have these groups, times and blocks. Where the rotor accelerates for moments alone, the balances know little of it.
pub fn find_in_free_run(
    fit: &Fit,
    groups: &[u8],
    times: &[(usize, f64)],
    blocks: &[usize],
    floor: &Floor,
) -> Option<Variation> {
    let nothing = DVector::zeros(groups.len());
    Rows { times, blocks, current: nothing.clone(), speed: nothing }.find(fit, groups, floor, 0.0)
}

/// The rows of the balances, or of the free run.
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
        let of_base = || free().filter(|place| entries[*place].key.base().is_some());
        let is_told = |(place, border): &(usize, Border)| self.is_told_on_both_sides(fit, *place, *border);
        let in_time = of_base().flat_map(|place| borders.iter().map(move |border| (place, *border)));
        let in_time = in_time.filter(is_told).map(|(place, border)| (place, With::Time(border)));
        let longest = self.times.iter().fold(f64::MIN_POSITIVE, |longest, (_, t)| longest.max(*t));
        let drifts = of_base().map(|place| (place, With::Drift(longest)));
        let state = [With::Current(self.current.max()), With::Speed(self.speed.max())];
        let of_effects = free().filter(|place| entries[*place].is_size());
        let in_state = of_effects.flat_map(|place| state.map(|with| (place, with)));
        let tries: Vec<Try> = in_time.chain(drifts).chain(in_state).collect();
        let complement = Complement::of(&fit.jacobian);
        let taken = |(place, with): &Try| {
            let column = self.column(fit, *place, *with);
            let own = complement.project(&column);
            let square = own.norm_squared();
            let is_own = square > LEAST_INDEPENDENT.powi(2) * column.norm_squared();
            if is_own { own.dot(&fit.residuals).powi(2) / square } else { 0.0 }
        };
        let best_of = |tries: &[Try]| {
            let squares: Vec<f64> = tries.par_iter().map(taken).collect();
            (0..tries.len()).max_by(|a, b| squares[*a].total_cmp(&squares[*b])).map(|best| tries[best])
        };
        let (place, mut with) = best_of(&tries)?;
        let mut spacing = match with {
            With::Time(border) => border.within_s,
            _ => 0.0,
        };
        // From block to block at first, then ever more closely.
        while let With::Time(border) = with
            && spacing > FINEST_S
        {
            spacing /= CLOSER;
            let around = (-CLOSER as i32..=CLOSER as i32).map(|k| border.at_s + f64::from(k) * spacing);
            let around = around.filter(|at_s| *at_s > 0.0).map(|at_s| (place, With::Time(Border { at_s, ..border })));
            with = best_of(&around.collect::<Vec<_>>())?.1;
        }

        let column = self.column(fit, place, with);
        let (more, step) = complement.with_column(fit, &column, LEAST_INDEPENDENT)?;
        let (before, after) = (held_out(fit, groups, self.blocks), held_out(&more, groups, self.blocks));
        let gain = before.fall_to(&after);
        let p = p_value(&before, &after, &more, groups, 1) * tries.len() as f64;
        let shrunk = rms_of(&more.residuals, groups);
        let left = Completeness::of_rms([0, 1].map(|g| fit.rms[g] * shrunk[g]), floor);
        let was = Completeness::of(fit, floor);
        if gain < SMALLEST_GAIN.max(OVER_DECOYS * decoy_gain) || p > SIGNIFICANCE || left.leaves_most(&was) {
            return None;
        }
        let entry = entries[place];
        let slope = entry.slope(fit.space.coordinates()[place]);
        let first = entry.value - slope * step * share_of(fit, place, &column);
        let values = [first, first + slope * step];
        Some(Variation {
            key: entry.key,
            name: entry.name.clone(),
            with,
            values,
            gain,
            p_value: p.min(1.0),
            log_error: after.log_error(),
            explains: left.explains(&was),
        })
    }

    /// Whether enough blocks tell of a parameter on either side of a border.
    fn is_told_on_both_sides(&self, fit: &Fit, place: usize, border: Border) -> bool {
        let mut squares = vec![[0.0; 2]; self.blocks.iter().max().map_or(0, |b| b + 1)];
        let own = fit.jacobian.column(place);
        for ((x, block), time) in own.iter().zip(self.blocks).zip(self.times) {
            squares[*block][usize::from(border.is_before(*time))] += x * x;
        }
        let blocks = |side: usize| {
            let (sum, square) = squares.iter().fold((0.0, 0.0), |(s, q), e| (s + e[side], q + e[side] * e[side]));
            sum * sum / square
        };
        [0, 1].map(blocks).iter().all(|blocks| *blocks >= FEWEST_BLOCKS)
    }

    /// The column of a parameter that varies.
    fn column(&self, fit: &Fit, place: usize, with: With) -> DVector<f64> {
        let own = fit.jacobian.column(place);
        let scaled = |by: &DVector<f64>, largest: f64| own.component_mul(by) / largest.max(f64::MIN_POSITIVE);
        match with {
            With::Time(border) => later(fit, place, border, self.times),
            With::Drift(longest) => drifting(fit, place, longest, self.times),
            With::Current(largest) => scaled(&self.current, largest),
            With::Speed(largest) => scaled(&self.speed, largest),
        }
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

/// The coefficient of a parameter where all of them together explain a column, by the part of the parameter's own that
/// the others do not explain (Frisch and Waugh).
fn share_of(fit: &Fit, place: usize, column: &DVector<f64>) -> f64 {
    let own =
        Complement::of(&fit.jacobian.clone().remove_column(place)).project(&fit.jacobian.column(place).into_owned());
    own.dot(column) / own.norm_squared()
}

#[cfg(test)]
mod tests {
    use std::sync::OnceLock;

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

    /// A fit that takes p of `u = p c + noise` of 0.3 V for a constant; c, A or 1, and p are by recording and time.
    fn fit(key: Key, column: impl Fn(usize, f64) -> f64, size: impl Fn(usize, f64) -> f64) -> Fit {
        let (times, _) = times();
        let noise = |k: usize| 0.3 * ((k as f64 * 12.9898).sin() * 43_758.545).fract();
        let mut space = Space::new(Kind::PmDc, Base::Full, &[EffectId::VoltageOffset]);
        let all: Vec<Key> = space.free().map(|entry| entry.key).collect();
        space.hold(all.into_iter().filter(|other| *other != key), Freedom::Pinned);
        let rows = DVector::from_fn(1600, |k, _| column(times[k].0, times[k].1));
        let u = DVector::from_fn(1600, |k, _| size(times[k].0, times[k].1) * rows[k] + noise(k));
        let fitted = rows.dot(&u) / rows.norm_squared();
        space.get_mut(key).unwrap().value = fitted;
        let slope = space.get(key).unwrap().slope(space.coordinates()[0]);
        let residuals = &rows * fitted - u;
        let rms = (residuals.norm_squared() / 1600.0).sqrt();
        Fit {
            space,
            jacobian: DMatrix::from_columns(&[&rows * (slope / rms)]),
            residuals: residuals / rms,
            rms: [rms, f64::NAN],
            ended: true,
            known_held_out: OnceLock::new(),
        }
    }

    /// What is found in a fit.
    fn found(fit: &Fit) -> Option<Variation> {
        let (times, blocks) = times();
        let currents = DVector::from_fn(1600, |k, _| current(times[k].1));
        let rows = Rows { times: &times, blocks: &blocks, current: currents, speed: DVector::zeros(1600) };
        rows.find(fit, &[0; 1600], &Floor::UNKNOWN, 0.0)
    }

    /// A fit of a resistance.
    fn of_resistance(size: impl Fn(usize, f64) -> f64) -> Fit {
        fit(BaseParameter::R.into(), |_, t| current(t), size)
    }

    #[test]
    fn a_resistance_that_changes_is_told_with_the_time_and_both_values() {
        let changes = of_resistance(|recording, t| if recording == 1 && t > 3.5 { 2.4 } else { 2.0 });
        let change = found(&changes).expect("0.8 V of 0.17 V of noise");
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
        let change = found(&of_resistance(|recording, t| if recording == 1 || t > 5.0 { 2.4 } else { 2.0 }));
        let With::Time(border) = change.expect("a change").with else { panic!("a change in time") };
        assert!(border.lasts && border.recording == 0 && (border.at_s - 5.0).abs() < 0.02, "{border:?}");
    }

    #[test]
    fn a_size_that_goes_with_the_current_is_another_form_of_its_law() {
        let size = Key::size_of(EffectId::VoltageOffset);
        let grows = fit(size, |_, _| 1.0, |_, t| 2.0 + 0.4 * current(t));
        let grows = found(&grows).expect("0.8 V of 0.17 V of noise");
        assert_eq!(grows.of_law(), Some(EffectId::VoltageOffset));
        // At zero and at the largest current, 3 A. The noise leaves 0.17/√1600 of a constant, and twice that of the
        // slope at the ends, which lie at one and three standard deviations of the current from its mean.
        let [at_zero, at_most] = grows.values;
        assert!((at_zero - 2.0).abs() < 0.05 && (at_most - 3.2).abs() < 0.05, "{grows:?}");
    }

    /// A motor that runs up in its first second and steadily from then on tells its inertia once: what is left of the
    /// rest is no other inertia.
    #[test]
    fn a_run_up_and_what_follows_are_no_change() {
        let runs_up = |recording: usize, t: f64| recording == 0 && t < 1.0;
        let acceleration = |recording, t| if runs_up(recording, t) { 10.0 } else { 0.1 };
        let once =
            fit(BaseParameter::J.into(), acceleration, |recording, t| if runs_up(recording, t) { 2.0 } else { 12.0 });
        assert_eq!(found(&once), None);
        // The same where it runs up in every second second, and its inertia is another one from 8 s on.
        let often = fit(
            BaseParameter::J.into(),
            |_, t| if t % 2.0 < 1.0 { 10.0 } else { 0.1 },
            |recording, t| if recording == 1 && t > 4.0 { 2.2 } else { 2.0 },
        );
        assert!(found(&often).is_some());
    }

    #[test]
    fn a_change_has_to_show_in_the_free_run_and_in_the_same_direction() {
        let (times, blocks) = times();
        let later = |value: f64| of_resistance(move |recording, t| if recording == 1 || t > 5.0 { value } else { 2.0 });
        let change = found(&later(2.4)).unwrap();
        let shows = |fit: &Fit| change.shows_in(fit, &[0; 1600], &times, &blocks);
        assert!(shows(&later(2.2)));
        assert!(!shows(&later(2.0)), "nothing but noise");
        assert!(!shows(&later(1.8)), "the other way");
    }

    #[test]
    fn noise_is_no_change() {
        assert_eq!(found(&of_resistance(|_, _| 2.0)), None);
        assert_eq!(found(&fit(Key::size_of(EffectId::VoltageOffset), |_, _| 1.0, |_, _| 2.0)), None);
    }
}
