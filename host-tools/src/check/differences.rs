//! Differences of a channel, which leave of it what its converter, its filter and its logger did.

use realfft::RealFftPlanner;

/// Samples that are looked at, at most: at 10 kHz 26 s.
const MOST: usize = 1 << 18;
/// Deviations, by their ninth decile, from which on a difference is an edge and not noise.
const EDGE: f64 = 6.0;
/// Ninth decile of the magnitude of a Gaussian variable, in standard deviations. Not the median: between samples that
/// were interpolated most second differences are zero.
const DECILE: f64 = 1.645;

/// Fourth differences, those of edges set to zero. `None` with too few, or where nothing is left.
pub fn fourth(values: &[f64]) -> Option<Vec<f64>> {
    without_edges(values.windows(5).take(MOST).map(|w| w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]).collect())
}

/// Second differences, those of edges set to zero.
pub fn second(values: &[f64]) -> Option<Vec<f64>> {
    without_edges(values.windows(3).take(MOST).map(|w| w[0] - 2.0 * w[1] + w[2]).collect())
}

fn without_edges(mut differences: Vec<f64>) -> Option<Vec<f64>> {
    const FEWEST: usize = 1000;
    if differences.len() < FEWEST {
        return None;
    }
    let mut magnitudes: Vec<f64> = differences.iter().map(|d| d.abs()).collect();
    let at = magnitudes.len() * 9 / 10;
    let usual = *magnitudes.select_nth_unstable_by(at, f64::total_cmp).1;
    let limit = EDGE * usual / DECILE;
    differences.iter_mut().filter(|d| d.abs() > limit).for_each(|d| *d = 0.0);
    (usual > 0.0).then_some(differences)
}

/// Autocorrelation at the lags below half the length, by the spectrum of the padded sequence.
pub fn autocorrelation(x: &[f64]) -> Vec<f64> {
    let length = (2 * x.len()).next_power_of_two();
    let mut planner = RealFftPlanner::<f64>::new();
    let (there, back) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
    let mut padded = x.to_vec();
    padded.resize(length, 0.0);
    let mut spectrum = there.make_output_vec();
    let mut out = back.make_output_vec();
    if there.process(&mut padded, &mut spectrum).is_err() {
        return Vec::new();
    }
    for bin in &mut spectrum {
        *bin = (bin.norm_sqr()).into();
    }
    if back.process(&mut spectrum, &mut out).is_err() || out[0] <= 0.0 {
        return Vec::new();
    }
    let power = out[0];
    out.truncate(x.len() / 2);
    out.iter_mut().for_each(|r| *r /= power);
    out
}

/// Power at the frequencies k/n, k = 0 … n/2, n the length returned: a power of two not longer than the sequence.
pub fn periodogram(x: &[f64]) -> (usize, Vec<f64>) {
    let length = if x.len().is_power_of_two() { x.len() } else { x.len().next_power_of_two() / 2 };
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let mean = x[..length].iter().sum::<f64>() / length as f64;
    let mut input: Vec<f64> = x[..length].iter().map(|x| x - mean).collect();
    let mut output = fft.make_output_vec();
    if fft.process(&mut input, &mut output).is_err() {
        return (length, Vec::new());
    }
    (length, output.iter().map(|x| x.norm_sqr()).collect())
}
