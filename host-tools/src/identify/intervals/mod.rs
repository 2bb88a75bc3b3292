//! Intervals that survive autocorrelated residuals.
//!
//! The residuals of a free-run simulation are strongly correlated in time: a second of them holds far less information
//! than its ten thousand samples. The covariance of the estimate is therefore that of the delete-a-block jackknife over
//! B time blocks longer than the correlation, `V = (B − 1)/B Σ_b d_b d_bᵀ`, `d_b = (A − A_b)⁻¹ g_b`, `A = JᵀJ`, `A_b =
//! J_bᵀJ_b`, `g_b = J_bᵀ r_b`, where d_b is the change of the estimate when block b is left out, with Student's t
//! ([`Covariance::half_width_95`]). Unlike the plain sandwich estimate it does not trust blocks that determine a
//! parameter nearly by themselves, such as the only run-up of a recording.
//!
//! To this comes [`SYSTEMATIC`], which no repetition would show.
//!
//! Source: M. H. Quenouille 1956 and J. W. Tukey 1958 for the jackknife; A. C. Cameron, D. L. Miller: A practitioner's
//! guide to cluster-robust inference, Journal of Human Resources 50 (2015) 317–372, section VI, for blocks ("CR3").

pub(super) mod of_fit;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Blocks are this many integrated correlation times long: six time constants of noise of the first order, whose
/// variance they show to five sixths.
const CORRELATION_TIMES: f64 = 3.0;

/// No fewer blocks than this are made; with fewer, the blocks' own scatter is not known. More would be too short for
/// what the noise of a measured voltage does to a free run, which lasts for seconds: with 16 in 12 s of data, one
/// interval of J in ten misses it.
const FEWEST_BLOCKS: f64 = 12.0;

/// Nor fewer than this many times the parameters: without a block the others have to determine them all.
const BLOCKS_PER_PARAMETER: f64 = 1.5;

/// More blocks than this bring little (Student's t of 13 degrees of freedom is a tenth wider than of many), and would
/// be too short where the slow part of the residuals is hidden.
const MOST_BLOCKS: f64 = 16.0;

/// A correlation below this ends the sum.
const NEGLIGIBLE: f64 = 0.05;

/// Correlations of as many values as count are told from none at this many standard deviations, 1/√n.
const SIGNIFICANT: f64 = 2.0;

/// Means are taken over windows, each this many times as long as the one before …
const COARSER: usize = 4;

/// … as long as there are this many of them: with fewer, a chance correlation looks like a long one.
const FEWEST_MEANS: usize = 200;

/// Fewer degrees of freedom are not reckoned with: at 2, an interval is 2.2 times as wide as with many.
const FEWEST_DEGREES: f64 = 2.0;

/// Relative standard uncertainty of every parameter that comes from the computation itself. Between samples the host
/// takes the voltage as a cubic and the microcontroller as straight, which makes a sine of angular frequency ω too
/// small by (ωh)²/12 = 8.2e-5 at 50 Hz and 10 kHz.
pub const SYSTEMATIC: f64 = 1e-4;

/// Covariance of an estimate, in the optimiser's coordinates.
#[derive(Debug, Clone)]
pub struct Covariance {
    /// The matrix.
    pub matrix: DMatrix<f64>,
    /// Lengths of the Jacobian's columns.
    lengths: DVector<f64>,
    /// What each block tells, J_bᵀJ_b, and the inverse of their sum, for columns of length one.
    information: Vec<DMatrix<f64>>,
    inverse: DMatrix<f64>,
    /// Condition number of the Jacobian with columns of equal length.
    pub condition: f64,
}

impl Covariance {
    /// Degrees of freedom of the scatter that it comes from: blocks less parameters.
    pub fn freedom(&self) -> f64 {
        (self.information.len() as f64 - self.lengths.len() as f64).max(FEWEST_DEGREES)
    }

