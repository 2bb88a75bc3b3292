//! What the samples themselves show, before any fit: clipped channels, a sensor without a sign, sparks.

use std::collections::BTreeMap;

use crate::experiment::Experiment;
use crate::model::Kind;
use crate::recording::{Channel, Recording, clipping};

/// Share of samples at the limit from which a channel counts as clipped in operation.
const CLIPPED_SHARE: f64 = 1e-4;
/// A speed that never falls below this share of its largest value to the negative side has no sign.
const NO_SIGN: f64 = 0.02;
/// Noise of the current at high |i ω| over that at low from which sparks are seen.
const SPARKS: f64 = 2.0;
/// Half-period samples that are compared, at least.
const FEWEST: usize = 2000;

/// A finding with its reason.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The effect.
    pub id: &'static str,
    /// Why, in words.
    pub text: String,
}

/// Recordings whose clipped samples do not count (reading a file has seen to that already).
pub fn without_clipped(recordings: &[Recording]) -> Vec<Recording> {
    let mut clean = recordings.to_vec();
    for recording in &mut clean {
        for channel in [Channel::Current, Channel::Speed] {
            let Some(values) = recording.channel(channel) else { continue };
            let clipped: Vec<usize> = clipping::find(channel, values).into_iter().flat_map(|c| c.samples).collect();
            for n in clipped {
                recording.valid[n] = false;
            }
        }
    }
    clean
}

/// Looks at the samples of all recordings.
pub fn look(recordings: &[Recording], experiments: &[Experiment], kind: Kind) -> Vec<Finding> {
    let mut found = Vec::new();
    for recording in recordings {
        for channel in [Channel::Current, Channel::Speed] {
            let Some(values) = recording.channel(channel) else { continue };
            let clipped: BTreeMap<&str, (f64, usize)> = clipping::find(channel, values)
                .iter()
                .map(|c| (if c.level > 0.0 { "top" } else { "bottom" }, (c.level, c.samples.len())))
                .collect();
            let count: usize = clipped.values().map(|c| c.1).sum();
            if count as f64 > CLIPPED_SHARE * values.len() as f64
                && found.iter().all(|f: &Finding| f.id != "adc_clipping")
            {
                let level = clipped.values().map(|c| c.0.abs()).fold(0.0, f64::max);
                let unit = if channel == Channel::Current { "A" } else { "rad/s" };
                found.push(Finding {
                    id: "adc_clipping",
                    text: format!(
                        "{count} samples of {} rest at ±{level:.3} {unit} while the quantity goes on: the channel clips",
                        if channel == Channel::Current { "the current" } else { "the speed" }
                    ),
                });
            }
        }
    }
    if kind == Kind::PmDc && experiments.iter().any(sign_lost) {
        found.push(Finding {
            id: "speed_sign_lost",
            text:
                "the voltage changes its sign for longer than the motor takes to follow, and the speed never does: the \
                   sensor gives its magnitude"
                    .to_owned(),
        });
    }
    if let Some(ratio) = sparking(experiments) {
        found.push(Finding {
            id: "brush_arcing",
            text: format!(
                "the current's noise above the signal's band is {ratio:.1} times as large at high |i ω| as at low: sparks at the \
                 commutator (in the variance; the mean hides in the resistance)"
            ),
        });
    }
    found
}

/// Whether the speed is that of a magnet motor that must have turned backwards, without a sign.
fn sign_lost(e: &Experiment) -> bool {
    let Some(speed) = &e.speed else { return false };
    let (low, high) = speed.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let largest = e.input.iter().fold(0.0f64, |m, u| m.max(u.abs()));
    let backwards = e.input.iter().filter(|u| **u < -0.2 * largest).count();
    let forwards = e.input.iter().filter(|u| **u > 0.2 * largest).count();
    let both = backwards.min(forwards) * 10 > e.len();
    both && (low >= -NO_SIGN * high || high <= -NO_SIGN * low)
}

/// Ratio of the current's high-frequency noise at high |i ω| to that at low, where that tells of sparks.
fn sparking(experiments: &[Experiment]) -> Option<f64> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for e in experiments {
        let (Some(i), Some(w)) = (&e.current, &e.speed) else { continue };
        if e.interval_s > 2e-4 {
            continue;
        }
        for n in 2..e.len() - 2 {
            if e.counted[n] && !e.is_open(n) && !e.is_locked(n) {
                // Fourth difference: takes any smooth signal off, and lets noise through.
                let d = i[n - 2] - 4.0 * i[n - 1] + 6.0 * i[n] - 4.0 * i[n + 1] + i[n + 2];
                points.push(((i[n] * w[n]).abs(), d * d));
            }
        }
    }
    if points.len() < 4 * FEWEST {
        return None;
    }
    let mut by_load: Vec<usize> = (0..points.len()).collect();
    by_load.sort_by(|a, b| points[*a].0.total_cmp(&points[*b].0));
    let mean = |part: &[usize]| {
        // Without the largest hundredth: edges of a chopped voltage are no sparks.
        let mut squares: Vec<f64> = part.iter().map(|k| points[*k].1).collect();
        squares.sort_by(f64::total_cmp);
        let kept = &squares[..squares.len() * 99 / 100];
        kept.iter().sum::<f64>() / kept.len() as f64
    };
    let quarter = points.len() / 4;
    let ratio = (mean(&by_load[3 * quarter..]) / mean(&by_load[..quarter])).sqrt();
    (ratio > SPARKS).then_some(ratio)
}
