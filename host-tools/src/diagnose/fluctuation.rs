//! A load that fluctuates: what is left of the torque where nothing in the recordings orders it.
//!
//! Residuals that go with themselves tell of noise, residuals that go with what drives the motor tell of the model
//! (Ljung). What the torque balance leaves over is regressed on a dictionary of current, speed, their products and
//! powers, what they were windows before, and time, beside what the base model's own terms do. The share of its
//! variance that the dictionary explains is compared with the shares that it explains of torques which have nothing to
//! do with the recording but go with themselves as this one does: white noise and a first-order process,
//!
//! ```text
//! c_k = σ² a^k      k = 1, 2, …       c_0 = σ² + w
//! ```
//! with autocovariances c of what is left, a and σ by least squares. If more than one in a hundred of these has a share
//! as large, and the process is most of it, the rest is a load that fluctuates, or what acts like one.
//!
//! Source: L. Ljung, System Identification, 2nd edition (1999), section 16.6; surrogates: J. Theiler et al., Testing
//! for nonlinearity in time series: the method of surrogate data, Physica D 58 (1992) 77–94.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::identify::equation_error::{Balance, EquationError};
use crate::identify::minimise::{Fit, Residuals};

/// The rows of the torque balance.
const TORQUE: u8 = 1;
/// Torques that have nothing to do with the recording.
const SURROGATES: usize = 199;
/// Share of them below which what is left is no load.
const CHANCE: f64 = 0.01;
/// Rows for each column, at least.
const ROWS_A_COLUMN: usize = 5;
/// Part of its length that a column has to keep beside the others.
const OWN: f64 = 1e-6;
/// Autocovariances by which the process is told.
const LAGS: usize = 8;
/// Values of a that are tried, evenly in the logarithm of the time constant: from a third of a window to a thousand.
const TIMES: usize = 40;
const ENDS: (f64, f64) = (0.3, 1000.0);

/// A function of current (A), speed (rad/s) and di/dt (A/s).
type Term = fn(f64, f64, f64) -> f64;

/// Those of the base model, which a fit has made the best of.
const KNOWN: &[Term] = &[
    |_, _, _| 1.0,
    |i, _, _| i,
    |i, _, _| i * i.abs(),
    |_, w, _| w,
    |_, w, _| w * w.abs(),
    |_, w, _| if w == 0.0 { 0.0 } else { w.signum() },
];
/// Those of other laws.
const TERMS: &[Term] = &[
    |i, _, _| i.abs(),
    |i, _, _| i * i,
    |i, _, _| i * i * i,
    |_, w, _| w.abs(),
    |_, w, _| w * w,
    |_, w, _| w * w * w,
    |_, w, _| w.abs().sqrt() * w.signum(),
    |i, w, _| i * w,
    |i, w, _| i * i * w,
    |i, w, _| i.abs() * w,
    |i, w, _| i * w * w,
    |i, _, d| i * d,
];
/// Those of windows before, and how many windows.
const BEFORE: [usize; 3] = [1, 3, 10];
const EARLIER: &[Term] = &[|i, _, _| i, |i, _, _| i * i, |_, w, _| w, |_, w, _| w.abs()];

/// A load that fluctuates by itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fluctuation {
    /// Standard deviation, N m.
    pub torque: f64,
    /// Time constant, s.
    pub time_constant_s: f64,
}

