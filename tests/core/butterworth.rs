//! The filter against scipy, against the closed formula, and against bad input.

use std::f64::consts::PI;

use greyrig::butterworth::{Cascade, MAX_CUTOFF_RATIO, MIN_CUTOFF_RATIO, SETTLED, Settings, SettingsError, fixed};
use greyrig::scalar::Scalar;
use proptest::prelude::*;

/// One row of a table made by `butterworth_scipy.py`: the settings, and the numbers after them.
fn rows(table: &'static str) -> impl Iterator<Item = (Settings, Vec<f64>)> {
    table.lines().skip(1).map(|line| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        (Settings { order: cells[0] as u8, cutoff_hz: cells[1], sample_rate_hz: cells[2] }, cells[3..].to_vec())
    })
}

fn impulse_response(settings: &Settings, samples: usize) -> Vec<f64> {
    let coefficients = settings.build::<f64>().unwrap();
    let mut cascade = Cascade::default();
    (0..samples).map(|n| cascade.process(&coefficients, if n == 0 { 1.0 } else { 0.0 })).collect()
}

/// scipy puts the gain of the whole filter into the first section and splits the double zeros its own way, so the
/// denominators are compared section by section and the numerators multiplied out.
#[test]
fn sections_equal_scipy() {
    let rows: Vec<_> = rows(include_str!("butterworth_scipy.csv")).collect();
    let mut compared = 0;
    for group in rows.chunk_by(|a, b| a.0 == b.0) {
        let settings = group[0].0;
        let ours = settings.second_order_sections().unwrap();
        assert_eq!(ours.len(), group.len(), "{settings:?}");
        let (mut gain_ours, mut gain_scipy) = (1.0, 1.0);
        for (section, (_, row)) in ours.iter().zip(group) {
            let scipy = &row[1..];
            for (a, b) in section[3..].iter().zip(&scipy[3..]) {
                assert!((a - b).abs() < 1e-12, "{settings:?}: {section:?} {scipy:?}");
            }
            gain_ours *= section[0];
            gain_scipy *= scipy[0];
            // All zeros lie at −1: b is (1, 2, 1) or (1, 1, 0) times a gain.
            let zeros = |b: &[f64]| b[1] / b[0] + b[2] / b[0];
            compared += (zeros(&section[..3]) > 0.0 && zeros(scipy) > 0.0) as usize;
        }
        assert!((gain_ours / gain_scipy - 1.0).abs() < 1e-9, "{settings:?}: {gain_ours} {gain_scipy}");
        let zeros_ours: usize = ours.iter().map(|s| if s[2] == 0.0 { 1 } else { 2 }).sum();
        assert_eq!(zeros_ours, usize::from(settings.order));
    }
    assert_eq!(compared, rows.len());
}

#[test]
fn responses_equal_scipy() {
    for (settings, row) in rows(include_str!("butterworth_scipy_response.csv")) {
        let (sample, impulse, step, settling) = (row[0] as usize, row[1], row[2], row[3] as u32);
        let response = impulse_response(&settings, sample + 1);
        // scipy's direct form itself is good to about 1e-9 at the lowest cut-offs.
        assert!((response[sample] - impulse).abs() < 1e-9, "{settings:?} {sample}");
        assert!((response.iter().sum::<f64>() - step).abs() < 1e-8, "{settings:?} {sample}");
        assert_eq!(settings.settling_samples().unwrap(), settling, "{settings:?}");
    }
}

#[test]
fn frequency_response_is_the_closed_formula() {
    for order in 1..=8 {
        for cutoff_hz in [40.0, 250.0, 2_000.0, 4_500.0] {
            let settings = Settings { order, cutoff_hz, ..Settings::default() };
            let response = impulse_response(&settings, 60_000);
            for frequency in [1.0, 0.5 * cutoff_hz, cutoff_hz, 1.05 * cutoff_hz, 4_900.0] {
                let (mut re, mut im) = (0.0, 0.0);
                for (n, h) in response.iter().enumerate() {
                    let phase = 2.0 * PI * frequency * n as f64 / settings.sample_rate_hz;
                    re += h * phase.cos();
                    im -= h * phase.sin();
                }
                let ratio =
                    (PI * frequency / settings.sample_rate_hz).tan() / (PI * cutoff_hz / settings.sample_rate_hz).tan();
                let expected = 1.0 / (1.0 + ratio.powi(2 * i32::from(order)));
                let actual = re * re + im * im;
                // Sums of 60,000 rounded terms.
                assert!((actual - expected).abs() < 1e-10, "{settings:?} {frequency}: {actual} {expected}");
            }
        }
    }
}

#[test]
fn default_is_the_papers_filter() {
    assert_eq!(Settings::default(), Settings { order: 4, cutoff_hz: 250.0, sample_rate_hz: 10_000.0 });
    // scipy: 108 samples, 10.8 ms.
    assert_eq!(Settings::default().settling_samples(), Ok(108));
}

