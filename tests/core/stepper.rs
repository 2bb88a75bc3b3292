//! The stepper against a reference integration (Runge–Kutta of the `ode_solvers` crate, in f64, with steps so small
//! that halving them changes the result by less than 1e-7) with the same input, linear between samples.

use std::f64::consts::PI;

use greyrig::motor::{Constraints, FluxLaw, LIMITS, Motor, Parameters, State, Stepper};
use ode_solvers::{Rk4, SVector, System};
use proptest::prelude::*;

const H: f64 = 1e-4;

/// The 1.4 kW vacuum-cleaner motor.
pub const UNIVERSAL: Parameters<f64> = Parameters {
    flux_law: FluxLaw::Series,
    resistance: 2.2,
    inductance: 20e-3,
    flux_coefficient: 9.45e-3,
    inertia: 1.8e-4,
    dry_friction: 0.015,
    viscous_friction: 8e-6,
    turbulent_friction: 2.98e-8,
};

/// A coreless 24 V motor: R/L is 23,500 1/s, far too stiff for an explicit step of 100 µs.
const CORELESS: Parameters<f64> = Parameters {
    flux_law: FluxLaw::PermanentMagnet,
    resistance: 2.35,
    inductance: 1e-4,
    flux_coefficient: 0.0226,
    inertia: 1.1e-6,
    dry_friction: 1.2e-3,
    viscous_friction: 1e-7,
    turbulent_friction: 0.0,
};

fn single(p: &Parameters<f64>) -> Parameters<f32> {
    Parameters::from_values(p.flux_law, p.values().map(|v| v as f32))
}

/// The equations written once more, for one interval with linear voltage.
struct Interval {
    p: Parameters<f64>,
    from: f64,
    slope: f64,
    direction: f64,
}

impl System<f64, SVector<f64, 2>> for Interval {
    fn system(&self, t: f64, y: &SVector<f64, 2>, dy: &mut SVector<f64, 2>) {
        let (p, i, w) = (&self.p, y[0], y[1]);
        let u = self.from + self.slope * t;
        let flux = if p.flux_law == FluxLaw::Series { i } else { 1.0 };
        dy[0] = (u - p.resistance * i - p.flux_coefficient * flux * w) / p.inductance;
        dy[1] = (p.flux_coefficient * flux * i
            - self.direction * p.dry_friction
            - p.viscous_friction * w
            - p.turbulent_friction * w * w.abs())
            / p.inertia;
        if self.direction == 0.0 {
            dy[1] = 0.0;
        }
    }
}

/// Reference: sample by sample with `steps` Runge–Kutta steps each, and sign changes of the speed located to 1 µs.
fn integrate(p: &Parameters<f64>, start: State<f64>, u: &[f64], steps: u32) -> Vec<State<f64>> {
    let mut state = start;
    let mut states = vec![state];
    for pair in u.windows(2) {
        let parts = if state.speed.abs() < 100.0 { 100 } else { 1 };
        let slope = (pair[1] - pair[0]) / H;
        for part in 0..parts {
            let h = H / f64::from(parts);
            let from = pair[0] + slope * h * f64::from(part);
            let flux = if p.flux_law == FluxLaw::Series { state.current } else { 1.0 };
            let torque = p.flux_coefficient * flux * state.current;
            let direction = if state.speed != 0.0 {
                state.speed.signum()
            } else if torque.abs() > p.dry_friction {
                torque.signum()
            } else {
                0.0
            };
            let system = Interval { p: *p, from, slope, direction };
            let y0 = SVector::<f64, 2>::new(state.current, state.speed);
            let mut solver = Rk4::new(system, 0.0, y0, h, h / f64::from((steps / parts).max(1)));
            solver.integrate().expect("the reference integrates");
            let y = solver.y_out().last().expect("a last point");
            state = State { current: y[0], speed: y[1] };
            if direction * state.speed < 0.0 {
                state.speed = 0.0;
            }
        }
        states.push(state);
    }
    states
}

