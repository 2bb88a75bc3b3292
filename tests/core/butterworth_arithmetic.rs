//! The choice of form and arithmetic, measured. `docs/filter.md` shows the table that this prints:
//!
//! ```text
//! cargo test --release --package greyrig --test core butterworth_arithmetic -- --nocapture
//! ```
//!
//! The reference is the `f64` filter, which the other tests hold against scipy. The rival forms live here only.

use greyrig::butterworth::{Cascade, Settings, fixed};

/// Largest magnitude of a signed 12-bit sample, counts.
const FULL_SCALE_COUNTS: f64 = 2048.0;
/// From counts to the fixed-point format: full scale on 2^28.
const COUNT_SHIFT: u32 = 17;
const SAMPLES: usize = 200_000;

/// A sine at half the cut-off, 60 % of full scale, on an offset of 30 %, with two counts of noise, as a 12-bit
/// converter gives it.
fn counts(settings: &Settings) -> Vec<i32> {
    let mut state = 0x9e37_79b9_u32;
    let mut uniform = || {
        // Marsaglia (2003), "Xorshift RNGs": shifts 13, 17, 5.
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        f64::from(state) / f64::from(u32::MAX) - 0.5
    };
    (0..SAMPLES)
        .map(|n| {
            let phase = std::f64::consts::PI * settings.cutoff_hz / settings.sample_rate_hz * n as f64;
            // Twelve uniform numbers have unit variance.
            let noise: f64 = (0..12).map(|_| uniform()).sum();
            (FULL_SCALE_COUNTS * (0.3 + 0.6 * phase.sin()) + 2.0 * noise).round().clamp(-2048.0, 2047.0) as i32
        })
        .collect()
}

/// Direct form 1 in `f32`, unit gain at zero frequency restored after rounding a1 and a2.
fn direct_form_1(settings: &Settings, samples: &[i32]) -> Vec<f64> {
    let mut signal: Vec<f32> = samples.iter().map(|&x| x as f32).collect();
    for [b0, b1, b2, a1, a2] in rounded_sections(settings) {
        let (mut x1, mut x2, mut y1, mut y2) = (0.0, 0.0, 0.0, 0.0);
        for x in &mut signal {
            let y = b0 * *x + b1 * x1 + b2 * x2 - a1 * y1 - a2 * y2;
            (x2, x1, y2, y1) = (x1, *x, y1, y);
            *x = y;
        }
    }
    signal.into_iter().map(f64::from).collect()
}

/// Transposed direct form 2 in `f32`, likewise.
fn transposed_direct_form_2(settings: &Settings, samples: &[i32]) -> Vec<f64> {
    let mut signal: Vec<f32> = samples.iter().map(|&x| x as f32).collect();
    for [b0, b1, b2, a1, a2] in rounded_sections(settings) {
        let (mut s1, mut s2) = (0.0, 0.0);
        for x in &mut signal {
            let y = b0 * *x + s1;
            s1 = b1 * *x - a1 * y + s2;
            s2 = b2 * *x - a2 * y;
            *x = y;
        }
    }
    signal.into_iter().map(f64::from).collect()
}

fn rounded_sections(settings: &Settings) -> Vec<[f32; 5]> {
    let sections = settings.second_order_sections().unwrap();
    sections
        .iter()
        .map(|s| {
            let (a1, a2) = (s[4] as f32, s[5] as f32);
            // Exact in f64, so that the gain at zero frequency is one for the rounded poles.
            let b = ((1.0 + f64::from(a1) + f64::from(a2)) / 4.0) as f32;
            [b, 2.0 * b, b, a1, a2]
        })
        .collect()
}

/// Direct form 1 in 32-bit integers: coefficients of 30 fraction bits, sums in 64 bits, with or without carrying the
/// remainder of the division into the next sample.
fn integer_direct_form_1(settings: &Settings, samples: &[i32], feedback: bool) -> Vec<f64> {
    let mut signal: Vec<i32> = samples.iter().map(|&x| x << COUNT_SHIFT).collect();
    let one = f64::from(1 << 30);
    for s in settings.second_order_sections().unwrap() {
        let (a1, a2) = ((s[4] * one).round() as i64, (s[5] * one).round() as i64);
        let sum = (1 << 30) + a1 + a2;
        let b = sum / 4;
        let (b0, b1, b2) = (b, sum - 2 * b, b);
        let (mut x1, mut x2, mut y1, mut y2, mut remainder) = (0, 0, 0, 0, 0);
        for x in &mut signal {
            let now = i64::from(*x);
            let sum = b0 * now + b1 * x1 + b2 * x2 - a1 * y1 - a2 * y2 + remainder;
            let y = if feedback { sum >> 30 } else { (sum + (1 << 29)) >> 30 };
            remainder = if feedback { sum & ((1 << 30) - 1) } else { 0 };
            (x2, x1, y2, y1) = (x1, now, y1, y);
            *x = i32::try_from(y).unwrap();
        }
    }
    signal.into_iter().map(|y| f64::from(y) / f64::from(1 << COUNT_SHIFT)).collect()
}

