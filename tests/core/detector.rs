//! The detector against formulas and figures written out here, as docs/detector.md has them: no constant of the
//! detector is imported.

use std::f32::consts::TAU;

use greyrig::butterworth::HighPass;
use greyrig::detector::{
    Alarm, Cause, Cumulative, Fast, Jump, Kind, Limits, PeriodClock, Point, Settings, SettingsError, Sums, Tolerance,
    Verdict, locate,
};
use greyrig::motor::State;
use greyrig::tick::Output;

const RATE: f32 = 10_000.0;

#[test]
fn high_pass_has_the_response_of_a_butterworth() {
    for frequency in [50.0f64, 250.0, 500.0, 1000.0, 2000.0, 4000.0] {
        let mut filter = HighPass::new(0.1).unwrap();
        let (mut sum, mut count) = (0.0f64, 0.0);
        for n in 0..20_000 {
            let y = filter.process((std::f64::consts::TAU * frequency * f64::from(n) / 1e4).sin() as f32);
            if n >= 10_000 {
                sum += f64::from(y).powi(2);
                count += 1.0;
            }
        }
        let tan = |hz: f64| (std::f64::consts::PI * hz / 1e4).tan();
        let expected = (1.0 / (1.0 + (tan(1000.0) / tan(frequency)).powi(8))).sqrt();
        let gain = (2.0 * sum / count).sqrt();
        // Single precision leaves 1e-6 of the input.
        assert!((gain - expected).abs() < 3e-6 + 1e-4 * expected, "{frequency} Hz: {gain} against {expected}");
    }
}

#[test]
fn high_pass_refuses_what_is_no_cut_off() {
    assert!(HighPass::new(0.0).is_none() && HighPass::new(0.5).is_none() && HighPass::new(f64::NAN).is_none());
}

fn periods(mains_hz: f32, seconds: f32) -> Vec<u32> {
    let mut clock = PeriodClock::new(RATE, 230.0);
    (0..(seconds * RATE) as u32)
        .filter_map(|n| clock.process(325.0 * (TAU * mains_hz * n as f32 / RATE).sin()))
        .collect()
}

#[test]
fn periods_follow_the_mains_at_50_and_60_hz() {
    for hz in [47.0f32, 50.0, 60.0, 63.0] {
        let found = periods(hz, 1.0);
        let samples = RATE / hz;
        assert!(found.len() as f32 >= hz - 3.0, "{hz} Hz: {} periods", found.len());
        for length in &found[2..] {
            assert!((*length as f32 - samples).abs() <= 1.0, "{hz} Hz: {length} samples");
        }
    }
}

#[test]
fn direct_voltage_has_periods_of_20_ms() {
    let mut clock = PeriodClock::new(RATE, 24.0);
    let found: Vec<u32> = (0..10_000).filter_map(|_| clock.process(24.0)).collect();
    assert_eq!(found.len(), 49);
    assert!(found.iter().all(|n| *n == 200));
}

/// A rise through zero ends a period if the voltage has been below −5 % of the nominal one, 15 ms or more after the
/// last end, and 22 ms after it at the latest.
#[test]
fn periods_end_where_the_voltage_rises_after_it_was_clearly_negative() {
    // On 20 V, of 230 V, with a dip every 17 ms: 170 samples.
    let dips = |volts: f32| {
        let mut clock = PeriodClock::new(RATE, 230.0);
        (1..=1_700).filter_map(|n| clock.process(if n % 170 == 0 { volts } else { 20.0 })).collect::<Vec<u32>>()
    };
    assert_eq!(dips(-11.6)[1..], [170; 8]);
    assert!(dips(-11.4).iter().all(|&samples| samples == 200), "a direct voltage of 20 ms periods");

    // After a crossing the next one: 14.9 ms are too short for a period, and 22.1 ms too long.
    let after = |samples: usize| {
        let mut clock = PeriodClock::new(RATE, 230.0);
        let first = [-100.0, 20.0];
        let signal = first.into_iter().chain(std::iter::repeat_n(20.0, samples - 2)).chain(first);
        signal.filter_map(|volts| clock.process(volts)).collect::<Vec<u32>>().last().copied()
    };
    assert_eq!([after(149), after(151), after(219)], [None, Some(151), Some(219)]);
    assert_eq!(after(225), Some(220));
}

