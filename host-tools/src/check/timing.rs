//! One channel later than the others, or on a clock of its own.
//!
//! The balance of the voltage holds at one instant. With current or speed taken from t + a + b t, the a and b for which
//! it holds best are that channel's shift and the skew of its clock. A lag of the motor or of a sensor's filter shows
//! the same; it is an effect, and this finding says only that it is there. Nor is a clock to blame where the balance
//! leaves less with other coefficients from some time on: the motor has changed.

use std::borrow::Cow;

use super::balance;
use super::criteria::{ELECTRICAL_WINDOW_S, WINDOW_SAMPLES};
use super::evidence::{Evidence, variance};
use super::regression::{self, Fit};
use super::signals::{self, Signals, short};
use crate::averaging;
use crate::model::Kind;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};
use crate::recording::{Channel, Recording};

/// Longest interval, s: of an edge of the voltage between slower samples the balance knows too little.
const SLOWEST_S: f64 = 2e-3;
/// Windows that the balance is taken over, at most.
const WINDOWS: usize = 1200;
/// Largest shift that is looked for, s.
const LARGEST_S: f64 = 0.15;
/// Largest skew that is looked for.
const LARGEST_SKEW: f64 = 0.02;
/// Shifts that are tried first, as parts of the largest, and skews.
const PARTS: [f64; 14] = [0.006, 0.01, 0.016, 0.025, 0.04, 0.06, 0.09, 0.14, 0.2, 0.3, 0.42, 0.58, 0.78, 1.0];
/// How many times less the balance has to leave: from 40 windows on the ratio of likelihoods is 10^9 and more.
const BETTER: f64 = 1.6;
/// The same for a skew beside a shift.
const BETTER_YET: f64 = 1.25;
/// Least shift that is one, s and samples.
const LEAST_S: f64 = 1e-3;
const LEAST_SAMPLES: f64 = 1.0;
/// Steps of the search by golden section: to a thousandth of the distance.
const STEPS: usize = 15;

/// How many times less the balance has to leave for a clock to be blamed: less a drift of a channel makes, too.
const BLAMED: f64 = 3.0;

/// Parts of a recording whose borders are tried for a change of the motor.
const BORDERS: usize = 16;

/// A channel's time: it is taken from t + shift + skew t, t from the first sample.
#[derive(Clone, Copy)]
struct Clock {
    shift_s: f64,
    skew: f64,
}

const RIGHT: Clock = Clock { shift_s: 0.0, skew: 0.0 };

/// What to look for.
pub fn look(s: &Signals<'_>, e: &Evidence, kind: Kind, found: &mut Vec<DataFinding>) {
    let kind = e.told.unwrap_or(kind);
    let all = s.voltage.is_some() && s.recording().channel(Channel::Current).is_some() && s.speed.is_some();
    let moves = e.voltage(kind).is_some() && s.interval_s <= SLOWEST_S;
    let mean_square = e.short.iter().map(|x| x.u * x.u).sum::<f64>() / e.short.len().max(1) as f64;
    if !all || !moves || variance(e.short.iter().map(|x| x.u)) < 0.05 * mean_square {
        return;
    }
    let balance = Balance::new(s, kind);
    let coarse = balance.coarse();
    let Some(as_it_is) = balance.left(Channel::Current, RIGHT) else { return };
    let Some(coarse_as_it_is) = coarse.left(Channel::Current, RIGHT) else { return };
    let mut best: Option<(Channel, Clock, f64)> = None;
    let channels = [Channel::Current, s.speed_channel];
    let candidates = channels.iter().flat_map(|channel| coarse.candidates(*channel).map(|found| (*channel, found)));
    // Half of what it takes, as a logarithm, is worth a look at the signals as they are.
    for (channel, (clock, _)) in candidates.filter(|(_, (_, left))| left * BETTER.sqrt() < coarse_as_it_is) {
        let (clock, left) = balance.closer(channel, clock);
        if best.is_none_or(|(_, _, least)| left < least) {
            best = Some((channel, clock, left));
        }
    }
    let Some((channel, clock, left)) = best else { return };
    let over_s = clock.skew * s.len() as f64 * s.interval_s;
    let least = LEAST_S.max(LEAST_SAMPLES * s.interval_s);
    if left * BETTER > as_it_is || clock.shift_s.abs().max(over_s.abs()) < least {
        return;
    }
    // Signs that no motor has are another matter.
    if !balance.fit(channel, clock).is_some_and(|f| f.b[1] > 0.0 && f.b[3] > 0.0) {
        return;
    }
    let name = signals::name(channel);
    let without = balance.best_shift(channel).1;
    let stepped = found.iter().any(|f| f.recording == s.path() && f.channel == Some(channel));
    if without > BETTER_YET * left && over_s.abs() > least {
        if stepped || as_it_is < BLAMED * left || balance.left_by_a_change() < left {
            return;
        }
        let skew = balance.skew_alone(channel, clock, left);
        let over_s = skew * s.len() as f64 * s.interval_s;
        let text = format!(
            "the clock of {name} runs {} ppm {} than that of the voltage: {} ms over the recording",
            short(1e6 * skew.abs()),
            if skew > 0.0 { "slower" } else { "faster" },
            short(1e3 * over_s.abs())
        );
        found.push(s.finding(Code::ClockSkew, Severity::Warning, text).on(channel).value(skew, ""));
    } else {
        let text = format!(
            "{name} is {} ms {} than the voltage says",
            short(1e3 * clock.shift_s.abs()),
            if clock.shift_s > 0.0 { "later" } else { "earlier" }
        );
        let finding = s.finding(Code::ChannelShift, Severity::Info, text).on(channel).value(clock.shift_s, "s");
        found.push(finding.handled(Handled::Modelled));
    }
}

