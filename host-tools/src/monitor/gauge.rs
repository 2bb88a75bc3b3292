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

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-9 * expected.abs().max(1.0), "{found} against {expected}");
    }

    /// Four parts, three appraisers, two trials, and an interaction that stays: two-way analysis of variance by numpy,
    /// p-value by scipy.stats.f. (The tests of the master motor have the manual's example, in which it is pooled.)
    #[test]
    fn an_interaction_that_is_significant_is_the_appraisers() {
        let values: Vec<Vec<Vec<f64>>> = [
            [[1.0, 1.2], [4.0, 4.1], [6.5, 6.3]],
            [[3.0, 3.1], [4.2, 4.5], [8.9, 9.1]],
            [[5.0, 5.3], [8.1, 8.0], [9.0, 9.4]],
            [[2.0, 2.2], [4.9, 5.1], [7.6, 7.2]],
        ]
        .iter()
        .map(|part| part.iter().map(|cell| cell.to_vec()).collect())
        .collect();
        let g = crossed(&values).unwrap();
        for (source, freedom, squares) in [
            (g.parts, 3, 41.994_583_333),
            (g.appraisers, 2, 106.110_833_333),
            (g.interaction, 6, 6.839_166_667),
            (g.error, 12, 0.365),
        ] {
            assert_eq!(source.freedom, freedom);
            close(source.squares, squares);
        }
        assert!((g.interaction_p / 4.333_785e-7 - 1.0).abs() < 1e-4, "{}", g.interaction_p);
        close(g.repeatability, 0.174_403_746_14);
        close(g.reproducibility, 2.654_084_901_93);
        close(g.gauge, 2.659_808_890_38);
        close(g.part, 1.463_917_878_69);
        close(g.total, 3.036_056_469_98);
        close(g.of_total(), 0.876_073_589_76);
        close(g.of_tolerance(20.0), 0.797_942_667_11);
        // 1.41 · 1.464/2.660 = 0.776 of a category.
        assert_eq!(g.categories(), 0);
    }

    /// By hand, one part and two appraisers of two trials: means 2 and 5, MS_a = 4 (1.5)² = 9, MS_ε = (1 + 1 + 1 +
    /// 1)/2, σ²_a = (9 − 2)/2.
    #[test]
    fn a_single_part_has_no_scatter_of_parts() {
        let g = crossed(&[vec![vec![1.0, 3.0], vec![4.0, 6.0]]]).unwrap();
        assert_eq!((g.appraisers.squares, g.error.squares, g.part, g.interaction_p), (9.0, 4.0, 0.0, 1.0));
        close(g.repeatability, 2f64.sqrt());
        close(g.reproducibility, 3.5f64.sqrt());
        close(g.total, 5.5f64.sqrt());
    }

    /// By hand, two parts and one appraiser: MS_p = 4 (1.5)² = 9, σ²_p = (9 − 2)/2, 1.41 √(3.5/2) = 1.87 categories.
    #[test]
    fn a_single_appraiser_has_no_scatter_of_appraisers() {
        let g = crossed(&[vec![vec![1.0, 3.0]], vec![vec![4.0, 6.0]]]).unwrap();
        assert_eq!((g.parts.squares, g.reproducibility, g.categories()), (9.0, 0.0, 1));
        close(g.part, 3.5f64.sqrt());
        close(g.gauge, 2f64.sqrt());
    }

    #[test]
    fn a_study_takes_repetitions_parts_or_appraisers_and_balance() {
        let twice = || vec![1.0, 2.0];
        assert_eq!(crossed(&[vec![twice()]]), None, "one part, one appraiser");
        assert_eq!(crossed(&[vec![vec![1.0]], vec![vec![2.0]]]), None, "no repetition");
        assert_eq!(crossed(&[vec![twice(), twice()], vec![twice()]]), None, "an appraiser less");
        assert_eq!(crossed(&[vec![twice()], vec![vec![1.0, 2.0, 3.0]]]), None, "a repetition more");
        assert!(crossed(&[vec![twice()], vec![twice()]]).is_some() && crossed(&[vec![twice(), twice()]]).is_some());
    }

    #[test]
    fn nothing_that_scatters_is_nothing_of_anything() {
        let g = crossed(&[vec![vec![1.0, 1.0]], vec![vec![1.0, 1.0]]]).unwrap();
        assert_eq!((g.of_total(), g.categories(), g.total), (0.0, 0, 0.0));
        assert_eq!(Source { freedom: 0, squares: 3.0 }.mean(), 0.0);
        assert_eq!(Source { freedom: 2, squares: 3.0 }.mean(), 1.5);
    }
}