#[test]
fn errors_name_the_parameter() {
    let name = |settings: Settings| settings.build::<f32>().map(|_| ()).map_err(|SettingsError { name, .. }| name);
    let good = Settings::default();
    assert_eq!(name(good), Ok(()));
    for order in [0, 9, 255] {
        assert_eq!(name(Settings { order, ..good }), Err("order"));
    }
    for rate in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(name(Settings { sample_rate_hz: rate, ..good }), Err("sample_rate_hz"));
    }
    for cutoff in [0.0, -250.0, 0.9, 4_901.0, 5_000.0, f64::NAN, f64::INFINITY] {
        assert_eq!(name(Settings { cutoff_hz: cutoff, ..good }), Err("cutoff_hz"));
    }
    let above = Settings { cutoff_hz: 4_500.0, ..good };
    assert_eq!(above.build_fixed().unwrap_err().to_string(), "cutoff_hz has to lie between 1 and 4000");
    assert!(above.build::<f32>().is_ok());
}

/// A recording does not begin with a transient, in any arithmetic, at any order and cut-off: bit by bit.
#[test]
fn constant_input_is_reproduced_exactly() {
    fn check<S: Scalar>(settings: &Settings, value: S) {
        let coefficients = settings.build::<S>().unwrap();
        let mut cascade = Cascade::default();
        cascade.reset_to(value);
        for _ in 0..100 {
            assert!(cascade.process(&coefficients, value) == value, "{settings:?}");
        }
    }
    for order in 1..=8 {
        for ratio in [MIN_CUTOFF_RATIO, 1e-3, 0.025, 0.25, 0.4, MAX_CUTOFF_RATIO] {
            let settings = Settings { order, cutoff_hz: ratio, sample_rate_hz: 1.0 };
            for value in [0.0, 1.0, -0.1, 325.269, 1e-20, -1e30] {
                check::<f32>(&settings, value as f32);
                check::<f64>(&settings, value);
            }
            let Ok(coefficients) = settings.build_fixed() else { continue };
            let mut cascade = fixed::Cascade::default();
            for value in [0, 1, -1, 12_345, -fixed::FULL_SCALE, fixed::FULL_SCALE] {
                cascade.reset_to(value);
                for _ in 0..100 {
                    assert_eq!(cascade.process(&coefficients, value), value, "{settings:?}");
                }
            }
        }
    }
}

/// What `f32` loses of a step at the lowest cut-off that is allowed.
#[test]
fn lowest_cutoff_still_follows_a_step() {
    let mut worst: f32 = 0.0;
    for order in 1..=8 {
        let settings = Settings { order, cutoff_hz: MIN_CUTOFF_RATIO, sample_rate_hz: 1.0 };
        let coefficients = settings.build::<f32>().unwrap();
        let mut cascade = Cascade::default();
        let mut output = 0.0;
        for _ in 0..4 * settings.settling_samples().unwrap() {
            output = cascade.process(&coefficients, 1.0);
        }
        worst = worst.max((output - 1.0).abs());
    }
    // ε/g, for the eight orders together.
    assert!(worst < 3e-4, "{worst}");
}

#[test]
fn bad_samples_are_held() {
    let coefficients = Settings::default().build::<f32>().unwrap();
    let signal = |n: usize| (n as f32 * 0.05).sin();
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1.1e30];
    let (mut with_bad, mut with_held) = (Cascade::default(), Cascade::default());
    for n in 0..1_000 {
        let spoilt = (400..400 + bad.len()).contains(&n);
        let sample = if spoilt { bad[n - 400] } else { signal(n) };
        let held = if spoilt { signal(399) } else { signal(n) };
        assert_eq!(with_bad.process(&coefficients, sample), with_held.process(&coefficients, held));
    }
    with_bad.reset_to(f32::NAN);
    assert_eq!(with_bad, Cascade::default());
}

/// The input that drives the output furthest: the signs of the impulse response, backwards, at full scale.
#[test]
fn worst_input_does_not_overflow_fixed_point() {
    for order in 1..=8 {
        for ratio in [1e-3, 0.01, 0.1, 0.25, 0.33, fixed::MAX_CUTOFF_RATIO] {
            let settings = Settings { order, cutoff_hz: ratio, sample_rate_hz: 1.0 };
            let response = impulse_response(&settings, (10.0 / ratio) as usize + 200);
            let sign = |h: &f64| if *h < 0.0 { i32::MIN } else { i32::MAX };
            let difference =
                follow(&settings, response.iter().rev().chain(&response).chain(response.iter().rev()).map(sign));
            assert!(difference < 1e-6, "{settings:?}: {difference}");
        }
    }
}

