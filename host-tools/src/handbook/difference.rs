//! What an effect changes: the stretches of a run in which current and speed differ most, drawn side by side.

use std::ops::Range;

use greyrig::effects::Description;

use super::words::capitalised;
use crate::recording::{Channel, Recording};
use crate::report::panels::{Panel, Scale, panels};

/// Points of a curve in the figure: more than one can see at its width.
const POINTS: usize = 180;

/// Lengths of a stretch that is drawn, s: two periods of the mains, a step, or all of it.
const STRETCHES_S: [f64; 3] = [0.04, 0.4, f64::INFINITY];

/// The share of a stretch by which two curves have to lie apart to be seen as two: a line's width of its height.
const SEEN: f64 = 0.025;

/// How often a curve may change its sign in a panel and still be a curve: six periods.
const MOST_SWINGS: usize = 12;

/// A signal, and how far an effect moves it.
#[derive(Debug, Clone, PartialEq)]
pub struct Moved {
    /// What it is called.
    pub name: &'static str,
    /// RMS of the difference over RMS without the effect.
    pub relative: f64,
    panel: Panel,
}

/// Two runs of the same motor, without an effect and with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// What makes the run with it.
    pub command: String,
    /// Current and speed; where neither moves at all, the voltage, whose channel it is then, and the current.
    pub moved: Vec<Moved>,
}

/// Below this share a signal has not moved: what the converter's steps make of it.
const RESTS: f64 = 5e-5;

/// A channel, its name, and its name with the unit.
const SIGNALS: [(Channel, &str, &str); 3] = [
    (Channel::Voltage, "voltage", "voltage, V"),
    (Channel::Current, "current", "current, A"),
    (Channel::Speed, "speed", "speed, rad/s"),
];

impl Difference {
    /// Of two runs of equal length.
    pub fn between(without: &Recording, with: &Recording, command: String) -> Self {
        let moved = |(channel, name, label): (Channel, &'static str, &str)| {
            let (a, b) = (without.channel(channel)?, with.channel(channel)?);
            Some(Moved { name, relative: relative(a, b), panel: panel(name, label, a, b, without.sample_time_s()) })
        };
        let [voltage, current, speed] = SIGNALS.map(moved);
        let rests = |it: &Option<Moved>| it.as_ref().is_none_or(|it| it.relative < RESTS);
        let shown = if rests(&current) && rests(&speed) { [voltage, current] } else { [current, speed] };
        Self { command, moved: shown.into_iter().flatten().collect() }
    }

    /// The figure, as the text of an SVG file.
    pub fn figure(&self, d: &Description) -> String {
        let shown: Vec<Panel> = self.moved.iter().map(|it| it.panel.clone()).collect();
        let with = format!("with {}", d.id);
        let legend = [with.as_str(), "the same motor without it", "with less without"];
        // Curves that are too close to be told apart are drawn as their difference, the third.
        let has_difference = shown.iter().any(|panel| panel.curves.len() > 2);
        let description = format!("A motor on the virtual rig without and with {}, where it differs most", d.name);
        panels(&description, if has_difference { &legend } else { &legend[..2] }, &shown, 2)
    }
}

/// RMS(with − without)/RMS(without); a signal that is nothing at all does not move.
fn relative(without: &[f64], with: &[f64]) -> f64 {
    let whole: f64 = without.iter().map(|v| v * v).sum();
    let moved: f64 = without.iter().zip(with).map(|(a, b)| (b - a).powi(2)).sum();
    if whole > 0.0 { (moved / whole).sqrt() } else { 0.0 }
}

/// The panel of a signal: both curves where one can tell them apart, else their difference. A signal that does not
/// move is drawn as it is.
fn panel(name: &str, label: &str, without: &[f64], with: &[f64], interval: f64) -> Panel {
    let (stretch, is_seen) = stretch(without, with, interval);
    let shown = |values: &[f64]| points(&values[stretch.clone()], stretch.start, interval);
    let (title, curves) = if is_seen || relative(without, with) < RESTS {
        (format!("{} where it differs most", capitalised(name)), vec![shown(with), shown(without)])
    } else {
        let difference: Vec<f64> = without.iter().zip(with).map(|(a, b)| b - a).collect();
        (format!("{}: the difference where it is largest", capitalised(name)), vec![vec![], vec![], shown(&difference)])
    };
    let (low, high) = ends(curves.iter().flatten().map(|(_, y)| y));
    let room = 0.05 * (high - low);
    let [first, last] = [stretch.start, stretch.end].map(|sample| sample as f64 * interval);
    Panel {
        title,
        x: Scale::Linear("time, s".to_owned(), first, last),
        y: Scale::Linear(label.to_owned(), low - room, high + room),
        curves,
        marks: false,
    }
}

fn ends<'a>(values: impl Iterator<Item = &'a f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)))
}

/// The longest stretch in which one can tell the curves apart, or else the shortest; and whether one can.
fn stretch(without: &[f64], with: &[f64], interval: f64) -> (Range<usize>, bool) {
    let samples = without.len().min(with.len());
    let mut shortest = 0..samples;
    for length in STRETCHES_S.iter().rev() {
        let length = ((length / interval).round() as usize).clamp(1, samples);
        let first = most_different(&without[..samples], &with[..samples], length);
        shortest = first..first + length;
        let [a, b] = [&without[shortest.clone()], &with[shortest.clone()]];
        let (low, high) = ends(a.iter().chain(b));
        let apart = (a.iter().zip(b).map(|(a, b)| (b - a).powi(2)).sum::<f64>() / length as f64).sqrt();
        // Curves that swing many times within a panel are an area, whatever lies between them.
        let swings = a.windows(2).filter(|pair| (pair[0] < 0.0) != (pair[1] < 0.0)).count();
        if apart > SEEN * (high - low) && swings <= MOST_SWINGS {
            return (shortest, true);
        }
    }
    (shortest, false)
}

/// The begin of the stretch of a length in which the squared difference is largest.
fn most_different(without: &[f64], with: &[f64], length: usize) -> usize {
    let squares: Vec<f64> = without.iter().zip(with).map(|(a, b)| (b - a).powi(2)).collect();
    let mut sum: f64 = squares[..length].iter().sum();
    let (mut most, mut best) = (sum, 0);
    for first in 1..=squares.len() - length {
        sum += squares[first + length - 1] - squares[first - 1];
        // By more than what sums of roundings leave.
        if sum > most * (1.0 + 1e-9) {
            (most, best) = (sum, first);
        }
    }
    best
}

/// A curve, thinned out to the points that can be seen: least and largest of each piece, in their order.
fn points(values: &[f64], first: usize, interval: f64) -> Vec<(f64, f64)> {
    let piece = values.len().div_ceil(POINTS / 2).max(1);
    let at = |k: usize| ((first + k) as f64 * interval, values[k]);
    if values.len() <= POINTS {
        return (0..values.len()).map(at).collect();
    }
    (0..values.len())
        .step_by(piece)
        .flat_map(|begin| {
            let within = begin..(begin + piece).min(values.len());
            let by = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
            let [least, most] = [within.clone().min_by(by), within.max_by(by)].map(|k| k.unwrap_or(begin));
            [at(least.min(most)), at(least.max(most))]
        })
        .collect()
}
