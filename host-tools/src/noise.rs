//! White noise of a measured signal.

use std::f64::consts::TAU;

use realfft::RealFftPlanner;

/// The top of the band, as fractions of the sampling rate, in which the spectrum is taken for noise.
pub const TOP_OF_BAND: (f64, f64) = (0.25, 0.40);

/// Standard deviation of white noise per sample, from the top of the spectrum (median over frequencies, so that single
/// lines do not count). Pieces of the signal in which something jumps do not count either. `None` when there is too
/// little data.
pub fn white_noise(signal: &[f64]) -> Option<f64> {
    const LENGTH: usize = 1024;
    /// Fewest pieces.
    const FEWEST: usize = 4;
    /// Power of a piece, in that of the median one, above which it holds more than noise, which scatters by a tenth.
    const LOUD: f64 = 4.0;
    let mut planner = RealFftPlanner::<f64>::new();
    let fft = planner.plan_fft_forward(LENGTH);
    let window: Vec<f64> = (0..LENGTH).map(|k| 0.5 - 0.5 * (TAU * k as f64 / LENGTH as f64).cos()).collect();
    let energy: f64 = window.iter().map(|w| w * w).sum();
    let bins = (TOP_OF_BAND.0 * LENGTH as f64) as usize..(TOP_OF_BAND.1 * LENGTH as f64) as usize;
    let mut pieces: Vec<Vec<f64>> = Vec::new();
    for piece in signal.chunks_exact(LENGTH) {
        let mean = piece.iter().sum::<f64>() / LENGTH as f64;
        let mut input: Vec<f64> = piece.iter().zip(&window).map(|(x, w)| (x - mean) * w).collect();
        let mut output = fft.make_output_vec();
        fft.process(&mut input, &mut output).ok()?;
        pieces.push(bins.clone().map(|k| output[k].norm_sqr() / energy).collect());
    }
    if pieces.len() < FEWEST {
        return None;
    }
    let power = |piece: &[f64]| piece.iter().sum::<f64>();
    let usual = median(pieces.iter().map(|p| power(p)).collect());
    pieces.retain(|p| power(p) <= LOUD * usual);
    let mean = |k: usize| pieces.iter().map(|p| p[k]).sum::<f64>() / pieces.len() as f64;
    Some(median((0..bins.len()).map(mean).collect()).sqrt())
}

/// The middle one, or 0 without any.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// Standard deviation of white noise per sample, from fourth differences (median, so that edges do not count): a signal
/// that is smooth over five samples has none.
pub fn of_differences(signal: &[f64]) -> f64 {
    const MIDDLE: [(f64, f64); 1] = [(0.5, 0.674_490)];
    of_quantiles(signal, &MIDDLE)
}

/// The same of a signal that moves most of the time, as a voltage that steps every few samples: from where it is
/// calmest, by the least of four quantiles of the differences. Noise alone has the same at each of them, but for
/// chance, which makes the least of them smaller by an eighth where there are a few hundred samples.
pub fn of_calm_differences(signal: &[f64]) -> f64 {
    const QUANTILES: [(f64, f64); 4] = [(0.05, 0.062_707), (0.1, 0.125_661), (0.25, 0.318_639), (0.5, 0.674_490)];
    of_quantiles(signal, &QUANTILES)
}

/// The least that quantiles of the fourth differences tell, each with that of the magnitude of a standard Gaussian
/// variable.
fn of_quantiles(signal: &[f64], quantiles: &[(f64, f64)]) -> f64 {
    /// Of the squares of the coefficients 1, −4, 6, −4, 1.
    const SQUARES: f64 = 70.0;
    let fourth = |w: &[f64]| (w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]).abs();
    let mut differences: Vec<f64> = signal.windows(5).map(fourth).collect();
    if differences.is_empty() {
        return 0.0;
    }
    let mut at = |share: f64| {
        let place = (share * differences.len() as f64) as usize;
        *differences.select_nth_unstable_by(place, f64::total_cmp).1
    };
    quantiles.iter().map(|(share, gaussian)| at(*share) / (gaussian * SQUARES.sqrt())).fold(f64::INFINITY, f64::min)
}

