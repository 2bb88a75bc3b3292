//! What the free run of a fitted model leaves, sample by sample: its standard deviation by what the motor does, and how
//! often it is exceeded.
//!
//! The residual measured − modelled, before any filter, holds the noise of the measuring chain, fluctuations of the
//! load and of the supply, and what the model lacks. It is larger where more happens. Its variance is a sum of squares,
//! each with a factor that is not negative:
//!
//! `σ² = a₀ + a₁ î² + a₂ ω̂² + a₃ (dî/dt)² + a₄ (dω̂/dt)²`
//!
//! The factors are those of the largest likelihood `−½ Σ (ln σ² + r²/σ²)`, found by multiplications that raise it and
//! keep every factor positive. Neither the residual's distribution nor its independence is believed: what share of the
//! samples lies within how many σ is counted.
//!
//! Source: C. Févotte, N. Bertin, J.-L. Durrieu: Nonnegative matrix factorization with the Itakura-Saito divergence,
//! Neural Computation 21 (2009) 793–830, for the multiplications; J. Lei, M. G'Sell, A. Rinaldo, R. Tibshirani, L.
//! Wasserman: Distribution-free predictive inference for regression, JASA 113 (2018) 1094–1111, section 5.2, for bands
//! that are scaled before they are counted.

use statrs::distribution::{ContinuousCDF, Normal};

use crate::model::Scatter;

/// Parts of the variance.
const PARTS: usize = 5;
/// Samples that tell it: neighbours tell nearly the same, and more would only take time.
const MOST_SAMPLES: usize = 20_000;
/// Multiplications. Further ones move no σ by a hundredth.
const STEPS: usize = 200;
/// Shares of the samples at which it is counted how many σ hold them.
const SHARES: [f64; 9] = [0.5, 0.682_689, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.999];

/// What the motor does at a sample, as the model has it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Doing {
    /// î, A.
    pub current: f64,
    /// ω̂, rad/s.
    pub speed: f64,
    /// dî/dt, A/s.
    pub current_rate: f64,
    /// dω̂/dt, rad/s².
    pub speed_rate: f64,
}

impl Doing {
    /// All samples of a run, sampled every so many seconds.
    pub fn of(current: &[f64], speed: &[f64], interval_s: f64) -> Vec<Self> {
        let rate = |signal: &[f64], n: usize| match n {
            0 => 0.0,
            _ => (signal[n] - signal[n - 1]) / interval_s,
        };
        (0..current.len())
            .map(|n| Self {
                current: current[n],
                speed: speed[n],
                current_rate: rate(current, n),
                speed_rate: rate(speed, n),
            })
            .collect()
    }

    fn squares(&self) -> [f64; PARTS] {
        [1.0, self.current, self.speed, self.current_rate, self.speed_rate].map(|x| x * x)
    }
}

/// Square of a residual, and those of what the motor does.
type Squares = (f64, [f64; PARTS]);

impl Scatter {
    /// Of residuals, in the signal's unit, and what the motor does meanwhile. `None` without any.
    pub fn of(residuals: &[(f64, Doing)]) -> Option<Self> {
        let every = residuals.len().div_ceil(MOST_SAMPLES).max(1);
        let samples: Vec<Squares> =
            residuals.iter().step_by(every).map(|(r, doing)| (r * r, doing.squares())).collect();
        if samples.is_empty() {
            return None;
        }
        let count = samples.len() as f64;
        let mean = |of: &dyn Fn(&Squares) -> f64| samples.iter().map(of).sum::<f64>() / count;
        let usual = mean(&|(square, _)| *square);
        let sizes: [f64; PARTS] = std::array::from_fn(|k| mean(&|(_, parts)| parts[k]));
        let scaled = |parts: &[f64; PARTS], k: usize| if sizes[k] > 0.0 { parts[k] / sizes[k] } else { 0.0 };
        let mut factors = [usual / PARTS as f64; PARTS];
        for _ in 0..if usual > 0.0 { STEPS } else { 0 } {
            let (mut above, mut below) = ([0.0; PARTS], [0.0; PARTS]);
            for (square, parts) in &samples {
                let variance: f64 = (0..PARTS).map(|k| factors[k] * scaled(parts, k)).sum();
                for k in 0..PARTS {
                    above[k] += scaled(parts, k) * square / (variance * variance);
                    below[k] += scaled(parts, k) / variance;
                }
            }
            for k in 0..PARTS {
                factors[k] *= if below[k] > 0.0 { (above[k] / below[k]).sqrt() } else { 0.0 };
            }
        }
        let deviation = |k: usize| if sizes[k] > 0.0 { (factors[k] / sizes[k]).sqrt() } else { 0.0 };
        let mut scatter = Self {
            floor: deviation(0),
            of_current: deviation(1),
            of_speed: deviation(2),
            of_current_rate: deviation(3),
            of_speed_rate: deviation(4),
            within: Vec::new(),
        };
        let mut times: Vec<f64> = residuals
            .iter()
            .step_by(every)
            .map(|(r, doing)| if *r == 0.0 { 0.0 } else { (r.abs() / scatter.deviation(doing)).min(f64::MAX) })
            .collect();
        times.sort_by(f64::total_cmp);
        let at = |share: f64| times[((share * count).ceil() as usize).clamp(1, times.len()) - 1];
        scatter.within = SHARES.map(|share| [share, at(share)]).to_vec();
        Some(scatter)
    }