/// Puts channels on the clock of the voltage, as the findings `clock_skew` say: values at its instants lie on straight
/// lines between the samples. What the channel's own time does not reach any more does not count.
pub fn correct(recordings: &mut [Recording], found: &mut [DataFinding]) {
    for finding in found.iter_mut().filter(|f| f.code == Code::ClockSkew) {
        let (Some(channel), Some(skew)) = (finding.channel, finding.value) else { continue };
        let Some(recording) = recordings.iter_mut().find(|r| finding.recording == r.path()) else { continue };
        let Some(values) = recording.channel(channel) else { continue };
        let masked = recording.masked(channel);
        let place = |n: usize| n as f64 * (1.0 + skew);
        let before = |n: usize| (place(n) as usize).min(values.len() - 1);
        let on_time = |n: usize| {
            let (one, share) = (before(n), place(n) - before(n) as f64);
            values.get(one + 1).map_or(values[one], |next| values[one] + share * (next - values[one]))
        };
        let corrected: Vec<f64> = (0..values.len()).map(on_time).collect();
        let is_masked = |n: usize| masked.binary_search(&n).is_ok();
        let lacks = |n: &usize| before(*n) + 1 >= values.len() || is_masked(before(*n)) || is_masked(before(*n) + 1);
        let lacking: Vec<usize> = (0..values.len()).filter(lacks).collect();
        if recording.set_channel(channel, corrected).is_ok() {
            recording.exclude(lacking);
            finding.handled = Handled::Corrected;
        }
    }
}

/// The balance of the voltage with one channel on another clock.
struct Balance<'a> {
    voltage: Cow<'a, [f64]>,
    current: Cow<'a, [f64]>,
    speed: Cow<'a, [f64]>,
    interval_s: f64,
    kind: Kind,
    length: usize,
    /// First samples of the windows.
    windows: Vec<usize>,
    phi: Vec<f64>,
    psi: Vec<f64>,
}

impl<'a> Balance<'a> {
    fn new(s: &'a Signals<'_>, kind: Kind) -> Self {
        let length = s.window(ELECTRICAL_WINDOW_S);
        let n = s.len();
        let margin = ((LARGEST_S / s.interval_s) as usize).min(n / 8);
        let last = n.saturating_sub(margin + length);
        let hop = (last.saturating_sub(margin) / WINDOWS).max(length / 2).max(1);
        let usable = |from: usize| {
            [from, from + length / 2, from + length - 1].into_iter().all(|k| s.is_valid(k) && !s.is_open(k))
        };
        let [phi, psi] = balance::weights(length, s.interval_s);
        Self {
            voltage: s.voltage.unwrap_or_default().into(),
            current: s.current.unwrap_or_default().into(),
            speed: s.speed.as_deref().unwrap_or_default().into(),
            interval_s: s.interval_s,
            kind,
            length,
            windows: (margin..last).step_by(hop).filter(|from| usable(*from)).collect(),
            phi,
            psi,
        }
    }

