//! How fast the model runs free over a recording on one processor core: the core's stepper as a fit and the detector
//! use it, and the comparison's filter.
//!
//! `cargo bench -p greyrig-host --bench model`; an element is a recorded second, so that elements per second are times
//! real time. Required of the free run: 500 times real time.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use greyrig::motor::{FluxLaw, Motor, Parameters};
use greyrig::scalar::Scalar;
use greyrig_host::experiment::{Experiment, Imposed};
use greyrig_host::model::{Filter, Kind};
use greyrig_host::rig::Setup;

const SECONDS: f64 = 60.0;

/// R, L, K, J, μ0, μ1, μ2 near those of the rig's universal motor.
const VALUES: [f64; 7] = [2.2, 0.02, 0.00945, 1.8e-4, 0.015, 7.9e-6, 2.98e-8];

fn end_speed<S: Scalar<Base = S>>(experiment: &Experiment) -> S {
    let values = VALUES.map(S::constant);
    let motor = Motor::build(Parameters::from_values(FluxLaw::Series, values), &[]).expect("a possible motor");
    let mut last = S::ZERO;
    experiment.run(&motor, 1, Imposed::Nothing, |_, state| last = state.speed).expect("a motor that can be stepped");
    last
}

fn model(c: &mut Criterion) {
    let run = Setup::new(Kind::Universal).seconds(SECONDS).run().expect("a possible run");
    let experiment = Experiment::new(&run.recording, &Filter::default()).expect("a usable recording");
    let mut group = c.benchmark_group("model");
    group.sample_size(20).throughput(Throughput::Elements(SECONDS as u64));
    group.bench_function("free run f32", |b| b.iter(|| end_speed::<f32>(black_box(&experiment))));
    group.bench_function("free run f64", |b| b.iter(|| end_speed::<f64>(black_box(&experiment))));
    group.bench_function("filter one channel f64", |b| b.iter(|| experiment.filtered(black_box(&experiment.input))));
    group.finish();
}

criterion_group!(benches, model);
criterion_main!(benches);
