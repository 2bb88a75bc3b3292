//! White noise of a measured signal.

use std::f64::consts::TAU;

use realfft::RealFftPlanner;

/// The top of the band, as fractions of the sampling rate, in which the spectrum is taken for noise.
pub const TOP_OF_BAND: (f64, f64) = (0.25, 0.40);

/// Standard deviation of white noise per sample, from the top of the spectrum (median over frequencies, so that single
/// lines do not count). `None` when there is too little data.
pub fn white_noise(signal: &[f64]) -> Option<f64> {
    const LENGTH: usize = 1024;
    let mut planner = RealFftPlanner::<f64>::new();
    let fft = planner.plan_fft_forward(LENGTH);
    let window: Vec<f64> = (0..LENGTH).map(|k| 0.5 - 0.5 * (TAU * k as f64 / LENGTH as f64).cos()).collect();
    let energy: f64 = window.iter().map(|w| w * w).sum();
    let bins = (TOP_OF_BAND.0 * LENGTH as f64) as usize..(TOP_OF_BAND.1 * LENGTH as f64) as usize;
    let mut densities = vec![0.0; bins.len()];
    let mut count = 0.0;
    for piece in signal.chunks_exact(LENGTH) {
        let mean = piece.iter().sum::<f64>() / LENGTH as f64;
        let mut input: Vec<f64> = piece.iter().zip(&window).map(|(x, w)| (x - mean) * w).collect();
        let mut output = fft.make_output_vec();
        fft.process(&mut input, &mut output).ok()?;
        for (d, k) in densities.iter_mut().zip(bins.clone()) {
            *d += output[k].norm_sqr() / energy;
        }
        count += 1.0;
    }
    if count < 4.0 {
        return None;
    }
    densities.sort_by(f64::total_cmp);
    Some((densities[densities.len() / 2] / count).sqrt())
}
