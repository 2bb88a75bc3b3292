//! What a channel shows while nothing happens: an offset, and one that wanders.

use super::balance::{self, Window};
use super::criteria::T_SIGN;
use super::signals::{self, Signals, short};
use crate::recording::Channel;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};

/// Window of rest, s: five periods of 50 Hz.
const WINDOW_S: f64 = 0.1;
/// Share of a channel's largest magnitude within which it rests.
const RESTS: f64 = 0.01;
/// The same for the change of a channel that rests elsewhere.
const STILL: f64 = 2e-3;
/// Share of the largest speed from which on a shaft that does not slow down coasts and has no offset.
const COASTS: f64 = 0.1;
/// An offset below this share of the largest magnitude matters to nothing.
const MATTERS: f64 = 0.005;
/// Fewest windows of rest.
const FEWEST: usize = 2;

/// What to look for.
pub fn look(s: &Signals<'_>, found: &mut Vec<DataFinding>) {
    let all = balance::windows_of_all(s, WINDOW_S);
    let length = s.window(WINDOW_S);
    let largest = |of: fn(&Window) -> f64| all.iter().map(|x| of(x).abs()).fold(0.0, f64::max);
    let peaks = [largest(|x| x.u), largest(|x| x.i), largest(|x| x.w)];
    let quiet = |x: &Window, channel: Channel| {
        let others: [(bool, f64, f64); 2] = match channel {
            Channel::Current => [(s.voltage.is_some(), x.u, peaks[0]), (s.speed.is_some(), x.w, peaks[2])],
            _ => [(s.voltage.is_some(), x.u, peaks[0]), (s.current.is_some(), x.i, peaks[1])],
        };
        others.iter().all(|(there, value, peak)| *there && value.abs() <= RESTS * peak)
    };
    for channel in [Channel::Current, Channel::Speed] {
        let Some(values) = s.recording().channel(channel) else { continue };
        let peak = signals::largest(values);
        let of = |x: &Window| if channel == Channel::Current { x.i } else { x.w };
        let change = |x: &Window| if channel == Channel::Current { x.di } else { x.dw };
        let rests: Vec<&Window> = all
            .iter()
            .filter(|x| match channel {
                Channel::Current => quiet(x, channel) || (x.at..x.at + length).all(|n| s.is_open(n)),
                // A shaft that coasts is at no rest.
                _ => quiet(x, channel) && of(x).abs() < COASTS * peak && change(x).abs() * WINDOW_S < STILL * peak,
            })
            .collect();
        if rests.len() < FEWEST {
            continue;
        }
        let n = rests.len() as f64;
        let mean = rests.iter().map(|x| of(x)).sum::<f64>() / n;
        let scatter = (rests.iter().map(|x| (of(x) - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt();
        let (first, last) = (rests[0], rests[rests.len() - 1]);
        let wanders = of(last) - of(first);
        // What windows beside one another differ by is noise.
        let steps: Vec<f64> = rests.windows(2).map(|w| (of(w[1]) - of(w[0])).abs()).collect();
        let noise = crate::noise::median(steps);
        let (name, unit) = (signals::name(channel), s.unit(channel));
        let (code, value, text) = if wanders.abs() > (T_SIGN * noise).max(MATTERS * peak) {
            let (from, to) = (short(of(first)), short(of(last)));
            (Code::Drift, wanders, format!("{name} at rest goes from {from} to {to} {unit}: it drifts"))
        } else if mean.abs() > (T_SIGN * scatter / n.sqrt()).max(MATTERS * peak) {
            (Code::OffsetAtRest, mean, format!("{name} at rest is {} {unit}", short(mean)))
        } else {
            continue;
        };
        found.push(
            s.finding(code, Severity::Info, text)
                .on(channel)
                .between(s.time_s(first.at), s.time_s(last.at))
                .value(value, unit)
                .handled(Handled::Modelled),
        );
    }
}
