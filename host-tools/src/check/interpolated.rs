//! A logger that has interpolated between the samples that it had.
//!
//! Straight lines between samples have second differences only near the samples: their squares repeat with the
//! original interval. Source: A. C. Gallagher, Detection of linear and cubic interpolation in JPEG compressed images,
//! 2005.

use super::differences::{periodogram, second};
use super::signals::{self, Signals, short};
use crate::mains;
use crate::recording::Channel;
use crate::recording::finding::{Code, DataFinding, Severity};

/// Power of the line, in the mean power about it. Of n frequencies of white noise the largest has ln n, 12 for 2^17;
/// e^-30 of them have this.
const LINE: f64 = 40.0;
/// Lowest frequency of a line, in cycles a sample: a hundred samples for each of the original ones.
const SLOWEST: f64 = 0.01;
/// Frequencies on either side that are the neighbourhood.
const ABOUT: usize = 200;
/// Distance from a harmonic of the mains, in the mains frequency, that its own uncertainty makes of a high one.
const NEAR_A_HARMONIC: f64 = 0.06;
/// Share of second differences that are zero from which on there are three samples and more in an original interval.
const STRAIGHT: f64 = 0.1;

/// What to look for.
pub fn look(s: &Signals<'_>, found: &mut Vec<DataFinding>) {
    let period = s.voltage.and_then(|u| mains::period_s(u, s.interval_s)).map(|t| t / s.interval_s);
    let lines: Vec<(f64, f64)> = s
        .channels()
        .filter(|(c, _)| *c != Channel::Angle && !signals::goes_in_steps(s, *c, found))
        .filter_map(|(_, values)| line(values, period))
        .collect();
    // All channels went through the logger.
    let common = lines.iter().find(|a| lines.iter().filter(|b| (a.0 - b.0).abs() < 2e-4).count() >= 2);
    let Some((frequency, straight)) = common else { return };
    let rows = if *straight > STRAIGHT { 1.0 / frequency } else { 1.0 / (1.0 - frequency) };
    let text = format!(
        "the samples lie on straight lines that begin every {} rows: a logger has interpolated, what was sampled is {} ms apart",
        short(rows),
        short(1e3 * rows * s.interval_s)
    );
    found.push(s.finding(Code::Resampled, Severity::Info, text).value(rows * s.interval_s, "s"));
}

/// The frequency at which the squares of the second differences repeat, in cycles a sample, and the share of them that
/// is zero.
fn line(values: &[f64], mains_period: Option<f64>) -> Option<(f64, f64)> {
    let differences = second(values)?;
    let squares: Vec<f64> = differences.iter().map(|d| d * d).collect();
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    // What the printed digits make of zero.
    let straight = differences.iter().filter(|d| d.abs() < 0.01 * rms).count() as f64 / squares.len() as f64;
    let (length, power) = periodogram(&squares);
    let of_mains = |k: usize| {
        mains_period.is_some_and(|period| {
            let harmonic = k as f64 / length as f64 * period;
            (harmonic - harmonic.round()).abs() < (4.0 * period / length as f64).max(NEAR_A_HARMONIC)
        })
    };
    let first = ((SLOWEST * length as f64) as usize).max(1);
    let usable = (first..power.len()).filter(|k| !of_mains(*k));
    let at = usable.max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
    let near = at.saturating_sub(ABOUT).max(first)..(at + ABOUT).min(power.len());
    let others: Vec<f64> = near.filter(|k| k.abs_diff(at) > 4 && !of_mains(*k)).map(|k| power[k]).collect();
    let mean = others.iter().sum::<f64>() / others.len().max(1) as f64;
    (mean > 0.0 && power[at] > LINE * mean).then_some((at as f64 / length as f64, straight))
}
