//! Whether anything is left to explain: the residual against what does not repeat, the pure error.
//!
//! (The noise floor of a comparison, [`compare::noise_floor`](crate::compare::noise_floor), is that of the measuring
//! chain alone.)
//!
//! Structure repeats from one mains period T to the next (without mains: from one T to the next that [`period_s`]
//! takes), noise does not. The floor of the voltage balance, and of the free run's current, is therefore the RMS of
//! `(e(t + T) − e(t))/√2`; that of the torque balance, which is known once per window, the RMS of the second difference
//! of windows over √6: of neighbours or, if that is more, of every second one, since a load that fluctuates for as long
//! as a window hardly differs from one to the next. Both levels include turbulence and sparking, which no deterministic
//! model can predict.
//!
//! In the free run's speed turbulence adds up: it makes a first-order process with the time constant τ of the rotor,
//! most of which repeats from one period to the next. Half the mean square of `e(t + D) − e(t)` is then w + σ²(1 −
//! e^(−D/τ)), with w of the noise of the sensor, to which structure that changes smoothly adds bD². The three follow
//! from D = T, 2T, 4T and 8T by least squares; the floor f is √(w + σ²). Turbulence is there all the time: where a
//! motor is acquitted, an error that is large for moments alone, as where the rotor accelerates, is none, and these
//! means are limited by their medians. Beside effects that were found it is: their laws have other forms, which an
//! inrush shows.
//!
//! Where recordings of the same excitation are among them ([`repeats`](crate::repeats)), what is slow need not be
//! concluded: what does not come back at the same time does not repeat. With e and e' of two such recordings, ⟨e²⟩ − ⟨e
//! e'⟩ is the floor of the torque balance where that is more, and stands for σ² in the free run, where e are means over
//! a period, whatever the phase of the mains was.
//!
//! Turbulence passes to the current by way of the speed, where it is slow as well. With d the current of the model at
//! the speed that its measuring chain shows of the free run, less that at the measured speed, and e the error of the
//! speed, the square of the current's floor is larger by `min(1, f²/⟨e²⟩) (⟨d²⟩ − ⟨(d(t + T) − d(t))²⟩/2)` where a
//! verdict is judged; unless that is more than the whole error of the current, as of a motor whose resistance has gone:
//! then the fit is wrong about that way, and excuses nothing.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use crate::experiment::Experiment;
use crate::identify::minimise::{Fit, Residuals};
use crate::noise::median;

/// Windows that the second differences of the torque balance are apart.
const STRIDES: [usize; 2] = [1, 2];
/// Mains periods that turbulence is told by.
const LAGS: [f64; 4] = [1.0, 2.0, 4.0, 8.0];
/// RMS of what does not repeat, in the standard deviation that its median tells, above which it is not noise but rare:
/// what noise that goes with the current or the speed does stays below 2.
const RARE: f64 = 2.4;
/// Median of the square of a Gaussian variable, in its variance.
const MEDIAN_OF_SQUARE: f64 = 0.454_936;
/// Residual over floor below which a balance is complete.
const COMPLETE: f64 = 1.35;
/// Share of the structure that has to be explained where the floor is not reached: another form of the right law leaves
/// less, the wrong law more.
const EXPLAINED: f64 = 0.95;
/// And of both signals together, where what is left of one is little by itself.
const EXPLAINED_TOGETHER: f64 = 0.9;
/// Share of the structure that is most of it.
const MOST: f64 = 0.5;
/// Residual over floor below which little is left, whatever there was.
const NEARLY_COMPLETE: f64 = 1.5;
/// The same where what is left of both signals is little of what there was: the speed of healthy motors reaches 1.55 in
/// sets of recordings, where turbulence is added up for longer than the lags tell.
const NEARLY_COMPLETE_TOGETHER: f64 = 1.75;
/// Residual over floor in the free run above which no motor is acquitted: of 660 healthy ones 659 have at most 1.55,
/// one 1.76.
const HEALTHY: f64 = 2.5;

/// Residual over what does not repeat, for the voltage and the torque balance, or for current and speed of the free
/// run; 1 is perfect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Completeness {
    /// Voltage balance, or current.
    pub electrical: f64,
    /// Torque balance, or speed.
    pub mechanical: f64,
}

/// What an error of the speed is that is large for moments alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moments {
    /// A part of what the load does.
    OfTurbulence,
    /// No turbulence, which is there all the time.
    Rare,
}

