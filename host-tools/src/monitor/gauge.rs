//! Gauge repeatability and reproducibility: how much of what is measured is the gauge's own scatter.
//!
//! Crossed study by analysis of variance, all factors random: p parts, each measured n times by each of o appraisers
//! (rigs, shifts, people):
//!
//! ```text
//! x_ijk = μ + part_i + appraiser_j + (part × appraiser)_ij + ε_ijk
//! σ²_ε = MS_ε     σ²_pa = (MS_pa − MS_ε)/n     σ²_a = (MS_a − MS_pa)/(p n)     σ²_p = (MS_p − MS_pa)/(o n)
//! ```
//!
//! Where the interaction is not significant it is pooled with the error. Components below zero count as zero.
//!
//! Source: AIAG, Measurement Systems Analysis, 4th edition (2010), chapter III section B and appendix A.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// An interaction of a larger p-value is pooled with the error.
const POOLED_ABOVE: f64 = 0.25;

/// A line of the analysis of variance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Source {
    /// Degrees of freedom.
    pub freedom: usize,
    /// Sum of squares.
    pub squares: f64,
}

impl Source {
    /// Mean square; 0 without freedom.
    pub fn mean(&self) -> f64 {
        if self.freedom > 0 { self.squares / self.freedom as f64 } else { 0.0 }
    }
}

/// The result of a study; standard deviations in the unit of what was measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gauge {
    /// Between parts.
    pub parts: Source,
    /// Between appraisers.
    pub appraisers: Source,
    /// Parts times appraisers.
    pub interaction: Source,
    /// Within repetitions.
    pub error: Source,
    /// p-value of the interaction; 1 without one.
    pub interaction_p: f64,
    /// Equipment variation: the same part by the same appraiser, again.
    pub repeatability: f64,
    /// Appraiser variation with the interaction: the same part by another appraiser.
    pub reproducibility: f64,
    /// Both together.
    pub gauge: f64,
    /// Between parts.
    pub part: f64,
    /// All of it.
    pub total: f64,
}

impl Gauge {
    /// Share of the total variation that is the gauge's.
    pub fn of_total(&self) -> f64 {
        if self.total > 0.0 { self.gauge / self.total } else { 0.0 }
    }

    /// Share of a tolerance's width, above zero, that six standard deviations of the gauge take.
    pub fn of_tolerance(&self, width: f64) -> f64 {
        6.0 * self.gauge / width
    }

    /// Number of distinct categories of parts that the gauge can tell, 1.41 part/gauge, rounded down.
    pub fn categories(&self) -> usize {
        if self.gauge > 0.0 { (1.41 * self.part / self.gauge) as usize } else { 0 }
    }
}

/// Analyses a balanced crossed study: `values[part][appraiser]` holds the repetitions. `None` where it is not balanced,
/// or has too little of everything: it takes two repetitions, and two parts or two appraisers.
pub fn crossed(values: &[Vec<Vec<f64>>]) -> Option<Gauge> {
    let (p, o) = (values.len(), values.first()?.len());
    let n = values.first()?.first()?.len();
    let balanced = values.iter().all(|part| part.len() == o && part.iter().all(|cell| cell.len() == n));
    if !balanced || n < 2 || p.max(o) < 2 {
        return None;
    }
    let mean = |cells: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = cells.fold((0.0, 0.0), |(s, c), x| (s + x, c + 1.0));
        sum / f64::max(count, 1.0)
    };
    let whole = mean(&mut values.iter().flatten().flatten().copied());
    let of_part: Vec<f64> = values.iter().map(|part| mean(&mut part.iter().flatten().copied())).collect();
    let of_appraiser: Vec<f64> =
        (0..o).map(|j| mean(&mut values.iter().flat_map(|part| part[j].iter().copied()))).collect();
    let (mut interaction, mut error) = (0.0, 0.0);
    for (part, part_mean) in values.iter().zip(&of_part) {
        for (cell, appraiser_mean) in part.iter().zip(&of_appraiser) {
            let here = mean(&mut cell.iter().copied());
            interaction += n as f64 * (here - part_mean - appraiser_mean + whole).powi(2);
            error += cell.iter().map(|x| (x - here).powi(2)).sum::<f64>();
        }
    }
    let square = |means: &[f64], times: usize| times as f64 * means.iter().map(|m| (m - whole).powi(2)).sum::<f64>();
    let parts = Source { freedom: p - 1, squares: square(&of_part, o * n) };
    let appraisers = Source { freedom: o - 1, squares: square(&of_appraiser, p * n) };
    let interaction = Source { freedom: (p - 1) * (o - 1), squares: interaction };
    let error = Source { freedom: p * o * (n - 1), squares: error };

    let interaction_p = if interaction.freedom > 0 && error.mean() > 0.0 {
        let f = FisherSnedecor::new(interaction.freedom as f64, error.freedom as f64).ok()?;
        1.0 - f.cdf(interaction.mean() / error.mean())
    } else {
        1.0
    };
    let pooled = interaction_p > POOLED_ABOVE;
    let noise = if pooled {
        let both =
            Source { freedom: interaction.freedom + error.freedom, squares: interaction.squares + error.squares };
        both.mean()
    } else {
        error.mean()
    };
    let against = if pooled { noise } else { interaction.mean() };
    let component = |mean: f64, of: f64, count: usize| f64::max(0.0, (mean - of) / count as f64);
    let between_appraisers = if o > 1 { component(appraisers.mean(), against, p * n) } else { 0.0 };
    let between_parts = if p > 1 { component(parts.mean(), against, o * n) } else { 0.0 };
    let crossing = if pooled { 0.0 } else { component(interaction.mean(), noise, n) };
    let reproducibility = between_appraisers + crossing;
    Some(Gauge {
        parts,
        appraisers,
        interaction,
        error,
        interaction_p,
        repeatability: noise.sqrt(),
        reproducibility: reproducibility.sqrt(),
        gauge: (noise + reproducibility).sqrt(),
        part: between_parts.sqrt(),
        total: (noise + reproducibility + between_parts).sqrt(),
    })
}
