//! From stamps to the rows of a raster.

use std::ops::Range;

use super::placement::{Beside, Placement};
use super::raster::Raster;
use super::{coarse, resolution, tracking};
use crate::recording::time_axis::{self, Fault, TimeAxis};

/// Gaps of a recording at most; with more, its parts are too short for anything.
const MOST_GAPS: usize = 100;
/// Share of the rows that may be missing.
const MOST_MISSING: f64 = 1.0 / 3.0;
/// Segments among which most may be [`SHORT`], in samples: where more are, it is the rate that has changed.
const MOST_SHORT: usize = 8;
const SHORT: usize = 16;
/// RMS scatter of stamps, in intervals, that matters: less moves a signal that turns by 0.3 rad from sample to sample
/// (a twentieth of the sampling rate) by 0.15 % of its amplitude, no more than a 10-bit converter tells.
const LEAST_SCATTER: f64 = 0.005;

/// Reads stamps, s.
///
/// # Errors
/// The first row that no raster explains, as [`time_axis::check`] tells it.
pub fn read(t: &[f64]) -> Result<Placement, Fault> {
    let checked = time_axis::check(t);
    if let Ok(axis) = &checked
        && (axis.jitter <= LEAST_SCATTER || resolution::explains(t, axis.start_s, axis.interval_s))
    {
        return Ok(Placement::uniform(*axis, t.len()));
    }
    let further = || coarse::read(t).or_else(|| placed(t, &tracking::raster(t)?));
    match checked {
        Ok(axis) => Ok(further().unwrap_or_else(|| Placement::uniform(axis, t.len()))),
        Err(fault) => further().ok_or(fault),
    }
}