/// Time after which structure comes back and noise does not, s: the period of the mains; without mains 20 ms, or half a
/// period of the filter's cut-off where that is longer, as of slow samples. Nearer ones share their noise: what a
/// Butterworth filter of the fourth order lets pass of white noise has a correlation of 0.58 after a quarter of the
/// period, of −0.006 after half of it.
pub fn period_s(experiments: &[Experiment]) -> f64 {
    const WITHOUT_MAINS_S: f64 = 0.02;
    let forgets = |e: &Experiment| 0.5 / e.filter.cutoff_hz;
    let mains = experiments.iter().find_map(|e| e.mains_period_s);
    mains.unwrap_or_else(|| experiments.iter().map(forgets).fold(WITHOUT_MAINS_S, f64::max))
}

/// When the rows were measured, and how often the same.
#[derive(Debug, Clone, Copy)]
pub struct Course<'a> {
    /// Recording and time, s, of each row.
    pub times: &'a [(usize, f64)],
    /// Period of the mains, s.
    pub period_s: f64,
    /// Recordings of the same excitation, two by two.
    pub repeats: &'a [[usize; 2]],
}

/// What does not repeat: RMS of the voltage balance (V) and the torque balance (N m s per window).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floor([f64; 2]);

impl Floor {
    /// Nothing is known; then no structure is claimed.
    pub const UNKNOWN: Self = Self([0.0; 2]);

    /// Whether it is known.
    pub fn is_known(&self) -> bool {
        self.0.iter().any(|f| *f > 0.0)
    }

    /// Of both balances from a fit by equation error. Structure that grows or fades counts to some degree, so the floor
    /// of the best fit is that of all.
    pub fn of_balances(fit: &Fit, problem: &impl Residuals, course: &Course<'_>) -> Self {
        let Course { times, period_s, repeats } = *course;
        let [voltage, torque] = [0, 1].map(|group| Signal::of(&fit.residuals, problem, times, group));
        let bent = STRIDES.map(|stride| torque.bent(stride)).into_iter().fold(0.0, f64::max);
        let torque = torque.comes_back(repeats).map_or(bent, |back| bent.max(back.differs + back.others * bent));
        Self::new(fit, [voltage.apart(period_s), torque])
    }

    /// Of current and speed from a fit in the free run; `time_constant_s` is that of the rotor.
    pub fn of_free_run(
        fit: &Fit,
        problem: &impl Residuals,
        course: &Course<'_>,
        time_constant_s: f64,
        moments: Moments,
    ) -> Self {
        let Course { times, period_s, repeats } = *course;
        let [current, speed] = [0, 1].map(|group| Signal::of(&fit.residuals, problem, times, group));
        let turbulent = speed.with_turbulence(period_s, time_constant_s, moments);
        let fast = speed.apart(period_s);
        let by_repeats = |back: Back| fast + back.differs + back.others * (turbulent - fast).max(0.0);
        let speed = speed.means(period_s).comes_back(repeats).map_or(turbulent, by_repeats);
        Self::new(fit, [current.usually_apart(period_s), speed])
    }

    /// The same where the inertia is `times` as large: what does not repeat of a torque is mostly the noise of the
    /// acceleration.
    pub fn with_inertia(self, times: f64) -> Self {
        let [voltage, torque] = self.0;
        Self([voltage, if times.is_finite() && times > 0.0 { torque * times } else { torque }])
    }

    /// The same with what turbulence makes of the current by way of the speed; `through_the_speed` is what the error of
    /// the speed makes of each row (A, rad/s).
    pub fn with_turbulence_passed_on(
        self,
        fit: &Fit,
        problem: &impl Residuals,
        through_the_speed: &DVector<f64>,
        course: &Course<'_>,
    ) -> Self {
        let passed_on = Signal::of(through_the_speed, problem, course.times, 0).slow(course.period_s);
        let [current, speed] = self.0;
        let passed_on = (speed / fit.rms[1]).powi(2).min(1.0) * passed_on;
        // Of 170 healthy motors it makes up to 0.13 of the error's square, of 160 with an effect up to 0.4; without a
        // resistance thousands.
        let is_refuted = passed_on > fit.rms[0].powi(2);
        if current == 0.0 || is_refuted {
            return self;
        }
        Self([current.hypot(passed_on.sqrt()), speed])
    }

