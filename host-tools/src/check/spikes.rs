//! Values that stand for "out of range", and single samples far from their neighbours.
//!
//! A sample is an outlier if it stands out from both neighbours to the same side by [`SIGMAS_OF_OUTLIER`] standard
//! deviations of the noise (of fourth differences, by their median), and by four times as much as any other within ten
//! samples, but for another such one: a motor's current and speed have an inductance and an inertia, and go nowhere and
//! back within two intervals. A voltage can, by a switch: one that is switched shows pulses of several samples, too.
//!
//! A few samples of a sine lie on no straight line. Of an alternating supply all this is asked of what is left of a
//! slow recording less the mean of a period before and one after.

use std::borrow::Cow;

use super::criteria::SIGMAS_OF_OUTLIER;
use super::regression;
use super::signals::{self, Signals, short};
use crate::between::cubic;
use crate::mains;
use crate::noise;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};
use crate::recording::{Channel, Recording};

/// Share of samples from which outliers are no longer single events.
const RARE: f64 = 0.02;

/// Samples before and after that are looked at, and outliers among them at most: more are no single events.
const AROUND: usize = 10;
const MOST_AROUND: usize = 2;

/// Periods before and after at which the same phase is looked at, and the share of a height from which on it has been
/// there before; of the first period before and after half of it is what the height itself leaves.
const PERIODS_AROUND: usize = 5;
const ECHO: f64 = 0.25;

/// Samples a period of the mains from which on its bend from sample to sample, (2π/64)² of the amplitude, is little.
const FEW_A_PERIOD: f64 = 64.0;

/// How closely the neighbours have to lie on the line, relative to the height: an edge lifts one of them.
const TOLERANCE: f64 = 0.25;

/// From this magnitude on a number is a code: instruments write 9.9E37 (SCPI), 1e30 or the largest of a format.
const NO_MEASUREMENT: f64 = 1e9;

/// Numbers that loggers write where there is none.
const FILLS: [f64; 7] = [-999.0, -9999.0, -99999.0, 9999.0, 99999.0, -999.25, 65535.0];

/// Samples of a channel that no motor has caused.
pub struct Wild {
    /// Codes for "out of range".
    pub codes: Vec<usize>,
    /// Outliers.
    pub outliers: Vec<usize>,
}

/// What to look for.
pub fn look(s: &mut Signals<'_>, found: &mut Vec<DataFinding>) {
    let mut left_out = Vec::new();
    for (channel, values) in s.channels() {
        let wild = wild(s, channel, values);
        if let (Some(&first), Some(&last)) = (wild.codes.first(), wild.codes.last()) {
            let text = format!(
                "{} of {} samples of {} are {}: a code for 'no measurement'",
                wild.codes.len(),
                values.len(),
                signals::name(channel),
                short(values[first])
            );
            found.push(
                s.finding(Code::Overrange, Severity::Warning, text)
                    .on(channel)
                    .between(s.time_s(first), s.time_s(last))
                    .value(values[first], s.unit(channel))
                    .handled(Handled::Masked),
            );
        }
        if let (Some(&first), Some(&last)) = (wild.outliers.first(), wild.outliers.last()) {
            let text = format!(
                "{} single {} of {} far from their neighbours, the first at {} s",
                wild.outliers.len(),
                if wild.outliers.len() == 1 { "sample" } else { "samples" },
                signals::name(channel),
                short(s.time_s(first))
            );
            found.push(
                s.finding(Code::Outliers, Severity::Warning, text)
                    .on(channel)
                    .between(s.time_s(first), s.time_s(last))
                    .value(wild.outliers.len() as f64 / values.len() as f64, "")
                    .handled(Handled::Masked),
            );
        }
        left_out.extend(wild.codes);
        left_out.extend(wild.outliers);
    }
    s.leave_out(&left_out);
}