    /// σ at a sample, in the signal's unit.
    pub fn deviation(&self, doing: &Doing) -> f64 {
        let factors = [self.floor, self.of_current, self.of_speed, self.of_current_rate, self.of_speed_rate];
        doing.squares().iter().zip(factors).map(|(square, factor)| square * factor * factor).sum::<f64>().sqrt()
    }

    /// How many σ hold a share of the samples: between the shares that were counted along the normal distribution,
    /// beyond the last one as many times more as there.
    pub fn times(&self, share: f64) -> f64 {
        let normal = |share: f64| Normal::standard().inverse_cdf(0.5 + 0.5 * share);
        let Some(after) = self.within.iter().position(|[counted, _]| *counted >= share) else {
            return self.within.last().map_or(0.0, |[counted, times]| times * normal(share) / normal(*counted));
        };
        let [to, high] = self.within[after];
        let [from, low] = after.checked_sub(1).map_or([0.0; 2], |before| self.within[before]);
        low + (high - low) * (normal(share) - normal(from)) / (normal(to) - normal(from))
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    fn residuals(law: &Scatter, samples: usize) -> Vec<(f64, Doing)> {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let current: Vec<f64> = (0..samples).map(|n| 10.0 * (n as f64 * 0.0314).sin()).collect();
        let speed: Vec<f64> = (0..samples).map(|n| 200.0 * (n as f64 / samples as f64)).collect();
        let doing = Doing::of(&current, &speed, 1e-4);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        doing.into_iter().map(|doing| (normal() * law.deviation(&doing), doing)).collect()
    }

    /// Normal noise of a known law: 20,000 samples tell a deviation to a hundredth where it is the larger part.
    #[test]
    fn the_law_is_found_from_its_residuals() {
        let law = Scatter { floor: 0.02, of_current: 0.01, ..Scatter::default() };
        let residuals = residuals(&law, 20_000);
        let found = Scatter::of(&residuals).unwrap();
        // Along a sine, where the square of its rate is a constant less its own: how a constant is shared among the two
        // is open, and does not matter.
        for (_, at) in residuals.iter().skip(1).step_by(37) {
            let ratio = found.deviation(at) / law.deviation(at);
            assert!((0.93..1.07).contains(&ratio), "{at:?}: {ratio}, {found:?}");
        }
        // Of the normal distribution: 0.6745, 1.6449 and 2.5758 hold 50, 90 and 99 %.
        for (share, times) in [(0.5, 0.6745), (0.9, 1.6449), (0.99, 2.5758)] {
            assert!((found.times(share) / times - 1.0).abs() < 0.04, "{share}: {}", found.times(share));
        }
    }

    #[test]
    fn between_and_beyond_what_was_counted_it_goes_on_as_the_normal_distribution() {
        let within = [(0.5, 0.674_490), (0.95, 1.959_964), (0.99, 2.575_829)];
        let normal = Scatter { within: within.map(|(share, times)| [share, times]).to_vec(), ..Scatter::default() };
        for (share, times) in [(0.25, 0.318_639), (0.8, 1.281_552), (0.99, 2.575_829), (0.999, 3.290_527)] {
            assert!((normal.times(share) - times).abs() < 1e-5, "{share}: {}", normal.times(share));
        }
        assert!(Scatter::of(&[]).is_none());
        // A recording without any noise leaves nothing, and has a band without a width.
        let silent = Scatter::of(&[(0.0, Doing { current: 1.0, ..Doing::default() }); 9]).unwrap();
        assert_eq!(silent.deviation(&Doing { current: 2.0, ..Doing::default() }), 0.0);
        assert_eq!(silent.times(0.95), 0.0);
    }
}
