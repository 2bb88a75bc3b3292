//! The functions of a unit's library, called as a simulator calls them, against formulas that know nothing of the code.

mod importer;

use greyrig::effects::{Effect, EffectId};
use greyrig::exchange::Variable;
use greyrig::motor::{BaseParameter, Constraints, FluxLaw, Motor, Parameters, Stepper};
use greyrig::parameters::Settings;
use greyrig::term::{Op, Target, Term};
use greyrig_fmi::importer::Status;
use importer::{Folder, Three, Two, messages};

/// The interval of the units, s.
const INTERVAL: f64 = 1e-4;

/// R, L, K, J of a magnet motor without dry friction, and its viscous friction. A step of the interval is a twentieth
/// of L/R: the error of a third-order step, some hundredths of its fourth power, is below the rounding of single
/// precision.
const MAGNET: [f64; 7] = [2.0, 4e-3, 0.05, 2e-5, 0.0, 8e-6, 0.0];

fn settings(law: FluxLaw, values: [f64; 7]) -> Settings {
    Settings { motor: Parameters::from_values(law, values.map(|x| x as f32)), ..Settings::default() }
}

fn magnet() -> Folder {
    Folder::of(&settings(FluxLaw::PermanentMagnet, MAGNET))
}

/// Where the magnet motor starts: in motion, as a rotor at rest waits a step for what turns it.
const START: [(Variable, f64); 2] = [(Variable::StartCurrent, 0.5), (Variable::StartSpeed, 10.0)];

/// Current and speed of the magnet motor so long after the voltage has been switched on at [`START`]: the two linear
/// equations `L i' = u − R i − K ω`, `J ω' = K i − μ1 ω`, by the roots of their characteristic polynomial.
fn switched_on(u: f64, t: f64) -> [f64; 2] {
    let [r, l, k, j, _, mu1, _] = MAGNET;
    let [(_, i0), (_, w0)] = START;
    let (a, b) = (r / l, mu1 / j);
    let (sum, product) = (a + b, a * b + k * k / (l * j));
    let root = (sum * sum / 4.0 - product).sqrt();
    let (p, q) = (-sum / 2.0 + root, -sum / 2.0 - root);
    let speed = k * u / (r * mu1 + k * k);
    let current = mu1 * speed / k;
    // x(t) = x∞ + c e^(pt) + d e^(qt), with the value and the slope at 0 that the equations give.
    let course = |steady: f64, start: f64, slope: f64| {
        let c = (slope - q * (start - steady)) / (p - q);
        let d = start - steady - c;
        steady + c * (p * t).exp() + d * (q * t).exp()
    };
    [course(current, i0, (u - r * i0 - k * w0) / l), course(speed, w0, (k * i0 - mu1 * w0) / j)]
}

/// In single precision: a part in 10⁵ of the largest value leaves ten rounding units for each of a few additions.
fn close(found: f64, expected: f64, largest: f64, what: &str) {
    assert!((found - expected).abs() <= 1e-5 * largest, "{what}: {found}, not {expected}");
}

#[test]
fn a_magnet_motor_does_as_its_equations_say() {
    let folder = magnet();
    let mut unit = Three::started(&folder, &START);
    unit.set(Variable::Voltage, 24.0);
    for n in 1..=2_000 {
        unit.step(INTERVAL);
        let [current, speed] = switched_on(24.0, f64::from(n) * INTERVAL);
        close(unit.get(Variable::Current), current, 12.0, "current");
        close(unit.get(Variable::Speed), speed, 480.0, "speed");
        close(unit.get(Variable::Torque), 0.05 * unit.get(Variable::Current), 0.6, "K i");
    }
}