fn floating<S: greyrig::scalar::Scalar>(settings: &Settings, samples: &[i32], to_f64: fn(S) -> f64) -> Vec<f64> {
    let coefficients = settings.build::<S>().unwrap();
    let mut cascade = Cascade::default();
    samples.iter().map(|&x| to_f64(cascade.process(&coefficients, S::constant(f64::from(x))))).collect()
}

fn integer(settings: &Settings, samples: &[i32]) -> Vec<f64> {
    let coefficients = settings.build_fixed().unwrap();
    let mut cascade = fixed::Cascade::default();
    let unit = f64::from(1 << COUNT_SHIFT);
    samples.iter().map(|&x| f64::from(cascade.process(&coefficients, x << COUNT_SHIFT)) / unit).collect()
}

/// RMS difference relative to full scale.
fn noise(outputs: &[f64], reference: &[f64]) -> f64 {
    let sum: f64 = outputs.iter().zip(reference).map(|(y, r)| (y - r) * (y - r)).sum();
    (sum / reference.len() as f64).sqrt() / FULL_SCALE_COUNTS
}

#[test]
fn noise_of_forms_and_arithmetics() {
    // RMS of rounding to whole counts.
    let converter = 1.0 / 12_f64.sqrt() / FULL_SCALE_COUNTS;
    println!("RMS noise relative to full scale, order 4, 10 kHz; the 12-bit converter's own: {converter:.1e}");
    println!("| cut-off, Hz | `f32` | `i32` | `f32` DF2T | `f32` DF1 | `i32` DF1 + feedback | `i32` DF1 |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for cutoff_hz in [1_000.0, 250.0, 50.0, 10.0, 1.0] {
        let settings = Settings { cutoff_hz, ..Settings::default() };
        let samples = counts(&settings);
        let reference = floating::<f64>(&settings, &samples, |y| y);
        let noise = |outputs: Vec<f64>| noise(&outputs, &reference);
        let float = noise(floating::<f32>(&settings, &samples, f64::from));
        let fixed = noise(integer(&settings, &samples));
        let df2t = noise(transposed_direct_form_2(&settings, &samples));
        let df1 = noise(direct_form_1(&settings, &samples));
        let integer_df1 = noise(integer_direct_form_1(&settings, &samples, false));
        let feedback = noise(integer_direct_form_1(&settings, &samples, true));
        println!(
            "| {cutoff_hz} | {float:.1e} | {fixed:.1e} | {df2t:.1e} | {df1:.1e} | {feedback:.1e} | {integer_df1:.1e} |"
        );
        // The converter's noise is the yardstick: the filter must not be seen beside it.
        assert!(float < converter / 100.0, "{cutoff_hz}: {float}");
        assert!(fixed < converter / 100.0, "{cutoff_hz}: {fixed}");
    }
}

#[test]
fn silence_after_a_signal() {
    println!("output long after the input has become zero, in units of full scale, and how many samples it takes");
    println!("| cut-off, Hz | `f32` | `i32` |");
    println!("| --- | --- | --- |");
    for cutoff_hz in [1_000.0, 250.0, 10.0] {
        let settings = Settings { cutoff_hz, ..Settings::default() };
        let mut samples = counts(&settings);
        samples[1_000..].fill(0);
        let largest_of_last =
            |outputs: &[f64]| outputs[outputs.len() - 100_000..].iter().fold(0.0_f64, |a, y| a.max(y.abs())) / 2048.0;
        let last_nonzero = |outputs: &[f64]| outputs.iter().rposition(|&y| y != 0.0).unwrap() - 999;
        let float = floating::<f32>(&settings, &samples, f64::from);
        let fixed = integer(&settings, &samples);
        println!(
            "| {cutoff_hz} | {:.1e}, {} | {:.1e}, {} |",
            largest_of_last(&float),
            last_nonzero(&float),
            largest_of_last(&fixed),
            last_nonzero(&fixed)
        );
        assert_eq!(largest_of_last(&fixed), 0.0);
        assert!(largest_of_last(&float) < 1e-30);
    }
}
