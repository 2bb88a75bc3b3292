//! Counting rows along stamps that scatter.
//!
//! A second-order tracking loop predicts when the next sample is due. A stamp that is late by more than half an
//! interval tells of missing rows, if those that follow it are late as well.

use super::raster::Raster;
use crate::noise::median;
use crate::recording::table::MAX_VALUES;

/// Samples over which the loop settles: its phase then scatters by √(1.25/2/16) = 0.2 of the stamps' scatter.
const SETTLING: f64 = 16.0;
/// Samples that have to be late with the first one.
const FOLLOWING: usize = 16;
/// A stamp that is later than this, in intervals, is so by no scatter.
const SURELY: f64 = 1.25;
/// Steps over which the interval is told: their ends scatter less than the span is long.
const SPAN: usize = 32;
/// Fewest samples.
const FEWEST: usize = 8;
/// Gaps after which the rest is not looked at.
const MOST: usize = 10_000;

/// The raster under stamps, s, if they are in order.
pub fn raster(t: &[f64]) -> Option<Raster> {
    if t.len() < FEWEST || t.windows(2).any(|w| w[1] <= w[0]) {
        return None;
    }
    let span = SPAN.min(t.len() / FEWEST).max(1);
    let rough = median(t.windows(span + 1).map(|w| (w[span] - w[0]) / span as f64).collect());
    // Samples that follow one without a gap that no scatter makes.
    let run = |from: usize, interval: f64| {
        let all = &t[from..(from + FOLLOWING).min(t.len())];
        let gap = all.windows(2).position(|w| w[1] - w[0] > (1.0 + SURELY) * interval);
        &all[..gap.map_or(all.len(), |k| k + 1)]
    };
    let begin = |from: usize, interval: f64| {
        let first = run(from, interval);
        median(first.iter().enumerate().map(|(k, t)| t - k as f64 * interval).collect())
    };
    let mut interval = rough;
    let mut due = begin(0, interval) + interval;
    let (mut segments, mut first_rows) = (Vec::new(), vec![0]);
    let (mut from, mut row) = (0, 0usize);
    for n in 1..t.len() {
        let late = (t[n] - due) / interval;
        let mut missing = late.round().max(0.0);
        if missing > 0.0 && late < SURELY {
            let following = run(n, interval);
            let all = median(following.iter().enumerate().map(|(k, t)| (t - due) / interval - k as f64).collect());
            missing = if all > 0.5 { all.round().max(1.0) } else { 0.0 };
        }
        // No gap is longer than any recording.
        if missing > MAX_VALUES as f64 {
            return None;
        }
        row += 1 + missing as usize;
        if missing > 0.0 {
            segments.push(from..n);
            if segments.len() > MOST {
                return None;
            }
            first_rows.push(row);
            from = n;
            due = begin(n, interval) + interval;
            continue;
        }
        let late = late.clamp(-0.5, 0.5);
        let gain = 1.0 / SETTLING;
        due += interval * (1.0 + gain * late);
        interval += rough * 0.25 * gain * gain * late;
        // A loop that has lost its raster has none.
        if !(0.5..2.0).contains(&(interval / rough)) {
            return None;
        }
    }
    segments.push(from..t.len());
    Some(fitted(t, segments, first_rows))
}

/// The interval by least squares over all segments, each with a phase of its own; the rows of their first samples by
/// these phases.
fn fitted(t: &[f64], segments: Vec<std::ops::Range<usize>>, counted: Vec<usize>) -> Raster {
    let (mut moment, mut spread) = (0.0, 0.0);
    let mut means = Vec::new();
    for segment in &segments {
        let n = segment.len() as f64;
        let middle = 0.5 * (n - 1.0);
        let mean = segment.clone().map(|k| t[k] - t[0]).sum::<f64>() / n;
        for (k, t_n) in t[segment.clone()].iter().enumerate() {
            moment += (k as f64 - middle) * (t_n - t[0] - mean);
        }
        spread += n * (n * n - 1.0) / 12.0;
        means.push(mean);
    }
    let exact = moment / spread;
    let span = *counted.last().unwrap_or(&0) + segments.last().map_or(0, std::iter::ExactSizeIterator::len);
    let interval_s = plain(exact, 0.02 * exact / span as f64);
    let begins = |k: usize| means[k] - 0.5 * (segments[k].len() - 1) as f64 * interval_s;
    let start = begins(0);
    let mut first_rows: Vec<usize> = vec![0];
    for k in 1..segments.len() {
        let row = ((begins(k) - start) / interval_s).round().max(0.0) as usize;
        let after = first_rows[k - 1] + segments[k - 1].len() + 1;
        first_rows.push(row.max(after));
    }
    // Stamps without scatter begin at the first of them.
    let start_s = if (start / interval_s).abs() < 1e-3 { t[0] } else { t[0] + start };
    Raster { start_s, interval_s, segments, first_rows }
}

/// The shortest decimal within a tolerance: nobody sets a timer to 1.00000003e-4 s.
pub fn plain(exact: f64, tolerance: f64) -> f64 {
    (0..12)
        .filter_map(|digits| format!("{exact:.digits$e}").parse::<f64>().ok())
        .find(|x| (x - exact).abs() <= tolerance)
        .unwrap_or(exact)
}
