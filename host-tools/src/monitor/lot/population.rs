//! What is usual in a lot: the balances of healthy motors, block by block of the test.
//!
//! A row of motor m in block k is
//!
//! ```text
//! r = r̄(k) + Σ_p x_p(k) θ_mp + Σ_s h_s(k) a_ms + noise of covariance C(k)
//! ```
//!
//! with r̄ what the model leaves over of all of them at that time of the test, θ the motor's own parameters (those of
//! the faults that are parameters, and its levels of sparks and ripple), normal with the lot's scatter, and h a few
//! shapes over time by which the motors differ besides, with amplitudes of variance 1. r̄, scatter, h and C are found
//! from healthy motors by expectation and maximisation.
//!
//! Source: A. P. Dempster, N. M. Laird, D. B. Rubin, Maximum likelihood from incomplete data via the EM algorithm,
//! J. R. Stat. Soc. B 39 (1977) 1–38; shapes: M. E. Tipping, C. M. Bishop, Probabilistic principal component analysis,
//! J. R. Stat. Soc. B 61 (1999) 611–622.

use nalgebra::{DMatrix, DVector};

use super::blocks::{Block, Cut, Run, SPARKS};
use crate::model::lot::{BALANCES, Fault, OWN, Population, ROWS};

/// Most shapes.
const MOST_SHAPES: usize = 4;
/// Rounds of expectation and maximisation, and those of them before shapes are looked for.
const ROUNDS: usize = 12;
const WITHOUT_SHAPES: usize = 4;
/// Blocks on either side over which a covariance is averaged: motors are few, and it changes little within 0.7 s.
const BESIDE: usize = 3;
/// Share of the correlation between the balances that few motors are believed.
const BELIEVED: f64 = 0.9;
/// Least power by which a row of power is measured, of the largest: where none flows none is missed.
const LEAST_POWER: f64 = 0.01;
/// Least variance: what rounding leaves.
const LEAST_VARIANCE: f64 = 1e-18;
/// Scatter of a parameter that is assumed first, and the least: no lot scatters by less, and of parameters that a test
/// hardly tells apart a few motors would have one scatter for all. By judgement.
const FIRST: f64 = 0.05;
const LEAST_SCATTER: f64 = 0.01;

/// A run in units of what is usual: rows of variance 1.
#[derive(Debug, Clone)]
pub struct Whitened {
    /// Block of each row.
    pub blocks: Vec<usize>,
    /// Which of its block's rows each is.
    pub row_of_block: Vec<usize>,
    /// What is left over.
    pub rows: DVector<f64>,
    /// Columns of what differs from motor to motor, each of variance 1: parameters, then shapes.
    pub own: DMatrix<f64>,
    /// Columns of the faults at unit size, in the order of [`Fault::ALL`].
    pub faults: Vec<DVector<f64>>,
    /// What a gain of the speed's sensor adds to the block that it comes in.
    pub jump: DVector<f64>,
}

/// How many shapes so many motors tell.
fn shapes_of(motors: usize) -> usize {
    (motors.saturating_sub(3) / 2).min(MOST_SHAPES)
}