/// Whatever the communication step, the voltage is held and the solution is the same.
#[test]
fn other_steps_than_the_interval_are_as_good() {
    for step in [0.3e-4, 1.5e-4, 1e-3, 3.7e-3] {
        let folder = magnet();
        let mut unit = Three::started(&folder, &START);
        unit.set(Variable::Voltage, 24.0);
        let steps = (0.05 / step) as u32;
        (0..steps).for_each(|_| unit.step(step));
        let [current, speed] = switched_on(24.0, f64::from(steps) * step);
        close(unit.get(Variable::Current), current, 12.0, "current");
        close(unit.get(Variable::Speed), speed, 480.0, "speed");
        assert!((unit.get(Variable::Time) - f64::from(steps) * step).abs() < 1e-12);
    }
}

#[test]
fn a_multiple_of_the_interval_has_the_same_bits() {
    let folder = magnet();
    let [mut fine, mut coarse] = [(); 2].map(|()| Three::started(&folder, &[]));
    for n in 0..100 {
        let voltage = f64::from(n % 7) - 2.0;
        fine.set(Variable::Voltage, voltage);
        coarse.set(Variable::Voltage, voltage);
        (0..5).for_each(|_| fine.step(INTERVAL));
        // As a simulator that sums up its time has it.
        coarse.step(5.0 * INTERVAL * (1.0 + 1e-12));
        assert_eq!(fine.outputs(), coarse.outputs());
    }
}

/// In the steady state K i = μ1 ω + T and u = R i + K ω.
#[test]
fn a_load_brakes() {
    let [r, _, k, _, _, mu1, _] = MAGNET;
    let folder = magnet();
    let mut unit = Three::started(&folder, &[]);
    unit.set(Variable::Voltage, 24.0);
    for load in [0.0, 0.1, 0.3, -0.1, 0.0] {
        unit.set(Variable::Load, load);
        (0..20).for_each(|_| unit.step(0.05));
        let speed = (k * 24.0 / r - load) / (k * k / r + mu1);
        close(unit.get(Variable::Speed), speed, 480.0, "speed");
        close(unit.get(Variable::Current), (mu1 * speed + load) / k, 12.0, "current");
    }
}

#[test]
fn dry_friction_holds_a_load_that_is_smaller() {
    let mut values = MAGNET;
    values[4] = 0.02;
    let folder = Folder::of(&settings(FluxLaw::PermanentMagnet, values));
    let mut unit = Three::started(&folder, &[]);
    unit.set(Variable::Load, 0.019);
    unit.step(0.1);
    assert_eq!(unit.get(Variable::Speed), 0.0);
    unit.set(Variable::Load, 0.021);
    unit.step(0.1);
    assert!(unit.get(Variable::Speed) < 0.0, "the load turns the motor");
}

/// What is set before the begin counts: a motor with R and K that were set runs as one that has them.
#[test]
fn parameters_can_be_set_before_the_begin() {
    let [r, k] = [BaseParameter::R, BaseParameter::K].map(Variable::Base);
    let folder = magnet();
    let mut values = MAGNET;
    (values[0], values[2]) = (3.1, 0.04);
    let other = Folder::of(&settings(FluxLaw::PermanentMagnet, values));
    let mut set = Three::started(&folder, &[(r, 3.1), (k, 0.04), (Variable::StartSpeed, 100.0)]);
    let mut built = Three::started(&other, &[(Variable::StartSpeed, 100.0)]);
    assert_eq!((set.get(r), built.get(k), set.get(Variable::Speed)), (3.1, 0.04, 100.0));
    for _ in 0..100 {
        for unit in [&mut set, &mut built] {
            unit.set(Variable::Voltage, 10.0);
            unit.step(INTERVAL);
        }
        assert_eq!(set.outputs(), built.outputs());
    }
}

