//! Time that a bsdf takes to give value and density of a direction, and to sample one: each kind that the own scenes have.
//!
//! The answers are checked: a sample's weight is value over density, and no more comes back than went in.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{compiled, load};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use snell::accel::Accelerator;
use snell::bsdf::{Bsdf, BsdfSample};
use snell::material::Material;
use snell::sampler::{BsdfUniforms, Sampler, SamplerKind};
use std::collections::BTreeMap;
use std::hint::black_box;

/// Calls in one measured round.
const CALLS: u32 = 1 << 12;

/// Where the bsdfs are from.
const SCENES: [&str; 3] = ["cornell-box-materials", "furnace", "plates"];

/// How far the mean of value over density may be from that of the weights. A direction is rounded by 2⁻²⁴, a lobe of
/// roughness α = 0.01 falls off within angles of α, and its tails with the angle: by relative errors of some 2⁻²⁴/α² = 6e-4.
const AGREEMENT: f64 = 2e-3;

/// The first bsdf of each kind, by the name of the kind.
fn bsdfs() -> BTreeMap<String, Bsdf> {
    let mut all = BTreeMap::new();
    for name in SCENES {
        let scene = compiled(&load(&format!("scenes/{name}/scene.xml"), &[]), Accelerator::Native);
        let sides = scene.materials.iter().filter_map(|m| match m {
            Material::Plain(sides) => Some(sides),
            Material::Varying(_) => None,
        });
        let sides = sides.flat_map(|m| std::iter::once(&m.front).chain(&m.back));
        for bsdf in sides {
            let kind = format!("{bsdf:?}").split('(').next().unwrap_or_default().to_owned();
            all.entry(kind).or_insert_with(|| bsdf.clone());
        }
    }
    all
}

/// Uniform numbers, and directions to look from on the front side.
fn questions() -> Vec<(Vec3, BsdfUniforms)> {
    let sampler = Sampler { kind: SamplerKind::Independent, seed: 1 };
    let question = |i| {
        let stream = sampler.stream(3, 5, i);
        (snell::sampling::warp::square_to_cosine_hemisphere(stream.film()), stream.bsdf(0))
    };
    (0..CALLS).map(question).collect()
}

fn check(kind: &str, bsdf: &Bsdf, questions: &[(Vec3, BsdfUniforms)]) -> Vec<(Vec3, Vec3)> {
    let samples = questions.iter().filter_map(|&(wo, u)| Some((wo, bsdf.sample(wo, u)?)));
    let samples: Vec<(Vec3, BsdfSample)> = samples.collect();
    assert!(!samples.is_empty(), "{kind}: no sample carries energy");
    let (mut weights, mut quotients) = (0.0, 0.0);
    for (wo, s) in &samples {
        // Radiance that is transmitted changes by 1/η², and its flux doesn't.
        let flux = s.weight.max_component() * s.eta * s.eta;
        assert!((0.0..=1.0 + f32::EPSILON * 8.0).contains(&flux), "{kind}: a sample weighs {flux}");
        if let Some(pdf) = s.pdf {
            let (value, queried) = bsdf.eval_pdf(*wo, s.wi);
            assert!(pdf.0 > 0.0 && queried.0 > 0.0, "{kind}: a sampled direction has no density");
            weights += f64::from(s.weight.max_component());
            quotients += f64::from(value.max_component() / queried.0);
        }
    }
    assert!((weights - quotients).abs() <= AGREEMENT * weights, "{kind}: {quotients} should be {weights}");
    samples.into_iter().map(|(wo, s)| (wo, s.wi)).collect()
}

fn bench(c: &mut Criterion) {
    let questions = questions();
    let mut group = c.benchmark_group("bsdf");
    for (kind, bsdf) in bsdfs() {
        let directions = check(&kind, &bsdf, &questions);
        group.throughput(Throughput::Elements(directions.len() as u64));
        group.bench_function(BenchmarkId::new("eval_pdf", &kind), |b| {
            b.iter(|| directions.iter().map(|&(wo, wi)| black_box(&bsdf).eval_pdf(wo, wi).1.0).sum::<f32>());
        });
        group.throughput(Throughput::Elements(questions.len() as u64));
        group.bench_function(BenchmarkId::new("sample", &kind), |b| {
            b.iter(|| {
                let samples = questions.iter().filter_map(|&(wo, u)| black_box(&bsdf).sample(wo, u));
                samples.map(|s| s.weight.max_component()).sum::<f32>()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