fn reference(p: &Parameters<f64>, start: State<f64>, u: &[f64]) -> Vec<State<f64>> {
    let fine = integrate(p, start, u, 128);
    let coarse = integrate(p, start, u, 64);
    let own_error = relative_rms(&coarse, &fine, |s| s.current).max(relative_rms(&coarse, &fine, |s| s.speed));
    assert!(own_error < 1e-6, "the reference itself is off by {own_error:e}");
    fine
}

fn in_single_precision(p: &Parameters<f64>, start: State<f64>, u: &[f64]) -> Vec<State<f64>> {
    let motor = Motor::build(single(p), &[]).expect("valid parameters");
    let mut stepper = Stepper::build(motor, H as f32).unwrap();
    stepper.set_state(State { current: start.current as f32, speed: start.speed as f32 });
    let mut states = vec![start];
    for pair in u.windows(2) {
        let s = stepper.step(pair[0] as f32, pair[1] as f32, Constraints::FREE);
        states.push(State { current: f64::from(s.current), speed: f64::from(s.speed) });
    }
    states
}

fn relative_rms(a: &[State<f64>], b: &[State<f64>], of: impl Fn(&State<f64>) -> f64) -> f64 {
    let error: f64 = a.iter().zip(b).map(|(a, b)| (of(a) - of(b)).powi(2)).sum();
    let size: f64 = b.iter().map(|b| of(b).powi(2)).sum();
    (error / size).sqrt()
}

/// The accuracy that the core promises: 0.1 % RMS of a reference with the same input.
fn assert_accurate(name: &str, p: &Parameters<f64>, start: State<f64>, u: &[f64]) {
    let ours = in_single_precision(p, start, u);
    let reference = reference(p, start, u);
    let current = relative_rms(&ours, &reference, |s| s.current);
    let speed = relative_rms(&ours, &reference, |s| s.speed);
    println!("{name:40} current {current:.1e} speed {speed:.1e}");
    assert!(current < 1e-3, "{name}: current is off by {current:e}");
    assert!(speed < 1e-3 || reference.iter().all(|s| s.speed == 0.0), "{name}: speed is off by {speed:e}");
}

fn sampled(seconds: f64, u: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..=(seconds / H) as usize).map(|n| u(n as f64 * H)).collect()
}

fn mains(rms: f64, hertz: f64) -> impl Fn(f64) -> f64 {
    move |t| rms * 2f64.sqrt() * (2.0 * PI * hertz * t).sin()
}

#[test]
fn universal_motor_on_ac() {
    let rest = State::default();
    assert_accurate("direct start, 230 V 50 Hz", &UNIVERSAL, rest, &sampled(2.0, mains(230.0, 50.0)));
    assert_accurate("direct start, 120 V 60 Hz", &UNIVERSAL, rest, &sampled(2.0, mains(120.0, 60.0)));
    let fast = State { current: 0.0, speed: 6910.0 };
    assert_accurate("twice nominal speed, 460 V", &UNIVERSAL, fast, &sampled(1.0, mains(460.0, 50.0)));
    assert_accurate("low voltage, 20 V", &UNIVERSAL, rest, &sampled(2.0, mains(20.0, 50.0)));
}

#[test]
fn universal_motor_with_phase_angle_control() {
    let chopped = |t: f64| {
        let phase = (100.0 * t).fract();
        if phase < 0.4 { 0.0 } else { mains(230.0, 50.0)(t) }
    };
    assert_accurate("phase angle 72°", &UNIVERSAL, State::default(), &sampled(2.0, chopped));
    let fast = State { current: 0.0, speed: 6910.0 };
    assert_accurate("phase angle, twice nominal speed", &UNIVERSAL, fast, &sampled(0.5, chopped));
}