fn placed(t: &[f64], raster: &Raster) -> Option<Placement> {
    let stamps: Vec<f64> = t.iter().map(|t| (t - raster.start_s) / raster.interval_s).collect();
    let smooth = raster.smooth(&stamps)?;
    let wanders = raster.wanders(&smooth);
    let on_row = |n: usize| if wanders { smooth[n].round().max(0.0) as usize } else { raster.row_of(n) };
    let last = t.len() - 1;
    let rows = on_row(last) + 1;
    let between = |pair: &[Range<usize>]| on_row(pair[0].end - 1) + 1..on_row(pair[1].start);
    let gaps: Vec<Range<usize>> = raster.segments.windows(2).map(between).filter(|gap| !gap.is_empty()).collect();
    let missing: usize = gaps.iter().map(ExactSizeIterator::len).sum();
    let short = raster.segments.iter().filter(|segment| segment.len() < SHORT).count();
    if raster.segments.len() > MOST_SHORT && 2 * short > raster.segments.len() {
        return None;
    }
    if gaps.len() > MOST_GAPS || missing as f64 > MOST_MISSING * rows as f64 {
        return None;
    }
    // The nearest one; each row has its own where the rate does not wander.
    let mut next = 0;
    let nearest = |row: usize| {
        while next < last && on_row(next + 1) <= row {
            next += 1;
        }
        u32::try_from(next).ok()
    };
    let mut samples: Vec<Option<u32>> = (0..rows).map(nearest).collect();
    gaps.iter().for_each(|gap| samples[gap.clone()].fill(None));
    let squares: f64 = stamps.iter().zip(&smooth).map(|(a, b)| (a - b).powi(2)).sum();
    let scatter = (squares / t.len() as f64).sqrt();
    let matters = scatter > LEAST_SCATTER && !resolution::explains_about(t, &smooth, raster.start_s, raster.interval_s);
    let axis = TimeAxis { start_s: raster.start_s, interval_s: raster.interval_s, jitter: raster.jitter(t) };
    let stretches = raster.segments.clone();
    if gaps.is_empty() && !matters && !wanders {
        return Some(Placement::uniform(axis, rows));
    }
    let beside = Beside { samples, stretches, stamps, smooth, scatter: matters.then_some(scatter), wanders };
    Some(Placement { gaps, beside: Some(beside), ..Placement::uniform(axis, rows) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform numbers below 1 that look random.
    fn random(n: usize) -> f64 {
        let x = (n as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let x = (x ^ (x >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        ((x ^ (x >> 29)) >> 11) as f64 / (1u64 << 53) as f64
    }

    #[test]
    fn gaps_are_found_under_scatter_and_without() {
        for share in [0.0, 0.2, 0.8] {
            let kept = (0..20_000).filter(|n| !(3000..3001).contains(n) && !(9000..9500).contains(n));
            let t: Vec<f64> = kept.map(|n| 5.0 + 1e-3 * (n as f64 + share * (random(n) - 0.5))).collect();
            let placed = read(&t).expect("two gaps");
            assert_eq!(placed.rows, 20_000, "{share}");
            assert_eq!(placed.gaps, [3000..3001, 9000..9500], "{share}");
            assert!((placed.axis.interval_s / 1e-3 - 1.0).abs() < 1e-6, "{share}: {}", placed.axis.interval_s);
            let on_rows = placed.gather(t, f64::NAN);
            for (row, t) in on_rows.iter().enumerate().filter(|(_, t)| !t.is_nan()) {
                assert!((t - 5.0 - 1e-3 * row as f64).abs() < 0.45e-3, "{share}: row {row} at {t} s");
            }
            match placed.scatter_s() {
                // Uniform over ±share/2: RMS share/√12.
                Some(rms) => assert!((rms / (1e-3 * share / 12f64.sqrt()) - 1.0).abs() < 0.05, "{share}: {rms}"),
                None => assert_eq!(share, 0.0),
            }
        }
    }

    #[test]
    fn too_many_gaps_are_none() {
        // Two hundred, of a row each.
        let t: Vec<f64> = (0..8000).filter(|n| n % 40 < 39).map(|n| 1e-3 * f64::from(n)).collect();
        assert!(read(&t).is_err());
        // A tenth of the run at half the rate.
        let t: Vec<f64> = (0..1000).chain((1000..1200).step_by(2)).map(|n| 1e-3 * f64::from(n)).collect();
        assert!(read(&t).is_err(), "two rates");
        // One half missing in one gap.
        let t: Vec<f64> = (0..4000).filter(|n| !(1000..3000).contains(n)).map(|n| 1e-3 * n as f64).collect();
        assert!(read(&t).expect_err("a gap").what.contains("2000 samples are missing"));
    }

    #[test]
    fn rounded_stamps_are_uniform_however_coarse() {
        // 10 kHz printed in ms, 700 Hz in ms, 3 kHz with four decimals, 1050 Hz in ms.
        for (rate, digits) in [(1e4, 1e3), (700.0, 1e3), (3e3, 1e4), (1050.0, 1e3)] {
            let t: Vec<f64> = (0..30_000).map(|n| (f64::from(n) / rate * digits).floor() / digits).collect();
            let placed = read(&t).expect("rounded");
            assert!((placed.axis.interval_s * rate - 1.0).abs() < 1e-5, "{rate} Hz: {}", placed.axis.interval_s);
            assert!(placed.gaps.is_empty() && placed.scatter_s().is_none() && placed.rows == t.len(), "{rate} Hz");
            assert_eq!(placed.coarse_s.is_some(), rate > digits, "{rate} Hz");
        }
        // Seconds since 1970 at 100 kHz, and single precision at 10 kHz.
        let t: Vec<f64> = (0..30_000).map(|n| 1.772_352e9 + 1e-5 * f64::from(n)).collect();
        assert!(read(&t).expect("rounded").scatter_s().is_none());
        let t: Vec<f64> = (0..300_000).map(|n| f64::from((1e-4 * f64::from(n)) as f32)).collect();
        assert!(read(&t).expect("rounded").scatter_s().is_none());
    }

    #[test]
    fn a_rate_that_wanders_is_followed_and_a_change_is_not() {
        // By 1 % up and down once in the run: 32 rows to the side.
        let wandering = |n: i32| 1e-3 * (f64::from(n) + 32.0 * (std::f64::consts::TAU * f64::from(n) / 2e4).sin());
        let t: Vec<f64> = (0..20_000).map(wandering).collect();
        let placed = read(&t).expect("wanders");
        assert!(placed.wanders() && placed.gaps.is_empty());
        for (row, t) in placed.gather(t, f64::NAN).iter().enumerate() {
            let told = placed.axis.start_s + placed.axis.interval_s * row as f64;
            assert!((t - told).abs() < 1.1e-3, "row {row}: {t} s, not {told} s");
        }
        let t: Vec<f64> = (0..20_000).map(|n| 1e-3 * (f64::from(n) + 0.05 * (f64::from(n) - 1e4).max(0.0))).collect();
        assert!(read(&t).is_err(), "two rates");
    }
}
