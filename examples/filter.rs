//! A Butterworth filter on a channel: `cargo run --example filter`.

use std::f64::consts::TAU;

use greyrig::butterworth::{Cascade, Settings};

/// Runs the example.
pub fn main() {
    // Fourth order, 250 Hz, sampled at 10 kHz: the coefficients are shared by all channels.
    let settings = Settings { order: 4, cutoff_hz: 250.0, sample_rate_hz: 10_000.0 };
    let coefficients = settings.build::<f32>().expect("a cut-off below half the sampling rate");
    let mut channel = Cascade::default();

    // A current at 50 Hz with the ripple of a commutator at 1 kHz.
    let ripple_after_settling = (0..2_000)
        .map(|n| {
            let t = f64::from(n) / 10_000.0;
            let clean = (TAU * 50.0 * t).sin();
            let seen = clean + 0.2 * (TAU * 1000.0 * t).sin();
            channel.process(&coefficients, seen as f32)
        })
        .skip(settings.settling_samples().expect("as above") as usize)
        .fold(0.0f32, |most, value| most.max(value.abs()));

    println!("amplitude behind the filter: {ripple_after_settling:.4} (1 without ripple)");
    assert!((ripple_after_settling - 1.0).abs() < 2e-3);
}
