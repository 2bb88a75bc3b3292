//! Samples that were taken beside the rows of a raster, brought to the rows.
//!
//! Between two samples stands the cubic through the two on either side where it leaves the straight line by more than
//! noise makes it, and else the line, which passes less noise on. Across an edge nothing is interpolated: the nearer
//! sample stands, as it would have been taken.

use std::ops::Range;

use super::placement::Placement;
use crate::noise::{self, median};

/// A jump between two samples that is no edge is at most so many times the jumps around it, or
/// this share of the channel's range.
const EDGE: (f64, f64) = (5.0, 0.05);
/// Median of the magnitude of a Gaussian variable, in standard deviations.
const MEDIAN: f64 = 0.674_490;
/// Samples that are left out in turn at most.
const TRIED: usize = 20_000;

/// Distance of cubic and line, in standard deviations of the noise, from which the cubic is followed. In the middle
/// between even samples the distance has the weights ∓1/16, ±1/16, ±1/16, ∓1/16, an eighth of the noise; this is four
/// times that.
const CURVED: f64 = 0.5;

/// What the values of a channel are.
struct Channel<'a> {
    /// Instants, in rows.
    t: &'a [f64],
    x: &'a [f64],
    /// Greatest less least value.
    range: f64,
    /// Standard deviation of the noise.
    noise: f64,
}

/// A channel on the rows, and the usual error of a sample that is left out, as a share of the channel's RMS: an upper
/// bound of the error of interpolation, since rows lie nearer to samples than these to each other.
pub fn at_rows(placement: &Placement, values: &[f64], as_stamped: bool) -> (Vec<f64>, f64) {
    let Some(beside) = &placement.beside else { return (values.to_vec(), 0.0) };
    let instants = if as_stamped { &beside.stamps } else { &beside.smooth };
    let finite = || values.iter().filter(|x| x.is_finite());
    let rms = (finite().map(|x| x * x).sum::<f64>() / finite().count().max(1) as f64).sqrt();
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
    let channel = Channel { t: instants, x: values, range: high - low, noise: noise::of_differences(values) };
    let error = channel.left_out(&beside.stretches);
    let mut on_rows = vec![f64::NAN; placement.rows];
    let mut stretches = beside.stretches.iter();
    let Some(mut stretch) = stretches.next() else { return (on_rows, 0.0) };
    let mut after = 0;
    for (row, (value, sample)) in on_rows.iter_mut().zip(&beside.samples).enumerate() {
        let Some(sample) = sample else { continue };
        while *sample as usize >= stretch.end
            && let Some(next) = stretches.next()
        {
            (stretch, after) = (next, next.start);
        }
        while after < stretch.end && instants[after] < row as f64 {
            after += 1;
        }
        *value = channel.at(stretch, after, row as f64);
    }
    (on_rows, if rms > 0.0 { error / rms } else { 0.0 })
}

impl Channel<'_> {
    /// The value at an instant, in rows, before the sample `after` and not before the one before it.
    fn at(&self, stretch: &Range<usize>, after: usize, at: f64) -> f64 {
        let Self { t, x, .. } = self;
        if after == stretch.start || after == stretch.end {
            return x[after.min(stretch.end - 1)];
        }
        let (a, b) = (after - 1, after);
        let inside = |n: usize| stretch.contains(&n) && stretch.contains(&(n + 1));
        let jump = |n: usize| if inside(n) { (x[n + 1] - x[n]).abs() } else { 0.0 };
        let [before, ahead] = [a.wrapping_sub(1), b].map(jump);
        let others = [before, ahead, jump(a.wrapping_sub(2)), jump(b + 1)].into_iter().fold(0.0, f64::max);
        if self.is_edge(jump(a), others) {
            return if at - t[a] < t[b] - at { x[a] } else { x[b] };
        }
        let line = x[a] + (at - t[a]) / (t[b] - t[a]) * (x[b] - x[a]);
        // A cubic through an edge swings on both sides of it.
        if a == stretch.start || b + 1 >= stretch.end || self.is_edge(before.max(ahead), jump(a)) {
            return line;
        }
        let cubic = lagrange([a - 1, a, b, b + 1].map(|n| (t[n], x[n])), at);
        if (cubic - line).abs() > CURVED * self.noise { cubic } else { line }
    }

    fn is_edge(&self, jump: f64, others: f64) -> bool {
        jump > EDGE.0 * others && jump > EDGE.1 * self.range
    }

    /// Median error of samples that are left out in turn, as a standard deviation in its unit: of the line or of the
    /// cubic, whichever meets them better.
    fn left_out(&self, stretches: &[Range<usize>]) -> f64 {
        let Self { t, x, .. } = self;
        let every = (x.len() / TRIED).max(1);
        let line = |n: usize| x[n - 1] + (t[n] - t[n - 1]) / (t[n + 1] - t[n - 1]) * (x[n + 1] - x[n - 1]);
        let cubic = |n: usize| lagrange([n - 2, n - 1, n + 1, n + 2].map(|k| (t[k], x[k])), t[n]);
        let inside = || stretches.iter().flat_map(|s| (s.start + 2..s.end.saturating_sub(2)).step_by(every));
        let usual = |told: &dyn Fn(usize) -> f64| {
            median(inside().map(|n| (told(n) - x[n]).abs()).filter(|e| e.is_finite()).collect())
        };
        usual(&line).min(usual(&cubic)) / MEDIAN
    }
}

fn lagrange(points: [(f64, f64); 4], at: f64) -> f64 {
    let weight = |k: usize| -> f64 {
        let others = (0..4).filter(|j| *j != k);
        others.map(|j| (at - points[j].0) / (points[k].0 - points[j].0)).product()
    };
    (0..4).map(|k| weight(k) * points[k].1).sum()
}