/// Masks codes for "no measurement" and, where asked, outliers. A channel of which nothing would be left stays as it
/// is; what is left of it is another finding's matter.
pub fn mask(recording: &mut Recording, outliers_too: bool) {
    let samples: Vec<(Channel, Vec<usize>)> = {
        let s = Signals::new(recording);
        let of = |channel, values| {
            let Wild { mut codes, outliers } = wild(&s, channel, values);
            if outliers_too {
                codes.extend(outliers);
                codes.sort_unstable();
            }
            (channel, codes)
        };
        s.channels().map(|(channel, values)| of(channel, values)).collect()
    };
    for (channel, samples) in samples.into_iter().filter(|(_, samples)| !samples.is_empty()) {
        // An error is that of a channel without any usable sample: it stays.
        let _ = recording.mask(channel, &samples);
    }
}

/// Finds them.
pub fn wild(s: &Signals<'_>, channel: Channel, values: &[f64]) -> Wild {
    let usable = |n: usize| s.is_valid(n);
    let mut usual: Vec<f64> = (0..values.len()).filter(|n| usable(*n)).map(|n| values[n].abs()).collect();
    if usual.is_empty() {
        return Wild { codes: Vec::new(), outliers: Vec::new() };
    }
    let at = (usual.len() - 1) * 98 / 100;
    let most = *usual.select_nth_unstable_by(at, f64::total_cmp).1;
    let is_code = |x: f64| x.abs() >= NO_MEASUREMENT || (FILLS.contains(&x) && x.abs() > 4.0 * most);
    let codes: Vec<usize> = (0..values.len()).filter(|n| usable(*n) && is_code(values[*n])).collect();
    let period = s.voltage.and_then(|u| mains::period_s(u, s.interval_s)).map(|t| t / s.interval_s);
    let period = period.filter(|samples| *samples < FEW_A_PERIOD);
    let signal = &*without_mains(values, period);
    let sigma = noise::of_differences(signal).max(1e-9 * most);
    let quantum = smallest_step(values);
    // Height above the straight line between the neighbours.
    let height = |n: usize| signal[n] - 0.5 * (signal[n - 1] + signal[n + 1]);
    let limit = (SIGMAS_OF_OUTLIER * sigma).max(4.0 * quantum);
    // Half of it is seen a period before and a period after, and nothing at the same phase of the others around: there
    // the switch of a phase-angle control is.
    let is_its_own = |n: usize| {
        let echoes = |lag: f64| {
            let lag = lag.round() as usize;
            let all = [n.saturating_sub(lag + 1)..=n.saturating_sub(lag - 1), n + lag - 1..=n + lag + 1];
            all.into_iter().flatten().filter(|k| (1..signal.len() - 1).contains(k)).map(|k| height(k).abs())
        };
        let keeps_below = |samples: f64, periods: usize| {
            let most = if periods == 1 { 0.5 + ECHO } else { ECHO } * height(n).abs();
            echoes(periods as f64 * samples).all(|echo| echo < most)
        };
        period.is_none_or(|samples| (1..=PERIODS_AROUND).all(|periods| keeps_below(samples, periods)))
    };
    let voltage = s.voltage.filter(|_| period.is_some()).map(|u| without_mains(u, period));
    let voltage_noise = voltage.as_deref().map_or(0.0, noise::of_differences);
    let is_switched_otherwise = |n: usize| {
        let jumps = |u: &[f64]| {
            let mut near = n.saturating_sub(2).max(1)..(n + 3).min(u.len() - 1);
            near.any(|k| (u[k] - 0.5 * (u[k - 1] + u[k + 1])).abs() > SIGMAS_OF_OUTLIER * voltage_noise)
        };
        channel != Channel::Voltage && voltage.as_deref().is_some_and(jumps)
    };
    let stands_alone = |n: usize| {
        let h = height(n);
        let lone = |side: f64| (side + 0.5 * h).abs() < TOLERANCE * h.abs();
        h.abs() > limit && lone(height(n - 1)) && lone(height(n + 1))
    };
    let alone: Vec<usize> = (2..values.len().saturating_sub(2)).filter(|n| stands_alone(*n)).collect();
    let voltage_step = s.voltage.map_or(0.0, smallest_step);
    let is_outlier = |n: usize| {
        let (first, last) = (n.saturating_sub(AROUND).max(1), (n + AROUND).min(values.len() - 2));
        let counts = (first - 1..=last + 1).all(|k| usable(k) && !is_code(values[k]) && !s.is_open(k));
        let beside = &alone[alone.partition_point(|k| k + 1 < first)..alone.partition_point(|k| *k <= last + 1)];
        // What is left of two that are close is their own.
        let own = |k: usize| beside.iter().any(|other| other.abs_diff(k) <= 1);
        let around = (first..=last).filter(|k| !own(*k)).fold(0.0_f64, |m, k| m.max(height(k).abs()));
        let is_single = beside.len() <= 1 + MOST_AROUND && height(n).abs() > 4.0 * around;
        counts
            && is_single
            && is_its_own(n)
            && !is_switched_otherwise(n)
            && (channel == Channel::Voltage || !edge_of_voltage(s, n, voltage_step))
    };
    let mut outliers: Vec<usize> = alone.iter().copied().filter(|n| is_outlier(*n)).collect();
    if channel == Channel::Current {
        let explained = from_the_others(s, &outliers, &height, period);
        outliers.retain(|&n| (height(n) - explained(n)).abs() > 0.5 * height(n).abs());
    }
    if channel == Channel::Voltage && is_switched(values, &outliers, &height) {
        outliers.clear();
    }
    if outliers.len() as f64 > RARE * values.len() as f64 {
        outliers.clear();
    }
    Wild { codes, outliers }
}

