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

/// Amplitude density of a signal's noise in a band, Hz, per √Hz of the sampling rate: square root of the median, over windows
/// in which all samples are `usable`, of the mean power in the band. What repeats with the mains is taken off by the mean of a
/// period before and one after. `None` when there are too few windows.
pub fn density(
    signal: &[f64],
    interval_s: f64,
    mains_period_s: Option<f64>,
    band_hz: (f64, f64),
    usable: &dyn Fn(usize) -> bool,
) -> Option<f64> {
    const LENGTH: usize = 512;
    const FEWEST: usize = 8;
    let period = mains_period_s.map_or(0, |t| (t / interval_s).round() as usize);
    let mut planner = RealFftPlanner::<f64>::new();
    let fft = planner.plan_fft_forward(LENGTH);
    let window: Vec<f64> = (0..LENGTH).map(|k| 0.5 - 0.5 * (TAU * k as f64 / LENGTH as f64).cos()).collect();
    let energy: f64 = window.iter().map(|w| w * w).sum();
    let bin = |hz: f64| (hz * interval_s * LENGTH as f64) as usize;
    let bins = bin(band_hz.0)..bin(band_hz.1);
    let mut powers = Vec::new();
    let mut from = period;
    while from + LENGTH + period <= signal.len() {
        if (from..from + LENGTH).all(usable) {
            let at = |n: usize| {
                // The mean of two periods adds half the noise's power to that of the sample.
                if period == 0 {
                    signal[n]
                } else {
                    (signal[n] - 0.5 * (signal[n - period] + signal[n + period])) / 1.5f64.sqrt()
                }
            };
            let mean = (from..from + LENGTH).map(at).sum::<f64>() / LENGTH as f64;
            let mut input: Vec<f64> = (0..LENGTH).map(|k| (at(from + k) - mean) * window[k]).collect();
            let mut output = fft.make_output_vec();
            fft.process(&mut input, &mut output).ok()?;
            powers.push(output[bins.clone()].iter().map(|x| x.norm_sqr()).sum::<f64>() / energy / bins.len() as f64);
        }
        from += LENGTH;
    }
    if powers.len() < FEWEST {
        return None;
    }
    powers.sort_by(f64::total_cmp);
    Some(powers[powers.len() / 2].sqrt())
}
