//! Samples per second of the render loop, on own scenes. The picture's mean is checked against the reference's.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Estimate, REFERENCES, RES, accelerators, compiled, file_settings, load_scene, read_reference, rendered};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use snell::integrator::Estimator;

/// Samples per pixel.
const SAMPLES: u32 = 16;

/// Standard errors that the mean may be off by: probability 6e-7 a picture, some twenty pictures, a fixed seed.
const BOUND: f64 = 5.0;

fn bench(c: &mut Criterion) {
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let mut group = c.benchmark_group("render");
    group.sample_size(10);
    group.throughput(Throughput::Elements(u64::from(RES * RES * SAMPLES)));
    for row in &REFERENCES {
        let scratch = tempfile::tempdir().unwrap();
        let reference = read_reference(row.name);
        let description = load_scene(row.name, RES, scratch.path());
        let settings = file_settings(&description, Estimator::Path, SAMPLES);
        for accelerator in accelerators() {
            let scene = compiled(&description, accelerator);
            let picture = rendered(&scene, &settings, threads).film.develop();
            // As sure of itself as the reference would be, had it as many samples.
            let estimate = Estimate::with_variance_of(&picture, &reference, row.samples / SAMPLES);
            let z = estimate.worst_z_against(&reference).whole;
            assert!(z < BOUND, "{}, {accelerator:?}: the mean is off by {z} standard errors", row.name);
            group.bench_function(BenchmarkId::new(row.name, format!("{accelerator:?}")), |b| {
                b.iter(|| rendered(&scene, &settings, threads).samples);
            });
        }
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
