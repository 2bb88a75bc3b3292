//! Noise that is not white: white noise has one power at all frequencies, pink noise falls with them.

use std::borrow::Cow;

use super::criteria::T_SIGN;
use super::regression;
use super::signals::{self, Signals, short};
use super::spectrum::{plain_channels, spectrum};
use crate::mains;
use crate::recording::finding::{Code, DataFinding, Severity};

/// Lowest frequency at which what a channel shows is noise and no longer the motor, Hz, and as a share of the rate.
const NOISE_HZ: f64 = 150.0;
const NOISE_SHARE: f64 = 0.04;
/// Highest, as a share of the rate: the converter's filter.
const TOP: f64 = 0.3;
/// Slope of the logarithm of power against that of frequency from which on noise has a colour: half of pink noise's.
const SLOPE: f64 = -0.5;
/// Fewest frequencies that a slope is taken over, and the octaves that they span.
const FEWEST: usize = 24;
const OCTAVES: f64 = 1.5;

/// What to look for.
pub fn look(s: &Signals<'_>, found: &mut Vec<DataFinding>) {
    let period = s.voltage.and_then(|u| mains::period_s(u, s.interval_s)).map(|t| t / s.interval_s);
    if found.iter().any(|f| f.recording == s.path() && f.code == Code::Resampled) {
        return;
    }
    for (channel, values) in plain_channels(s, found) {
        if let Some(slope) = slope(&without_mains(values, period), s.interval_s) {
            let text = format!(
                "the noise of {} is not white: its power goes with the frequency to the power of {}",
                signals::name(channel),
                short(slope)
            );
            found.push(s.finding(Code::ColouredNoise, Severity::Info, text).on(channel).value(slope, ""));
        }
    }
}

/// What a channel does not repeat from one period of the mains to the next.
fn without_mains(values: &[f64], period: Option<f64>) -> Cow<'_, [f64]> {
    let Some(period) = period else { return Cow::Borrowed(values) };
    let (whole, part) = (period as usize, period.fract());
    let before = |n: usize| values[n - whole] + part * (values[n - whole - 1] - values[n - whole]);
    Cow::Owned((whole + 1..values.len()).map(|n| values[n] - before(n)).collect())
}

/// The power of frequency with which noise goes, where it is not zero.
fn slope(values: &[f64], interval_s: f64) -> Option<f64> {
    const LENGTH: usize = 512;
    let power = spectrum(values, LENGTH, LENGTH / 2)?;
    let low = (NOISE_HZ * interval_s).max(NOISE_SHARE);
    let (first, last) = ((low * LENGTH as f64).ceil() as usize, (TOP * LENGTH as f64) as usize);
    if last < first + FEWEST || (last as f64 / first as f64).log2() < OCTAVES {
        return None;
    }
    let rows = (first..last).filter(|k| power[*k] > 0.0).map(|k| ([1.0, (k as f64).ln()], power[k].ln()));
    let fit = regression::fit(rows)?;
    (fit.b[1] < SLOPE && fit.t[1] < -T_SIGN).then_some(fit.b[1])
}