/// The core's own stepper along a held voltage, with an effect and a term of the user's own.
#[test]
fn effects_and_terms_are_those_of_the_microcontroller() {
    let values = [2.2, 0.02, 9.45e-3, 1.8e-4, 0.015, 8e-6, 2.98e-8];
    let mut settings = settings(FluxLaw::Series, values);
    settings.effects.push(Effect::new(EffectId::Saturation, &[0.35, 6.0, 2.0])).unwrap();
    let ops = [Op::Unknown(0), Op::Current, Op::Mul, Op::Current, Op::Abs, Op::Mul];
    settings.terms.push(Term::build(Target::Voltage, &ops, [0.05, 0.0, 0.0, 0.0]).unwrap()).unwrap();
    let folder = Folder::of(&settings);
    let mut unit = Three::started(&folder, &[]);
    assert_eq!(unit.get(Variable::Effect { place: 0, parameter: 1 }), 6.0);
    assert_eq!(unit.get(Variable::Term { place: 0, unknown: 0 }), 0.05, "as it was written, not as it is rounded");
    let motor = Motor::build(settings.motor, &settings.effects).unwrap().with_terms(&settings.terms).unwrap();
    let mut stepper = Stepper::build(motor, INTERVAL as f32).unwrap();
    for n in 0..2_000 {
        let voltage = 100.0 * (f64::from(n) * 0.0314).sin();
        unit.set(Variable::Voltage, voltage);
        unit.step(INTERVAL);
        stepper.step(voltage as f32, voltage as f32, Constraints::FREE);
        let shown = stepper.reading();
        assert_eq!(unit.outputs()[..2], [shown.current, shown.speed].map(f64::from), "step {n}");
    }
}

#[test]
fn instances_do_not_disturb_each_other() {
    let folder = magnet();
    let run = |unit: &mut Three, n: i32, voltage: f64| {
        unit.set(Variable::Voltage, voltage * f64::from(n % 5));
        unit.step(INTERVAL);
        unit.outputs()
    };
    let alone = |voltage: f64| {
        let mut unit = Three::started(&folder, &[]);
        (0..50).map(|n| run(&mut unit, n, voltage)).collect::<Vec<_>>()
    };
    let expected = [alone(3.0), alone(-7.0)];
    let [mut one, mut other] = [(); 2].map(|()| Three::started(&folder, &[]));
    for n in 0..50 {
        assert_eq!(run(&mut one, n, 3.0), expected[0][n as usize]);
        assert_eq!(run(&mut other, n, -7.0), expected[1][n as usize]);
    }
}

#[test]
fn a_unit_can_be_reset_and_goes_back_to_a_state() {
    let folder = magnet();
    let mut unit = Three::started(&folder, &[]);
    let run = |unit: &mut Three| {
        unit.set(Variable::Voltage, 12.0);
        (0..20)
            .map(|_| {
                unit.step(INTERVAL);
                unit.outputs()
            })
            .collect::<Vec<_>>()
    };
    let first = run(&mut unit);
    let state = unit.state();
    let further = run(&mut unit);
    unit.go_back_to(&state);
    assert!((unit.get(Variable::Time) - 20.0 * INTERVAL).abs() < 1e-12);
    assert_eq!(run(&mut unit), further);
    unit.free(state);
    assert_eq!(unit.terminate(), Status::Ok);
    assert_eq!(unit.reset(), Status::Ok);
    unit.initialize(0.0);
    assert_eq!(run(&mut unit), first);
}

#[test]
fn both_versions_of_the_interface_give_the_same_bits() {
    let folder = magnet();
    let mut three = Three::started(&folder, &[(Variable::Base(BaseParameter::R), 2.5)]);
    let mut two = Two::started(&folder, &[(Variable::Base(BaseParameter::R), 2.5)]);
    for n in 0..200 {
        let voltage = f64::from(n % 11);
        three.set(Variable::Voltage, voltage);
        two.set(Variable::Voltage, voltage);
        three.step(INTERVAL);
        two.step(INTERVAL);
        assert_eq!(three.outputs(), two.outputs());
    }
}

