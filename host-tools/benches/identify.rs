//! How long an identification takes: 60 s at 10 kHz, a staircase and a ramp of 30 s each, jointly, with intervals.
//!
//! `cargo bench -p greyrig-host --bench identify`. Required: less than 5 s on two processor cores.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use greyrig_host::context::Context;
use greyrig_host::identify::{Settings, identify};
use greyrig_host::model::Kind;
use greyrig_host::rig::Setup;

fn identification(c: &mut Criterion) {
    let recordings = ["staircase", "ramp"].map(|profile| {
        let setup = Setup::new(Kind::Universal).seconds(30.0).seed(1).profile(profile).expect("a known profile");
        setup.run().expect("a possible run").recording
    });
    let settings = Settings::new(Kind::Universal);
    let mut group = c.benchmark_group("identify");
    group.sample_size(10).measurement_time(Duration::from_secs(30));
    group.bench_function("two recordings, 60 s", |b| {
        b.iter(|| identify(black_box(&recordings), &settings, &Context::quiet()).expect("an identifiable motor"));
    });
    group.finish();
}

criterion_group!(benches, identification);
criterion_main!(benches);
