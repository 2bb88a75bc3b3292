//! What is in a signal at each frequency, and at each order of the rotor; and what a model's residual still has to do
//! with its own past and with the input.

pub mod correlation;
mod orders;

use std::f64::consts::TAU;

use realfft::RealFftPlanner;

pub use orders::at_angles;

/// Parts that are averaged at least: the standard deviation of a density is then a third of it (Welch 1967, half
/// overlapping parts: 8 of them count as some 7 independent ones).
const FEWEST_PARTS: usize = 8;
/// Shortest and longest part, as powers of two: 64 samples, and 8192, whose lines are as many as
/// a large screen has columns.
const PARTS: (u32, u32) = (6, 13);

/// Power spectral density, one-sided.
#[derive(Debug, Clone, PartialEq)]
pub struct Density {
    /// From one value to the next: Hz, or orders.
    pub step: f64,
    /// Density at 0, step, 2 step …: squares of the signal's unit per Hz, or per order.
    pub power: Vec<f64>,
    /// Parts that were averaged.
    pub parts: usize,
}

/// The density of a signal by Welch's method: of half overlapping parts, each without its mean and under a Hann window
/// ```text
/// S(f) = 2 |Σ w x e^(−2πi f n/rate)|² / (rate Σ w²),    averaged over the parts
/// ```
/// `rate` is in samples a second, or a turn. Parts with a NaN are left out. None: too few parts are left.
///
/// P. D. Welch, IEEE Transactions on Audio and Electroacoustics 15 (1967), 70–73.
pub fn density(values: &[f32], rate: f64) -> Option<Density> {
    let longest = 2 * values.len() / (FEWEST_PARTS + 1);
    let length = 1usize << longest.checked_ilog2()?.min(PARTS.1);
    if length < 1 << PARTS.0 {
        return None;
    }
    let window: Vec<f64> = (0..length).map(|n| 0.5 - 0.5 * (TAU * n as f64 / length as f64).cos()).collect();
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let (mut input, mut output) = (fft.make_input_vec(), fft.make_output_vec());
    let (mut power, mut parts) = (vec![0.0; length / 2 + 1], 0usize);
    for from in (0..=values.len() - length).step_by(length / 2) {
        let part = &values[from..from + length];
        if part.iter().any(|x| !x.is_finite()) {
            continue;
        }
        let mean = part.iter().map(|x| f64::from(*x)).sum::<f64>() / length as f64;
        for ((input, x), w) in input.iter_mut().zip(part).zip(&window) {
            *input = (f64::from(*x) - mean) * w;
        }
        fft.process(&mut input, &mut output).ok()?;
        for (sum, x) in power.iter_mut().zip(&output) {
            *sum += x.norm_sqr();
        }
        parts += 1;
    }
    if parts < FEWEST_PARTS / 2 {
        return None;
    }
    let scale = 2.0 / (rate * window.iter().map(|w| w * w).sum::<f64>() * parts as f64);
    for p in &mut power {
        *p *= scale;
    }
    // Nothing stands opposite of the mean and of half the rate.
    power[0] /= 2.0;
    power[length / 2] /= 2.0;
    Some(Density { step: rate / length as f64, power, parts })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(count: usize) -> Vec<f32> {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        (0..count).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    fn total(d: &Density) -> f64 {
        d.power.iter().sum::<f64>() * d.step
    }

    #[test]
    fn the_area_is_the_variance() {
        let rate = 1000.0;
        let wave: Vec<f32> = (0..40_000).map(|n| (3.0 * (TAU * 125.0 * n as f64 / rate).sin()) as f32).collect();
        let d = density(&wave, rate).unwrap();
        // Half the square of the amplitude; Parseval's theorem holds to rounding for a whole number of periods.
        assert!((total(&d) - 4.5).abs() < 1e-4, "{}", total(&d));
        let peak = (0..d.power.len()).max_by(|a, b| d.power[*a].total_cmp(&d.power[*b])).unwrap();
        assert!((peak as f64 * d.step - 125.0).abs() <= d.step, "{}", peak as f64 * d.step);

        let d = density(&noise(200_000), rate).unwrap();
        // With a standard error of √(2/200,000), 0.3 %.
        assert!((total(&d) - 1.0).abs() < 0.012, "{}", total(&d));
        let flat = 2.0 / rate;
        let quarter = |k: usize| {
            let n = d.power.len() / 4;
            d.power[k * n..(k + 1) * n].iter().sum::<f64>() / n as f64
        };
        // 50,000 samples tell each quarter: 4 % is nine standard deviations.
        assert!((0..4).all(|k| (quarter(k) / flat - 1.0).abs() < 0.04), "white noise is white");
    }

    #[test]
    fn gaps_are_left_out_and_little_is_refused() {
        let mut wave: Vec<f32> = (0..40_000).map(|n| (TAU * 0.125 * f64::from(n)).sin() as f32).collect();
        let whole = density(&wave, 1.0).unwrap();
        wave[7000] = f32::NAN;
        let part = density(&wave, 1.0).unwrap();
        assert!(part.parts < whole.parts && (total(&part) - 0.5).abs() < 1e-4);
        assert_eq!(density(&wave[..200], 1.0), None);
        assert_eq!(density(&[f32::NAN; 10_000], 1.0), None);
        assert_eq!(density(&[], 1.0), None);
    }
}
