//! Where samples lie on a uniform raster.

use std::ops::Range;

use crate::recording::time_axis::TimeAxis;

/// Where the samples lie on a uniform raster.
#[derive(Debug, Clone, PartialEq)]
pub struct Placement {
    /// The raster.
    pub axis: TimeAxis,
    /// Its rows.
    pub rows: usize,
    /// Rows that are missing, in their order.
    pub gaps: Vec<Range<usize>>,
    /// None: the n-th sample lies on the n-th row.
    pub(super) beside: Option<Beside>,
    /// What a stamp resolves, s, where several samples share one.
    pub coarse_s: Option<f64>,
}

/// Samples that do not lie on the rows in their order.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Beside {
    /// The sample of each row.
    pub samples: Vec<Option<u32>>,
    /// Samples without a gap between them.
    pub stretches: Vec<Range<usize>>,
    /// The stamp of each sample, in rows.
    pub stamps: Vec<f64>,
    /// The same without scatter.
    pub smooth: Vec<f64>,
    /// RMS scatter, in rows, where the digits of the stamps do not explain it.
    pub scatter: Option<f64>,
    /// Whether the rate wanders by more than a clock does.
    pub wanders: bool,
}

impl Placement {
    /// Samples that lie on the rows of a raster in their order.
    pub fn uniform(axis: TimeAxis, rows: usize) -> Self {
        Self { axis, rows, gaps: Vec::new(), beside: None, coarse_s: None }
    }

    /// RMS scatter of the stamps beyond what their digits explain, s.
    pub fn scatter_s(&self) -> Option<f64> {
        Some(self.beside.as_ref()?.scatter? * self.axis.interval_s)
    }

    /// Whether the rate wanders by more than a clock does.
    pub fn wanders(&self) -> bool {
        self.beside.as_ref().is_some_and(|b| b.wanders)
    }

    /// Furthest that a sample lies from where it would be at the mean rate, s.
    pub fn strays_s(&self) -> f64 {
        let Some(b) = &self.beside else { return 0.0 };
        let furthest = |s: &Range<usize>| {
            let strays = |n: usize| (b.smooth[n] - b.smooth[s.start] - (n - s.start) as f64).abs();
            s.clone().map(strays).fold(0.0, f64::max)
        };
        self.axis.interval_s * b.stretches.iter().map(furthest).fold(0.0, f64::max)
    }

    /// Whether each sample belongs on a row of its own, so that a stated interval may replace the stamps'.
    pub fn is_on_rows(&self) -> bool {
        self.beside.as_ref().is_none_or(|b| b.scatter.is_none() && !b.wanders)
    }

    /// The samples before and behind each gap: what is told by their neighbours is not known there.
    pub fn borders(&self) -> Vec<usize> {
        let stretches = self.beside.as_ref().map_or(&[][..], |b| &b.stretches);
        stretches.windows(2).flat_map(|w| [w[0].end - 1, w[1].start]).collect()
    }

    /// Values of the samples on the rows, unchanged; `missing` in a gap.
    pub fn gather<T: Copy>(&self, values: Vec<T>, missing: T) -> Vec<T> {
        let Some(beside) = &self.beside else { return values };
        let of = |sample: &Option<u32>| sample.and_then(|n| values.get(n as usize).copied()).unwrap_or(missing);
        beside.samples.iter().map(of).collect()
    }
}
