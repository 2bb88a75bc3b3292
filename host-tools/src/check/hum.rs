//! Hum: lines of the mains that are the measuring chain's, found and taken out of the samples.
//!
//! Hum stands out of its neighbours in the spectrum of a channel, in the median over windows, and not in that of the
//! voltage. A line that the voltage does not have, with the same amplitude and phase whatever the motor does, is the
//! measuring chain's: A cos(2πft + φ) is fitted to it and taken off. In short windows with a taper a phasor z is what
//! the line makes of them, and the power P of its neighbours in the spectrum is what all else does; the line is the
//! mean of z weighted by 1/P, at the frequency at which that mean is largest. It has to stand out of the same mean at
//! its neighbours, which a voltage in regular steps has as well. A line that follows the load or the rotor has another
//! phasor in each window, and stays; so does one that was recorded at a single speed, where it may be the rotor's.

use std::f64::consts::TAU;

use realfft::num_complex::Complex64;

use super::signals::{self, Signals, short};
use super::spectrum::{plain_channels, spectrum};
use crate::mains;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};
use crate::recording::{Channel, Recording};

/// Frequencies of hum, Hz.
const HUMS_HZ: [f64; 4] = [50.0, 60.0, 100.0, 120.0];
/// Windows: ten periods of 50 Hz.
const WINDOW_S: f64 = 0.2;
/// Frequencies of the neighbours beside the line, Hz: clear of its own lobe, which is 10 Hz wide on either side.
const BESIDE_HZ: [f64; 4] = [-20.0, -15.0, 15.0, 20.0];
/// Farthest from its nominal value that the mains is looked for, Hz.
const FARTHEST_HZ: f64 = 1.0;
/// Power of the line in that of its error, from which on it is there: e^-20 by chance.
const SURE: f64 = 20.0;
/// Power of the line in the largest of its neighbours, from which on it is no line of the motor's excitation, and the
/// same in the voltage, from which on the supply has it.
const STANDS_OUT: f64 = 8.0;
const IN_THE_SUPPLY: f64 = 3.0;
/// Power of a line in the voltage, as a share of its own, that makes one in current or speed, at least: the current's
/// may be u/(R i) times as large, and that is ten or so.
const PASSED_ON: f64 = 1e-4;
/// Largest change of its phasor that is none, in its amplitude.
const STEADY: f64 = 0.1;
/// Power of the neighbours, in the line's, up to which a window sees it.
const SEEN: f64 = 0.05;
/// Square of what the phasors are off by, in what is expected, that most windows keep below: 1.6 of noise of known
/// power, twice that of one that four neighbours tell.
const SCATTER: f64 = 4.0;
const MOST: f64 = 0.8;
/// Fewest windows.
const FEWEST_WINDOWS: usize = 8;
/// Spread of the speeds at which the line is seen, in the largest.
const SPEEDS: f64 = 0.2;
/// Lines of a channel at most: the mains and its harmonics.
const MOST_LINES: usize = 3;

/// What to look for: a line that stands out in most windows, or in all of them together.
pub fn look(s: &Signals<'_>, found: &mut Vec<DataFinding>) {
    let is_resampled = found.iter().any(|f| f.recording == s.path() && f.code == Code::Resampled);
    // Of an alternating supply all harmonics are in all channels.
    let alternates = s.voltage.is_some_and(|u| mains::period_s(u, s.interval_s).is_some());
    if is_resampled || alternates {
        return;
    }
    for (channel, values) in plain_channels(s, found) {
        let stands_out = || hum(s, values).map(|(hz, power)| (hz, power.sqrt()));
        let steady = || Line::strongest(s.recording(), channel).map(|line| (line.hz, line.times));
        if let Some((hz, times)) = stands_out().or_else(steady) {
            let text = format!(
                "{} hums at {hz} Hz, {} times its neighbourhood, and the voltage does not",
                signals::name(channel),
                short(times)
            );
            found.push(s.finding(Code::Hum, Severity::Info, text).on(channel).value(hz, "Hz").handled(Handled::None));
        }
    }
}