#[test]
fn a_step_that_cannot_be_is_refused_and_nothing_moves() {
    let folder = magnet();
    let mut unit = Three::started(&folder, &[]);
    unit.set(Variable::Voltage, 24.0);
    unit.step(INTERVAL);
    let before = unit.outputs();
    for (time, step, says) in [
        (INTERVAL, 0.0, "has to be positive"),
        (INTERVAL, -1e-4, "multiple of the model's interval, 0.0001 s"),
        (INTERVAL, f64::NAN, "has to be positive"),
        (INTERVAL, f64::INFINITY, "has to be positive"),
        (5.0, INTERVAL, "does not go on from the present time, 0.0001 s"),
        (f64::NAN, INTERVAL, "does not go on from the present time"),
    ] {
        assert_eq!(unit.try_step(time, step), Status::Error, "{time} {step}");
        let told = messages().pop().expect("a message");
        assert!(told.contains(says), "{told}");
        assert_eq!(unit.outputs(), before);
    }
    unit.step(INTERVAL);
}

#[test]
fn what_cannot_be_set_or_read_is_told() {
    let folder = magnet();
    let mut unit = Three::started(&folder, &[]);
    for (number, value, says) in [
        (Variable::Current.number(), 1.0, "no input"),
        (Variable::Voltage.number(), f64::NAN, "no number"),
        (Variable::Voltage.number(), 1e300, "no number"),
        (Variable::Base(BaseParameter::R).number(), 1.0, "before and in the initialization"),
        (7, 1.0, "value reference 7"),
        (Variable::Effect { place: 0, parameter: 0 }.number(), 1.0, "no variable"),
        (u32::MAX, 1.0, "no variable"),
    ] {
        assert_eq!(unit.try_set(&[Variable::Voltage.number(), number], &[5.0, value]), Status::Error);
        let told = messages().pop().expect("a message");
        assert!(told.contains(says), "{told}");
        assert_eq!(unit.get(Variable::Voltage), 0.0, "all of them, or none");
    }
    assert_eq!(unit.try_set(&[1], &[]), Status::Error);
    assert_eq!(unit.try_get(99), Status::Error);
    assert_eq!(unit.with_null_arrays(), Status::Error);
    assert_eq!(unit.of_another_type(), [Status::Ok, Status::Error]);
}

#[test]
fn a_parameter_that_no_motor_can_have_is_told_at_the_end_of_the_initialization() {
    let folder = magnet();
    let mut unit = Three::made(&folder).expect("an instance");
    unit.set(Variable::Base(BaseParameter::L), -1.0);
    assert_eq!(unit.try_step(0.0, INTERVAL), Status::Error, "not before the initialization");
    assert_eq!(unit.enter(0.0), Status::Ok);
    assert_eq!(unit.exit(), Status::Error);
    let told = messages().pop().expect("a message");
    assert!(told.contains('L') && told.contains("between"), "{told}");
    // It can be mended.
    unit.set(Variable::Base(BaseParameter::L), 1e-3);
    assert_eq!(unit.exit(), Status::Ok);
}

#[test]
fn resources_that_do_not_belong_are_refused() {
    let folder = magnet();
    assert!(Three::with_token(&folder, "{another}").is_none());
    assert!(messages().pop().expect("a message").contains("token"));
    assert!(Two::with_token(&folder, "{another}").is_none());
    assert!(messages().pop().expect("a message").contains("token"));
    for spoil in [&mut |bytes: &mut Vec<u8>| bytes[40] ^= 1, &mut |bytes: &mut Vec<u8>| bytes.truncate(9)]
        as [&mut dyn FnMut(&mut Vec<u8>); 2]
    {
        let folder = magnet();
        let mut bytes = std::fs::read(folder.block()).unwrap();
        spoil(&mut bytes);
        std::fs::write(folder.block(), bytes).unwrap();
        assert!(Three::made(&folder).is_none());
        let told = messages().pop().expect("a message");
        assert!(told.contains("motor.bin") && told.contains("export the unit again"), "{told}");
    }
    let folder = magnet();
    std::fs::remove_file(folder.block()).unwrap();
    assert!(Three::made(&folder).is_none());
    assert!(messages().pop().expect("a message").contains("motor.bin"));
    assert!(importer::model_exchange(&magnet()).is_null());
}
