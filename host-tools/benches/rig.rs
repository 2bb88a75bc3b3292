//! How fast the virtual rig runs: seconds of the motor's life for each second of one processor core, chain included.
//!
//! `cargo bench -p greyrig-host --bench rig`; criterion prints elements per second, and an element is a simulated
//! second. On one virtual core of 2026 (x86-64, release, two shared cores): base 145, saturation 80, five effects 40
//! times real time.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use greyrig_host::rig::{Kind, Setup};

fn rig(c: &mut Criterion) {
    let mut group = c.benchmark_group("rig");
    group.sample_size(20).throughput(Throughput::Elements(2));
    let everything = ["saturation", "hysteresis", "eddy_current", "brush_drop", "winding_temperature"];
    for (name, effects) in [("base", &[][..]), ("saturation", &["saturation"]), ("five effects", &everything)] {
        let setup = effects
            .iter()
            .try_fold(Setup::new(Kind::Universal).seconds(2.0), |setup, effect| setup.effect(effect))
            .expect("known effects");
        group.bench_function(name, |b| b.iter(|| black_box(&setup).run().expect("a possible run")));
    }
    group.finish();
}

criterion_group!(benches, rig);
criterion_main!(benches);
