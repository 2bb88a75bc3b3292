//! Single figures by hand, of parts that the other tests reach only in the middle of a run.

use greyrig::anfis::{Firing, Premise, Settings3x3, Shape};
use greyrig::app::Window;
use greyrig::detector::{Features, PeriodClock};
use greyrig::effects::{Effect, EffectId};
use greyrig::exchange::Variable;
use greyrig::link::message::{Greeting, PROTOCOL};
use greyrig::motor::{
    BaseParameter, Constraints, FluxLaw, Gradient, Motor, OperatingPoint, ParameterError, Parameters, State, Stepper,
};
use greyrig::parameters::Settings;
use greyrig::scalar::Scalar;
use greyrig::term::{Op, Target, Term};
use greyrig::tick::Output;

use crate::stepper::UNIVERSAL;

/// A few roundings of `f64`.
fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1e-3), "{found} against {expected}");
}

/// (μ1 + μ2 |ω|) ω + μ0 sgn ω at 100 rad/s: (8e-6 + 2.98e-6) 100 + 0.015.
#[test]
fn a_load_is_friction_less_what_drives() {
    let plain = Motor::build(UNIVERSAL, &[]).unwrap();
    close(plain.load_torque(100.0, 1.0), 0.016_098);
    close(plain.load_torque(-100.0, -1.0), -0.016_098);
    close(plain.load_torque(100.0, 0.0), 0.001_098);
    // An asymmetry acts one way whatever the direction: 1e-6 |ω| and 0.002.
    let lame = Effect::new(EffectId::AsymmetricFriction, &[1e-6, 0.002]);
    close(Motor::build(UNIVERSAL, &[lame]).unwrap().load_torque(-100.0, -1.0), -0.016_098 + 1e-4 + 0.002);
    let held_back = Effect::new(EffectId::TorqueOffset, &[0.003]);
    close(Motor::build(UNIVERSAL, &[held_back]).unwrap().load_torque(100.0, 1.0), 0.016_098 + 0.003);
}

/// K = 0.02 V s, J = 1e-5 kg m², dry friction alone.
fn slowing(dry_friction: f64) -> Parameters<f64> {
    Parameters::from_values(FluxLaw::PermanentMagnet, [2.0, 1e-3, 0.02, 1e-5, dry_friction, 0.0, 0.0])
}

/// The speed after a step of 100 µs at a held current.
fn after_a_step(motor: Motor<f64>, current: f64, speed: f64) -> f64 {
    let mut stepper = Stepper::build(motor, 1e-4).unwrap();
    stepper.go_on_in(State { current, speed }, 0.0);
    stepper.step(0.0, 0.0, Constraints { current: Some(current), speed: None }).speed
}

/// With −10 mN m and 1 mN m of friction a rotor of 0.022 rad/s is at rest after a fifth of the step (1100 rad/s²), and
/// turns back at 900 rad/s² for four fifths: −0.072 rad/s.
#[test]
fn a_rotor_that_turns_round_has_its_friction_turned_round() {
    let found = after_a_step(Motor::build(slowing(1e-3), &[]).unwrap(), -0.5, 0.022);
    assert!((found + 0.072).abs() < 1e-9, "{found}");
    let mirrored = after_a_step(Motor::build(slowing(1e-3), &[]).unwrap(), 0.5, -0.022);
    assert!((mirrored - 0.072).abs() < 1e-9, "{mirrored}");
    // Less than the friction holds it.
    assert_eq!(after_a_step(Motor::build(slowing(1e-3), &[]).unwrap(), -0.04, 0.003), 0.0);
}

/// The current's −0.2 mN m are less than the friction of 0.5 mN m; with 1 mN m that act beside it, of an effect behind
/// another one or of a term, 0.7 mN m are left: from 0.004 rad/s it slows down at 170 rad/s² and comes back at 70.
#[test]
fn what_acts_at_rest_turns_a_rotor_round() {
    let expected = -70.0 * (1e-4 - 0.004 / 170.0);
    let brushes = Effect::new(EffectId::BrushDrop, &[2.0, 0.1]);
    let offset = Effect::new(EffectId::TorqueOffset, &[1e-3]);
    let with_effect = after_a_step(Motor::build(slowing(5e-4), &[brushes, offset]).unwrap(), -0.01, 0.004);
    assert!((with_effect - expected).abs() < 1e-9, "{with_effect}");
    let term = Term::build(Target::Torque, &[Op::Unknown(0)], [1e-3, 0.0, 0.0, 0.0]).unwrap();
    let motor = Motor::build(slowing(5e-4), &[]).unwrap().with_terms(&[term]).unwrap();
    let with_term = after_a_step(motor, -0.01, 0.004);
    assert!((with_term - expected).abs() < 1e-9, "{with_term}");
    assert_eq!(after_a_step(Motor::build(slowing(5e-4), &[brushes]).unwrap(), -0.01, 0.004), 0.0);
}

