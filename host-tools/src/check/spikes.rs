//! Values that stand for "out of range", and single samples far from their neighbours.
//!
//! A sample is an outlier if it stands out from both neighbours to the same side by [`SIGMAS_OF_OUTLIER`] standard
//! deviations of the noise (of fourth differences, by their median), and by four times as much as any other within ten
//! samples: a motor's current and speed have an inductance and an inertia, and go nowhere and back within two
//! intervals.

use super::criteria::SIGMAS_OF_OUTLIER;
use super::regression;
use super::signals::{self, Signals, short};
use crate::noise;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};
use crate::recording::{Channel, Recording};

/// Share of samples from which outliers are no longer single events.
const RARE: f64 = 0.02;

/// Samples before and after that are looked at.
const AROUND: usize = 10;

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
    let sigma = noise::of_differences(values).max(1e-9 * most);
    let quantum = smallest_step(values);
    // Height above the straight line between the neighbours.
    let height = |n: usize| values[n] - 0.5 * (values[n - 1] + values[n + 1]);
    let limit = (SIGMAS_OF_OUTLIER * sigma).max(4.0 * quantum);
    let mut outliers = Vec::new();
    for n in 2..values.len().saturating_sub(2) {
        let h = height(n);
        let lone = |side: f64| (side + 0.5 * h).abs() < TOLERANCE * h.abs();
        if h.abs() <= limit || !lone(height(n - 1)) || !lone(height(n + 1)) {
            continue;
        }
        let (first, last) = (n.saturating_sub(AROUND).max(1), (n + AROUND).min(values.len() - 2));
        let counts = (first - 1..=last + 1).all(|k| usable(k) && !is_code(values[k]) && !s.is_open(k));
        let around = (first..=last).filter(|k| k.abs_diff(n) > 1).fold(0.0_f64, |m, k| m.max(height(k).abs()));
        if counts && h.abs() > 4.0 * around && (channel == Channel::Voltage || !edge_of_voltage(s, n)) {
            outliers.push(n);
        }
    }
    if channel == Channel::Current {
        let explained = from_the_others(s, &outliers, &height);
        outliers.retain(|&n| (height(n) - explained(n)).abs() > 0.5 * height(n).abs());
    }
    // A binary sequence goes up and down by itself.
    let least = outliers.iter().map(|&n| height(n).abs()).fold(f64::INFINITY, f64::min);
    let jumps = values.windows(2).filter(|w| (w[1] - w[0]).abs() > 0.5 * least).count();
    if jumps > 2 * outliers.len() + outliers.len() / 4 + 1 && channel == Channel::Voltage {
        outliers.clear();
    }
    if outliers.len() as f64 > RARE * values.len() as f64 {
        outliers.clear();
    }
    Wild { codes, outliers }
}

/// What voltage and speed say about a height of the current: where the current settles within an interval it follows
/// both at once.
fn from_the_others<'a>(
    s: &'a Signals<'_>,
    outliers: &[usize],
    height: &dyn Fn(usize) -> f64,
) -> impl Fn(usize) -> f64 + use<'a> {
    let above = |x: Option<&[f64]>, n: usize| x.map_or(0.0, |x| x[n] - 0.5 * (x[n - 1] + x[n + 1]));
    let others = move |n: usize| {
        [above(s.voltage, n), above(s.speed.as_deref(), n), above(s.voltage, n - 1), above(s.voltage, n + 1)]
    };
    let near: Vec<usize> = outliers.iter().flat_map(|&n| n - 1..=n + 1).collect();
    let rows = (2..s.len().saturating_sub(2))
        .filter(|n| (n - 1..=n + 1).all(|k| s.is_valid(k)) && near.binary_search(n).is_err())
        .map(|n| (others(n), height(n)));
    let b = if outliers.is_empty() { [0.0; 4] } else { regression::fit(rows).map_or([0.0; 4], |f| f.b) };
    move |n| others(n).iter().zip(b).map(|(x, b)| x * b).sum()
}

/// Whether the voltage jumps next to a sample: a slow log shows an inrush as a single sample.
fn edge_of_voltage(s: &Signals<'_>, n: usize) -> bool {
    let Some(u) = s.voltage else { return false };
    let usual = signals::largest(&u[n.saturating_sub(64)..(n + 64).min(u.len())]);
    let near = &u[n.saturating_sub(2)..(n + 3).min(u.len())];
    let jump = near.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
    let mut steps: Vec<f64> =
        u[n.saturating_sub(64)..(n + 64).min(u.len())].windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let middle = steps.len() / 2;
    let median = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    jump > 6.0 * median && jump > 0.03 * usual
}

/// Smallest distance between two neighbours that are not alike.
fn smallest_step(values: &[f64]) -> f64 {
    let step = values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    if step.is_finite() { step } else { 0.0 }
}