/// What does not come back: a signal less the mean of one period before and one after, which are its own where there is
/// none.
fn without_mains(values: &[f64], period: Option<f64>) -> Cow<'_, [f64]> {
    let Some(period) = period else { return Cow::Borrowed(values) };
    let last = values.len() as f64 - 3.0;
    let without = |n: usize| {
        let around = [n as f64 - period, n as f64 + period];
        if around[0] < 1.0 || around[1] > last {
            return 0.0;
        }
        values[n] - 0.5 * around.iter().map(|t| cubic(values, *t as usize + 1, t.fract())).sum::<f64>()
    };
    Cow::Owned((0..values.len()).map(without).collect())
}

/// Whether a signal jumps up and down by itself, as a binary sequence does: for several samples as well as for one.
/// Steps that last are no pulses.
fn is_switched(values: &[f64], outliers: &[usize], height: &dyn Fn(usize) -> f64) -> bool {
    /// Pulses of several samples, as a share of the outliers: a binary sequence has as many of them as of one sample.
    const PULSES: usize = 4;
    let least = outliers.iter().map(|&n| height(n).abs()).fold(f64::INFINITY, f64::min);
    let jump = |n: usize| values[n] - values[n - 1];
    let jumps: Vec<usize> = (1..values.len()).filter(|n| jump(*n).abs() > 0.5 * least).collect();
    let is_pulse = |pair: &&[usize]| (2..=AROUND).contains(&(pair[1] - pair[0])) && jump(pair[0]) * jump(pair[1]) < 0.0;
    jumps.windows(2).filter(is_pulse).count() > 1 + outliers.len() / PULSES
}

/// What voltage and speed say about a height of the current: where the current settles within an interval it follows
/// both at once.
fn from_the_others<'a>(
    s: &Signals<'a>,
    outliers: &[usize],
    height: &dyn Fn(usize) -> f64,
    period: Option<f64>,
) -> impl Fn(usize) -> f64 + use<'a> {
    let voltage = s.voltage.map(|u| without_mains(u, period));
    let speed = s.speed.as_ref().map(|w| without_mains(w, period).into_owned());
    let above = |x: Option<&[f64]>, n: usize| x.map_or(0.0, |x| x[n] - 0.5 * (x[n - 1] + x[n + 1]));
    let others = move |n: usize| {
        let voltage = |n: usize| above(voltage.as_deref(), n);
        [voltage(n), above(speed.as_deref(), n), voltage(n - 1), voltage(n + 1)]
    };
    let near: Vec<usize> = outliers.iter().flat_map(|&n| n - 1..=n + 1).collect();
    let rows = (2..s.len().saturating_sub(2))
        .filter(|n| (n - 1..=n + 1).all(|k| s.is_valid(k)) && near.binary_search(n).is_err())
        .map(|n| (others(n), height(n)));
    let b = if outliers.is_empty() { [0.0; 4] } else { regression::fit(rows).map_or([0.0; 4], |f| f.b) };
    move |n| others(n).iter().zip(b).map(|(x, b)| x * b).sum()
}

