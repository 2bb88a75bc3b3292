//! One tick, seen from outside.

use greyrig::app::bench::MOTOR;
use greyrig::butterworth::Settings;
use greyrig::motor::{Constraints, Motor, State, Stepper};
use greyrig::tick::Tick;
use greyrig::units::{Amperes, CalibrationSettings, Counts, RadiansPerSecond, Sample, Scale, Volts};

fn stepper() -> Stepper<f32> {
    Stepper::build(Motor::build(MOTOR, &[]).unwrap(), 1e-4).unwrap()
}

fn tick() -> Tick {
    Tick::new(stepper(), Settings::default().build().unwrap())
}

fn sample(u: f32, i: f32, speed: f32) -> Sample {
    Sample { voltage: Volts(u), current: Amperes(i), speed: RadiansPerSecond(speed) }
}

#[test]
fn residual_vanishes_when_the_motor_is_the_model() {
    // The measurement comes from a second model, so both sides are the same numbers through the same filter.
    let mut rig = tick();
    let mut truth = stepper();
    let mut last = 0.0;
    for n in 0..20_000u32 {
        let u = 325.0 * (n as f32 * 0.031_415_93).sin();
        let state = if n == 0 { State::default() } else { truth.step(last, u, Constraints::FREE) };
        last = u;
        let output = rig.process(sample(u, state.current, state.speed), Constraints::FREE);
        assert_eq!(output.residual(), State::default(), "sample {n}");
    }
}

#[test]
fn measured_signals_never_reach_the_model() {
    let (mut one, mut other) = (tick(), tick());
    for n in 0..5000u32 {
        let u = 200.0 * (n as f32 * 0.03).sin();
        let a = one.process(sample(u, 0.0, 0.0), Constraints::FREE);
        let b = other.process(sample(u, n as f32, f32::NAN), Constraints::FREE);
        assert_eq!(a.modelled.current.to_bits(), b.modelled.current.to_bits());
        assert_eq!(a.modelled.speed.to_bits(), b.modelled.speed.to_bits());
    }
}

#[test]
fn bad_samples_pass_without_a_trace_that_lasts() {
    let (mut clean, mut disturbed) = (tick(), tick());
    let mut outputs = Default::default();
    for n in 0..40_000u32 {
        let u = 325.0 * (n as f32 * 0.031_415_93).sin();
        let bad = n == 10_000;
        let seen = if bad { sample(f32::NAN, f32::INFINITY, f32::NAN) } else { sample(u, 5.0, 100.0) };
        outputs = (clean.process(sample(u, 5.0, 100.0), Constraints::FREE), disturbed.process(seen, Constraints::FREE));
        let o = outputs.1;
        assert!(
            [o.measured.current, o.measured.speed, o.modelled.current, o.modelled.speed].iter().all(|x| x.is_finite())
        );
    }
    // Three seconds later; the mechanical time constant is about half a second.
    assert!((outputs.0.modelled.speed - outputs.1.modelled.speed).abs() < 0.5);
    assert_eq!(outputs.0.measured, outputs.1.measured);
}

#[test]
fn the_residual_is_modelled_less_measured() {
    let output = greyrig::tick::Output {
        measured: State { current: 2.0, speed: 30.0 },
        modelled: State { current: 5.0, speed: 20.0 },
        ..Default::default()
    };
    assert_eq!(output.residual(), State { current: 3.0, speed: -10.0 });
}

#[test]
fn a_run_begins_in_the_steady_state_of_its_first_sample_and_of_the_model() {
    let mut rig = tick();
    rig.start_from(State { current: 4.0, speed: 500.0 });
    let first = rig.process(sample(100.0, 3.0, 400.0), Constraints::FREE);
    assert_eq!(first.raw, [100.0, 3.0]);
    assert_eq!(first.measured, State { current: 3.0, speed: 400.0 });
    assert_eq!(first.modelled, State { current: 4.0, speed: 500.0 });
    assert_eq!((first.validity, first.crossed_zero), (1.0, false), "without a correction");
    // The voltage between two samples is a line: a step from the last one to this one.
    let mut model = stepper();
    model.set_state(State { current: 4.0, speed: 500.0 });
    let expected = model.step(100.0, 60.0, Constraints::FREE);
    let held = rig.process(sample(60.0, 3.0, 400.0), Constraints::FREE);
    assert_eq!(held.raw[0], 60.0);
    assert!((held.modelled.current - 4.0).abs() <= (expected.current - 4.0).abs(), "filtered, and on the way there");
}

/// The voltage is replaced by the last usable one, not by zero: the model goes on as if the supply had not changed.
#[test]
fn a_voltage_that_is_no_number_is_the_last_one() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let (mut clean, mut disturbed) = (tick(), tick());
        for n in 0..3000 {
            let u = if n < 2000 { 150.0 } else { 90.0 };
            let seen = if (1000..1100).contains(&n) { bad } else { u };
            let expected = clean.process(sample(u, 1.0, 10.0), Constraints::FREE);
            assert_eq!(disturbed.process(sample(seen, 1.0, 10.0), Constraints::FREE), expected, "{bad} sample {n}");
            assert_eq!(expected.raw[0], u);
        }
    }
    let begin = tick().process(sample(f32::NAN, 1.0, 10.0), Constraints::FREE);
    assert_eq!((begin.raw, begin.modelled), ([0.0, 1.0], State::default()), "before the first one it is zero");
}

#[test]
fn counts_become_quantities() {
    let calibration = CalibrationSettings::default().build().unwrap();
    let low = calibration.sample(Counts { voltage: 0, current: 0, speed: 0 });
    let high = calibration.sample(Counts { voltage: 4095, current: 4095, speed: 4095 });
    assert!((low.voltage.0 + 400.0).abs() < 1e-3 && (high.voltage.0 - 400.0).abs() < 1e-3);
    assert!((low.current.0 + 40.0).abs() < 1e-4 && (high.current.0 - 40.0).abs() < 1e-4);
    assert!(low.speed.0 == 0.0 && (high.speed.0 - 5000.0).abs() < 1e-2);
    for (zero, per_count) in [(0.0, 0.0), (f32::NAN, 1.0), (0.0, f32::INFINITY)] {
        let (scale, usual) = (Scale { zero, per_count }, CalibrationSettings::default());
        let refused = |settings: CalibrationSettings| settings.build().unwrap_err().0;
        assert_eq!(refused(CalibrationSettings { voltage: scale, ..usual }), "voltage");
        assert_eq!(refused(CalibrationSettings { current: scale, ..usual }), "current");
        assert_eq!(refused(CalibrationSettings { speed: scale, ..usual }), "speed");
    }
}