/// What a fit leaves over in the torque balance, if it is a load that fluctuates.
pub fn of(fit: &Fit, problem: &EquationError<'_>) -> Option<Fluctuation> {
    let rows: Vec<usize> = (0..problem.groups().len()).filter(|k| problem.groups()[*k] == TORQUE).collect();
    let times: Vec<(usize, f64)> = rows.iter().map(|k| problem.times()[*k]).collect();
    let known = matrix(KNOWN.iter().map(|term| column(problem, &rows, *term)).collect());
    let others = dictionary(problem, &rows, &times);
    if rows.len() < ROWS_A_COLUMN * (known.ncols() + others.ncols()) {
        return None;
    }
    let split = Split::new(&known, &others);
    let left = split.beside(&DVector::from_fn(rows.len(), |row, _| fit.residuals[rows[row]]));
    let process = Process::of(left.as_slice(), &times)?;
    let share = split.share(&left);
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let as_large =
        (0..SURROGATES).filter(|_| split.share(&split.beside(&process.draw(&times, &mut random))) >= share).count();
    let chance = (as_large + 1) as f64 / (SURROGATES + 1) as f64;
    let impulse = column(problem, &rows, |_, _, _| 1.0).iter().fold(0.0f64, |most, x| most.max(x.abs()));
    let is_most = process.variance > process.white;
    (chance > CHANCE && is_most && impulse > 0.0).then(|| Fluctuation {
        torque: process.variance.sqrt() * fit.rms[usize::from(TORQUE)] / impulse,
        time_constant_s: -process.step_s / process.kept.ln(),
    })
}

fn column(problem: &EquationError<'_>, rows: &[usize], term: Term) -> Vec<f64> {
    let all = problem.column(Balance::Torque, &term);
    rows.iter().map(|k| all[*k]).collect()
}

/// Columns of what could order a torque.
fn dictionary(problem: &EquationError<'_>, rows: &[usize], times: &[(usize, f64)]) -> DMatrix<f64> {
    let mut columns: Vec<Vec<f64>> = TERMS.iter().map(|term| column(problem, rows, *term)).collect();
    for term in EARLIER {
        let now = column(problem, rows, *term);
        for lag in BEFORE {
            let before = |k: usize| if k >= lag && times[k - lag].0 == times[k].0 { now[k - lag] } else { now[k] };
            columns.push((0..rows.len()).map(before).collect());
        }
    }
    let last = times.iter().fold(f64::MIN_POSITIVE, |last, (_, t)| last.max(*t));
    let constant = column(problem, rows, |_, _, _| 1.0);
    for power in 1..3 {
        columns.push(constant.iter().zip(times).map(|(x, (_, t))| x * (t / last).powi(power)).collect());
    }
    matrix(columns)
}

fn matrix(columns: Vec<Vec<f64>>) -> DMatrix<f64> {
    DMatrix::from_fn(columns.first().map_or(0, Vec::len), columns.len(), |row, c| columns[c][row])
}

/// Orthonormal columns of what is known and of a dictionary beside it.
struct Split {
    known: DMatrix<f64>,
    others: DMatrix<f64>,
}

impl Split {
    fn new(known: &DMatrix<f64>, others: &DMatrix<f64>) -> Self {
        let rows = known.nrows();
        let known = orthonormal(known, &DMatrix::zeros(rows, 0));
        let others = orthonormal(others, &known);
        Self { known, others }
    }

    /// What is left of a column beside what is known.
    fn beside(&self, column: &DVector<f64>) -> DVector<f64> {
        column - &self.known * self.known.tr_mul(column)
    }

    /// Share of the squares of what is left that the dictionary explains.
    fn share(&self, left: &DVector<f64>) -> f64 {
        self.others.tr_mul(left).norm_squared() / left.norm_squared().max(f64::MIN_POSITIVE)
    }
}

/// Orthonormal columns that span a matrix's beside those of another.
fn orthonormal(columns: &DMatrix<f64>, beside: &DMatrix<f64>) -> DMatrix<f64> {
    let mut kept: Vec<DVector<f64>> = Vec::new();
    for column in columns.column_iter() {
        let whole = column.norm();
        let mut left = column.into_owned();
        // Twice is enough (Kahan and Parlett).
        for _ in 0..2 {
            left -= beside * beside.tr_mul(&left);
            for other in &kept {
                left -= other * other.dot(&left);
            }
        }
        if left.norm() > OWN * whole {
            kept.push(left.normalize());
        }
    }
    DMatrix::from_fn(columns.nrows(), kept.len(), |row, column| kept[column][row])
}

/// White noise and a first-order process.
#[derive(Debug, Clone, Copy)]
struct Process {
    /// σ².
    variance: f64,
    /// w.
    white: f64,
    /// a: what is kept from one row to the next.
    kept: f64,
    /// From one row to the next, s.
    step_s: f64,
}