#[test]
fn dc_steps() {
    let steps = |t: f64| {
        if t < 0.3 {
            60.0
        } else if t < 0.6 {
            160.0
        } else {
            20.0
        }
    };
    assert_accurate("universal motor, DC steps", &UNIVERSAL, State::default(), &sampled(1.0, steps));
    let reversing = |t: f64| if (2.5 * t).fract() < 0.5 { 24.0 } else { -12.0 };
    assert_accurate("coreless motor, reversing steps", &CORELESS, State::default(), &sampled(1.2, reversing));
}

#[test]
fn converges_with_third_order() {
    // Smooth motion in one direction, voltage linear over the whole span and hence the same for every step size; the
    // steps are coarse enough that rounding in f64 plays no part.
    let at_the_end = |steps: u32| {
        let h = 0.002 / f64::from(steps);
        let u = |k: u32| 100.0 + 5000.0 * h * f64::from(k);
        let mut stepper = Stepper::build(Motor::build(UNIVERSAL, &[]).unwrap(), h).unwrap();
        stepper.set_state(State { current: 1.0, speed: 3000.0 });
        (0..steps).map(|k| stepper.step(u(k), u(k + 1), Constraints::FREE).current).last().unwrap()
    };
    let exact = at_the_end(2000);
    let errors: Vec<f64> = [2, 4, 8, 16].map(|n| (at_the_end(n) - exact).abs()).to_vec();
    let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
    assert!(orders.iter().all(|o| (2.7..3.4).contains(o)), "errors {errors:?}, observed orders {orders:?}");
}

#[test]
fn follows_the_analytic_rl_response_when_locked() {
    let motor = Motor::build(single(&UNIVERSAL), &[]).unwrap();
    let mut stepper = Stepper::build(motor, H as f32).unwrap();
    let locked = Constraints::ROTOR_LOCKED;
    let tau = UNIVERSAL.inductance / UNIVERSAL.resistance;
    for n in 1..=1000 {
        let i = f64::from(stepper.step(10.0, 10.0, locked).current);
        let exact = 10.0 / UNIVERSAL.resistance * (1.0 - (-(f64::from(n) * H) / tau).exp());
        assert!((i - exact).abs() < 1e-4 * exact.max(0.1), "sample {n}: {i} instead of {exact}");
        assert_eq!(stepper.state().speed, 0.0);
    }
}

#[test]
fn coasts_down_like_the_analytic_solution() {
    // With the supply open J dω/dt = −μ0 − μ1 ω − μ2 ω² has the solution ω = q tan(atan((ω0 + p)/q) − t μ2 q / J) − p
    // with p = μ1/(2 μ2) and q = sqrt(μ0/μ2 − p²).
    let m = UNIVERSAL;
    let p = m.viscous_friction / (2.0 * m.turbulent_friction);
    let q = (m.dry_friction / m.turbulent_friction - p * p).sqrt();
    let start = 3455.0;
    let exact = |t: f64| q * (((start + p) / q).atan() - t * m.turbulent_friction * q / m.inertia).tan() - p;
    let stop = m.inertia / (m.turbulent_friction * q) * (((start + p) / q).atan() - (p / q).atan());
    let mut stepper = Stepper::build(Motor::build(single(&m), &[]).unwrap(), H as f32).unwrap();
    stepper.set_state(State { current: 3.0, speed: start as f32 });
    let open = Constraints::SUPPLY_OPEN;
    let samples = ((stop + 1.0) / H) as usize;
    for n in 1..=samples {
        let t = n as f64 * H;
        let state = stepper.step(0.0, 0.0, open);
        assert_eq!(state.current, 0.0);
        let expected = if t < stop { exact(t) } else { 0.0 };
        // 0.02 rad/s is 6e-6 of the initial speed: rounding of the parameters to f32.
        assert!((f64::from(state.speed) - expected).abs() < 0.02, "{t} s: {} not {expected}", state.speed);
    }
    assert_eq!(stepper.state().speed, 0.0, "the rotor rests in the end");
}