/// Amplitude density of a signal's noise in a band, Hz, per √Hz of the sampling rate: square root of the median, over
/// windows in which all samples are `usable`, of the mean power in the band. What repeats with the mains is taken off
/// by the mean of a period before and one after. `None` when there are too few windows.
///
/// A window lasts as long at any rate: a course that bends within it leaks over two lines of its spectrum, 40 Hz.
pub fn density(
    signal: &[f64],
    interval_s: f64,
    mains_period_s: Option<f64>,
    band_hz: (f64, f64),
    usable: &dyn Fn(usize) -> bool,
) -> Option<f64> {
    const WINDOW_S: f64 = 0.0512;
    const FEWEST: usize = 8;
    let length = (WINDOW_S / interval_s).round() as usize;
    let period = mains_period_s.map_or(0, |t| (t / interval_s).round() as usize);
    let mut planner = RealFftPlanner::<f64>::new();
    let fft = planner.plan_fft_forward(length);
    let window: Vec<f64> = (0..length).map(|k| 0.5 - 0.5 * (TAU * k as f64 / length as f64).cos()).collect();
    let energy: f64 = window.iter().map(|w| w * w).sum();
    let bin = |hz: f64| (hz * interval_s * length as f64) as usize;
    let bins = bin(band_hz.0)..bin(band_hz.1);
    let mut powers = Vec::new();
    let mut from = period;
    while from + length + period <= signal.len() {
        if (from..from + length).all(usable) {
            let at = |n: usize| {
                // The mean of two periods adds half the noise's power to that of the sample.
                if period == 0 {
                    signal[n]
                } else {
                    (signal[n] - 0.5 * (signal[n - period] + signal[n + period])) / 1.5f64.sqrt()
                }
            };
            let mean = (from..from + length).map(at).sum::<f64>() / length as f64;
            let mut input: Vec<f64> = (0..length).map(|k| (at(from + k) - mean) * window[k]).collect();
            let mut output = fft.make_output_vec();
            fft.process(&mut input, &mut output).ok()?;
            powers.push(output[bins.clone()].iter().map(|x| x.norm_sqr()).sum::<f64>() / energy / bins.len() as f64);
        }
        from += length;
    }
    if powers.len() < FEWEST {
        return None;
    }
    powers.sort_by(f64::total_cmp);
    Some(powers[powers.len() / 2].sqrt())
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// White noise of unit variance.
    fn noise(values: usize, seed: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        (0..values).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    fn sine(values: usize, amplitude: f64, per_sample: f64) -> Vec<f64> {
        (0..values).map(|k| amplitude * (TAU * per_sample * k as f64).sin()).collect()
    }

    fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
        a.iter().zip(b).map(|(a, b)| a + b).collect()
    }

    /// numpy.convolve with 1, −4, 6, −4, 1 makes eight differences, of which 11.3 is the fifth and 1.1 the first; the
    /// quantiles of the normal distribution are scipy's.
    #[test]
    fn fourth_differences_tell_noise_by_their_quantiles() {
        let signal = [0.0, 1.0, -0.5, 2.0, 0.3, -1.1, 0.7, 1.9, -0.2, 0.4, -1.6, 0.8];
        assert!((of_differences(&signal) - 2.002_414_904).abs() < 1e-5);
        assert!((of_calm_differences(&signal) - 1.046_265_620).abs() < 1e-5);
        let cubic: Vec<f64> = (0..20).map(|k| f64::from(k).powi(3)).collect();
        assert_eq!(of_differences(&cubic), 0.0, "a cubic has no fourth difference");
        assert_eq!((of_differences(&signal[..4]), of_calm_differences(&[])), (0.0, 0.0));
    }

    /// Medians of 10,000 differences scatter by 1.5 %, which neighbours share.
    #[test]
    fn differences_of_white_noise_tell_its_standard_deviation() {
        assert!((of_differences(&noise(10_000, 1)) - 1.0).abs() < 0.05);
        let calm = of_calm_differences(&noise(10_000, 2));
        assert!((0.85..1.05).contains(&calm), "{calm}");
    }

    #[test]
    fn the_median_is_the_upper_one_of_two() {
        assert_eq!(
            (median(vec![3.0, 1.0, 2.0]), median(vec![4.0, 1.0, 3.0, 2.0]), median(Vec::new())),
            (2.0, 3.0, 0.0)
        );
    }

    /// The median of 153 powers, each a mean of 20 pieces: by Gaussian statistics it is 1/(3 · 20) below the mean, 0.8
    /// % of the standard deviation, and scatters by 1 %. A loud signal below the band, and a piece with a jump, change
    /// nothing.
    #[test]
    fn the_top_of_the_spectrum_tells_white_noise_alone() {
        let white = noise(20 * 1024, 3);
        let told = white_noise(&white).unwrap();
        assert!((told - 1.0).abs() < 0.04, "{told}");
        let loud = white_noise(&sum(&white, &sine(white.len(), 1000.0, 0.01))).unwrap();
        assert!((loud / told - 1.0).abs() < 1e-2, "{loud}");
        let mut jumps = white.clone();
        jumps[5 * 1024 + 512..6 * 1024].iter_mut().for_each(|x| *x += 1e5);
        let jumping = white_noise(&jumps).unwrap();
        assert!((jumping / told - 1.0).abs() < 0.04, "{jumping}");
        // Half as much noise is half as much; a constant is none.
        let halved: Vec<f64> = white.iter().map(|x| 0.5 * x + 7.0).collect();
        assert!((white_noise(&halved).unwrap() / told - 0.5).abs() < 1e-9);
        assert!(white_noise(&white[..4 * 1024]).is_some() && white_noise(&white[..4 * 1024 - 1]).is_none());
    }

    /// A line of the spectrum within the band: the power in Hann's window of amplitude a is a²/4 Σw² at its middle, N/6
    /// a² over Σw² = 3N/8, in one of 153 bins, of which the median sees nothing.
    #[test]
    fn a_line_in_the_band_is_no_noise() {
        let white = noise(20 * 1024, 4);
        let lined = white_noise(&sum(&white, &sine(white.len(), 3.0, 0.3125))).unwrap();
        assert!((lined / white_noise(&white).unwrap() - 1.0).abs() < 0.05, "{lined}");
    }

    /// At 10 kHz white noise has unit power in each bin; what repeats with the mains is taken off, also where it is a
    /// thousand times as loud. Forty windows of some forty bins scatter by 3 %.
    #[test]
    fn the_density_in_a_band_is_that_of_white_noise() {
        let white = noise(30_000, 5);
        let all = |_: usize| true;
        let plain = density(&white, 1e-4, None, (1000.0, 2000.0), &all).unwrap();
        assert!((plain - 1.0).abs() < 0.08, "{plain}");
        // 1.5 kHz, in the band, repeat after 20 ms.
        let mains = sum(&white, &sine(white.len(), 1000.0, 0.15));
        let without = density(&mains, 1e-4, Some(0.02), (1000.0, 2000.0), &all).unwrap();
        assert!((without - 1.0).abs() < 0.08, "{without}");
        let within = density(&mains, 1e-4, None, (1000.0, 2000.0), &all).unwrap();
        assert!(within > 30.0, "{within}");
        // Outside of the band, five bins off, it is not seen.
        let outside = density(&mains, 1e-4, None, (2000.0, 4000.0), &all).unwrap();
        assert!((outside - 1.0).abs() < 0.08, "{outside}");
    }

    #[test]
    fn a_density_takes_eight_whole_windows() {
        let white = noise(20 * 512, 6);
        let of = |values: usize, usable: &dyn Fn(usize) -> bool| {
            density(&white[..values], 1e-4, None, (1000.0, 2000.0), usable).is_some()
        };
        assert!(of(8 * 512, &|_| true) && !of(8 * 512 - 1, &|_| true));
        // One sample takes a window away.
        assert!(!of(8 * 512, &|n| n != 700) && of(9 * 512, &|n| n != 700));
        // A period before and one after.
        let with_mains = |values: usize| density(&white[..values], 1e-4, Some(0.02), (1000.0, 2000.0), &|_| true);
        assert!(with_mains(8 * 512 + 400).is_some() && with_mains(8 * 512 + 399).is_none());
    }
}
