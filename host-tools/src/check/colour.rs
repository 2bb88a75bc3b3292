//! Noise that is not white, and hum.
//!
//! Spectra of short windows, the median over the windows: what jumps somewhere does not count. White noise has one
//! power at all frequencies; pink noise falls with them. Hum stands out of its neighbours, in a channel and not in the
//! voltage: in most windows, or in all of them together with one amplitude and phase ([`Line`]).

use std::borrow::Cow;
use std::f64::consts::TAU;

use realfft::RealFftPlanner;

use super::criteria::T_SIGN;
use super::hum::{HUMS_HZ, Line};
use super::regression;
use super::signals::{self, Signals, short};
use crate::mains;
use crate::recording::Channel;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};

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
/// Windows for hum: ten of its periods.
const HUM_WINDOW_S: f64 = 0.2;
/// Power of hum in that of its neighbours.
const STANDS_OUT: f64 = 8.0;
/// The same in the voltage, from which on the motor may cause it.
const IN_THE_SUPPLY: f64 = 3.0;

/// What to look for.
pub fn look(s: &Signals<'_>, found: &mut Vec<DataFinding>) {
    let period = s.voltage.and_then(|u| mains::period_s(u, s.interval_s)).map(|t| t / s.interval_s);
    if found.iter().any(|f| f.recording == s.path() && f.code == Code::Resampled) {
        return;
    }
    let stepped: Vec<Channel> = found
        .iter()
        .filter(|f| f.recording == s.path())
        .filter(|f| !matches!(f.code, Code::OneSided | Code::Outliers | Code::Clipped))
        .filter_map(|f| f.channel)
        .collect();
    for (channel, values) in s.channels() {
        if matches!(channel, Channel::Angle | Channel::Voltage) || stepped.contains(&channel) {
            continue;
        }
        // Of an alternating supply all harmonics are in all channels.
        let stands_out = || hum(s, values).filter(|_| period.is_none()).map(|(hz, power)| (hz, power.sqrt()));
        let steady = || Line::strongest(s.recording(), channel).map(|line| (line.hz, line.times));
        if let Some((hz, times)) = stands_out().or_else(steady) {
            let text = format!(
                "{} hums at {hz} Hz, {} times its neighbourhood, and the voltage does not",
                signals::name(channel),
                short(times)
            );
            found.push(s.finding(Code::Hum, Severity::Info, text).on(channel).value(hz, "Hz").handled(Handled::None));
        } else if let Some(slope) = slope(&without_mains(values, period), s.interval_s) {
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

/// Power at each frequency k/length, the median over windows.
fn spectrum(values: &[f64], length: usize, hop: usize) -> Option<Vec<f64>> {
    const FEWEST_WINDOWS: usize = 8;
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let window: Vec<f64> = (0..length).map(|k| 0.5 - 0.5 * (TAU * k as f64 / length as f64).cos()).collect();
    let mut all: Vec<Vec<f64>> = Vec::new();
    let mut output = fft.make_output_vec();
    for from in (0..values.len().saturating_sub(length)).step_by(hop) {
        let piece = &values[from..from + length];
        // A straight line through the ends, so that a run-up is no edge.
        let (a, b) = (piece[0], (piece[length - 1] - piece[0]) / (length - 1) as f64);
        let mut input: Vec<f64> = (0..length).map(|k| (piece[k] - a - b * k as f64) * window[k]).collect();
        fft.process(&mut input, &mut output).ok()?;
        all.push(output.iter().map(|x| x.norm_sqr()).collect());
    }
    if all.len() < FEWEST_WINDOWS {
        return None;
    }
    let middle = all.len() / 2;
    let at = |k: usize| {
        let mut powers: Vec<f64> = all.iter().map(|w| w[k]).collect();
        *powers.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    Some((0..length / 2 + 1).map(at).collect())
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

/// The frequency of hum, Hz, and its power in that of its neighbours.
pub fn hum(s: &Signals<'_>, values: &[f64]) -> Option<(f64, f64)> {
    let length = (HUM_WINDOW_S / s.interval_s).round() as usize;
    let hop = (length / 2).max(1);
    if length < 32 {
        return None;
    }
    let power = spectrum(values, length, hop)?;
    let supply = s.voltage.and_then(|u| spectrum(u, length, hop));
    // Hann's main lobe is two frequencies wide on either side.
    let stands_out = |power: &[f64], k: usize| {
        let beside = [k - 3, k - 4, k + 3, k + 4].into_iter().filter_map(|k| power.get(k)).map(|p| p.max(1e-300).ln());
        let count = beside.clone().count().max(1) as f64;
        power.get(k).map_or(0.0, |p| p / (beside.sum::<f64>() / count).exp())
    };
    let at = |hz: f64| (hz * length as f64 * s.interval_s).round() as usize;
    HUMS_HZ
        .into_iter()
        .filter(|hz| at(*hz) + 4 < power.len() && at(*hz) >= 5)
        .map(|hz| (hz, stands_out(&power, at(hz)), supply.as_ref().map_or(0.0, |u| stands_out(u, at(hz)))))
        .filter(|(_, times, supply)| *times > STANDS_OUT && *supply < IN_THE_SUPPLY)
        .map(|(hz, times, _)| (hz, times))
        .max_by(|a, b| a.1.total_cmp(&b.1))
}