impl Process {
    /// Of what is left at times, by recording.
    fn of(left: &[f64], times: &[(usize, f64)]) -> Option<Self> {
        let step_s = times.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| w[1].1 - w[0].1).reduce(f64::min)?;
        let covariance = |lag: usize| {
            let rows = (0..left.len().saturating_sub(lag)).filter(|k| times[*k].0 == times[k + lag].0);
            let (sum, count) = rows.fold((0.0, 0.0), |(sum, n), k| (sum + left[k] * left[k + lag], n + 1.0));
            (count > 0.0).then(|| sum / count)
        };
        let whole = covariance(0)?;
        let lags: Vec<f64> = (1..=LAGS).map(covariance).collect::<Option<_>>()?;
        let with = |kept: f64| {
            let powers: Vec<f64> = (1..=LAGS as i32).map(|lag| kept.powi(lag)).collect();
            let product: f64 = powers.iter().zip(&lags).map(|(p, c)| p * c).sum();
            let variance = (product / powers.iter().map(|p| p * p).sum::<f64>()).clamp(0.0, whole);
            let off: f64 = powers.iter().zip(&lags).map(|(p, c)| (c - variance * p).powi(2)).sum();
            (off, Self { variance, white: whole - variance, kept, step_s })
        };
        let ratio = ENDS.1 / ENDS.0;
        let times = (0..TIMES).map(|k| ENDS.0 * ratio.powf(k as f64 / (TIMES - 1) as f64));
        times.map(|time| with((-1.0 / time).exp())).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, process)| process)
    }

    /// A draw of it.
    fn draw(&self, times: &[(usize, f64)], random: &mut ChaCha8Rng) -> DVector<f64> {
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let mut state = 0.0;
        let mut before = None;
        let at = |(recording, _): &(usize, f64)| {
            let kept = if before == Some(*recording) { self.kept } else { 0.0 };
            before = Some(*recording);
            state = kept * state + (self.variance * (1.0 - kept * kept)).sqrt() * normal();
            state + self.white.sqrt() * normal()
        };
        DVector::from_iterator(times.len(), times.iter().map(at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(count: usize) -> Vec<(usize, f64)> {
        (0..count).map(|k| (0, 0.02 * k as f64)).collect()
    }

    /// A process of 0.1 s in rows 0.02 s apart keeps e^−0.2 = 0.819 from one to the next. Of 20,000 rows, 2,000
    /// independent pieces, the variance is known to 3 %.
    #[test]
    fn a_process_is_told_by_its_covariances() {
        let truth = Process { variance: 2.0, white: 0.5, kept: (-0.2f64).exp(), step_s: 0.02 };
        let times = rows(20_000);
        let drawn = truth.draw(&times, &mut ChaCha8Rng::seed_from_u64(3));
        let told = Process::of(drawn.as_slice(), &times).unwrap();
        assert!((told.variance / 2.0 - 1.0).abs() < 0.12, "{told:?}");
        assert!((-told.step_s / told.kept.ln() / 0.1 - 1.0).abs() < 0.25, "{told:?}");
    }

    /// A dictionary of k columns explains k/n of white noise on average, and all of what is made of it.
    #[test]
    fn a_share_is_that_of_a_regression() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let known = DMatrix::from_element(400, 1, 1.0);
        let mut others = DMatrix::from_fn(400, 8, |_, _| normal());
        // A column that is known already, and one twice.
        others.set_column(6, &DVector::from_element(400, 3.0));
        let again = others.column(0) * 2.0;
        others.set_column(7, &again);
        let split = Split::new(&known, &others);
        assert_eq!(split.others.ncols(), 6);
        let made = split.beside(&(others.column(1) * 5.0 - others.column(4)));
        assert!((split.share(&made) - 1.0).abs() < 1e-12);
        let mean = (0..200).map(|_| split.share(&split.beside(&DVector::from_fn(400, |_, _| normal())))).sum::<f64>();
        // k/n = 6/399, known to √(2 k)/n/√200 = 0.0006.
        assert!((mean / 200.0 - 6.0 / 399.0).abs() < 0.002, "{mean}");
    }
}