/// Flux that lags by T = 0.1 ms makes of 20 mH at 1000 rad/s, x = T K ω/L = 0.047 25 of it, L/(1 + x), and where it
/// turns the other way, L (1 + x).
#[test]
fn flux_that_lags_changes_the_inductance() {
    let motor = Motor::build(UNIVERSAL, &[Effect::new(EffectId::EddyCurrent, &[1e-4, 0.0])]).unwrap();
    let memories = std::array::from_fn(|_| Default::default());
    let inductance = |speed: f64| motor.slopes(&OperatingPoint::unsupplied(5.0, speed), None, &memories).inductance;
    close(inductance(1000.0), 0.02 / 1.047_25);
    close(inductance(-1000.0), 0.02 * 1.047_25);
    close(inductance(0.0), 0.02);
}

/// Half a volt second times a quarter of an ampere is an eighth of a newton metre, all of them exact in binary.
#[test]
fn a_rotor_begins_to_turn_beyond_its_friction() {
    let parameters = Parameters::from_values(FluxLaw::PermanentMagnet, [2.0, 1e-3, 0.5, 1e-3, 0.125, 0.0, 0.0]);
    let motor = Motor::build(parameters, &[]).unwrap();
    let memories = std::array::from_fn(|_| Default::default());
    let direction = |current| motor.slopes(&OperatingPoint::unsupplied(current, 0.0), None, &memories).direction;
    assert_eq!([0.25, -0.25, 0.26, -0.26].map(direction), [0.0, 0.0, 1.0, -1.0]);
}

/// At 100 A and 10,000 rad/s, of h/J = r: h K² i²/J h/L is 0.5 r with K = 0.1 V s/A and 20 mH; h K i/(J ω) is 0.01 r
/// with 1 V s; 2 h μ2 ω/J is 0.02 r with 1e-6. Each may be 1.
#[test]
fn a_motor_is_slower_than_the_sampling() {
    let refused = |law: FluxLaw, [k, mu2]: [f64; 2], rate: f64| {
        let parameters = Parameters::from_values(law, [2.0, 0.02, k, 1e-4 / rate, 0.0, 0.0, mu2]);
        match Stepper::build(Motor::build(parameters, &[]).unwrap(), 1e-4) {
            Ok(_) => false,
            Err(error) => {
                assert_eq!(error, ParameterError::FasterThanSampling);
                true
            }
        }
    };
    for (law, values, most) in [
        (FluxLaw::Series, [0.1, 0.0], 2.0),
        (FluxLaw::PermanentMagnet, [1.0, 0.0], 100.0),
        (FluxLaw::PermanentMagnet, [0.01, 1e-6], 50.0),
        (FluxLaw::PermanentMagnet, [0.01, -1e-6], 50.0),
    ] {
        assert!(!refused(law, values, 0.95 * most) && refused(law, values, 1.05 * most), "{law:?} {values:?}");
    }
}

/// h R/L of three quarters, exact in binary, takes one step; a little more takes two, and a little more than 1.5 three.
#[test]
fn a_quick_circuit_is_stepped_more_often() {
    let substeps = |resistance: f64| {
        let values = [resistance, 1.0 / 256.0, 0.01, 0.01, 0.0, 0.0, 0.0];
        let motor = Motor::build(Parameters::from_values(FluxLaw::PermanentMagnet, values), &[]).unwrap();
        Stepper::build(motor, 1.0 / 1024.0).unwrap().substeps()
    };
    assert_eq!([2.9, 3.0, 3.1, 6.0, 6.1, 40.0, 1000.0].map(substeps), [1, 1, 2, 2, 3, 14, 16]);
}