    fn new(fit: &Fit, variances: [f64; 2]) -> Self {
        Self([0, 1].map(|g| variances[g].sqrt() * fit.rms[g]))
    }
}

/// The error of a fit's speed in the free run over what it differs by from one period to the next: 1 of noise, more of
/// what is slow.
pub fn wandering(fit: &Fit, problem: &impl Residuals, course: &Course<'_>) -> f64 {
    let speed = Signal::of(&fit.residuals, problem, course.times, 1);
    // The variance of the weighted residuals is 1.
    let apart = speed.apart(course.period_s);
    if apart > 0.0 { apart.sqrt().recip() } else { 1.0 }
}

/// Share of what is slow in the error of a fit's speed in the free run, over periods of the mains, that comes back in
/// recordings of the same excitation, two by two. `None`: there are none.
pub fn comes_back(fit: &Fit, problem: &impl Residuals, course: &Course<'_>) -> Option<f64> {
    let Course { times, period_s, repeats } = *course;
    Signal::of(&fit.residuals, problem, times, 1).means(period_s).comes_back(repeats).map(|back| back.share)
}

/// What comes back in recordings of the same excitation.
struct Back {
    /// Share of their mean square.
    share: f64,
    /// Sum of the squares of what does not, over the number of all rows.
    differs: f64,
    /// Rows that are not theirs, as a share.
    others: f64,
}

/// Residuals, or a part of them, of one group of rows.
struct Signal {
    residuals: Vec<f64>,
    /// Recording and time, s.
    times: Vec<(usize, f64)>,
    /// Interval between the rows, s.
    step_s: f64,
}

impl Signal {
    fn of(residuals: &DVector<f64>, problem: &impl Residuals, times: &[(usize, f64)], group: u8) -> Self {
        let groups = problem.groups();
        let rows: Vec<usize> = (0..groups.len()).filter(|k| groups[*k] == group).collect();
        let times: Vec<(usize, f64)> = rows.iter().map(|k| times[*k]).collect();
        let step_s = times.windows(2).map(|w| w[1].1 - w[0].1).find(|d| *d > 0.0).unwrap_or(1e-3);
        Self { residuals: rows.iter().map(|k| residuals[*k]).collect(), times, step_s }
    }

    /// Half the mean square of what lies `lag_s` apart; 0: not known.
    fn apart(&self, lag_s: f64) -> f64 {
        mean(self.differences(lag_s))
    }

    /// The same without what is rare: where the supply is switched now and then, an error lasts for milliseconds and
    /// never repeats, and yet is no noise.
    fn usually_apart(&self, lag_s: f64) -> f64 {
        let usual = median(self.differences(lag_s).collect()) / MEDIAN_OF_SQUARE;
        let mean = self.apart(lag_s);
        if usual > 0.0 { mean.min(RARE * RARE * usual) } else { mean }
    }

    /// The part of the mean square that does not differ from one period to the next.
    fn slow(&self, period_s: f64) -> f64 {
        (mean(self.residuals.iter().map(|e| e * e)) - self.apart(period_s)).max(0.0)
    }

    /// Half the squares of what lies `lag_s` apart.
    fn differences(&self, lag_s: f64) -> impl Iterator<Item = f64> {
        let lag = (lag_s / self.step_s).round().max(1.0) as usize;
        (0..self.times.len().saturating_sub(lag)).filter_map(move |k| {
            let (a, b) = (self.times[k], self.times[k + lag]);
            (a.0 == b.0 && (b.1 - a.1 - lag_s).abs() < self.step_s)
                .then(|| (self.residuals[k + lag] - self.residuals[k]).powi(2) / 2.0)
        })
    }

    /// Means over a period.
    fn means(&self, period_s: f64) -> Self {
        let mut means: BTreeMap<(usize, i64), (f64, f64)> = BTreeMap::new();
        for ((recording, t), e) in self.times.iter().zip(&self.residuals) {
            // A row that lies on the border of two periods belongs to the later one, however its time is rounded.
            let period = ((t + 0.5 * self.step_s) / period_s).floor() as i64;
            let (sum, count) = means.entry((*recording, period)).or_default();
            *sum += e;
            *count += 1.0;
        }
        Self {
            residuals: means.values().map(|(sum, count)| sum / count).collect(),
            times: means.keys().map(|(recording, period)| (*recording, *period as f64 * period_s)).collect(),
            step_s: period_s,
        }
    }

