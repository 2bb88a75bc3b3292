//! What a fit determines: the intervals of its parameters.

use std::collections::BTreeMap;

use super::identifiability;
use super::intervals::of_fit::{blocks_of_rows, interval, pin_shapes_at_limits};
use super::intervals::{Covariance, covariance};
use super::minimise::Fit;
use super::output_error::OutputError;
use super::space::{Entry, Key};

/// A shape whose interval covers more than this share of its physical range is open.
const OPEN: f64 = 0.9;

/// 95 % intervals of the free parameters of a fit by output error. Parameters at a limit have none.
pub fn intervals_of_fit(problem: &OutputError<'_>, fit: &Fit) -> BTreeMap<Key, [f64; 2]> {
    intervals_of(fit, &blocks_of_rows(problem, fit))
}

/// 95 % intervals of the free parameters of a fit, from the block of each of its rows. A shape that the data leave open
/// has none; the others' are those with that shape where it is.
pub fn intervals_of(fit: &Fit, blocks: &[usize]) -> BTreeMap<Key, [f64; 2]> {
    let mut fit = fit.clone();
    let Some(covariance) = covariance_without_open_shapes(&mut fit, blocks) else { return BTreeMap::new() };
    let theta = fit.space.coordinates();
    fit.space
        .free()
        .enumerate()
        .map(|(k, entry)| (entry, interval(entry, theta[k], covariance.half_width_95_of(k))))
        .filter(|(entry, interval)| !(entry.is_shape() && share_of_range(entry, *interval) > OPEN))
        .map(|(entry, interval)| (entry.key, interval))
        .collect()
}

/// Covariance of a fit in which the shapes of effects are held that are at their limits, or of which the data leave a
/// combination with other parameters open. A shape has a prior: it stays where the fit has left it, and nothing else
/// has to move.
pub fn covariance_without_open_shapes(fit: &mut Fit, blocks: &[usize]) -> Option<Covariance> {
    pin_shapes_at_limits(fit);
    loop {
        let covariance = covariance(&fit.jacobian, &fit.residuals, blocks);
        let Some(held) = identifiability::open_shape(fit, covariance.as_ref()) else { return covariance };
        fit.hold(held);
    }
}

/// Share of its physical range that an interval covers; of decades, where the parameter is positive.
fn share_of_range(entry: &Entry, interval: [f64; 2]) -> f64 {
    let (low, high) = entry.range;
    let covered = interval.map(|x| x.clamp(low, high));
    if entry.positive {
        (covered[1] / covered[0]).ln() / (high / low).ln()
    } else {
        (covered[1] - covered[0]) / (high - low)
    }
}