    /// Half the 95 % interval of a combination of the coordinates, `direction · θ`.
    ///
    /// The degrees of freedom are those of the blocks that determine it: with a_b the share of block b in the variance
    /// that white noise would make, there are effectively `(Σ a_b)²/Σ a_b²` of the B blocks. The moment of inertia,
    /// say, comes from the run-up alone.
    ///
    /// Source: A. V. Carter, K. T. Schnepel, D. G. Steigerwald: Asymptotic behavior of a t-test robust to cluster
    /// heterogeneity, Review of Economics and Statistics 99 (2017) 698–709.
    pub fn half_width_95(&self, direction: &DVector<f64>) -> f64 {
        let influence = &self.inverse * direction.component_div(&self.lengths);
        let (sum, squares) = self.information.iter().fold((0.0, 0.0), |(sum, squares), block| {
            let share = influence.dot(&(block * &influence));
            (sum + share, squares + share * share)
        });
        let blocks = self.information.len() as f64;
        let used = blocks - self.lengths.len() as f64;
        let freedom = (sum * sum / squares * used / blocks).clamp(FEWEST_DEGREES, used.max(FEWEST_DEGREES));
        let t95 = StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |t| t.inverse_cdf(0.975));
        t95 * direction.dot(&(&self.matrix * direction)).sqrt()
    }

    /// Half the 95 % interval of a coordinate.
    pub fn half_width_95_of(&self, coordinate: usize) -> f64 {
        let p = self.lengths.len();
        self.half_width_95(&DVector::from_fn(p, |k, _| if k == coordinate { 1.0 } else { 0.0 }))
    }
}

/// Integrated correlation time of a series, s: the time that one independent value is worth.
pub fn correlation_time_s(series: &[f64], interval_s: f64) -> f64 {
    integrated_correlation(series, NEGLIGIBLE) * interval_s
}

/// Integrated correlation time of the slowest part of a series, s.
///
/// White noise hides a slow part from the correlation of neighbours: turbulence of the load, which decides about the
/// mechanical parameters, may be a hundredth of the variance. Means over ever longer windows show it.
pub fn slowest_correlation_time_s(series: &[f64], interval_s: f64) -> f64 {
    let mut means = series.to_vec();
    let (mut window_s, mut slowest) = (interval_s, interval_s);
    loop {
        let significant = SIGNIFICANT / (means.len() as f64).sqrt();
        let correlation = integrated_correlation(&means, significant.max(NEGLIGIBLE));
        if correlation > 1.0 {
            slowest = slowest.max(correlation * window_s);
        }
        if means.len() / COARSER < FEWEST_MEANS {
            return slowest;
        }
        means = means.chunks_exact(COARSER).map(|window| window.iter().sum::<f64>() / COARSER as f64).collect();
        window_s *= COARSER as f64;
    }
}

/// Sum of the correlations of a series at all lags, in values, up to the first below a threshold; 1 of white noise.
fn integrated_correlation(series: &[f64], threshold: f64) -> f64 {
    let n = series.len();
    let mean = series.iter().sum::<f64>() / n.max(1) as f64;
    let variance: f64 = series.iter().map(|x| (x - mean).powi(2)).sum();
    if n < 8 || variance == 0.0 {
        return 1.0;
    }
    let mut sum = 1.0;
    // Lags are spread so that a long correlation is found in few steps; each stands for those up to the next.
    let (mut lag, mut last) = (1usize, 0usize);
    while lag < n / 4 {
        let covariance: f64 = (0..n - lag).map(|t| (series[t] - mean) * (series[t + lag] - mean)).sum();
        let rho = covariance / variance;
        if rho < threshold {
            break;
        }
        sum += 2.0 * rho * (lag - last) as f64;
        last = lag;
        lag += (lag / 4).max(1);
    }
    sum
}

/// Length of the blocks for a total duration, s, and a number of parameters.
pub fn block_length_s(correlation_s: f64, total_s: f64, parameters: usize) -> f64 {
    let fewest = FEWEST_BLOCKS.max(BLOCKS_PER_PARAMETER * parameters as f64);
    (CORRELATION_TIMES * correlation_s).clamp(total_s / MOST_BLOCKS.max(fewest), total_s / fewest)
}