    /// With e and e' of two recordings at the same time: ⟨e e'⟩ over half of ⟨e²⟩ + ⟨e'²⟩ is what comes back, 1 where
    /// they are equal, 0 on average where they have nothing to do with each other.
    fn comes_back(&self, repeats: &[[usize; 2]]) -> Option<Back> {
        let rows = || self.times.iter().zip(&self.residuals);
        let row = |((recording, t), e): (&(usize, f64), &f64)| ((*recording, (t / self.step_s).round() as i64), *e);
        let by_time: BTreeMap<(usize, i64), f64> = rows().map(row).collect();
        let (mut products, mut squares) = (0.0, 0.0);
        for ((recording, time), e) in &by_time {
            let others = repeats.iter().filter(|[one, _]| one == recording);
            for again in others.filter_map(|[_, other]| by_time.get(&(*other, *time))) {
                products += e * again;
                squares += 0.5 * (e * e + again * again);
            }
        }
        if squares == 0.0 {
            return None;
        }
        let share = products / squares;
        let theirs = || rows().filter(|(time, _)| repeats.iter().flatten().any(|recording| *recording == time.0));
        let count = self.residuals.len() as f64;
        let differs = (1.0 - share) * theirs().map(|(_, e)| e * e).sum::<f64>() / count;
        Some(Back { share, differs, others: 1.0 - theirs().count() as f64 / count })
    }

    /// A sixth of the mean square of the second difference of rows that lie a `stride` apart; 0: not known.
    fn bent(&self, stride: usize) -> f64 {
        mean(self.residuals.windows(2 * stride + 1).zip(self.times.windows(2 * stride + 1)).filter_map(|(e, t)| {
            let (first, middle, last) = (t[0], t[stride], t[2 * stride]);
            let even = ((last.1 - middle.1) - (middle.1 - first.1)).abs() < 1e-9;
            (first.0 == last.0 && even).then(|| (e[0] - 2.0 * e[stride] + e[2 * stride]).powi(2) / 6.0)
        }))
    }

    /// w + σ²: the noise of the sensor, and the first-order process that turbulence makes of the speed. (1 is the
    /// variance of the weighted residuals.)
    fn with_turbulence(&self, period_s: f64, time_constant_s: f64, moments: Moments) -> f64 {
        let apart = LAGS.map(|n| match moments {
            Moments::OfTurbulence => self.apart(n * period_s),
            Moments::Rare => self.usually_apart(n * period_s),
        });
        if apart.contains(&0.0) {
            return apart[0];
        }
        let terms = |n: f64| [1.0, 1.0 - (-n * period_s / time_constant_s).exp(), n * n];
        // Each lag counts by what it is relative to its size.
        let columns = DMatrix::from_fn(LAGS.len(), 3, |row, column| terms(LAGS[row])[column] / apart[row]);
        let solved = columns.svd(true, true).solve(&DVector::from_element(LAGS.len(), 1.0), 1e-9);
        solved.map_or(apart[0], |s| if s[1] > 0.0 { s[0].max(0.0) + s[1] } else { apart[0] })
    }
}

/// Mean of squares; none: not known, 0.
fn mean(squares: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = squares.fold((0.0, 0.0), |(s, n), x| (s + x, n + 1.0));
    if count < 8.0 { 0.0 } else { sum / count }
}

impl Completeness {
    /// Of a fit against a floor.
    pub fn of(fit: &Fit, floor: &Floor) -> Self {
        Self::of_rms(fit.rms, floor)
    }

    /// Of the RMS of residuals against a floor.
    pub fn of_rms(rms: [f64; 2], floor: &Floor) -> Self {
        let ratio = |g: usize| if floor.0[g] > 0.0 { rms[g] / floor.0[g] } else { 1.0 };
        Self { electrical: ratio(0), mechanical: ratio(1) }
    }

    /// Whether no structure is left in either balance.
    pub fn is_complete(&self) -> bool {
        self.electrical < COMPLETE && self.mechanical < COMPLETE
    }

    /// Whether structure is left in the torque balance, and in that alone.
    pub fn is_of_the_torque(&self) -> bool {
        self.electrical < COMPLETE && self.mechanical >= COMPLETE
    }

    /// Whether a free run is no farther off than that of a healthy motor may be.
    pub fn may_be_healthy(&self) -> bool {
        self.electrical < HEALTHY && self.mechanical < HEALTHY
    }

