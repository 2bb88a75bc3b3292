//! A uniform raster, with the stretches of samples that lie on it without a gap.

use std::ops::Range;

/// Samples over which the scatter of stamps averages out while a wandering rate does not, to either side.
const AROUND: usize = 32;
/// Stretches of time whose rates are compared.
const BLOCKS: usize = 32;
/// Share of the mean rate by which a rate may wander in all: a timer of an operating system does, a change to another
/// rate does more.
const MOST_WANDER: f64 = 0.2;
/// Share of the whole wandering that may happen from one block to the next: a step of the rate takes all of it, in two
/// blocks at most.
const MOST_IN_A_BLOCK: f64 = 0.34;
/// Wandering as a share of the rate that is too little to be looked at so closely.
const LITTLE_WANDER: f64 = 0.005;
/// Stamps that stray further from a straight line than by these, in rows and as a share of the run, come from a rate
/// that wanders: as in the check of uniform stamps.
const WANDER: (f64, f64) = (1.0, 1e-4);
/// Smooth deviations from the raster that are none, in rows.
const ON_THE_LINE: f64 = 0.25;

/// A uniform raster under stamps.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster {
    /// Time of the first row, s.
    pub start_s: f64,
    /// Interval, s.
    pub interval_s: f64,
    /// Samples without a gap between them.
    pub segments: Vec<Range<usize>>,
    /// Row of the first sample of each segment.
    pub first_rows: Vec<usize>,
}

impl Raster {
    /// Row of a sample whose rate does not wander.
    pub fn row_of(&self, sample: usize) -> usize {
        let k = self.segments.partition_point(|s| s.end <= sample).min(self.segments.len() - 1);
        self.first_rows[k] + (sample - self.segments[k].start)
    }

    /// Stamps, in rows, without their scatter; none where their rate does not wander but jump.
    pub fn smooth(&self, stamps: &[f64]) -> Option<Vec<f64>> {
        let mut smooth = Vec::with_capacity(stamps.len());
        for segment in &self.segments {
            let beside: Vec<f64> = segment.clone().map(|n| stamps[n] - self.row_of(n) as f64).collect();
            let means = means_around(&beside);
            let (low, high) = means.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
            let level = means.iter().sum::<f64>() / means.len() as f64;
            let wanders = high - low > 2.0 * ON_THE_LINE;
            if wanders && !is_slow(&means) {
                return None;
            }
            smooth.extend(
                segment.clone().zip(&means).map(|(n, m)| self.row_of(n) as f64 + if wanders { *m } else { level }),
            );
        }
        Some(smooth)
    }

    /// Whether smooth stamps, in rows, stray from their rows by more than a clock does.
    pub fn wanders(&self, smooth: &[f64]) -> bool {
        let allowed = WANDER.0.max(WANDER.1 * smooth.len() as f64);
        smooth.iter().enumerate().any(|(n, s)| (s - self.row_of(n) as f64).abs() > allowed)
    }

    /// Largest deviation of an interval from the mean one, as a fraction of it; gaps left out.
    pub fn jitter(&self, t: &[f64]) -> f64 {
        let inside = self.segments.iter().flat_map(|s| t[s.clone()].windows(2));
        inside.map(|w| ((w[1] - w[0]) / self.interval_s - 1.0).abs()).fold(0.0, f64::max)
    }
}

/// Straight line through the values around each, at it: a mean that an even slope does not shift.
fn means_around(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let mut sums = vec![[0.0; 2]; n + 1];
    for (k, x) in values.iter().enumerate() {
        sums[k + 1] = [sums[k][0] + x, sums[k][1] + k as f64 * x];
    }
    (0..n)
        .map(|k| {
            let (from, to) = (k.saturating_sub(AROUND), (k + AROUND + 1).min(n));
            let count = (to - from) as f64;
            let [sum, moment] = [0, 1].map(|j| sums[to][j] - sums[from][j]);
            let middle = 0.5 * (from + to - 1) as f64;
            let spread = count * (count * count - 1.0) / 12.0;
            let slope = if spread > 0.0 { (moment - middle * sum) / spread } else { 0.0 };
            sum / count + slope * (k as f64 - middle)
        })
        .collect()
}

/// Whether the rate behind smooth deviations, in rows, changes slowly.
fn is_slow(means: &[f64]) -> bool {
    let blocks = BLOCKS.min(means.len() / AROUND);
    if blocks < 4 {
        return false;
    }
    let at = |b: usize| b * (means.len() - 1) / blocks;
    let rates: Vec<f64> = (0..blocks).map(|b| (means[at(b + 1)] - means[at(b)]) / (at(b + 1) - at(b)) as f64).collect();
    let (low, high) = rates.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
    let steepest = rates.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
    let range = high - low;
    range <= MOST_WANDER && (range <= LITTLE_WANDER || steepest <= MOST_IN_A_BLOCK * range)
}