/// The slip of a rotor that turns a tenth slower than the model, and what has no signal to be measured by.
#[test]
fn features_of_the_speed_the_correction_and_of_nothing() {
    let mut sums = Sums::default();
    for n in 0..200 {
        let (measured, modelled) = (State { current: 0.0, speed: 900.0 }, State { current: 0.0, speed: 1000.0 });
        let validity = if n % 4 == 0 { 0.0 } else { 1.0 };
        sums.add(&Point { voltage: -3.0, measured, modelled, high: 0.0, validity });
    }
    let f = sums.features();
    assert_eq!(sums.count(), 200);
    assert!((f.speed - 1.0 / 9.0).abs() < 1e-6 && (f.speed_deviation + 0.1).abs() < 1e-6, "{f:?}");
    assert!((f.speed_mean - 900.0).abs() < 1e-3 && (f.voltage_rms - 3.0).abs() < 1e-5 && f.validity == 0.75);
    assert_eq!([f.current, f.current_deviation, f.sparking, f.arcing, f.current_rms], [0.0; 5]);
    assert_eq!(Sums::default().features(), Default::default(), "no sample, and no NaN either");
}

#[test]
fn features_of_a_motor_that_draws_a_tenth_less_than_the_model() {
    let mut sums = Sums::default();
    for n in 0..200 {
        let i = 5.0 * (TAU * n as f32 / 200.0).sin();
        let measured = State { current: i, speed: 1000.0 };
        let modelled = State { current: i / 0.9, speed: 1000.0 };
        sums.add(&Point { voltage: 100.0, measured, modelled, high: 0.02, validity: 1.0 });
    }
    let f = sums.features();
    // e = i/0.9 − i, so √(⟨e²⟩/⟨i²⟩) = 1/0.9 − 1, and −⟨e î⟩/⟨î²⟩ = −0.1.
    assert!((f.current - 0.111_111).abs() < 1e-5, "{f:?}");
    assert!((f.current_deviation + 0.1).abs() < 1e-5, "{f:?}");
    assert!(f.speed == 0.0 && f.speed_deviation == 0.0);
    assert!((f.voltage_rms - 100.0).abs() < 1e-3 && (f.sparking - 0.02).abs() < 1e-6);
    assert!((f.current_rms - 5.0 / 2f32.sqrt()).abs() < 1e-4);
}

#[test]
fn power_that_goes_with_the_current_is_arcing_and_power_that_does_not_is_noise() {
    let period = |current: &dyn Fn(f32) -> f32, power: &dyn Fn(f32) -> f32| {
        let mut sums = Sums::default();
        for n in 0..200 {
            let i = current(TAU * n as f32 / 200.0);
            let state = State { current: i, speed: 1000.0 };
            sums.add(&Point { voltage: 100.0, measured: state, modelled: state, high: power(i).sqrt(), validity: 1.0 });
        }
        sums.features()
    };
    let sine = |phase: f32| 5.0 * phase.sin();
    // ⟨|i|⟩ = 10/π A; sums of 200 samples, in single precision, agree with the integrals to some 1e-4.
    let f = period(&sine, &|i| 1e-4 + 2e-5 * i.abs());
    assert!((f.arcing - 2e-5 * 10.0 / std::f32::consts::PI).abs() < 1e-8, "{}", f.arcing);
    assert!((f.sparking.powi(2) - 1e-4 - f.arcing).abs() < 1e-8);
    assert!(period(&sine, &|_| 1e-4).arcing.abs() < 1e-8);
    assert_eq!(period(&|_| 5.0, &|i| 1e-4 * i).arcing, 0.0, "direct current cannot tell");
    // Ripple r cos on a direct current: the variance of |i| over its mean square is r²/2/(1 + r²/2), of which 0.02 are
    // needed.
    let rippled = |ripple: f32| period(&|phase| 5.0 * (1.0 + ripple * phase.cos()), &|i| 1e-4 + 1e-5 * i).arcing;
    assert_eq!(rippled(0.19), 0.0, "0.0177");
    assert!((rippled(0.22) - 5e-5).abs() < 2e-6, "0.0236: 1e-5 A² a ampere, at 5 A: {}", rippled(0.22));
}