    /// Whether more than half of the structure of an earlier fit is left in a signal, and is not little.
    pub fn leaves_most(&self, before: &Self) -> bool {
        let of = |left: f64, was: f64| left > NEARLY_COMPLETE && left - 1.0 > MOST * (was - 1.0);
        of(self.electrical, before.electrical) || of(self.mechanical, before.mechanical)
    }

    /// Whether nearly all structure of an earlier fit is explained in this one, signal by signal. What is left of one
    /// may also be little by itself, where what is left of both is little of what there was.
    pub fn explains(&self, before: &Self) -> bool {
        let over = |c: &Self| [c.electrical, c.mechanical].map(|ratio| (ratio - 1.0).max(0.0));
        let (was, left) = (over(before), over(self));
        let little = left.iter().sum::<f64>() <= (1.0 - EXPLAINED_TOGETHER) * was.iter().sum::<f64>();
        (0..2).all(|g| {
            let explained = left[g] <= (1.0 - EXPLAINED) * was[g];
            left[g] < COMPLETE - 1.0 || explained || (little && left[g] < NEARLY_COMPLETE_TOGETHER - 1.0)
        })
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::identify::space::Space;
    use crate::model::{Base, Kind};

    const PERIOD_S: f64 = 0.02;
    const ROTOR_S: f64 = 0.4;

    /// A minute at 1 kHz: white noise of 0.3, a first-order process of a size with the rotor's time constant, and
    /// something that depends on time.
    fn speed(process: f64, structure: impl Fn(f64) -> f64) -> Signal {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let kept = (-1e-3 / ROTOR_S).exp();
        let mut state = process * normal();
        let times: Vec<(usize, f64)> = (0..60_000).map(|k| (0, f64::from(k) * 1e-3)).collect();
        let mut at = |t: f64| {
            state = kept * state + process * (1.0 - kept * kept).sqrt() * normal();
            state + 0.3 * normal() + structure(t)
        };
        Signal { residuals: times.iter().map(|(_, t)| at(*t)).collect(), times, step_s: 1e-3 }
    }

    fn variance(signal: &Signal) -> f64 {
        signal.residuals.iter().map(|e| e * e).sum::<f64>() / signal.residuals.len() as f64
    }

    #[test]
    fn turbulence_that_the_rotor_adds_up_counts_as_noise() {
        let signal = speed(1.0, |_| 0.0);
        // 60 s hold 75 independent pieces of a process of 0.4 s: its variance is known to 16 %, 40 % is 2.5 sigma.
        let ratio = signal.with_turbulence(PERIOD_S, ROTOR_S, Moments::OfTurbulence) / variance(&signal);
        assert!((0.6..1.4).contains(&ratio), "{ratio}");
        // One period tells 1 - exp(-0.02/0.4) = 5 % of it, and the white noise.
        let apart = signal.apart(PERIOD_S);
        assert!((apart - 0.139).abs() < 0.02, "{apart}");
    }

    #[test]
    fn structure_that_changes_slowly_does_not_pass_for_turbulence() {
        let signal = speed(0.0, |t| 3.0 * (std::f64::consts::TAU * t / 4.0).sin());
        let floor = signal.with_turbulence(PERIOD_S, ROTOR_S, Moments::OfTurbulence);
        // The white noise has 0.09, known to 0.01 as below. Of the sine's 4.5 the three terms miss what D⁴ brings: at
        // 8T (2π·0.16 s/4 s)²/12 = 0.5 % of its part there, which is 3 % of it.
        assert!((floor - 0.09).abs() < 0.011, "{floor}");
    }

    #[test]
    fn an_error_of_moments_is_turbulence_or_rare() {
        // A rotor that is too slow for 60 ms in each second, as at a step of the voltage, beside the sensor's noise.
        let signal = speed(0.0, |t| if t % 1.0 < 0.06 { 20.0 * (-(t % 1.0) / 0.02).exp() } else { 0.0 });
        let floor = |moments| signal.with_turbulence(PERIOD_S, 0.02, moments).sqrt();
        // The square of the error is 400·0.01/1 of a second, and as good as all of it differs from one period to the
        // next.
        assert!(floor(Moments::OfTurbulence) > 1.4, "{}", floor(Moments::OfTurbulence));
        // RMS of the noise 0.3, of which at most 2.4 times pass; an eighth of the differences are not noise, which
        // moves their median by a third and its root by a sixth.
        assert!(floor(Moments::Rare) < 0.9, "{}", floor(Moments::Rare));
    }

    /// Two recordings of half a minute each: a process each, and something that depends on time, in both.
    fn twice(structure: impl Fn(f64) -> f64) -> Signal {
        let mut both = speed(1.0, |t| structure(t % 30.0));
        for time in &mut both.times {
            *time = ((time.1 / 30.0) as usize, time.1 % 30.0);
        }
        both
    }

    #[test]
    fn what_has_nothing_to_do_with_each_other_does_not_come_back() {
        let back = twice(|_| 0.0).means(PERIOD_S).comes_back(&[[0, 1]]).unwrap();
        // 30 s hold 37 independent pieces of a process of 0.4 s: 1/√37 = 0.16, 2.5 sigma.
        assert!(back.share.abs() < 0.4 && back.others == 0.0, "{}", back.share);
        // Of the process, without the noise of a single row; known as above.
        assert!((0.6..1.4).contains(&back.differs), "{}", back.differs);
    }

    #[test]
    fn what_is_slow_and_comes_back_does_not_pass_for_turbulence() {
        // A process like the other one, but the same both times, of twice the size: four fifths of all.
        let mut random = ChaCha8Rng::seed_from_u64(9);
        let kept = (-1e-3 / ROTOR_S).exp();
        let mut state = 0.0;
        let mut next = || {
            let normal: f64 = StandardNormal.sample(&mut random);
            state = kept * state + 2.0 * (1.0 - kept * kept).sqrt() * normal;
            state
        };
        let path: Vec<f64> = (0..30_000).map(|_| next()).collect();
        let signal = twice(|t| path[((t / 1e-3).round() as usize).min(29_999)]);
        let back = signal.means(PERIOD_S).comes_back(&[[0, 1]]).unwrap();
        // Of 5, what is common times what is not has 2/√37 in either recording, what is not times itself 1/√37; and the
        // sizes are known to 16 %: 0.1 in all, 2.5 sigma.
        assert!((back.share - 0.8).abs() < 0.25, "{}", back.share);
        // A fifth of the same 5, which the products tell to 0.1 of it: 0.5, of which this is less than two sigma. The
        // lags tell 60 % at least of what is all a process, as above.
        assert!((0.3..1.7).contains(&back.differs), "{}", back.differs);
        let by_lags = signal.with_turbulence(PERIOD_S, ROTOR_S, Moments::OfTurbulence) / variance(&signal);
        assert!(by_lags > 0.6, "{by_lags}");
    }

    #[test]
    fn rows_of_other_recordings_are_counted_as_others() {
        let mut signal = twice(|_| 0.0);
        signal.times.iter_mut().filter(|(_, t)| *t >= 20.0).for_each(|time| time.0 += 2);
        let back = signal.means(PERIOD_S).comes_back(&[[0, 1]]).unwrap();
        assert!((back.others - 1.0 / 3.0).abs() < 1e-3, "{}", back.others);
        assert!(signal.comes_back(&[]).is_none() && signal.comes_back(&[[5, 6]]).is_none());
    }

    #[test]
    fn without_turbulence_one_period_tells_all() {
        let signal = speed(0.0, |_| 0.0);
        let floor = signal.with_turbulence(PERIOD_S, ROTOR_S, Moments::OfTurbulence);
        // Each lag is known to √(3/60,000) = 0.7 %, and carried on by 1/(1 − e^(−0.16/0.4)) = 3 to the whole process:
        // 0.002. The quadratic term takes part, which costs as much again; 0.01 is 2.5 sigma of both.
        assert!((floor - 0.09).abs() < 0.01, "{floor}");
    }

    #[test]
    fn a_load_that_fluctuates_for_as_long_as_a_window_hardly_differs_from_one_to_the_next() {
        // Means over 20 ms of a process of 20 ms: neighbours are correlated by (1 − e⁻¹)²/(2 e⁻¹) = 0.543, the next
        // ones by 0.543 e⁻¹ = 0.200, and so on. The second difference of neighbours has (6 − 8·0.543 + 2·0.200)/6 =
        // 0.34 of the variance, that of every second one (6 − 8·0.200 + 2·0.027)/6 = 0.74. 12,000 windows, of which one
        // in three is independent, tell a variance to √(2/4,000) = 2 %.
        const WINDOWS: usize = 12_000;
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let kept = (-1.0f64 / 20.0).exp();
        let mut load = normal();
        let mut window = || {
            let mut next = || {
                load = kept * load + (1.0 - kept * kept).sqrt() * normal();
                load
            };
            (0..20).map(|_| next()).sum::<f64>() / 20.0
        };
        let residuals: Vec<f64> = (0..WINDOWS).map(|_| window()).collect();
        let times = (0..WINDOWS).map(|k| (0, PERIOD_S * k as f64)).collect();
        let torque = Signal { residuals, times, step_s: PERIOD_S };
        let share = |stride| torque.bent(stride) / variance(&torque);
        assert!((share(1) - 0.34).abs() < 0.03 && (share(2) - 0.74).abs() < 0.06, "{} {}", share(1), share(2));
    }

    #[test]
    fn what_happens_now_and_then_is_no_noise() {
        // Every second an error of 100 for 5 ms: an RMS of 7, of which nothing repeats from one period to the next.
        let signal = speed(0.0, |t| if t.fract() < 5e-3 { 100.0 } else { 0.0 });
        assert!(variance(&signal) > 49.0);
        let apart = signal.usually_apart(PERIOD_S);
        // The white noise has 0.09; the median of 60,000 squares with a hundredth of outliers tells it to a few per
        // cent.
        assert!((apart / (RARE * RARE * 0.09) - 1.0).abs() < 0.1, "{apart}");
    }

    #[test]
    fn noise_that_goes_with_a_sine_counts_as_it_is() {
        let signal = speed(0.0, |_| 0.0);
        let wave = |k: usize| (std::f64::consts::TAU * k as f64 * 1e-3 / PERIOD_S).sin();
        let residuals: Vec<f64> = signal.residuals.iter().enumerate().map(|(k, e)| e * wave(k)).collect();
        let signal = Signal { residuals, ..signal };
        // 60,000 squares tell their mean to √(2/60,000), which noise of a changing size doubles: 1 %, three times.
        assert!((signal.usually_apart(PERIOD_S) / variance(&signal) - 1.0).abs() < 0.03);
    }

    fn of(electrical: f64, mechanical: f64) -> Completeness {
        Completeness { electrical, mechanical }
    }

    #[test]
    fn both_signals_have_to_be_explained() {
        assert!(of(1.9, 1.1).explains(&of(20.0, 1.1)));
        assert!(!of(1.9, 4.0).explains(&of(20.0, 5.0)));
        assert!(!of(2.1, 1.1).explains(&of(20.0, 1.1)), "a seventeenth is left");
    }

    #[test]
    fn a_little_that_is_left_does_not_hide_what_was_explained() {
        assert!(of(1.2, 1.55).explains(&of(12.0, 1.55)));
        assert!(!of(1.2, 1.55).explains(&of(2.0, 1.55)), "it is half of what there was");
        assert!(!of(1.2, 1.8).explains(&of(12.0, 1.8)), "it is not little");
        assert!(of(1.8, 1.4).explains(&of(33.0, 2.3)), "a fortieth of the current's, little of the speed's");
    }

    #[test]
    fn half_of_the_structure_is_most_of_it_unless_it_is_little() {
        assert!(of(1.0, 3.5).leaves_most(&of(1.0, 4.2)));
        assert!(!of(0.9, 1.9).leaves_most(&of(36.0, 5.0)));
        assert!(!of(0.9, 1.4).leaves_most(&of(36.0, 1.5)));
    }

    /// Groups of rows, of which nothing else is asked.
    struct Groups(Vec<u8>);

    impl Residuals for Groups {
        fn at(&self, _: &Space, _: &[f64]) -> DVector<f64> {
            DVector::zeros(self.0.len())
        }
        fn groups(&self) -> &[u8] {
            &self.0
        }
        fn sizes(&self) -> [f64; 2] {
            [1.0; 2]
        }
    }

    fn fit(residuals: Vec<f64>, rms: [f64; 2]) -> Fit {
        let rows = residuals.len();
        Fit {
            space: Space::new(Kind::PmDc, Base::Full, &[]),
            residuals: residuals.into(),
            jacobian: DMatrix::zeros(rows, 0),
            rms,
            ended: true,
            known_held_out: std::sync::OnceLock::new(),
        }
    }

    /// Three recordings of thirty rows, one a period, at 1, at −1, and at 1 and −1 in turn.
    fn three() -> (Vec<f64>, Vec<(usize, f64)>) {
        let row = |k: usize| match k / 30 {
            0 => 1.0,
            1 => -1.0,
            _ => [1.0, -1.0][k % 2],
        };
        (0..90).map(|k| (row(k), (k / 30, (k % 30) as f64 * PERIOD_S))).unzip()
    }

    /// By hand. The voltage: 29 differences of each recording, those of the third one 2 apart, half of whose squares is
    /// 2; the mean is 2/3. The torque: second differences of 4, whose square over six is 8/3 of a third of the rows,
    /// 8/9; what lies two rows apart is not bent.
    #[test]
    fn floors_of_balances_are_what_does_not_repeat() {
        let (rows, times) = three();
        let course = |repeats| Course { times: &times, period_s: PERIOD_S, repeats };
        let floor = |group: u8, repeats| {
            Floor::of_balances(&fit(rows.clone(), [3.0, 5.0]), &Groups(vec![group; 90]), &course(repeats))
        };
        let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} against {expected}");
        close(floor(0, &[]).0[0], 3.0 * (2.0f64 / 3.0).sqrt());
        close(floor(1, &[]).0[1], 5.0 * (8.0f64 / 9.0).sqrt());
        // The first two are of the same excitation and opposite: nothing comes back, of 60 squares of 90 twice; the
        // third of the rows that is not theirs has what is bent.
        close(floor(1, &[[0, 1]]).0[1], 5.0 * (2.0 * 60.0 / 90.0 + 8.0 / 27.0f64).sqrt());
        assert!(floor(0, &[]).is_known() && !Floor::UNKNOWN.is_known());
        let problem = Groups(vec![1; 90]);
        close(wandering(&fit(rows.clone(), [1.0; 2]), &problem, &course(&[])), 1.5f64.sqrt());
        let still = fit(vec![1.0; 90], [1.0; 2]);
        assert_eq!(wandering(&still, &problem, &course(&[])), 1.0, "nothing differs");
        close(comes_back(&fit(rows.clone(), [1.0; 2]), &problem, &course(&[[0, 1]])).unwrap(), -1.0);
        assert_eq!(comes_back(&still, &problem, &course(&[])), None);
    }

