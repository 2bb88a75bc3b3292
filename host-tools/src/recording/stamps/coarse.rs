//! Stamps that several samples share, because they are printed with too few digits.

use super::placement::Placement;
use super::tracking::plain;
use crate::recording::time_axis::TimeAxis;

/// Fewest samples: with fewer, any stamps fit a line.
const FEWEST: usize = 16;
/// Relative error of a multiple of the resolution.
const MULTIPLE: f64 = 1e-4;
/// Share of the resolution by which rounding moves a stamp, with a margin for the fitted line.
const HALF: f64 = 0.55;

/// The uniform raster from the first stamp to the last, if each stamp, s, is that of its row to within what it
/// resolves.
pub fn read(t: &[f64]) -> Option<Placement> {
    let steps = || t.windows(2).map(|w| w[1] - w[0]);
    if t.len() < FEWEST || steps().any(|s| s < 0.0) || !steps().any(|s| s == 0.0) {
        return None;
    }
    let worth = steps().filter(|s| *s > 0.0).fold(f64::INFINITY, f64::min);
    let largest = t.iter().fold(0.0f64, |m, t| m.max(t.abs()));
    let rounding = MULTIPLE + 4.0 * f64::EPSILON * largest / worth;
    if !worth.is_finite() || steps().any(|s| (s / worth - (s / worth).round()).abs() > rounding) {
        return None;
    }
    let n = t.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let mean = t.iter().map(|x| x - t[0]).sum::<f64>() / n;
    let moment: f64 = t.iter().enumerate().map(|(k, x)| (k as f64 - middle) * (x - t[0] - mean)).sum();
    let exact = moment / (n * (n * n - 1.0) / 12.0);
    // Standard error of the slope of a line through values that are rounded: worth/√12 · √12/n^1.5.
    let interval_s = plain(exact, 3.0 * worth / n.powf(1.5));
    let beside = |k: usize| (t[k] - t[0] - mean - (k as f64 - middle) * interval_s).abs();
    if (0..t.len()).any(|k| beside(k) > HALF * worth + rounding * worth) {
        return None;
    }
    let jitter = steps().map(|s| (s / interval_s - 1.0).abs()).fold(0.0, f64::max);
    let axis = TimeAxis { start_s: t[0], interval_s, jitter };
    Some(Placement { coarse_s: Some(worth), ..Placement::uniform(axis, t.len()) })
}