/// Takes the hum that was found out of the samples, where it is the chain's.
pub fn take_out(recordings: &mut [Recording], found: &mut [DataFinding]) {
    for finding in found.iter_mut().filter(|f| f.code == Code::Hum) {
        let Some(channel) = finding.channel else { continue };
        let Some(recording) = recordings.iter_mut().find(|r| finding.recording == r.path()) else { continue };
        for _ in 0..MOST_LINES {
            let Some(line) = Line::strongest(recording, channel) else { break };
            let Some(values) = recording.channel(channel) else { break };
            let without = values.iter().enumerate().map(|(n, x)| x - line.at(n)).collect();
            if recording.set_channel(channel, without).is_err() {
                break;
            }
            finding.handled = Handled::Modelled;
        }
    }
}

/// A line of a spectrum that is the measuring chain's.
struct Line {
    /// Its nominal frequency, Hz.
    hz: f64,
    /// Its amplitude in that of the strongest neighbour.
    times: f64,
    /// Angle from sample to sample, rad.
    step: f64,
    phasor: Complex64,
}

/// What a window shows.
struct Window {
    middle_s: f64,
    /// The line, and its neighbours.
    phasor: Complex64,
    beside: [Complex64; 4],
    /// Mean power of the neighbours.
    power: f64,
    speed: f64,
}

impl Line {
    /// The strongest one of a channel, if it has any and no supply alternates.
    fn strongest(recording: &Recording, channel: Channel) -> Option<Self> {
        let voltage = recording.channel(Channel::Voltage);
        if voltage.is_some_and(|u| mains::period_s(u, recording.sample_time_s()).is_some()) {
            return None;
        }
        let lines = HUMS_HZ.into_iter().filter_map(|hz| Self::of(recording, channel, hz));
        lines.max_by(|a, b| a.times.total_cmp(&b.times))
    }

    fn of(recording: &Recording, channel: Channel, hz: f64) -> Option<Self> {
        let windows = windows(recording, channel, hz)?;
        let offset = offset_hz(&windows)?;
        let phasor = mean(&windows, offset, |w| w.phasor);
        let power = phasor.norm_sqr();
        let times = power / beside(&windows);
        let error = 1.0 / windows.iter().map(|w| 1.0 / w.power).sum::<f64>();
        // Windows overlap by half: each two of them tell as much as one.
        if power < SURE * 2.0 * error || times < STANDS_OUT || !is_steady(&windows, offset, phasor) {
            return None;
        }
        let of_supply = self::windows(recording, Channel::Voltage, hz).is_some_and(|u| {
            let line = mean(&u, offset, |w| w.phasor).norm_sqr();
            let share = |power: f64, channel| power / mean_square(recording, channel);
            line > IN_THE_SUPPLY * beside(&u) && share(line, Channel::Voltage) > PASSED_ON * share(power, channel)
        });
        (!of_supply).then(|| Self {
            hz,
            times: times.sqrt(),
            step: TAU * (hz + offset) * recording.sample_time_s(),
            phasor,
        })
    }

    fn at(&self, n: usize) -> f64 {
        (self.phasor * Complex64::cis(self.step * n as f64)).re
    }
}

/// How far a line is from its nominal frequency, Hz: where it is largest over all windows, near where it is largest in
/// the stretch of time that shows it best.
fn offset_hz(windows: &[Window]) -> Option<f64> {
    /// Time of a stretch, s, and parts of a turn by which the phase differs between two frequencies that are tried.
    const STRETCH_S: f64 = 20.0;
    const PARTS: f64 = 20.0;
    let largest = |windows: &[Window], middle: f64, reach: f64| {
        let duration_s = windows.last()?.middle_s - windows.first()?.middle_s + WINDOW_S;
        let tries = (reach * duration_s * PARTS).ceil() as i64;
        let offset = |k: i64| middle + reach * k as f64 / tries as f64;
        let power = |k: i64| mean(windows, offset(k), |w| w.phasor).norm_sqr();
        (-tries..=tries).map(|k| (k, power(k))).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| offset(k))
    };
    let stretch = |w: &Window| (w.middle_s / STRETCH_S) as usize;
    let told = |windows: &[Window]| windows.iter().map(|w| 1.0 / w.power).sum::<f64>();
    let stretches = || windows.chunk_by(|a, b| stretch(a) == stretch(b));
    let best = stretches().max_by(|a, b| told(a).total_cmp(&told(b)))?;
    let near = largest(best, 0.0, FARTHEST_HZ)?;
    if best.len() == windows.len() { Some(near) } else { largest(windows, near, 1.0 / STRETCH_S) }
}

