//! Samples that were taken beside the rows of a raster, brought to the rows.
//!
//! Between two samples stands the straight line, or the cubic through the two on either side, whichever of the two meets
//! left-out samples better (in the median): the cubic of slow samples, the line where noise is all that differs. Across
//! an edge nothing is interpolated: the nearer sample stands, as it would have been taken.

use std::ops::Range;

use super::placement::Placement;
use crate::noise::median;

/// A jump between two samples that is no edge is at most so many times the jumps around it, or
/// this share of the channel's range.
const EDGE: (f64, f64) = (5.0, 0.05);
/// Samples that are left out in turn at most.
const TRIED: usize = 20_000;

/// What stands between samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Course {
    Line,
    Cubic,
}

/// A channel on the rows, and the usual error of a sample that is left out, as a share of the channel's RMS: an upper
/// bound of the error of interpolation, since rows lie nearer to samples than these to each other.
pub fn at_rows(placement: &Placement, values: &[f64], as_stamped: bool) -> (Vec<f64>, f64) {
    let Some(beside) = &placement.beside else { return (values.to_vec(), 0.0) };
    let instants = if as_stamped { &beside.stamps } else { &beside.smooth };
    let errors = [Course::Line, Course::Cubic].map(|course| left_out(instants, values, &beside.stretches, course));
    let (course, error) = if errors[1] < errors[0] { (Course::Cubic, errors[1]) } else { (Course::Line, errors[0]) };
    let finite = || values.iter().filter(|x| x.is_finite());
    let rms = (finite().map(|x| x * x).sum::<f64>() / finite().count().max(1) as f64).sqrt();
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
    let range = high - low;
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
        *value = between(instants, values, stretch, after, row as f64, course, range);
    }
    (on_rows, if rms > 0.0 { error / rms } else { 0.0 })
}

/// The value at an instant before the sample `after`, and not before the one before it.
fn between(
    t: &[f64],
    x: &[f64],
    stretch: &Range<usize>,
    after: usize,
    at: f64,
    course: Course,
    range: f64,
) -> f64 {
    if after == stretch.start || after == stretch.end {
        return x[after.min(stretch.end - 1)];
    }
    let (a, b) = (after - 1, after);
    let nearest = if at - t[a] < t[b] - at { x[a] } else { x[b] };
    let jump = |n: usize| if stretch.contains(&n) && stretch.contains(&(n + 1)) { (x[n + 1] - x[n]).abs() } else { 0.0 };
    let around = [a.wrapping_sub(2), a.wrapping_sub(1), b, b + 1].map(jump);
    let is_edge = |size: f64, others: f64| size > EDGE.0 * others && size > EDGE.1 * range;
    if is_edge(jump(a), around.iter().fold(0.0, |m, j| m.max(*j))) {
        return nearest;
    }
    let line = x[a] + (at - t[a]) / (t[b] - t[a]) * (x[b] - x[a]);
    let has_four = a > stretch.start && b + 1 < stretch.end;
    // A cubic through an edge swings on both sides of it.
    let beside_edge = || around[1].max(around[2]) > EDGE.0 * jump(a) && around[1].max(around[2]) > EDGE.1 * range;
    if course == Course::Line || !has_four || beside_edge() {
        return line;
    }
    let cubic = lagrange([a - 1, a, b, b + 1].map(|n| (t[n], x[n])), at);
    if cubic.is_finite() { cubic } else { line }
}

fn lagrange(points: [(f64, f64); 4], at: f64) -> f64 {
    let weight = |k: usize| -> f64 {
        let others = (0..4).filter(|j| *j != k);
        others.map(|j| (at - points[j].0) / (points[k].0 - points[j].0)).product()
    };
    (0..4).map(|k| weight(k) * points[k].1).sum()
}

/// Median error of samples that are left out, as a standard deviation in its unit.
fn left_out(t: &[f64], x: &[f64], stretches: &[Range<usize>], course: Course) -> f64 {
    let every = (x.len() / TRIED).max(1);
    let error = |n: usize| {
        let told = match course {
            Course::Line => x[n - 1] + (t[n] - t[n - 1]) / (t[n + 1] - t[n - 1]) * (x[n + 1] - x[n - 1]),
            Course::Cubic => lagrange([n - 2, n - 1, n + 1, n + 2].map(|k| (t[k], x[k])), t[n]),
        };
        (told - x[n]).abs()
    };
    let inside = stretches.iter().flat_map(|s| (s.start + 2..s.end.saturating_sub(2)).step_by(every));
    let errors: Vec<f64> = inside.map(error).filter(|e| e.is_finite()).collect();
    /// Median of the magnitude of a Gaussian variable, in standard deviations.
    const MEDIAN: f64 = 0.674_490;
    median(errors) / MEDIAN
}
