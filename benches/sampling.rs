//! Time that uniform numbers take, warps, and directions towards lights. Means are checked against closed forms.
#![allow(missing_docs, clippy::unwrap_used, reason = "a benchmark")]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{compiled, load};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{DMat3, DVec3, Vec2, Vec3};
use snell::accel::Accelerator;
use snell::image::Picture;
use snell::light::{EnvironmentLight, Light};
use snell::sampler::{Batch, Sampler, SamplerKind};
use snell::sampling::warp;
use snell::scene::Scene;
use snell::shape::Shape;
use snell::spectrum::Rgb;
use std::f64::consts::PI;
use std::hint::black_box;
use std::sync::Arc;

/// Calls in one measured round.
const CALLS: u32 = 1 << 12;

/// Standard errors that a mean may be off by: probability 6e-7 a mean, some ten means, fixed seeds.
const BOUND: f64 = 5.0;

/// Fails unless the mean of the values is `expected`, within the noise of independent values and the rounding of f32.
fn check_mean(name: &str, values: impl Iterator<Item = f32>, expected: f64) {
    let values: Vec<f64> = values.map(f64::from).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0);
    let bound = BOUND * (variance / n).sqrt() + expected.abs() * 8.0 * f64::from(f32::EPSILON);
    assert!((mean - expected).abs() <= bound, "{name}: the mean is {mean}, not {expected} ± {bound}");
}

fn numbers(c: &mut Criterion) {
    let mut group = c.benchmark_group("numbers");
    // Pairs of numbers.
    group.throughput(Throughput::Elements(CALLS.into()));
    let kinds = [
        SamplerKind::Sobol,
        SamplerKind::ZSobol { log_samples: CALLS.ilog2() },
        SamplerKind::Stratified { samples: CALLS },
        SamplerKind::Independent,
    ];
    for kind in kinds {
        let sampler = Sampler { kind, seed: 1 };
        let pair = |i| sampler.stream(3, 5, i).bsdf(2).direction();
        check_mean("x", (0..CALLS).map(|i| pair(i).x), 0.5);
        check_mean("y", (0..CALLS).map(|i| pair(i).y), 0.5);
        let name = format!("{kind:?}");
        let name = name.split(' ').next().unwrap();
        group.bench_function(name, |b| b.iter(|| (0..CALLS).map(|i| pair(black_box(i))).sum::<Vec2>()));
        // As a render asks for them: both pairs of the set, of many samples at once.
        let mut batch = Batch::default();
        group.bench_function(format!("{name} in batches"), |b| {
            b.iter(|| {
                batch.fill_bsdf(2, (0..CALLS / 2).map(|i| sampler.stream(3, 5, black_box(i))));
                batch.bsdf(0).direction()
            });
        });
    }
    group.finish();
}

/// Independent points of the unit square.
fn points() -> Vec<Vec2> {
    let sampler = Sampler { kind: SamplerKind::Independent, seed: 2 };
    (0..CALLS).map(|i| sampler.stream(0, 0, i).film()).collect()
}

fn warps(c: &mut Criterion) {
    type Warp = fn(Vec2) -> Vec3;
    // With the mean of z.
    let table: [(&str, Warp, f64); 4] = [
        ("disk", |u| warp::square_to_disk(u).extend(0.0), 0.0),
        ("cosine hemisphere", warp::square_to_cosine_hemisphere, 2.0 / 3.0),
        ("uniform hemisphere", warp::square_to_uniform_hemisphere, 0.5),
        ("uniform sphere", warp::square_to_uniform_sphere, 0.0),
    ];
    let points = points();
    let mut group = c.benchmark_group("warps");
    group.throughput(Throughput::Elements(points.len() as u64));
    for (name, warp, mean) in table {
        check_mean(name, points.iter().map(|&u| warp(u).z), mean);
        check_mean(name, points.iter().map(|&u| warp(u).x), 0.0);
        group.bench_function(name, |b| b.iter(|| points.iter().map(|&u| warp(black_box(u))).sum::<Vec3>()));
    }
    group.finish();
}