    /// The same of averaged signals, at as few samples in a window as it may have.
    fn coarse(&self) -> Self {
        let factor = (self.length / WINDOW_SAMPLES).max(1);
        let fewer = |x: &[f64]| if factor == 1 { x.to_vec() } else { averaging::average(x, factor) };
        let (length, interval_s) = (self.length / factor, self.interval_s * factor as f64);
        let [phi, psi] = balance::weights(length, interval_s);
        Self {
            voltage: fewer(&self.voltage).into(),
            current: fewer(&self.current).into(),
            speed: fewer(&self.speed).into(),
            interval_s,
            kind: self.kind,
            length,
            windows: self.windows.iter().map(|from| from / factor).collect(),
            phi,
            psi,
        }
    }

    /// Variance of the voltage that is left, V².
    fn left(&self, channel: Channel, clock: Clock) -> Option<f64> {
        self.fit(channel, clock).map(|f| f.variance)
    }

    /// The same with the channels as they are, and other coefficients from some time on: the least over borders.
    fn left_by_a_change(&self) -> f64 {
        let rows: Vec<_> = self.rows(Channel::Current, RIGHT).collect();
        let of_part =
            |rows: &[([f64; 4], f64)]| regression::fit(rows.iter().copied()).map(|f| f.variance * f.rows as f64);
        let left = |border: usize| {
            let (before, after) = rows.split_at(border * rows.len() / BORDERS);
            Some((of_part(before)? + of_part(after)?) / rows.len() as f64)
        };
        (1..BORDERS).filter_map(left).fold(f64::INFINITY, f64::min)
    }

    /// u on 1, i, di/dt and the motion, with one channel on a clock.
    fn fit(&self, channel: Channel, clock: Clock) -> Option<Fit<4>> {
        regression::fit(self.rows(channel, clock))
    }

    fn rows(&self, channel: Channel, clock: Clock) -> impl Iterator<Item = ([f64; 4], f64)> {
        let (other_i, other_w) = match channel {
            Channel::Current => (clock, RIGHT),
            _ => (RIGHT, clock),
        };
        let taken = move |x: &[f64], n: usize, clock: Clock| {
            let position = n as f64 + clock.shift_s / self.interval_s + clock.skew * n as f64;
            let position = position.clamp(0.0, (x.len() - 1) as f64);
            let k = (position as usize).min(x.len().saturating_sub(2));
            x[k] + (position - k as f64) * (x[k + 1] - x[k])
        };
        self.windows.iter().map(move |&from| {
            let [mut u, mut i, mut di, mut motion] = [0.0; 4];
            for k in 0..self.length {
                let (a, d) = (self.phi[k], self.psi[k]);
                let current = taken(&self.current, from + k, other_i);
                let speed = taken(&self.speed, from + k, other_w);
                u += a * self.voltage[from + k];
                i += a * current;
                di += d * current;
                motion += a * if self.kind == Kind::PmDc { speed } else { current * speed };
            }
            ([1.0, i, di, motion], u)
        })
    }

    /// The shift of a channel, and the skew of its clock, that leave least, and what they leave.
    fn candidates(&self, channel: Channel) -> [(Clock, f64); 2] {
        let (shift_s, left) = self.best_shift(channel);
        let (skew, by_skew) = self.best_skew(channel);
        [(Clock { shift_s, skew: 0.0 }, left), (Clock { shift_s: 0.0, skew }, by_skew)]
    }

