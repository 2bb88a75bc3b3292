//! What a channel's steps tell: coarse quantisation, counts of an encoder, values held for several rows, bits that
//! rest.

use super::criteria::CHANCE;
use super::signals::{self, Signals, extremes, short};
use crate::counts::held_for;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};
use crate::recording::{Channel, clipping};

/// Samples of a stretch.
const STRETCH: usize = 8;
/// Range about a straight line that steps alone make, in steps: counts of a steady rate take two values. Gaussian noise
/// of half a step, rounded, has a deviation of √(1/4 + 1/12) = 0.58 and a range of 1.6 in eight samples.
const STEPS_ALONE: f64 = 1.5;
/// Share of the stretches with a turn in which that is all, from which on the steps, not noise, make the turns.
const NO_NOISE: f64 = 0.7;
/// More steps in the range than these are fine enough for any fit: noise of quantisation of 6e-4 of the range.
const FINE: f64 = 500.0;
/// The same of a speed, whose counts a fit of friction at slow speeds still sees.
const FINE_SPEED: f64 = 1500.0;

/// What to look for.
pub fn look(s: &Signals<'_>, found: &mut Vec<DataFinding>) {
    for (channel, all) in s.channels() {
        let values: Vec<f64> = s.measured(channel).into_iter().map(|n| all[n]).collect();
        let (low, high) = extremes(&values);
        if values.len() < 4 * STRETCH || high <= low || channel == Channel::Angle {
            continue;
        }
        // A program of steps holds its few exact values, and is no converter's work.
        if channel == Channel::Voltage && levels(&values) < 64 {
            continue;
        }
        let held = held_for(&values);
        if let Some(rows) = held {
            found.push(
                s.finding(
                    Code::HeldValues,
                    Severity::Info,
                    format!(
                        "{} is renewed every {rows} samples only ({} ms) and held in between",
                        signals::name(channel),
                        short(1e3 * rows as f64 * s.interval_s)
                    ),
                )
                .on(channel)
                .value(rows as f64 * s.interval_s, "s")
                .handled(Handled::None),
            );
        }
        let renewed: Vec<f64> = values.iter().copied().step_by(held.unwrap_or(1)).collect();
        if let Some(finding) = coarse(s, channel, &renewed, high - low, held.is_some()) {
            found.push(finding);
        }
        if let Some(finding) = stuck(s, channel, &values, low, high) {
            // What it makes of a carry is no outlier.
            found.retain(|f| f.recording != s.path() || f.channel != Some(channel) || f.code != Code::Outliers);
            found.push(finding);
        }
    }
}

/// Steps that noise does not resolve.
fn coarse(s: &Signals<'_>, channel: Channel, values: &[f64], range: f64, held: bool) -> Option<DataFinding> {
    let step = clipping::quantum(values, 1e-6 * range);
    let steps = range / step;
    let fine = if channel == Channel::Speed { FINE_SPEED } else { FINE };
    if steps > fine || values.len() < 4 * STRETCH {
        return None;
    }
    let (mut turning, mut narrow, mut resting) = (0_usize, 0_usize, 0_usize);
    for w in values.chunks_exact(STRETCH) {
        let turns = w.windows(3).filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0).count();
        let (low, high) = extremes(w);
        turning += usize::from(turns > 0);
        narrow += usize::from(turns > 0 && about_line(w) < STEPS_ALONE * step);
        resting += usize::from(low == high);
    }
    let stretches = values.len() / STRETCH;
    let by_steps = narrow as f64 >= NO_NOISE * turning.max(1) as f64 || turning * 20 < stretches;
    // A count is renewed once a window, and is a whole number of steps.
    let by_steps = by_steps || (held && channel == Channel::Speed && values.iter().all(|x| is_whole(x / step)));
    if !by_steps || resting == stretches {
        return None;
    }
    let unit = s.unit(channel);
    let (code, text) = if channel == Channel::Speed && s.is_rotary() {
        (
            Code::EncoderCounts,
            format!(
                "the speed goes in steps of {} rpm ({} rad/s): counts of an encoder in a window",
                short(step * 60.0 / std::f64::consts::TAU),
                short(step)
            ),
        )
    } else {
        (
            Code::CoarseSteps,
            format!("{} goes in steps of {} {unit}, {} in all", signals::name(channel), short(step), short(steps)),
        )
    };
    Some(s.finding(code, Severity::Info, text).on(channel).value(step, unit))
}

/// To what the digits of a text file round.
fn is_whole(x: f64) -> bool {
    (x - x.round()).abs() < 0.02
}

/// Range about the straight line of least squares, or about none where that is less.
fn about_line(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let (middle, mean) = ((n - 1.0) / 2.0, values.iter().sum::<f64>() / n);
    let about = || values.iter().enumerate().map(|(k, x)| (k as f64 - middle, x - mean));
    let slope = about().map(|(k, x)| k * x).sum::<f64>() / about().map(|(k, _)| k * k).sum::<f64>();
    let rest: Vec<f64> = about().map(|(k, x)| x - slope * k).collect();
    let range = |(low, high): (f64, f64)| high - low;
    range(extremes(&rest)).min(range(extremes(values)))
}

fn levels(values: &[f64]) -> usize {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    sorted.len()
}

/// A bit of the converter that rests: with codes c = (x − x0)/step, the half of all residues of c modulo 2^(k+1) in
/// which bit k is set (or not) never occurs, though the channel has gone through many such periods.
fn stuck(s: &Signals<'_>, channel: Channel, values: &[f64], low: f64, high: f64) -> Option<DataFinding> {
    let step = clipping::quantum(values, 1e-6 * (high - low));
    let codes = ((high - low) / step).round();
    if !(32.0..=1e6).contains(&codes) {
        return None;
    }
    let mut seen = vec![false; codes as usize + 1];
    for x in values {
        seen[((x - low) / step).round() as usize] = true;
    }
    for bit in 1..12_u32 {
        let (half, period) = (1_usize << bit, 2_usize << bit);
        if seen.len() < 3 * period {
            break;
        }
        let mut residues = vec![false; period];
        seen.iter().enumerate().filter(|(_, seen)| **seen).for_each(|(code, _)| residues[code % period] = true);
        let empty = (0..period).any(|from| (0..half).all(|k| !residues[(from + k) % period]));
        // Gaps between codes that were seen: by chance one of half a period's length is as rare as those of a quarter,
        // to the power of two.
        let mut gaps: Vec<usize> = Vec::new();
        let mut last = 0;
        for (code, _) in seen.iter().enumerate().filter(|(_, seen)| **seen) {
            gaps.push(code - last);
            last = code;
        }
        let wide = gaps.iter().filter(|gap| **gap > half).count();
        let middling = gaps.iter().filter(|gap| (half / 4 + 1..=half).contains(*gap)).count();
        // Half of the codes are missing, no more: a program of voltages has few.
        let dense = seen.iter().filter(|seen| **seen).count() * 4 >= seen.len();
        let stuck = dense && wide >= 3 && middling * 4 <= wide;
        let visited = seen.chunks(period).filter(|chunk| chunk.iter().any(|seen| *seen)).count();
        if empty && (stuck || 0.5_f64.powi(visited as i32) * (period as f64) < CHANCE) {
            let text = format!(
                "bit {bit} of the converter of {} never changes: steps of {} {} are missing throughout",
                signals::name(channel),
                short(half as f64 * step),
                s.unit(channel)
            );
            return Some(s.finding(Code::StuckBits, Severity::Warning, text).on(channel).value(f64::from(bit), ""));
        }
    }
    None
}