/// "After three periods above its limit in a row, and quiet again after three below 80 % of it."
#[test]
fn fast_detector_needs_three_periods_and_lets_go_below_four_fifths() {
    let mut watch = Fast::new(2.0);
    assert_eq!([3.0; 3].map(|feature| watch.process(feature)), [None, None, Some(1.5)]);
    // Between release and limit it goes on calling.
    assert!((0..10).all(|_| watch.process(1.62).is_some()), "81 % of the limit");
    assert!(watch.calls());
    assert_eq!([1.58; 3].map(|feature| watch.process(feature).is_some()), [true, true, false], "79 % of the limit");
    assert!(!watch.calls());
    assert!((0..10).all(|_| watch.process(2.0).is_none()), "at the limit it does not call");
    assert_eq!(Fast::new(0.0).process(1e9), None, "without a limit it never calls");
}

#[test]
fn periods_that_call_have_to_be_in_a_row() {
    let mut watch = Fast::new(1.0);
    assert!((0..100).all(|n| watch.process(if n % 3 == 0 { 0.5 } else { 50.0 }).is_none()));
    let mut calling = Fast::new(1.0);
    (0..3).for_each(|_| _ = calling.process(50.0));
    assert!((0..100).all(|n| calling.process(if n % 3 == 2 { 0.9 } else { 0.0 }).is_some()));
}

#[test]
fn cumulative_sum_calls_after_the_time_that_the_excess_says() {
    for excess in [0.1f32, 0.5, 1.0, 4.0] {
        let mut sum = Cumulative::new(Tolerance { centre: 0.02, half_width: 0.05 });
        let deviation = 0.02 - 0.05 * (1.0 + excess);
        let calls = (1..1000).find(|_| sum.process(deviation).is_some()).unwrap();
        // h is 25 tolerances times periods.
        let expected = 25.0 / excess;
        assert!((calls as f32 - expected).abs() <= 1.0 + 0.01 * expected, "{excess}: {calls} against {expected}");
    }
    let mut healthy = Cumulative::new(Tolerance { centre: 0.02, half_width: 0.05 });
    assert!((0..10_000).all(|n| healthy.process(if n % 2 == 0 { 0.069 } else { -0.029 }).is_none()));
}

/// At 50 Hz: half a second at twice the tolerance until it calls; once the cause is gone, however long it was there and
/// however large it was, one and a half until it is quiet: from 4 h = 100 down to h = 25, by one each period.
#[test]
fn cumulative_sum_comes_back_when_the_cause_is_gone() {
    for (periods, excess) in [(1_000, 3.0f32), (20, 1e6)] {
        for sign in [1.0, -1.0] {
            let mut sum = Cumulative::new(Tolerance { centre: 0.02, half_width: 0.05 });
            (0..periods).for_each(|_| _ = sum.process(0.02 + sign * 0.05 * (1.0 + excess)));
            let calls_on = (0..10_000).take_while(|_| sum.process(0.02).is_some()).count();
            assert_eq!(calls_on, 74, "{periods} {excess} {sign}");
        }
    }
}

#[test]
fn cumulative_sum_without_a_tolerance_never_calls() {
    for half_width in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let mut sum = Cumulative::new(Tolerance { centre: 0.0, half_width });
        assert!((0..1000).all(|_| sum.process(1e6).is_none()), "{half_width}");
    }
}