/// Whether the voltage jumps next to a sample, by more than its noise in steps of its converter: a slow log shows an
/// inrush as a single sample.
fn edge_of_voltage(s: &Signals<'_>, n: usize, smallest_step: f64) -> bool {
    let Some(u) = s.voltage else { return false };
    let usual = signals::largest(&u[n.saturating_sub(64)..(n + 64).min(u.len())]);
    let near = &u[n.saturating_sub(2)..(n + 3).min(u.len())];
    let jump = near.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
    let mut steps: Vec<f64> =
        u[n.saturating_sub(64)..(n + 64).min(u.len())].windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let middle = steps.len() / 2;
    let median = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    jump > 6.0 * median.max(smallest_step) && jump > 0.03 * usual
}

/// Smallest distance between two neighbours that are not alike.
fn smallest_step(values: &[f64]) -> f64 {
    let step = values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    if step.is_finite() { step } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Kind;
    use crate::rig::Setup;

    fn outliers(recording: &Recording, channel: Channel) -> Vec<usize> {
        wild(&Signals::new(recording), channel, recording.channel(channel).unwrap()).outliers
    }

    fn with(recording: &Recording, channel: Channel, at: &[(usize, f64)]) -> Recording {
        let mut spiked = recording.clone();
        let mut values = recording.channel(channel).unwrap().to_vec();
        at.iter().for_each(|(n, height)| values[*n] += height);
        spiked.set_channel(channel, values).unwrap();
        spiked
    }

    #[test]
    fn single_samples_far_off_are_found_in_each_channel_between_steps_at_rest_and_two_by_two() {
        let sound = Setup::new(Kind::PmDc).profile("dc-steps").unwrap().seconds(4.0).run().unwrap().recording;
        // The last two are six samples apart; the first ones fall on one voltage after another, rest among them.
        let at = [1203, 7203, 13_203, 19_203, 25_203, 31_203, 37_203, 37_209];
        for (channel, height) in [(Channel::Voltage, 9.0), (Channel::Current, -3.0), (Channel::Speed, 150.0)] {
            assert_eq!(outliers(&sound, channel), [0; 0], "{channel:?}");
            let spiked = with(&sound, channel, &at.map(|n| (n, height)));
            assert_eq!(outliers(&spiked, channel), at, "{channel:?}");
        }
    }

    #[test]
    fn single_samples_far_off_are_found_in_a_sine_of_a_few_samples_a_period() {
        let setup = Setup::new(Kind::Universal).profile("ramp").unwrap().seconds(4.0);
        let sound = setup.run().unwrap().recording.one_row_in(20, 0).unwrap();
        assert_eq!(outliers(&sound, Channel::Current), [0; 0]);
        let current = sound.channel(Channel::Current).unwrap();
        let largest = current.iter().fold(0.0f64, |m, i| m.max(i.abs()));
        let at = [203, 611, 1207, 1644];
        let spiked = with(&sound, Channel::Current, &at.map(|n| (n, 0.4 * largest)));
        assert_eq!(outliers(&spiked, Channel::Current), at);
    }

    #[test]
    fn a_binary_sequence_keeps_its_single_samples() {
        // A shift register of nine bits, x⁹ + x⁵ + 1, one bit a sample, rests of forty samples in between.
        let mut register = 0x1ff_u32;
        let mut bit = || {
            let next = (register >> 8 ^ register >> 4) & 1;
            register = (register << 1 | next) & 0x1ff;
            f64::from(next)
        };
        let voltage: Vec<f64> = (0..20_000).map(|n| if n / 40 % 2 == 0 { 12.0 } else { 12.0 * bit() }).collect();
        let still = vec![0.1; voltage.len()];
        let recording = Recording::builder(1e-4)
            .channel(Channel::Voltage, voltage)
            .channel(Channel::Current, still)
            .build()
            .unwrap();
        assert_eq!(outliers(&recording, Channel::Voltage), [0; 0]);
    }
}
