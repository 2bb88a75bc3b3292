//! A channel that is the mean over a window that moves, and effective values.
//!
//! Of white noise e the mean over W samples changes by (e(n) − e(n − W))/W: its differences of any order are correlated
//! by −1/2 at the lag W, and nowhere else beyond the order. A root of a mean of squares does the same.

use super::differences::{autocorrelation, fourth};
use super::hum::hum;
use super::signals::{self, Signals, short};
use crate::model::Kind;
use crate::recording::Channel;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};

/// Correlation at the window: half of what white noise makes, since noise after the mean adds to it.
const CORRELATED: f64 = -0.25;
/// Largest correlation at any other lag, as a share of that: what is periodic has many.
const ALONE: f64 = 0.5;
/// Lags beside zero and beside the window that the fourth differences correlate by themselves.
const ORDER: usize = 4;
/// Longest window, samples.
const LONGEST: usize = 4000;
/// Standard deviations of a correlation by chance, with that of the differences themselves.
const BY_CHANCE: f64 = 7.0;
/// Windows over which loggers take effective values: half a period of the mains and multiples of it, s.
const MAINS_S: [f64; 2] = [0.01, 1.0 / 120.0];

/// What to look for.
pub fn look(s: &Signals<'_>, kind: Kind, found: &mut Vec<DataFinding>) {
    if found.iter().any(|f| f.recording == s.path() && f.code == Code::Resampled) {
        return;
    }
    let mut windows = Vec::new();
    for (channel, values) in s.channels() {
        if channel == Channel::Angle || signals::goes_in_steps(s, channel, found) {
            continue;
        }
        if let Some(window) = window(values) {
            windows.push((channel, window));
        }
    }
    let of = |c: Channel| windows.iter().find(|(channel, _)| *channel == c).map(|(_, window)| *window);
    let magnitude = |c: Channel| s.usable(c).is_some_and(|x| !x.is_empty() && x.iter().all(|x| *x >= 0.0));
    let of_mains = |window: usize| {
        let seconds = window as f64 * s.interval_s;
        MAINS_S.iter().any(|half| {
            let halves = (seconds / half).round();
            halves >= 1.0 && (seconds - halves * half).abs() <= s.interval_s.max(0.01 * seconds)
        })
    };
    if magnitude(Channel::Voltage) && magnitude(Channel::Current) {
        let averaged = [Channel::Voltage, Channel::Current].into_iter().filter_map(of).find(|window| of_mains(*window));
        let ripple = s.speed.as_deref().filter(|_| kind == Kind::Universal).and_then(|w| hum(s, w));
        let why = match (averaged, ripple) {
            (Some(window), _) => format!("means over {} ms", short(1e3 * window as f64 * s.interval_s)),
            (None, Some((hz, _))) if hz >= 100.0 => format!("smooth, while the speed follows a torque of {hz} Hz"),
            _ => String::new(),
        };
        if !why.is_empty() {
            let text = format!(
                "voltage and current are never negative and {why}: effective values of an alternating supply; record the samples"
            );
            found.push(s.finding(Code::RmsValues, Severity::Stop, text));
            return;
        }
    }
    // A program of voltages repeats itself as it likes.
    for (channel, window) in windows.into_iter().filter(|(channel, _)| *channel != Channel::Voltage) {
        let seconds = window as f64 * s.interval_s;
        let text = format!(
            "{} is a mean over the last {window} samples ({} ms): it lags by half of that",
            signals::name(channel),
            short(1e3 * seconds)
        );
        let finding = s.finding(Code::MovingAverage, Severity::Info, text).on(channel).value(seconds, "s");
        found.push(finding.handled(Handled::Modelled));
    }
}

/// The window, samples.
fn window(values: &[f64]) -> Option<usize> {
    let x = fourth(values)?;
    let r = autocorrelation(&x);
    let last = LONGEST.min(r.len().saturating_sub(ORDER + 1));
    let lags = ORDER + 1..last;
    let at = lags.clone().min_by(|a, b| r[*a].total_cmp(&r[*b]))?;
    let beside = lags.filter(|k| k.abs_diff(at) > ORDER).map(|k| r[k].abs()).fold(0.0, f64::max);
    // Σρ² of fourth differences of white noise is 2.6.
    let chance = BY_CHANCE * (2.6 / x.len() as f64).sqrt();
    (r[at] < CORRELATED.min(-chance) && beside < ALONE * -r[at]).then_some(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(length: usize) -> Vec<f64> {
        let mut state = 1_u64;
        (0..length)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
            })
            .collect()
    }

    #[test]
    fn a_mean_over_thirty_samples_is_told_and_noise_is_not() {
        let x = noise(20_000);
        assert_eq!(window(&x), None);
        let mean: Vec<f64> = x.windows(30).map(|w| w.iter().sum::<f64>() / 30.0).collect();
        assert_eq!(window(&mean), Some(30));
    }
}
