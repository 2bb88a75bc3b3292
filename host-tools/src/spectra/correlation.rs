//! Correlation of a residual with its own past and with the input, with the bounds within which it is none.
//!
//! With residual e and input u, both without their means, over N samples,
//! ```text
//! ρ_e(k) = Σ e(n) e(n − k) / Σ e²                      |ρ_e| < 2.58 / √N            were e white
//! ρ_eu(k) = Σ e(n) u(n − k) / √(Σ e² Σ u²)            |ρ_eu| < 2.58 √(P / N)       were e independent of u
//! P = Σ_k ρ_e(k) ρ_u(k)
//! ```
//! with a probability of 99 % at each lag. A residual of a free run need not be white: what the model does not know of
//! the load is not. What goes with the input is what the model lacks. An input that repeats for ever, as the mains do,
//! goes with a residual of its frequency at any phase: P is then large, and the bound wide.
//!
//! L. Ljung, System Identification, 2nd edition 1999, section 16.6.

/// Normal quantile of 99 %, both sides.
const QUANTILE: f64 = 2.575_829_3;
/// Samples below which nothing is told.
const FEWEST: usize = 100;

/// A correlation at equal lags.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlation {
    /// First lag, in samples: positive, where the residual comes later.
    pub first: i32,
    /// At this lag and those that follow.
    pub values: Vec<f64>,
    /// The magnitude that it exceeds by chance at one lag in a hundred.
    pub bound: f64,
}

/// A signal at a rate at which a low-pass with this cut-off leaves white noise white: half the power at the cut-off
/// folds onto itself, and so does what is as far above it as below. The samples, and the interval between them, s.
pub fn at_the_cutoff(values: &[f32], interval_s: f64, cutoff_hz: f64) -> (Vec<f64>, f64) {
    let each = ((0.5 / cutoff_hz) / interval_s).round().max(1.0) as usize;
    (values.iter().step_by(each).map(|x| f64::from(*x)).collect(), each as f64 * interval_s)
}

/// Without its mean; zero, where there is none, adds nothing to any sum.
fn centred(values: &[f64]) -> (Vec<f64>, usize) {
    let finite = || values.iter().filter(|x| x.is_finite());
    let count = finite().count();
    let mean = finite().sum::<f64>() / count.max(1) as f64;
    (values.iter().map(|x| if x.is_finite() { x - mean } else { 0.0 }).collect(), count)
}

/// Σ a(n) b(n − k).
fn product(a: &[f64], b: &[f64], lag: i32) -> f64 {
    let by = lag.unsigned_abs() as usize;
    let (a, b) = if lag >= 0 { (a.get(by..), Some(b)) } else { (Some(a), b.get(by..)) };
    a.unwrap_or_default().iter().zip(b.unwrap_or_default()).map(|(a, b)| a * b).sum()
}

/// The correlation of a residual with its own past, from lag 0 to `most`. None: it is zero, or too short.
pub fn of_residual(residual: &[f64], most: i32) -> Option<Correlation> {
    let (e, count) = centred(residual);
    let power = product(&e, &e, 0);
    if count < FEWEST || power <= 0.0 {
        return None;
    }
    let values = (0..=most).map(|lag| product(&e, &e, lag) / power).collect();
    Some(Correlation { first: 0, values, bound: QUANTILE / (count as f64).sqrt() })
}

/// The correlation of a residual with an input, from lag −`most` to `most`. None: one of them is zero, or too short.
pub fn with_input(residual: &[f64], input: &[f64], most: i32) -> Option<Correlation> {
    let ((e, count), (u, _)) = (centred(residual), centred(input));
    let [of_e, of_u] = [product(&e, &e, 0), product(&u, &u, 0)];
    if count < FEWEST || of_e <= 0.0 || of_u <= 0.0 {
        return None;
    }
    // Further lags than are shown: what lasts longer widens the bound, too.
    let furthest = (4 * most).min(i32::try_from(count / 4).unwrap_or(most));
    let both = |lag: i32| product(&e, &e, lag) / of_e * product(&u, &u, lag) / of_u;
    let sum = 1.0 + 2.0 * (1..=furthest).map(both).sum::<f64>();
    let scale = (of_e * of_u).sqrt();
    let values = (-most..=most).map(|lag| product(&e, &u, lag) / scale).collect();
    Some(Correlation { first: -most, values, bound: QUANTILE * (sum.max(0.0) / count as f64).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(count: usize, seed: u64) -> Vec<f64> {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..count).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    #[test]
    fn white_noise_stays_within_its_bounds() {
        let (e, u) = (noise(20_000, 1), noise(20_000, 2));
        let own = of_residual(&e, 100).unwrap();
        assert!((own.values[0] - 1.0).abs() < 1e-12);
        // 1 % of the lags: of a hundred, four or more are outside with a probability of 2 %.
        let outside = |c: &Correlation, skip: usize| c.values.iter().skip(skip).filter(|x| x.abs() > c.bound).count();
        assert!(outside(&own, 1) < 4, "{}", outside(&own, 1));
        let cross = with_input(&e, &u, 50).unwrap();
        assert!(outside(&cross, 0) < 4, "{}", outside(&cross, 0));
        assert!((own.bound - 2.5758 / 20_000f64.sqrt()).abs() < 1e-6);
    }

    #[test]
    fn what_is_a_filtered_input_is_seen_at_its_lag() {
        let u = noise(20_000, 3);
        let mut e = noise(20_000, 4);
        for n in 5..e.len() {
            e[n] += u[n - 5];
        }
        let c = with_input(&e, &u, 20).unwrap();
        let at = |lag: i32| c.values[(lag - c.first) as usize];
        // Half of the variance of e is u: 1/√2, to within three standard errors of 1/√N.
        assert!((at(5) - 0.5f64.sqrt()).abs() < 0.021, "{}", at(5));
        assert!(at(5) > 20.0 * c.bound && at(-5).abs() < c.bound && at(4).abs() < c.bound);
    }

    #[test]
    fn a_coloured_residual_widens_the_bound_of_a_coloured_input() {
        let smooth = |x: Vec<f64>| -> Vec<f64> {
            let mut state = 0.0;
            x.into_iter()
                .map(|x| {
                    state += 0.1 * (x - state);
                    state
                })
                .collect()
        };
        let (e, u) = (smooth(noise(20_000, 5)), smooth(noise(20_000, 6)));
        let c = with_input(&e, &u, 50).unwrap();
        // ρ(k) = 0.9^|k| of both: P = (1 + 0.81)/(1 − 0.81) = 9.53, known from so many samples to a tenth.
        let p = (c.bound / QUANTILE).powi(2) * 20_000.0;
        assert!((p / 9.53 - 1.0).abs() < 0.2, "{p}");
    }

    #[test]
    fn gaps_and_silence_are_borne() {
        let mut e = noise(2000, 7);
        e[100..200].fill(f64::NAN);
        assert!(of_residual(&e, 10).unwrap().values.iter().all(|x| x.is_finite()));
        assert_eq!(of_residual(&[0.0; 1000], 10), None);
        assert_eq!(of_residual(&e[..50], 10), None);
        assert_eq!(with_input(&e, &[1.0; 2000], 10), None);
        let (at, step) = at_the_cutoff(&[1.0; 1000], 1e-4, 250.0);
        assert_eq!((at.len(), step), (50, 2e-3));
    }
}