/// What the headroom of fixed point rests on: the sum of magnitudes of the impulse response from the input to each
/// sum and state bounds it for every input.
#[test]
fn internal_gains_stay_within_the_headroom() {
    let mut largest: f64 = 0.0;
    for order in 1..=8 {
        for ratio in [1e-3, 0.01, 0.05, 0.1, 0.2, 0.25, 0.3, 0.35, fixed::MAX_CUTOFF_RATIO] {
            let g = (PI * ratio).tan();
            let mut signal = vec![0.0; (20.0 / ratio) as usize + 500];
            signal[0] = 1.0;
            let settings = Settings { order, cutoff_hz: ratio, sample_rate_hz: 1.0 };
            for section in settings.second_order_sections().unwrap() {
                let mut sums = [0.0; 4];
                if section[2] == 0.0 {
                    let mut s = 0.0;
                    for x in &mut signal {
                        let d = (*x - s) * g / (1.0 + g);
                        sums[0] += (*x - s).abs();
                        *x = s + d;
                        s = *x + d;
                        sums[1] += s.abs();
                    }
                } else {
                    // b0 = g²/D gives D, and the recurrence follows from its definition.
                    let d0 = g * g / section[0];
                    let k = (d0 - 1.0 - g * g) / g;
                    let (mut s1, mut s2) = (0.0, 0.0);
                    for x in &mut signal {
                        let v = *x - s2;
                        let d = (g * s1 + g * g * v) / d0;
                        sums[0] += v.abs();
                        sums[1] += f64::abs(s1);
                        sums[2] += f64::abs(s2);
                        s1 += 2.0 * (g * v - (g * k + g * g) * s1) / d0;
                        *x = s2 + d;
                        sums[3] += x.abs();
                        s2 = *x + d;
                    }
                }
                largest = sums.into_iter().fold(largest, f64::max);
            }
        }
    }
    assert!((4.0..5.5).contains(&largest), "{largest}");
}

/// Runs fixed point beside `f64` on the same samples; the largest difference, relative to full scale.
fn follow(settings: &Settings, samples: impl Iterator<Item = i32>) -> f64 {
    let coefficients = settings.build_fixed().unwrap();
    let reference = settings.build::<f64>().unwrap();
    let (mut integer, mut real) = (fixed::Cascade::default(), Cascade::default());
    let full = f64::from(fixed::FULL_SCALE);
    let mut largest: f64 = 0.0;
    for sample in samples {
        let limited = sample.clamp(-fixed::FULL_SCALE, fixed::FULL_SCALE);
        let difference =
            f64::from(integer.process(&coefficients, sample)) - real.process(&reference, f64::from(limited));
        largest = largest.max(difference.abs() / full);
    }
    largest
}

fn extreme_or_any() -> impl Strategy<Value = i32> {
    prop_oneof![Just(i32::MIN), Just(i32::MAX), Just(fixed::FULL_SCALE), Just(0), any::<i32>()]
}

proptest! {
    /// An overflow would be an error of the order of full scale; rounding is below a millionth.
    #[test]
    fn fixed_point_follows_any_input(
        order in 1_u8..=8,
        ratio in 1e-3..fixed::MAX_CUTOFF_RATIO,
        samples in prop::collection::vec((extreme_or_any(), 1_usize..60), 1..40),
    ) {
        let settings = Settings { order, cutoff_hz: ratio, sample_rate_hz: 1.0 };
        let held = samples.into_iter().flat_map(|(sample, times)| std::iter::repeat_n(sample, times));
        prop_assert!(follow(&settings, held) < 1e-6);
    }

    #[test]
    fn no_sample_can_poison_the_filter(
        order in 1_u8..=8,
        ratio in MIN_CUTOFF_RATIO..MAX_CUTOFF_RATIO,
        samples in prop::collection::vec(
            (prop_oneof![any::<f32>(), Just(f32::NAN), Just(1e30), Just(-1e30)], 1_usize..30), 1..40),
    ) {
        let settings = Settings { order, cutoff_hz: ratio, sample_rate_hz: 1.0 };
        let coefficients = settings.build::<f32>().unwrap();
        let mut cascade = Cascade::default();
        for (sample, times) in samples {
            for _ in 0..times {
                prop_assert!(cascade.process(&coefficients, sample).is_finite());
            }
        }
        // And it comes back: in the end only the present input counts.
        for _ in 0..3 {
            cascade.reset_to(f32::INFINITY);
            prop_assert_eq!(cascade.process(&coefficients, 0.0), 0.0);
        }
    }

    #[test]
    fn settled_means_settled(order in 1_u8..=8, ratio in 1e-3..MAX_CUTOFF_RATIO) {
        let settings = Settings { order, cutoff_hz: ratio, sample_rate_hz: 1.0 };
        let settling = settings.settling_samples().unwrap() as usize;
        let coefficients = settings.build::<f64>().unwrap();
        let mut cascade = Cascade::default();
        for n in 0..4 * settling + 100 {
            let error = (cascade.process(&coefficients, 1.0) - 1.0).abs();
            prop_assert!(n < settling || error <= SETTLED);
        }
    }
}