/// Mean of phasors at a frequency that is off by so many Hz, weighted by how little else the windows show.
fn mean(windows: &[Window], offset_hz: f64, of: impl Fn(&Window) -> Complex64) -> Complex64 {
    let turned = |w: &Window| of(w) * Complex64::cis(-TAU * offset_hz * w.middle_s);
    let sum: Complex64 = windows.iter().map(|w| turned(w) / w.power).sum();
    sum / windows.iter().map(|w| 1.0 / w.power).sum::<f64>()
}

fn mean_square(recording: &Recording, channel: Channel) -> f64 {
    let values = recording.channel(channel).unwrap_or_default();
    values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64
}

/// The largest power of such a mean among the neighbours.
fn beside(windows: &[Window]) -> f64 {
    (0..BESIDE_HZ.len()).map(|k| mean(windows, 0.0, |w| w.beside[k]).norm_sqr()).fold(f64::MIN_POSITIVE, f64::max)
}

/// Whether the phasor is the same in the windows that see the line, at different speeds.
fn is_steady(windows: &[Window], offset_hz: f64, phasor: Complex64) -> bool {
    let power = phasor.norm_sqr();
    let seen: Vec<&Window> = windows.iter().filter(|w| w.power < SEEN * power).collect();
    let off = |w: &&Window| {
        let off = w.phasor * Complex64::cis(-TAU * offset_hz * w.middle_s) - phasor;
        off.norm_sqr() / (w.power + STEADY * STEADY * power)
    };
    let steady = seen.iter().filter(|w| off(w) < SCATTER).count() as f64;
    let speeds = || seen.iter().map(|w| w.speed);
    let (low, high) = speeds().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), w| (l.min(w), h.max(w)));
    seen.len() >= FEWEST_WINDOWS / 2
        && steady >= MOST * seen.len() as f64
        && high - low > SPEEDS * high.abs().max(low.abs())
}

/// The windows of a channel of which nearly all samples are usable.
fn windows(recording: &Recording, channel: Channel, hz: f64) -> Option<Vec<Window>> {
    const USABLE: f64 = 0.9;
    let values = recording.channel(channel)?;
    let speed = recording.channel(Channel::Speed)?;
    let h = recording.sample_time_s();
    let length = (WINDOW_S / h).round() as usize;
    if (hz + BESIDE_HZ[3]) * h > 0.5 {
        return None;
    }
    let taper: Vec<f64> = (0..length).map(|k| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / length as f64).cos()).collect();
    let total: f64 = taper.iter().sum();
    let window = |from: usize| {
        let range = from..from + length;
        let usable = recording.valid()[range.clone()].iter().filter(|valid| **valid).count();
        if (usable as f64) < USABLE * length as f64 {
            return None;
        }
        let piece = &values[range.clone()];
        // A straight line through the ends, so that a run-up is no edge.
        let (a, b) = (piece[0], (piece[length - 1] - piece[0]) / (length - 1) as f64);
        let phasor = |hz: f64| {
            let (mut turned, step) = (Complex64::cis(-TAU * hz * h * from as f64), Complex64::cis(-TAU * hz * h));
            let mut sum = Complex64::default();
            for (k, (x, weight)) in piece.iter().zip(&taper).enumerate() {
                sum += turned * ((x - a - b * k as f64) * weight);
                turned *= step;
            }
            2.0 * sum / total
        };
        let own = phasor(hz);
        let beside = BESIDE_HZ.map(|d| phasor(hz + d));
        let power = beside.iter().map(|z| z.norm_sqr()).sum::<f64>() / BESIDE_HZ.len() as f64;
        Some(Window {
            middle_s: (from as f64 + 0.5 * (length - 1) as f64) * h,
            phasor: own,
            beside,
            power: power.max(1e-6 * own.norm_sqr()).max(f64::MIN_POSITIVE),
            speed: speed[range].iter().sum::<f64>() / length as f64,
        })
    };
    let from = (0..values.len().saturating_sub(length)).step_by((length / 2).max(1));
    let windows: Vec<Window> = from.filter_map(window).collect();
    (windows.len() >= FEWEST_WINDOWS && length >= 32).then_some(windows)
}