#[test]
fn a_step_is_a_jump_and_what_stays_is_none() {
    let mut jump = Jump::default();
    assert!((0..100).all(|_| jump.process(0.07) == 0.0), "what differs from motor to motor drops out");
    assert!((jump.process(0.09) - 0.02).abs() < 1e-6);
    // The past follows by a fiftieth of what is left each period, a time constant of a second at 50 Hz: 0.02 (1 −
    // 1/50)⁵⁰.
    let after_a_second = (0..50).map(|_| jump.process(0.09)).last().unwrap();
    assert!((after_a_second - 7.283_4e-3).abs() < 1e-6, "{after_a_second}");
    let later = (0..450).map(|_| jump.process(0.09)).last().unwrap();
    assert!(later.abs() < 1e-5);
    jump.reset();
    assert_eq!(jump.process(3.0), 0.0, "after a gap nothing has changed");
}

#[test]
fn faults_are_located_by_the_signs_of_the_deviations() {
    let cases = [
        ((-0.02, -0.02), Kind::Electrical),
        ((0.04, -0.02), Kind::Mechanical),
        ((-0.04, 0.02), Kind::Mechanical),
        ((0.03, 0.03), Kind::Electrical),
        ((0.1, 0.001), Kind::Sensor),
        ((0.0, -0.1), Kind::Sensor),
        // A deviation below a tenth of the other one counts as none.
        ((1.0, 0.11), Kind::Electrical),
        ((1.0, 0.09), Kind::Sensor),
        ((-0.11, 1.0), Kind::Mechanical),
        ((-0.09, 1.0), Kind::Sensor),
    ];
    for ((current, speed), kind) in cases {
        assert_eq!(locate(current, speed), kind, "{current} {speed}");
    }
}

fn settings() -> Settings {
    Settings {
        sample_rate_hz: RATE,
        nominal_voltage: 230.0,
        least_voltage: 0.3,
        most_voltage: 1.1,
        least_speed: 100.0,
        blanking_s: 0.5,
        fewest_periods: 20,
        limits: Limits { current: 0.05, ..Limits::default() },
    }
}

/// A run whose modelled current is `factor` times the measured one.
fn run(settings: Settings, seconds: f32, voltage: f32, factor: f32) -> (Verdict, u32) {
    let mut detector = settings.build().unwrap();
    let mut judged = 0;
    for n in 0..(seconds * RATE) as u32 {
        let s = (TAU * 50.0 * n as f32 / RATE).sin();
        let output = Output {
            raw: [voltage * 2f32.sqrt() * s, 5.0 * s],
            measured: State { current: 5.0 * s, speed: 1000.0 },
            modelled: State { current: factor * 5.0 * s, speed: 1000.0 },
            validity: 1.0,
            crossed_zero: false,
        };
        judged += u32::from(detector.process(&output).is_some_and(|period| period.judged));
    }
    (detector.verdict(), judged)
}

#[test]
fn verdicts() {
    assert_eq!(run(settings(), 2.0, 230.0, 1.0).0, Verdict::Pass);
    assert_eq!(run(settings(), 2.0, 230.0, 1.1).0, Verdict::Fail);
    assert_eq!(run(settings(), 0.7, 230.0, 1.0).0, Verdict::CannotJudge, "too short");
    assert_eq!(run(settings(), 2.0, 60.0, 1.1), (Verdict::CannotJudge, 0), "too little voltage");
    assert_eq!(run(settings(), 2.0, 260.0, 1.1), (Verdict::CannotJudge, 0), "too much voltage");
    let slow = Settings { least_speed: 2000.0, ..settings() };
    assert_eq!(run(slow, 2.0, 230.0, 1.1), (Verdict::CannotJudge, 0), "too slow");
}

#[test]
fn the_start_is_not_judged() {
    let (_, judged) = run(settings(), 2.0, 230.0, 1.0);
    // 1.5 s of 50 Hz less what the first crossing takes.
    assert!((73..=75).contains(&judged), "{judged}");
}

