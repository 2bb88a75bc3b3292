//! Channels that show nothing: a dead sensor, a motor that stands, a circuit without a current, a run without
//! excitation.

use super::balance::{self, Window};
use super::criteria::T_INFORM;
use super::evidence::{Evidence, variance};
use super::regression;
use super::signals::{self, Signals};
use crate::model::Kind;
use crate::recording::Channel;
use crate::recording::finding::{Code, DataFinding, Severity};

/// Window over which hum and ripple of a channel average out, s: five periods of 50 Hz.
const WINDOW_S: f64 = 0.1;

/// Variance of window means of white noise over that of its samples, times the samples of a window: Σφ² of a raised
/// cosine.
const WHITE: f64 = 1.5;

/// How far beyond that a resting channel may go: the ratio scatters by a fifth with 50 windows.
const SLOW: f64 = 3.0;

/// Share of the voltage's variance that back-EMF has to explain before a speed of zero is called dead: saturation,
/// brushes and hysteresis of a held rotor leave a few per cent.
const BACK_EMF: f64 = 0.1;

/// Largest deviation of Gaussian noise in 10^7 samples, in standard deviations, with a half on top for quantisation.
const MOST_OF_NOISE: f64 = 8.0;

/// Relative change of window means below which nothing has changed.
const STEADY: f64 = 1e-3;

/// What to look for.
pub fn look(s: &Signals<'_>, e: &Evidence, kind: Kind, found: &mut Vec<DataFinding>) {
    let windows = balance::windows(s, WINDOW_S);
    // What rests does so with the supply open, too.
    let all = Means { windows: balance::windows_of_all(s, WINDOW_S), length: s.window(WINDOW_S) };
    let usable = |c: Channel| s.usable(c).filter(|x| !x.is_empty());
    let (voltage, current) = (usable(Channel::Voltage), usable(Channel::Current));
    let speed = s.speed.as_ref().map(|w| (0..w.len()).filter(|n| s.is_valid(*n)).map(|n| w[n]).collect::<Vec<_>>());
    let locked = s.always(Signals::is_locked);
    let open = s.always(Signals::is_open);
    let rests = |x: &Option<Vec<f64>>, of: fn(&Window) -> f64| x.as_ref().is_some_and(|x| all.rest(x, of));
    let still = !locked && rests(&speed, |x| x.w);
    let dry = !open && current.as_ref().is_some_and(|i| no_current(s, i, &all));
    let moves = speed.is_some() && !rests(&speed, |x| x.w) && !locked;

    if still {
        // One value that is not zero is no motor at rest.
        let stuck = speed.as_deref().and_then(|w| w.first()).filter(|w| w.abs() > 0.0 && all_alike(&speed));
        let rests = stuck.map_or("the speed rests at 0".to_owned(), |w| {
            format!("the speed is {} rad/s in every sample", signals::short(*w))
        });
        let alone = balance::voltage_at_rest(&e.short);
        let explained = alone.as_ref().is_some_and(|f| f.unexplained < BACK_EMF);
        if current.is_some() && voltage.is_some() && !dry && !explained && alone.is_some() {
            found.push(
                s.finding(
                    Code::ChannelDead,
                    Severity::Stop,
                    format!("{rests} while voltage and current move as those of a running motor: its sensor is dead"),
                )
                .on(s.speed_channel),
            );
        } else {
            found.push(
                s.finding(
                    Code::Standstill,
                    Severity::Stop,
                    match stuck {
                        Some(_) => format!("{rests}: its sensor is dead, or this is a set point and no measurement"),
                        None => format!(
                            "{rests}: the motor never moves, or its sensor is dead; if the rotor was held, say so with the line '# rotor: locked'"
                        ),
                    },
                )
                .on(s.speed_channel),
            );
        }
    }
    if dry {
        let (code, text) = if moves && voltage.as_ref().is_some_and(|u| signals::largest(u) > 0.0) {
            (
                Code::ChannelDead,
                "the current rests while the motor moves under voltage: its sensor is dead, or not connected",
            )
        } else {
            (Code::NoCurrent, "no current flows: the circuit is open, or the current is not measured")
        };
        found.push(s.finding(code, Severity::Stop, text).on(Channel::Current));
    }
    if let Some(u) = &voltage
        && (signals::largest(u) == 0.0 || (is_white(u) && all.rest(u, |x| x.u)))
        && !open
        && (moves || current.as_ref().is_some_and(|i| signals::largest(i) > 0.0))
        && !(kind == Kind::PmDc && braked(&windows))
    {
        let text = "the voltage rests at 0 while the motor runs: it was not measured";
        found.push(s.finding(Code::ChannelDead, Severity::Stop, text).on(Channel::Voltage));
    }
    let idle = |of: fn(&Window) -> f64| {
        let mean = windows.iter().map(of).sum::<f64>() / windows.len().max(1) as f64;
        variance(windows.iter().map(of)) <= STEADY * STEADY * mean * mean
    };
    let steady = windows.len() >= 4 && idle(|x| x.u) && idle(|x| x.i) && idle(|x| x.w);
    if moves
        && steady
        && voltage.as_ref().is_some_and(|u| variance(u.iter().copied()) < 0.01 * signals::largest(u).powi(2))
    {
        let text = "nothing changes: one voltage, one speed. A step, a ramp or a run-up would tell more";
        found.push(s.finding(Code::NoExcitation, Severity::Warning, text));
    }
    const FEWEST: usize = 50;
    if s.len() < FEWEST {
        let text = format!("{} samples are too few to tell anything from", s.len());
        found.push(s.finding(Code::TooShort, Severity::Warning, text).value(s.len() as f64 * s.interval_s, "s"));
    }
}