    /// The clock near one that leaves least.
    fn closer(&self, channel: Channel, near: Clock) -> (Clock, f64) {
        let left_by = |clock: Clock| self.left(channel, clock).unwrap_or(f64::INFINITY);
        let (mut clock, mut least) = (near, left_by(near));
        for _ in 0..2 {
            let (shift_s, left) = fine(clock.shift_s, 0.02 * LARGEST_S, |shift_s| left_by(Clock { shift_s, ..clock }));
            if left < least {
                (clock.shift_s, least) = (shift_s, left);
            }
            let (skew, left) = fine(clock.skew, 0.02 * LARGEST_SKEW, |skew| left_by(Clock { skew, ..clock }));
            if left < least {
                (clock.skew, least) = (skew, left);
            }
        }
        (clock, least)
    }

    /// The skew of a clock that leaves `left`, less what its shift has taken of it: without a shift, if that does as
    /// well.
    fn skew_alone(&self, channel: Channel, clock: Clock, left: f64) -> f64 {
        let by = |skew: f64| self.left(channel, Clock { shift_s: 0.0, skew }).unwrap_or(f64::INFINITY);
        let (skew, by_skew) = fine(clock.skew, 0.02 * LARGEST_SKEW, by);
        if by_skew < BETTER_YET * left { skew } else { clock.skew }
    }

    fn best_shift(&self, channel: Channel) -> (f64, f64) {
        best(LARGEST_S, |shift_s| self.left(channel, Clock { shift_s, skew: 0.0 }).unwrap_or(f64::INFINITY))
    }

    fn best_skew(&self, channel: Channel) -> (f64, f64) {
        best(LARGEST_SKEW, |skew| self.left(channel, Clock { shift_s: 0.0, skew }).unwrap_or(f64::INFINITY))
    }
}

/// The least over parts of a largest value on either side, then finely.
fn best(largest: f64, of: impl Fn(f64) -> f64) -> (f64, f64) {
    let tried = PARTS.iter().flat_map(|part| [-part * largest, part * largest]).chain([0.0]);
    let (x, _) =
        tried.map(|x| (x, of(x))).fold((0.0, f64::INFINITY), |least, at| if at.1 < least.1 { at } else { least });
    fine(x, (0.3 * x.abs()).max(PARTS[0] * largest), of)
}

/// The least within a distance, by golden section.
fn fine(x: f64, around: f64, of: impl Fn(f64) -> f64) -> (f64, f64) {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (x - around, x + around);
    let inner = |low: f64, high: f64| [high - golden * (high - low), low + golden * (high - low)];
    let [mut a, mut b] = inner(low, high);
    let (mut at_a, mut at_b) = (of(a), of(b));
    for _ in 0..STEPS {
        if at_a < at_b {
            (high, b, at_b) = (b, a, at_a);
            a = inner(low, high)[0];
            at_a = of(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = inner(low, high)[1];
            at_b = of(b);
        }
    }
    if at_a < at_b { (a, at_a) } else { (b, at_b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Recording;

    #[test]
    fn a_channel_on_a_clock_of_its_own_is_put_on_that_of_the_voltage() {
        const H: f64 = 1e-3;
        const SKEW: f64 = 400e-6;
        let speed = |t: f64| 100.0 * (9.0 * t).sin();
        let at = |n: usize| n as f64 * H;
        let measured = (0..10_000).map(|n| speed(at(n) / (1.0 + SKEW))).collect();
        let recording = Recording::builder(H).channel(Channel::Speed, measured).build().unwrap().named("run.csv");
        let skewed = DataFinding::new(Code::ClockSkew, Severity::Warning, recording.path(), "its own clock");
        let mut found = [skewed.on(Channel::Speed).value(SKEW, "")];
        let mut recordings = [recording];
        correct(&mut recordings, &mut found);
        assert_eq!(found[0].handled, Handled::Corrected);
        let corrected = recordings[0].channel(Channel::Speed).unwrap();
        // Of ten seconds the last four milliseconds lie beyond the channel's own time.
        let counted: Vec<usize> = (0..10_000).filter(|n| recordings[0].valid()[*n]).collect();
        assert!((9_994..=9_996).contains(&counted.len()), "{}", counted.len());
        // A straight line is off by h²/8 times the second derivative, 100·81 rad/s³.
        let off = counted.iter().map(|n| (corrected[*n] - speed(at(*n))).abs()).fold(0.0, f64::max);
        assert!(off < 1.01 * H * H / 8.0 * 8100.0, "{off} rad/s");
    }
}