/// The frequency of hum, Hz, and its power in that of its neighbours.
pub fn hum(s: &Signals<'_>, values: &[f64]) -> Option<(f64, f64)> {
    let length = (WINDOW_S / s.interval_s).round() as usize;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::{Purpose, question};
    use crate::model::Kind;
    use crate::rig::Setup;

    const HZ: f64 = 50.03;

    fn humming(recording: &Recording, amplitude: impl Fn(usize) -> f64) -> Recording {
        let mut humming = recording.clone();
        let step = TAU * HZ * recording.sample_time_s();
        let i = recording.channel(Channel::Current).unwrap();
        let with = i.iter().enumerate().map(|(n, i)| i + amplitude(n) * (step * n as f64 + 0.7).cos()).collect();
        humming.set_channel(Channel::Current, with).unwrap();
        humming
    }

    fn sound() -> Recording {
        Setup::new(Kind::PmDc).profile("dc-steps").unwrap().seconds(5.0).run().unwrap().recording
    }

    #[test]
    fn hum_of_a_chain_is_taken_out_and_said_to_be() {
        let (sound, amplitude) = (sound(), 0.2);
        let mut recordings = [humming(&sound, |_| amplitude)];
        let found = question(&mut recordings, Kind::PmDc, Purpose::Fit);
        let hum = found.iter().find(|f| f.code == Code::Hum && f.channel == Some(Channel::Current)).unwrap();
        assert_eq!(hum.handled, Handled::Modelled, "{}", hum.text);
        let [left, before] = [&recordings[0], &sound].map(|r| r.channel(Channel::Current).unwrap());
        let rms = (left.iter().zip(before).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / left.len() as f64).sqrt();
        // The steps leave some milliamperes at 50 Hz in the quietest windows: a thirtieth of the hum.
        assert!(rms < amplitude / 30.0, "{rms} A");
        // A detector is told what there is.
        let mut recordings = [humming(&sound, |_| amplitude)];
        question(&mut recordings, Kind::PmDc, Purpose::Detection);
        assert_eq!(recordings[0].channel(Channel::Current), humming(&sound, |_| amplitude).channel(Channel::Current));
    }

    #[test]
    fn a_line_that_follows_the_rotor_or_the_supply_stays() {
        let sound = sound();
        assert!(Line::strongest(&sound, Channel::Current).is_none(), "there is none");
        let w = sound.channel(Channel::Speed).unwrap().to_vec();
        let fastest = w.iter().fold(0.0f64, |m, w| m.max(w.abs()));
        let changing = humming(&sound, |n| 0.4 * w[n].abs() / fastest);
        assert!(Line::strongest(&changing, Channel::Current).is_none(), "its amplitude goes with the speed");
        // At a single speed it may be the rotor's.
        let mut steady = humming(&sound, |_| 0.2);
        assert!(Line::strongest(&steady, Channel::Current).is_some());
        steady.set_channel(Channel::Speed, vec![100.0; sound.len()]).unwrap();
        assert!(Line::strongest(&steady, Channel::Current).is_none(), "a single speed");
        let mut supplied = humming(&sound, |_| 0.2);
        let step = TAU * HZ * sound.sample_time_s();
        let u = sound.channel(Channel::Voltage).unwrap();
        let with = u.iter().enumerate().map(|(n, u)| u + 0.5 * (step * n as f64).cos()).collect();
        supplied.set_channel(Channel::Voltage, with).unwrap();
        assert!(Line::strongest(&supplied, Channel::Current).is_none(), "the supply's");
    }
}