/// Covariance from the Jacobian, the residuals and the block of each row. `None` where a direction is not determined at
/// all or where there are too few blocks.
pub fn covariance(jacobian: &DMatrix<f64>, residuals: &DVector<f64>, blocks: &[usize]) -> Option<Covariance> {
    let p = jacobian.ncols();
    let count = blocks.iter().max().map_or(0, |b| b + 1);
    if p == 0 || count < p + 3 {
        return None;
    }
    let lengths: Vec<f64> = jacobian.column_iter().map(|c| c.norm()).collect();
    if lengths.iter().any(|l| *l == 0.0 || !l.is_finite()) {
        return None;
    }
    let mut gradients = vec![DVector::<f64>::zeros(p); count];
    let mut normals = vec![DMatrix::<f64>::zeros(p, p); count];
    for (row, block) in blocks.iter().enumerate() {
        for k in 0..p {
            let x = jacobian[(row, k)] / lengths[k];
            gradients[*block][k] += x * residuals[row];
            for j in 0..=k {
                normals[*block][(k, j)] += x * jacobian[(row, j)] / lengths[j];
            }
        }
    }
    for normal in &mut normals {
        normal.fill_upper_triangle_with_lower_triangle();
    }
    let normal = normals.iter().fold(DMatrix::zeros(p, p), |sum, n| sum + n);
    let eigenvalues = normal.clone().symmetric_eigenvalues();
    let condition = (eigenvalues.max() / eigenvalues.min().max(1e-300)).sqrt();
    let mut scatter = DMatrix::<f64>::zeros(p, p);
    for (block, gradient) in normals.iter().zip(&gradients) {
        let change = (&normal - block).cholesky()?.solve(gradient);
        scatter += &change * change.transpose();
    }
    scatter *= (count - 1) as f64 / count as f64;
    let matrix = DMatrix::from_fn(p, p, |r, c| scatter[(r, c)] / (lengths[r] * lengths[c]));
    let inverse = normal.cholesky()?.inverse();
    let lengths = DVector::from_vec(lengths);
    let finite = matrix.iter().all(|x| x.is_finite());
    finite.then_some(Covariance { matrix, lengths, information: normals, inverse, condition })
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Noise of the first order, with this correlation of neighbours and a variance of one.
    fn noise(correlation: f64, values: usize, seed: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut last = 0.0;
        let mut next = || {
            let z: f64 = StandardNormal.sample(&mut random);
            last = correlation * last + (1.0 - correlation * correlation).sqrt() * z;
            last
        };
        (0..values).map(|_| next()).collect()
    }

    /// The mean of four values is the simplest estimate there is: the jackknife's variance is s²/n, and the interval
    /// that of Student's t, 3.182 for three degrees of freedom in any table.
    #[test]
    fn the_interval_of_a_mean_is_that_of_the_textbook() {
        let residuals = DVector::from_vec(vec![-3.0, -1.0, 1.0, 3.0]);
        let c = covariance(&DMatrix::from_element(4, 1, 1.0), &residuals, &[0, 1, 2, 3]).unwrap();
        let variance = 20.0 / 3.0 / 4.0;
        assert!((c.matrix[(0, 0)] - variance).abs() < 1e-12, "{}", c.matrix);
        assert!((c.condition - 1.0).abs() < 1e-12);
        // The table has four digits.
        assert!((c.half_width_95_of(0) / variance.sqrt() - 3.182).abs() < 5e-4, "{}", c.half_width_95_of(0));
        // A unit that is half as large makes the number twice as large.
        let halved = covariance(&DMatrix::from_element(4, 1, 0.5), &residuals, &[0, 1, 2, 3]).unwrap();
        assert!((halved.half_width_95_of(0) / c.half_width_95_of(0) - 2.0).abs() < 1e-12);
    }

    /// Two means, each told by rows of its own: they are independent, and a sum of both has the sum of the variances.
    #[test]
    fn combinations_have_the_covariance_of_both() {
        let blocks: Vec<usize> = (0..6).flat_map(|b| [b, b]).collect();
        let jacobian = DMatrix::from_fn(12, 2, |row, column| f64::from(row % 2 == column));
        let residuals = DVector::from_fn(12, |row, _| [1.0, -1.0][row / 2 % 2] * [1.0, 2.0][row % 2]);
        let c = covariance(&jacobian, &residuals, &blocks).unwrap();
        // Σr²/(n (n − 1)) = 6/30 and 24/30; both go the same way in each block, so that the covariance is 12/30.
        let expected = DMatrix::from_row_slice(2, 2, &[0.2, 0.4, 0.4, 0.8]);
        assert!((&c.matrix - expected).abs().max() < 1e-12, "{}", c.matrix);
        let both = c.half_width_95(&DVector::from_vec(vec![1.0, 1.0]));
        // √1.8 times Student's t of 6 − 2 degrees of freedom, 2.776.
        assert!((both / 1.8f64.sqrt() - 2.776).abs() < 5e-4, "{both}");
    }

    #[test]
    fn what_is_not_determined_has_no_interval() {
        let residuals = DVector::from_element(8, 1.0);
        let blocks: Vec<usize> = (0..8).collect();
        assert!(covariance(&DMatrix::zeros(8, 1), &residuals, &blocks).is_none(), "no row depends on it");
        let once = DMatrix::from_fn(8, 1, |row, _| f64::from(row == 3));
        assert!(covariance(&once, &residuals, &blocks).is_none(), "without its only block nothing tells it");
        let ones = DMatrix::from_element(3, 1, 1.0);
        assert!(covariance(&ones, &DVector::from_element(3, 1.0), &[0, 1, 2]).is_none(), "too few blocks");
    }

    /// Theory: (1 + ρ)/(1 − ρ) values. The sum ends at a correlation of 0.05 and takes wide steps, and loses up to a
    /// tenth by that; 100,000 values, worth 2,500 of the slowest, leave some 4 % (0.87 to 1.02 in twelve other draws).
    #[test]
    fn correlation_times_are_those_of_noise_of_the_first_order() {
        for (correlation, expected) in [(0.0, 1.0), (0.5, 3.0), (0.8, 9.0), (0.95, 39.0)] {
            let time = correlation_time_s(&noise(correlation, 100_000, 7), 1e-3) / 1e-3;
            assert!((0.8..1.1).contains(&(time / expected)), "{correlation}: {time} against {expected}");
        }
        assert_eq!(correlation_time_s(&[2.0; 100], 0.1), 0.1, "a constant tells nothing of time");
        assert_eq!(correlation_time_s(&[1.0, -1.0, 1.0], 0.1), 0.1);
    }

    /// A slow part of a hundredth of the variance, beside white noise: its correlation lasts for twice its time
    /// constant.
    #[test]
    fn white_noise_does_not_hide_what_is_slow() {
        let (n, interval_s, time_constant_s) = (200_000, 1e-3, 0.5);
        let slow = noise(f64::exp(-interval_s / time_constant_s), n, 1);
        let sum: Vec<f64> = noise(0.0, n, 2).iter().zip(&slow).map(|(white, slow)| white + 0.1 * slow).collect();
        assert_eq!(correlation_time_s(&sum, interval_s), interval_s, "neighbours hardly correlate");
        let slowest = slowest_correlation_time_s(&sum, interval_s);
        // 200 s hold some 200 independent values of the slow part: a tenth to either side, and what is left of the
        // white noise.
        assert!((0.4..1.4).contains(&slowest), "{slowest} s");
        assert_eq!(slowest_correlation_time_s(&noise(0.0, n, 3), interval_s), interval_s);
    }

    /// Three correlation times, but 12 to 16 blocks, and one and a half blocks a parameter.
    #[test]
    fn blocks_are_as_long_as_the_correlation_asks() {
        for (correlation, parameters, blocks) in
            [(0.0, 2, 16.0), (0.3, 2, 12.0 / 0.9), (10.0, 2, 12.0), (10.0, 10, 15.0), (0.0, 20, 30.0), (10.0, 20, 30.0)]
        {
            let length = block_length_s(correlation, 12.0, parameters);
            assert!((12.0 / length - blocks).abs() < 1e-9, "{correlation} {parameters}: {length} s");
        }
    }
}