impl Population {
    /// What is usual in the runs of healthy motors, without limits; with or without shapes.
    pub fn learn(cut: &Cut, runs: &[&Run], motors: usize, with_shapes: bool) -> Self {
        let count = runs.iter().map(|run| run.blocks.len()).min().unwrap_or(0);
        let mean = |get: &dyn Fn(&Block) -> f64| -> Vec<f64> {
            (0..count).map(|k| runs.iter().map(|run| get(&run.blocks[k])).sum::<f64>() / runs.len() as f64).collect()
        };
        let (voltage, power) = (mean(&|b| b.voltage), mean(&|b| b.power));
        let most = |of: &[f64]| of.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(*x));
        let (highest, largest) = (most(&voltage), most(&power));
        let torque = largest / cut.top_speed.max(f64::MIN_POSITIVE);
        let unit = OWN.map(|fault| match fault.unit() {
            Some("N m") => torque,
            Some("rad/s") => 0.01 * cut.top_speed,
            Some("V") => 0.1 * highest,
            Some(_) => 0.1 * largest / highest,
            None => 1.0,
        });
        let least = unit.map(|unit| LEAST_SCATTER * unit);
        let mut population = Self {
            layout: Self::LAYOUT,
            block_s: cut.block_s,
            alternating: cut.alternating,
            top_speed: cut.top_speed,
            motors,
            false_alarms: 0.0,
            scatter: unit.map(|unit| FIRST * unit),
            voltage,
            power: power.iter().map(|p| p.max(LEAST_POWER * largest)).collect(),
            usual: vec![[0.0; ROWS]; count],
            shapes: Vec::new(),
            variance: vec![[1.0; ROWS]; count],
            correlation: vec![0.0; count],
            limits: Vec::new(),
        };
        population.take_means(&population.left(runs, &[]), runs);
        population.take_covariances(&population.left(runs, &[]), runs);
        for round in 0..ROUNDS {
            population.improve(runs, with_shapes && round >= WITHOUT_SHAPES, motors, &least);
        }
        population
    }

    /// A round of expectation and maximisation.
    fn improve(&mut self, runs: &[&Run], with_shapes: bool, motors: usize, least: &[f64]) {
        let told: Vec<(DVector<f64>, DMatrix<f64>)> =
            runs.iter().map(|run| self.whitened(run).own_of_motor()).collect();
        let mut amplitudes: Vec<DVector<f64>> = told.iter().map(|(a, _)| a.clone()).collect();
        self.take_means(&self.left(runs, &amplitudes), runs);
        if with_shapes {
            let of_shapes = self.find_shapes(runs, &amplitudes, shapes_of(motors));
            amplitudes = amplitudes
                .iter()
                .zip(of_shapes)
                .map(|(a, of_shapes)| {
                    DVector::from_iterator(
                        OWN.len() + of_shapes.len(),
                        a.iter().take(OWN.len()).copied().chain(of_shapes),
                    )
                })
                .collect();
        }
        self.take_covariances(&self.left(runs, &amplitudes), runs);
        for (p, scatter) in self.scatter.iter_mut().enumerate() {
            let square = told.iter().map(|(a, c)| a[p] * a[p] + c[(p, p)]).sum::<f64>() / runs.len() as f64;
            *scatter = (*scatter * square.sqrt()).max(least[p]);
        }
    }

    /// A row of a block, power as a share of what flows.
    fn scaled(&self, k: usize, mut rows: [f64; ROWS]) -> [f64; ROWS] {
        rows[0] /= self.power[k];
        rows
    }

    /// What is left of each run in each block beside what is usual and, where they are known, what goes with the
    /// motor's own amplitudes.
    fn left(&self, runs: &[&Run], amplitudes: &[DVector<f64>]) -> Vec<Vec<[f64; ROWS]>> {
        let of = |(m, run): (usize, &&Run)| {
            let own: &[f64] = amplitudes.get(m).map_or(&[], |a| a.as_slice());
            let in_block = |k: usize| {
                let block = &run.blocks[k];
                let mut left = self.scaled(k, block.rows);
                let mut less = |part: &[f64; ROWS], by: f64| {
                    left.iter_mut().zip(part).for_each(|(left, part)| *left -= by * part);
                };
                less(&self.usual[k], 1.0);
                for ((fault, scatter), a) in OWN.iter().zip(&self.scatter).zip(own) {
                    less(&self.scaled(k, block.columns[*fault as usize]), a * scatter);
                }
                for (shape, a) in self.shapes.iter().zip(own.iter().skip(OWN.len())) {
                    less(&shape[k], *a);
                }
                left
            };
            (0..self.usual.len()).map(in_block).collect()
        };
        runs.iter().enumerate().map(of).collect()
    }

    /// Adds to r̄ what is left on the average.
    fn take_means(&mut self, left: &[Vec<[f64; ROWS]>], runs: &[&Run]) {
        for (k, usual) in self.usual.iter_mut().enumerate() {
            for (row, usual) in usual.iter_mut().enumerate() {
                let counted = runs.iter().zip(left).filter(|(run, _)| run.blocks[k].counts[row]);
                let (sum, count) =
                    counted.fold((0.0, 0.0), |(sum, count), (_, left)| (sum + left[k][row], count + 1.0));
                if count > 0.0 {
                    *usual += sum / count;
                }
            }
        }
    }

    /// The shapes by which motors differ beside their parameters, the principal components of what these leave over,
    /// and their amplitudes in each run.
    fn find_shapes(&mut self, runs: &[&Run], amplitudes: &[DVector<f64>], count: usize) -> Vec<Vec<f64>> {
        let parameters: Vec<DVector<f64>> = amplitudes.iter().map(|a| a.rows(0, OWN.len()).into_owned()).collect();
        let left = self.left(runs, &parameters);
        let blocks = self.usual.len();
        let factors: Vec<DMatrix<f64>> = (0..blocks).map(|k| self.factor(k, &[true; ROWS])).collect();
        let mut white = DMatrix::zeros(runs.len(), blocks * ROWS);
        for (m, run) in runs.iter().enumerate() {
            for (k, factor) in factors.iter().enumerate() {
                let counts = &run.blocks[k].counts;
                // Sparks and ripple have no part in the shapes, or a fault of the balances would show in them.
                let counted =
                    DVector::from_fn(ROWS, |row, _| if counts[row] && row < SPARKS { left[m][k][row] } else { 0.0 });
                if let Some(solved) = factor.solve_lower_triangular(&counted) {
                    white.view_mut((m, k * ROWS), (1, ROWS)).copy_from(&solved.transpose());
                }
            }
        }
        let svd = white.svd(true, true);
        let (Some(of_runs), Some(directions)) = (svd.u, svd.v_t) else { return vec![Vec::new(); runs.len()] };
        let root = (runs.len() as f64).sqrt();
        let count = count.min(svd.singular_values.len());
        // Nalgebra gives the singular values in falling order.
        self.shapes = (0..count)
            .map(|j| {
                let size = svd.singular_values[j] / root;
                let in_block = |(k, factor): (usize, &DMatrix<f64>)| {
                    let shape = factor * directions.view((j, k * ROWS), (1, ROWS)).transpose() * size;
                    std::array::from_fn(|row| shape[row])
                };
                factors.iter().enumerate().map(in_block).collect()
            })
            .collect();
        (0..runs.len()).map(|m| (0..count).map(|j| of_runs[(m, j)] * root).collect()).collect()
    }

    /// The covariances of what is left over. r̄ and the shapes have taken a degree of freedom each.
    fn take_covariances(&mut self, left: &[Vec<[f64; ROWS]>], runs: &[&Run]) {
        let blocks = self.usual.len();
        let count = runs.len() as f64;
        let freedom = (count - 1.0 - self.shapes.len() as f64).max(1.0);
        for k in 0..blocks {
            let near = k.saturating_sub(BESIDE)..(k + BESIDE + 1).min(blocks);
            let rows =
                || near.clone().flat_map(|n| runs.iter().zip(left).map(move |(r, l)| (&r.blocks[n].counts, &l[n])));
            for row in 0..ROWS {
                let counted = rows().filter(|(counts, _)| counts[row]);
                let (sum, n) = counted.fold((0.0, 0.0), |(sum, n), (_, left)| (sum + left[row] * left[row], n + 1.0));
                self.variance[k][row] = if n > 0.0 { (sum / n * count / freedom).max(LEAST_VARIANCE) } else { 1.0 };
            }
            let both = rows().filter(|(counts, _)| counts[0] && counts[1]);
            let [a, b, c] =
                both.fold([0.0; 3], |[a, b, c], (_, x)| [a + x[0] * x[0], b + x[0] * x[1], c + x[1] * x[1]]);
            self.correlation[k] = if a > 0.0 && c > 0.0 { BELIEVED * b / (a * c).sqrt() } else { 0.0 };
        }
    }

    /// The lower triangular factor of the covariance of those rows of a block that count; 1 for the others.
    fn factor(&self, k: usize, counts: &[bool; ROWS]) -> DMatrix<f64> {
        let mut factor = DMatrix::identity(ROWS, ROWS);
        for row in (0..ROWS).filter(|row| counts[*row]) {
            factor[(row, row)] = self.variance[k][row].sqrt();
        }
        if counts[..BALANCES].iter().all(|counts| *counts) {
            let (correlation, deviation) = (self.correlation[k], factor[(1, 1)]);
            factor[(1, 0)] = correlation * deviation;
            factor[(1, 1)] = (1.0 - correlation * correlation).sqrt() * deviation;
        }
        factor
    }

    /// A run in units of what is usual.
    pub fn whitened(&self, run: &Run) -> Whitened {
        let width = OWN.len() + self.shapes.len();
        let (mut blocks, mut row_of_block, mut all) = (Vec::new(), Vec::new(), Vec::new());
        for (k, block) in run.blocks.iter().enumerate().take(self.usual.len()) {
            let mut columns = DMatrix::zeros(ROWS, 2 + width + Fault::ALL.len());
            let mut put = |column: usize, rows: [f64; ROWS], by: f64| {
                for row in (0..ROWS).filter(|row| block.counts[*row]) {
                    columns[(row, column)] += by * rows[row];
                }
            };
            put(0, self.scaled(k, block.rows), 1.0);
            put(0, self.usual[k], -1.0);
            for (p, (fault, scatter)) in OWN.iter().zip(&self.scatter).enumerate() {
                put(1 + p, self.scaled(k, block.columns[*fault as usize]), *scatter);
            }
            for (s, shape) in self.shapes.iter().enumerate() {
                put(1 + OWN.len() + s, shape[k], 1.0);
            }
            for (f, column) in block.columns.iter().enumerate() {
                put(1 + width + f, self.scaled(k, *column), 1.0);
            }
            put(1 + width + Fault::ALL.len(), self.scaled(k, block.jump), 1.0);
            let Some(white) = self.factor(k, &block.counts).solve_lower_triangular(&columns) else { continue };
            for row in (0..ROWS).filter(|row| block.counts[*row]) {
                blocks.push(k);
                row_of_block.push(row);
                all.push(white.row(row).transpose());
            }
        }
        let column = |c: usize| DVector::from_fn(all.len(), |n, _| all[n][c]);
        Whitened {
            rows: column(0),
            own: DMatrix::from_fn(all.len(), width, |n, c| all[n][1 + c]),
            faults: (0..Fault::ALL.len()).map(|f| column(1 + width + f)).collect(),
            jump: column(1 + width + Fault::ALL.len()),
            blocks,
            row_of_block,
        }
    }
}

impl Whitened {
    /// Amplitudes of what differs from motor to motor, a posteriori: mean and covariance.
    pub fn own_of_motor(&self) -> (DVector<f64>, DMatrix<f64>) {
        let width = self.own.ncols();
        let information = self.own.tr_mul(&self.own) + DMatrix::identity(width, width);
        // XᵀX + 1 is positive definite.
        let covariance = information.cholesky().map_or_else(|| DMatrix::identity(width, width), |c| c.inverse());
        (&covariance * self.own.tr_mul(&self.rows), covariance)
    }
}