    /// By hand: 2 A of a current that is all slow, by the quarter that turbulence is of the speed's square, is 1 A²
    /// more.
    #[test]
    fn turbulence_is_passed_on_unless_that_is_more_than_all() {
        let (_, times) = three();
        let course = Course { times: &times, period_s: PERIOD_S, repeats: &[] };
        let through = DVector::from_element(90, 2.0);
        let passed = |floor: [f64; 2], rms: [f64; 2]| {
            let fit = fit(vec![0.0; 90], rms);
            Floor(floor).with_turbulence_passed_on(&fit, &Groups(vec![0; 90]), &through, &course).0
        };
        let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12, "{found} against {expected}");
        close(passed([3.0, 2.0], [10.0, 4.0])[0], 10f64.sqrt());
        // No more than all of the speed's error is turbulence.
        close(passed([3.0, 8.0], [10.0, 4.0])[0], 13f64.sqrt());
        assert_eq!(passed([3.0, 2.0], [0.9, 4.0]), [3.0, 2.0], "more than all of the current's");
        assert_eq!(passed([0.0, 2.0], [10.0, 4.0]), [0.0, 2.0], "no floor is known");
    }

    #[test]
    fn a_floor_of_the_torque_goes_with_the_inertia() {
        let times = |times: f64| Floor([1.0, 2.0]).with_inertia(times).0;
        assert_eq!(
            [times(3.0), times(0.0), times(-1.0), times(f64::INFINITY)],
            [[1.0, 6.0], [1.0, 2.0], [1.0, 2.0], [1.0, 2.0]]
        );
    }

    #[test]
    fn a_period_is_the_mains_or_what_the_filter_forgets() {
        let recording = crate::rig::Setup::new(Kind::PmDc).seconds(1.0).run().unwrap().recording;
        let mut e = Experiment::new(&recording, &crate::filtering::Filter::default()).unwrap();
        let mut period = |mains_period_s, cutoff_hz| {
            (e.mains_period_s, e.filter.cutoff_hz) = (mains_period_s, cutoff_hz);
            period_s(std::slice::from_ref(&e))
        };
        assert_eq!([period(Some(1.0 / 60.0), 10.0), period(None, 10.0), period(None, 100.0)], [1.0 / 60.0, 0.05, 0.02]);
    }
}