fn all_alike(samples: &Option<Vec<f64>>) -> bool {
    samples.as_ref().is_some_and(|x| x.windows(2).all(|two| two[0] == two[1]))
}

/// Whether samples are white noise about their mean.
fn is_white(samples: &[f64]) -> bool {
    let n = samples.len() as f64;
    let mean = samples.iter().sum::<f64>() / n;
    let spread = variance(samples.iter().copied());
    let beside: f64 = samples.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum::<f64>() / n;
    let (low, high) = signals::extremes(samples);
    // Of white noise the correlation scatters by 1/√n.
    let white = beside.abs() < 5.0 / n.sqrt() * spread;
    white && (high - mean).max(mean - low) < MOST_OF_NOISE * spread.sqrt()
}

/// Whether the terminals are shorted: the current brakes.
fn braked(windows: &[Window]) -> bool {
    windows.iter().map(|x| x.iw).sum::<f64>() <= 0.0
}

/// Means over windows, whatever the supply does.
struct Means {
    windows: Vec<Window>,
    /// Samples of a window.
    length: usize,
}

impl Means {
    /// Whether a channel holds nothing but noise about zero, or one value.
    fn rest(&self, samples: &[f64], of: fn(&Window) -> f64) -> bool {
        let (low, high) = signals::extremes(samples);
        if low == high {
            return true;
        }
        let spread = variance(samples.iter().copied());
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        // A channel that is never more than its own noise away from zero.
        self.windows.len() >= 4
            && mean * mean < 4.0 * spread
            && variance(self.windows.iter().map(of)) < SLOW * WHITE / self.length as f64 * spread
    }
}

/// Whether a current holds nothing but white noise about one value.
fn no_current(s: &Signals<'_>, samples: &[f64], all: &Means) -> bool {
    let (low, high) = signals::extremes(samples);
    if low == high {
        return true;
    }
    if !(is_white(samples) && all.rest(samples, |x| x.i)) {
        return false;
    }
    let at = |signal: Option<&[f64]>, n: usize| signal.map_or(0.0, |x| x[n]);
    let (u, i, w) = (s.voltage, s.current, s.speed.as_deref());
    let rows = (1..s.len())
        .filter(|n| s.is_valid(*n) && s.is_valid(n - 1))
        .map(|n| ([1.0, at(u, n), at(w, n), at(u, n) - at(u, n - 1), at(w, n) - at(w, n - 1)], at(i, n)));
    regression::fit(rows).is_some_and(|f| f.t[1..].iter().all(|t| t.abs() < T_INFORM))
}