/// A period is judged if the correction was within what it has been trained on at nine tenths of its samples.
#[test]
fn a_period_is_judged_where_the_correction_can_be_relied_on() {
    let judged = |valid_samples: u32| {
        let mut detector = settings().build().unwrap();
        (0..(2.0 * RATE) as u32)
            .filter_map(|n| {
                let s = (TAU * 50.0 * n as f32 / RATE).sin();
                let state = State { current: 5.0 * s, speed: 1000.0 };
                let validity = if n % 200 < valid_samples { 1.0 } else { 0.0 };
                let raw = [325.0 * s, 5.0 * s];
                detector.process(&Output { raw, measured: state, modelled: state, validity, crossed_zero: false })
            })
            .filter(|period| period.judged)
            .count()
    };
    // Periods of 200 samples.
    assert_eq!((judged(178), judged(0)), (0, 0), "89 %");
    assert!(judged(182) > 70, "91 %");
}

/// What calls, and where it then sits: 50 Hz, with a current and a speed that the model has otherwise, and noise above
/// 1 kHz.
fn alarm(limits: Limits, current: f32, speed: f32, noise: f32) -> Option<Alarm> {
    let mut detector = Settings { limits, ..settings() }.build().unwrap();
    let told = (0..(3.0 * RATE) as u32).filter_map(|n| {
        let s = (TAU * 50.0 * n as f32 / RATE).sin();
        // After two seconds.
        let [current, speed, noise] = if n < 20_000 { [1.0, 1.0, 0.0] } else { [current, speed, noise] };
        let spark = noise * (TAU * 0.3 * n as f32).sin();
        detector.process(&Output {
            raw: [325.0 * s, 5.0 * s * current + spark],
            measured: State { current: 5.0 * s * current, speed: 1000.0 * speed },
            modelled: State { current: 5.0 * s, speed: 1000.0 },
            validity: 1.0,
            crossed_zero: false,
        })
    });
    let last = told.filter_map(|period| period.alarm).last();
    assert_eq!(detector.verdict() == Verdict::Fail, last.is_some());
    last
}

#[test]
fn the_strongest_cause_is_told_with_its_ratio() {
    let widely = [0.0, 1.0];
    let errors =
        Limits { current: 0.05, speed: 0.01, current_deviation: widely, speed_deviation: widely, ..Limits::default() };
    assert_eq!(alarm(errors, 1.0, 1.0, 0.0), None);
    // 1/0.9 − 1 = 0.111 are 2.2 times 0.05, and 1/0.95 − 1 = 0.0526 are 5.3 times 0.01.
    let both = alarm(errors, 0.9, 0.95, 0.0).unwrap();
    assert_eq!((both.cause, both.kind), (Cause::SpeedError, Kind::Electrical));
    assert!((both.ratio - 5.263).abs() < 1e-2, "{both:?}");
    let one = alarm(errors, 0.9, 1.0, 0.0).unwrap();
    assert_eq!((one.cause, one.kind), (Cause::CurrentError, Kind::Sensor));
    assert!((one.ratio - 2.222).abs() < 1e-2, "{one:?}");
}

#[test]
fn sparks_are_electrical_whatever_else_calls() {
    let limits = Limits { current: 0.01, sparking: 0.1, ..Limits::default() };
    // 0.5 A at 3 kHz, 0.354 A RMS, which the high-pass lets through: 3.5 times its limit; the current's error is 11
    // times its own.
    let sparks = alarm(limits, 0.9, 1.0, 0.5).unwrap();
    assert_eq!((sparks.cause, sparks.kind), (Cause::Sparking, Kind::Electrical));
    assert!((sparks.ratio - 3.54).abs() < 0.02, "{sparks:?}");
}