/// A normal at the point.
const N: Vec3 = Vec3::Y;

/// The first light of a scene that is a sphere, and the first that is not.
fn lights(c: &mut Criterion) {
    let points = points();
    let mut group = c.benchmark_group("lights");
    group.throughput(Throughput::Elements(points.len() as u64));
    for (name, file) in [("sphere", "plates"), ("triangles", "cornell-box"), ("sky", "furnace")] {
        let scene = compiled(&load(&format!("scenes/{file}/scene.xml"), &[]), Accelerator::Native);
        let light = &scene.lights[0];
        let p = DVec3::new(0.1, -0.2, 0.05);
        if let Some(solid_angle) = solid_angle(&scene, light, p) {
            let densities = points.iter().map(|&u| {
                light.sample(&scene.shapes, p, N, u, false).and_then(|s| s.pdf).map_or(0.0, |pdf| pdf.0.recip())
            });
            check_mean(name, densities, solid_angle);
        }
        group.bench_function(BenchmarkId::from_parameter(name), |b| {
            let found = |&u: &Vec2| light.sample(&scene.shapes, p, N, black_box(u), true);
            b.iter(|| points.iter().filter_map(found).map(|s| s.wi).sum::<Vec3>());
        });
    }
    group.finish();
}

/// What `p` sees above it of a light, in sr, where that is known in closed form: the mean of one over the density.
fn solid_angle(scene: &Scene, light: &Light, p: DVec3) -> Option<f64> {
    let Light::Area(area) = light else {
        return matches!(light, Light::Constant(_)).then_some(2.0 * PI);
    };
    let Shape::Sphere(sphere) = &scene.shapes[area.shape as usize] else {
        return None;
    };
    let sine = f64::from(sphere.radius) / (sphere.centre.as_dvec3() - p).length();
    Some(2.0 * PI * (1.0 - (1.0 - sine * sine).sqrt()))
}

/// Directions towards maps that do not fit into a cache, for surfaces that face anywhere and for those that scatter on both
/// sides, of which the mean of the radiance is checked.
fn skies(c: &mut Criterion) {
    let points = points();
    let normals: Vec<Vec3> = points.iter().rev().map(|u| warp::square_to_uniform_sphere(*u)).collect();
    let mut group = c.benchmark_group("skies");
    group.throughput(Throughput::Elements(points.len() as u64));
    for height in [64, 512, 2048] {
        let mut map = Picture::new(2 * height, height);
        for (x, y) in (0..height).flat_map(|y| (0..2 * height).map(move |x| (x, y))) {
            map.set(x, y, Rgb::splat(if x % 16 == 3 { 100.0 } else { 1.0 }));
        }
        let mean = 115.0 / 16.0;
        let light = Light::Environment(EnvironmentLight::new(&Arc::new(map), 1.0, DMat3::IDENTITY, false).unwrap());
        let sample = |n: Vec3, u: Vec2| {
            let s = light.sample(&[], DVec3::ZERO, n, u, false);
            s.map_or(0.0, |s| s.radiance.luminance() / s.pdf.map_or(1.0, |pdf| pdf.0))
        };
        // Of larger maps all of the variance is at the poles, and may not be seen.
        if height == 64 {
            check_mean("a sky", points.iter().map(|u| sample(Vec3::ZERO, *u)), 4.0 * PI * mean);
        }
        for (name, faces) in [("all around", 0.0), ("facing", 1.0)] {
            group.bench_function(BenchmarkId::new(name, format!("{}x{height}", 2 * height)), |b| {
                b.iter(|| normals.iter().zip(&points).map(|(&n, &u)| sample(black_box(n * faces), u)).sum::<f32>());
            });
        }
    }
    group.finish();
}

criterion_group!(benches, numbers, warps, lights, skies);
criterion_main!(benches);
