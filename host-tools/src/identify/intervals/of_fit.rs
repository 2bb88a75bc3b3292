//! What the intervals of a fit need: which rows make a block, what a limit does, and the way from the optimiser's
//! coordinates to the parameters.

use std::collections::BTreeMap;

use super::{SYSTEMATIC, block_length_s, slowest_correlation_time_s};
use crate::identify::minimise::Fit;
use crate::identify::output_error::{OutputError, Rows};
use crate::identify::space::{Entry, Freedom, Key};

/// Distance from a limit, in the optimiser's coordinates, at which a shape is at it.
const AT_LIMIT: f64 = 1e-4;

/// Half a 95 % interval of the normal distribution, in standard deviations.
const NORMAL_95: f64 = 1.96;

/// The block of each row, for the covariance of a fit by output error: several times as long as the residuals'
/// correlation.
pub fn blocks_of_rows(problem: &OutputError<'_>, fit: &Fit) -> Vec<usize> {
    let rows = problem.rows();
    let interval = rows.iter().map(Rows::row_interval_s).fold(0.0f64, f64::max);
    let total: f64 = rows.iter().map(Rows::covered_s).sum();
    let correlation = slowest_correlation_s(rows, fit.residuals.as_slice(), interval);
    let block = block_length_s(correlation, total, fit.jacobian.ncols());
    numbered(rows.iter().enumerate().flat_map(|(r, rows)| rows.blocks(block).into_iter().map(move |b| (r, b))))
}

fn slowest_correlation_s(rows: &[Rows<'_>], residuals: &[f64], interval_s: f64) -> f64 {
    let flags: Vec<bool> = rows.iter().flat_map(Rows::speed_rows).collect();
    let mut slowest = interval_s;
    let mut from = 0;
    while from < flags.len() {
        let to = (from..flags.len()).find(|k| flags[*k] != flags[from]).unwrap_or(flags.len());
        slowest = slowest.max(slowest_correlation_time_s(&residuals[from..to], interval_s));
        from = to;
    }
    slowest
}

/// Numbers arbitrary keys in the order in which they first appear.
pub fn numbered<K: Ord>(keys: impl Iterator<Item = K>) -> Vec<usize> {
    let mut seen = BTreeMap::new();
    keys.map(|key| {
        let next = seen.len();
        *seen.entry(key).or_insert(next)
    })
    .collect()
}

/// Shapes of effects that have run into their physical limits no longer answer to the data: they stay there, without an
/// interval.
pub fn pin_shapes_at_limits(refined: &mut Fit) {
    let theta = refined.space.coordinates();
    let at_limit = |(entry, theta): (&Entry, &f64)| {
        let (low, high) = entry.limits();
        let is_there = *theta - low < AT_LIMIT || high - *theta < AT_LIMIT;
        (entry.is_shape() && is_there).then_some(entry.key)
    };
    let at_limit: Vec<Key> = refined.space.free().zip(&theta).filter_map(at_limit).collect();
    at_limit.into_iter().for_each(|key| refined.hold(key));
}

/// 95 % interval of a free parameter from half that of its coordinate.
pub fn interval(entry: &Entry, theta: f64, half: f64) -> [f64; 2] {
    if entry.positive && entry.freedom == Freedom::Free(None) {
        let half = half_width(half, 1.0);
        [entry.value * (-half).exp(), entry.value * half.exp()]
    } else {
        let half = half_width(half * entry.slope(theta).abs(), entry.value);
        [entry.value - half, entry.value + half]
    }
}

/// Half a 95 % interval with what the computation itself adds.
pub fn half_width(half: f64, value: f64) -> f64 {
    half.hypot(NORMAL_95 * SYSTEMATIC * value)
}