#[test]
fn steady_deviations_call_later_and_are_located_in_tolerances() {
    // Both within their errors' limits; in tolerances the current is off by 2 and the speed by −2.
    let tolerances = Limits { current_deviation: [0.0, 0.05], speed_deviation: [0.0, 0.025], ..Limits::default() };
    let load = alarm(tolerances, 1.1, 0.95, 0.0).unwrap();
    assert_eq!(load.kind, Kind::Mechanical);
    assert!((load.ratio - 2.0).abs() < 1e-2, "{load:?}");
    // A tolerance around what healthy motors are.
    let elsewhere = Limits { current_deviation: [0.1, 0.05], ..Limits::default() };
    assert_eq!(
        alarm(elsewhere, 1.1, 1.0, 0.0).map(|alarm| alarm.cause),
        Some(Cause::CurrentDeviation),
        "the first 2 s"
    );
}

/// The number of judged periods that makes a verdict is the setting's, not one less.
#[test]
fn a_verdict_takes_as_many_periods_as_are_asked_for() {
    let (_, judged) = run(settings(), 2.0, 230.0, 1.0);
    let of = |fewest_periods| run(Settings { fewest_periods, ..settings() }, 2.0, 230.0, 1.0).0;
    assert_eq!((of(judged), of(judged + 1)), (Verdict::Pass, Verdict::CannotJudge));
}

/// The numbers of the samples with which a period is told, of a run in which the rotor is turned round at some.
fn told(sample_rate_hz: f32, mains_hz: f32, crossed_zero: impl Fn(u32) -> bool) -> Vec<u32> {
    let mut detector = Settings { sample_rate_hz, ..settings() }.build().unwrap();
    (0..sample_rate_hz as u32)
        .filter(|&n| {
            let s = (TAU * mains_hz * n as f32 / sample_rate_hz).sin();
            let output = Output { raw: [325.0 * s, s], crossed_zero: crossed_zero(n), ..Output::default() };
            detector.process(&output).is_some()
        })
        .collect()
}

#[test]
fn a_judgement_waits_for_the_model_but_not_for_ever() {
    for (rate, hz) in [(RATE, 50.0), (2_501.0, 66.0)] {
        let usual = told(rate, hz, |_| false);
        assert!(usual.len() as f32 > hz - 3.0);
        let once = usual.iter().map(|n| n + 1).collect::<Vec<_>>();
        assert_eq!(told(rate, hz, |n| usual.contains(&(n + 5))), once);
        let late = usual.iter().map(|n| n + 4).collect::<Vec<_>>();
        assert_eq!(told(rate, hz, |_| true), late);
    }
}

#[test]
fn settings_that_make_no_detector_are_refused() {
    let of = |s: Settings| s.build().map(|_| ()).unwrap_err();
    assert_eq!(of(Settings { sample_rate_hz: 2500.0, ..settings() }), SettingsError::SampleRate);
    assert_eq!(of(Settings { sample_rate_hz: f32::NAN, ..settings() }), SettingsError::SampleRate);
    assert_eq!(of(Settings { nominal_voltage: 0.0, ..settings() }), SettingsError::Voltage);
    for bad in [-1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(of(Settings { blanking_s: bad, ..settings() }), SettingsError::Negative);
        assert_eq!(of(Settings { least_voltage: bad, ..settings() }), SettingsError::Negative);
        assert_eq!(of(Settings { most_voltage: bad, ..settings() }), SettingsError::Negative);
        assert_eq!(of(Settings { least_speed: bad, ..settings() }), SettingsError::Negative);
        for place in 0..7 {
            let mut l = Limits::default();
            let [current, speed] = [&mut l.current_deviation[1], &mut l.speed_deviation[1]];
            *[&mut l.current, &mut l.speed, &mut l.sparking, &mut l.current_jump, &mut l.speed_jump, current, speed]
                [place] = bad;
            assert_eq!(of(Settings { limits: l, ..settings() }), SettingsError::Limit, "{place}");
        }
    }
    let limits = Limits { current_deviation: [f32::NAN, 0.0], ..Limits::default() };
    assert_eq!(of(Settings { limits, ..settings() }), SettingsError::Limit);
    let limits = Limits { speed_deviation: [0.0, f32::NAN], ..Limits::default() };
    assert_eq!(of(Settings { limits, ..settings() }), SettingsError::Limit);
}