#[test]
fn sticks_below_breakaway_and_turns_above() {
    let motor = Motor::build(single(&CORELESS), &[]).unwrap();
    let breakaway = (CORELESS.dry_friction / CORELESS.flux_coefficient * CORELESS.resistance) as f32;
    for (u, sign) in [(0.98, 0), (-0.98, 0), (1.02, 1), (-1.02, -1)] {
        let mut stepper = Stepper::build(motor.clone(), H as f32).unwrap();
        for _ in 0..2000 {
            stepper.step(u * breakaway, u * breakaway, Constraints::FREE);
        }
        let speed = stepper.state().speed;
        let moves = if speed > 0.0 {
            1
        } else if speed < 0.0 {
            -1
        } else {
            0
        };
        assert_eq!(moves, sign, "at {u} of the breakaway voltage the speed is {speed}");
    }
}

#[test]
fn small_accelerations_are_not_lost_in_rounding() {
    // Coasting at 3,000 rad/s with 0.1 rad/s²: an increment of 1e-5 is a tenth of a rounding unit of f32 there.
    let p = Parameters { dry_friction: 1.8e-5, viscous_friction: 0.0, turbulent_friction: 0.0, ..UNIVERSAL };
    let mut stepper = Stepper::build(Motor::build(single(&p), &[]).unwrap(), H as f32).unwrap();
    stepper.set_state(State { current: 0.0, speed: 3000.0 });
    for _ in 0..100_000 {
        stepper.step(0.0, 0.0, Constraints::SUPPLY_OPEN);
    }
    let lost = 3000.0 - f64::from(stepper.state().speed);
    assert!((lost - 1.0).abs() < 1e-3, "ten seconds took {lost} rad/s instead of 1");
}

fn log_uniform(least: f64, greatest: f64) -> impl Strategy<Value = f64> {
    (least.ln()..greatest.ln()).prop_map(f64::exp)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, max_global_rejects: 30_000, ..ProptestConfig::default() })]

    /// A passive motor on a bounded voltage keeps bounded, whatever the parameters that validation admits: it never
    /// stores more than twice the energy that the supply has delivered.
    #[test]
    fn stable_for_all_admitted_parameters(
        series in any::<bool>(),
        r in log_uniform(1e-4, 1e5), l in log_uniform(1e-7, 1e2), k in log_uniform(1e-7, 1e4),
        j in log_uniform(1e-10, 1e5), mu0 in log_uniform(1e-9, 1e5), mu1 in log_uniform(1e-9, 1e5),
        mu2 in log_uniform(1e-12, 1e4), load in 0.0f64..1.0, ac in any::<bool>(),
    ) {
        let p = Parameters {
            flux_law: if series { FluxLaw::Series } else { FluxLaw::PermanentMagnet },
            resistance: r as f32, inductance: l as f32, flux_coefficient: k as f32, inertia: j as f32,
            dry_friction: mu0 as f32, viscous_friction: mu1 as f32, turbulent_friction: mu2 as f32,
        };
        let built = Stepper::build(Motor::build(p, &[]).unwrap(), H as f32);
        prop_assume!(built.is_ok());
        let mut stepper = built.unwrap();
        let volts: f64 = load * (r * LIMITS.0).min(1000.0);
        let u = |n: u32| if ac { volts * (2.0 * PI * 50.0 * f64::from(n) * H).sin() } else { volts } as f32;
        // What one step alone may put into an empty motor before the sum below has seen any current.
        let first_step = 0.5 * l * (volts * (H / l).min(1.0 / r)).powi(2) + volts * volts / r * H;
        let mut supplied = first_step;
        for n in 0..3000 {
            let before = stepper.state();
            let s = stepper.step(u(n), u(n + 1), Constraints::FREE);
            prop_assert!(s.current.is_finite() && s.speed.is_finite(), "sample {n}: {s:?}");
            supplied += volts * H * f64::from(before.current.abs().max(s.current.abs()));
            let stored = 0.5 * l * f64::from(s.current).powi(2) + 0.5 * j * f64::from(s.speed).powi(2);
            prop_assert!(stored <= 2.0 * supplied, "sample {n}: {stored} J stored, {supplied} J supplied, {s:?}");
        }
    }
}