/// The tables of derivatives, at 0.7 and at −0.7.
#[test]
fn functions_have_the_derivatives_of_the_tables() {
    for x in [0.7, -0.7] {
        let of = |f: fn(Gradient<f64>) -> Gradient<f64>, value: f64, slope: f64| {
            let (by_current, by_speed) = (f(Gradient::current(x)), f(Gradient::speed(x)));
            // The functions are good to a few units of the twelfth digit.
            for (found, expected) in [
                (by_current.value, value),
                (by_current.by_current, slope),
                (by_current.by_speed, 0.0),
                (by_speed.by_speed, slope),
                (by_speed.by_current, 0.0),
            ] {
                assert!((found - expected).abs() < 1e-9, "{x}: {found} against {expected}");
            }
        };
        of(Scalar::exp, x.exp(), x.exp());
        of(Scalar::tanh, x.tanh(), 1.0 / x.cosh().powi(2));
        of(Scalar::atan, x.atan(), 1.0 / 1.49);
        of(Scalar::sin, x.sin(), x.cos());
        of(Scalar::cos, x.cos(), -x.sin());
        of(Scalar::abs, 0.7, x.signum());
        if x > 0.0 {
            of(Scalar::ln, x.ln(), 1.0 / x);
            of(Scalar::sqrt, x.sqrt(), 0.5 / x.sqrt());
        }
    }
}

#[test]
fn parameters_are_found_by_their_names() {
    for (name, parameter) in ["R", "L", "K", "J", "mu0", "mu1", "mu2"].into_iter().zip(BaseParameter::ALL) {
        assert_eq!(BaseParameter::of_name(name), Some(parameter));
    }
    assert_eq!(BaseParameter::of_name("r"), None);
}

#[test]
fn the_ends_of_a_range_are_within_it() {
    for (place, parameter) in BaseParameter::ALL.into_iter().enumerate() {
        let (least, greatest) = parameter.range();
        let with = |value: f64| {
            let mut values = UNIVERSAL.values();
            values[place] = value;
            Parameters::from_values(FluxLaw::Series, values).validate()
        };
        assert_eq!((with(least), with(greatest)), (Ok(()), Ok(())), "{parameter:?}");
        let outside = Err(ParameterError::OutOfRange { name: parameter.name(), least, greatest });
        assert_eq!(with(greatest + greatest.abs()), outside);
        assert_eq!(with(least - least.abs().max(1.0)), outside);
        assert_eq!(with(f64::NAN), Err(ParameterError::NotFinite(parameter.name())));
    }
}

#[test]
fn features_of_periods_have_a_mean() {
    let of = |sparking: f32, speed_mean: f32| Features { sparking, speed_mean, ..Features::default() };
    let mean = Features::mean([of(1.0, 300.0), of(2.0, 100.0), of(6.0, 200.0)].iter());
    // Three roundings of `f32`.
    assert!((mean.sparking - 3.0).abs() < 1e-6 && (mean.speed_mean - 200.0).abs() < 1e-4, "{mean:?}");
    assert_eq!(Features::mean(std::iter::empty()), Features::default());
}

/// Of 100 V a rise through zero counts after −5 V were passed, and not where they were just reached.
#[test]
fn a_period_begins_after_a_twentieth_of_the_voltage() {
    let ends = |lowest: f32| {
        let mut clock = PeriodClock::new(10_000.0, 100.0);
        // A period of 17 ms, from one rise to the next; direct voltage has one of 20 ms.
        let wave = |n: u32| if n % 170 < 85 { 50.0 } else { lowest };
        (0..1000).filter_map(|n| clock.process(wave(n)).map(|_| n)).any(|n| n == 340)
    };
    assert!(ends(-5.01) && !ends(-5.0));
}

/// Voltages 3 and 4 V: √12.5; currents 1 and 7 A: 5; speeds 100 and 200 rad/s; residuals 2 and 4 A, −30 and 30 rad/s.
#[test]
fn a_report_has_root_mean_squares_and_means() {
    let output = |voltage: f32, current: f32, speed: f32, apart: [f32; 2]| Output {
        raw: [voltage, current],
        measured: State { current, speed },
        modelled: State { current: current + apart[0], speed: speed + apart[1] },
        validity: 1.0,
        crossed_zero: false,
    };
    let window = Window::default().with(6, &output(3.0, 1.0, 100.0, [2.0, -30.0]));
    let report = window.with(7, &output(4.0, 7.0, 200.0, [4.0, 30.0])).report();
    assert_eq!((report.sample, report.count, report.speed), (7, 2, 150.0));
    for (found, expected) in [
        (report.voltage_rms, 12.5f32.sqrt()),
        (report.current_rms, 5.0),
        (report.residual_current_rms, 10f32.sqrt()),
        (report.residual_speed_rms, 30.0),
    ] {
        // The root of the display is off by up to 0.2 %.
        assert!((found / expected - 1.0).abs() < 2.5e-3, "{found} against {expected}");
    }
}

#[test]
fn a_variable_of_another_program_is_the_settings_parameter() {
    let motor = Parameters::from_values(FluxLaw::Series, [2.2, 0.02, 9.45e-3, 1.8e-4, 0.015, 8e-6, 2.98e-8]);
    let mut settings = Settings { motor, ..Settings::default() };
    assert_eq!(Variable::Base(BaseParameter::J).value(&settings), Some(1.8e-4));
    assert_eq!(Variable::Speed.value(&settings), None, "no parameter");
    assert_eq!(Variable::Effect { place: 0, parameter: 0 }.value(&settings), None, "no effect");
    let ops = [Op::Unknown(0), Op::Unknown(1), Op::Mul];
    settings.terms.push(Term::build(Target::Torque, &ops, [3.0, 5.0, 0.0, 0.0]).unwrap()).unwrap();
    assert_eq!(Variable::Term { place: 0, unknown: 1 }.value(&settings), Some(5.0));
    assert_eq!(Variable::Term { place: 1, unknown: 0 }.value(&settings), None, "no second term");
    // What is set is that and nothing else.
    settings.effects.push(Effect::new(EffectId::BrushDrop, &[2.0, 0.1])).unwrap();
    let (own, of_effect) = (Variable::Base(BaseParameter::R), Variable::Effect { place: 0, parameter: 1 });
    let of_term = Variable::Term { place: 0, unknown: 0 };
    for (variable, number) in [(own, 2.5), (of_effect, 0.2), (of_term, 7.0)] {
        assert_eq!(variable.set(&mut settings, number), Some(()));
    }
    assert_eq!([own, of_effect, of_term].map(|v| v.value(&settings).unwrap()), [2.5, 0.2, 7.0]);
    assert_eq!(settings.motor.values()[1..], [0.02, 9.45e-3, 1.8e-4, 0.015, 8e-6, 2.98e-8]);
    assert_eq!(settings.effects[0].values()[0], 2.0);
    assert_eq!(settings.terms[0].unknowns()[..2], [7.0, 5.0]);
    assert_eq!(Variable::Torque.set(&mut settings, 1.0), None);
    for number in [6, 7] {
        assert_eq!(Variable::with_number(number), None);
    }
    assert_eq!(Variable::with_number(5), Some(Variable::Torque));
}

/// Each number with a digit beyond the seventh becomes that of `f32`.
#[test]
fn a_network_in_single_precision_has_every_number_rounded() {
    let long = 0.123_456_789_012_345;
    let short = f64::from(0.123_456_79_f32);
    let of = |x: f64| Settings3x3 {
        shape: Shape::Bell,
        firing: Firing::Product,
        premise: [[Premise { a: x, b: 2.0 + x, c: x }; 3]; 3],
        slopes: [[x; 3]; 27],
        constants: [x; 27],
        inputs: [(-x, x); 3],
        output: (-x, x),
        margin: x,
    };
    let mut expected = of(short);
    expected.premise.as_flattened_mut().iter_mut().for_each(|p| p.b = f64::from(2.123_456_8_f32));
    assert_eq!(of(long).in_single_precision(), expected);
}

/// Reply 7 with an identity; then in postcard's form, small numbers as they are, protocol, fingerprint, and a text of
/// one letter behind its length.
#[test]
fn a_partner_of_another_version_greets() {
    let body = |protocol: u8| [0, 7, 0, protocol, 9, 1, b'x', 200, 200];
    let other = body(PROTOCOL as u8 + 1);
    let greeting = Greeting::of_another_version(&other).unwrap();
    assert_eq!((greeting.protocol, greeting.fingerprint, greeting.firmware), (PROTOCOL + 1, 9, "x"));
    assert_eq!(Greeting::of_another_version(&body(PROTOCOL as u8)), None, "this version");
    assert_eq!(Greeting::of_another_version(&[1, 7, 0, 4, 9, 1, b'x']), None, "no reply");
}
