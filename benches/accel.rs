//! Rays per second of one thread, for both accelerators: camera, first-bounce and shadow rays, on a mesh of a million
//! triangles and on a room of 36. Each answer is checked: it must be the same for both, but for ties and the few rays that
//! Embree loses.
#![allow(missing_docs, reason = "a benchmark")]

#[path = "../tests/accel_support/mod.rs"]
mod accel_support;

use accel_support::{Rng, boxes, displaced_sphere};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use snell::accel::oracle::{self, Verdict};
use snell::accel::{Accel, Accelerator, Hit, Quality};
use snell::math::ray::Ray;
use snell::shape::Shape;

/// Rays in a batch, as the integrator has them.
const BATCH: usize = 256;

/// Rows and columns of the camera's picture.
const SIZE: usize = 640;

/// Edges of the large mesh's triangles along an edge of the cube that it is made of.
const EDGES: u32 = 296;

/// The fraction of answers that may differ between the accelerators, ties aside: rays that Embree loses.
const ALLOWED_DIFFERENCES: f64 = 1e-4;

fn bench(c: &mut Criterion) {
    let inside = Vec3::new(0.05, 0.02, 0.03);
    measure(c, "a million triangles", &[Shape::Mesh(displaced_sphere(EDGES))], inside);
    measure(c, "two boxes in a room", &[boxes()], Vec3::new(0.0, 0.2, -0.95));
}

fn measure(c: &mut Criterion, name: &str, shapes: &[Shape], eye: Vec3) {
    let mut group = c.benchmark_group(name);
    group.sample_size(10);
    let which =
        if cfg!(feature = "embree") { &[Accelerator::Embree, Accelerator::Native][..] } else { &[Accelerator::Native] };
    let triangles: usize = shapes.iter().map(Shape::primitive_count).sum();
    group.throughput(Throughput::Elements(triangles as u64));
    let build = |which| Accel::build(which, shapes, 0, Quality::default()).expect("the accelerator can be built");
    for &which in which {
        group.bench_function(format!("build/{which:?}"), |b| b.iter(|| build(which).memory_bytes()));
    }
    let accels: Vec<Accel> = which.iter().map(|&which| build(which)).collect();
    let camera = camera_rays(eye);
    let mut hits = vec![Hit::NONE; camera.len()];
    accels[0].closest_hits(&camera, &mut hits);
    let (bounce, shadow) = bounce_rays(shapes, &camera, &hits);
    time(&mut group, "camera", shapes, &accels, &camera, false);
    time(&mut group, "bounce", shapes, &accels, &bounce, false);
    time(&mut group, "shadow", shapes, &accels, &shadow, true);
    group.finish();
}

/// Rays of a pinhole camera of 90°, row by row.
fn camera_rays(eye: Vec3) -> Vec<Ray> {
    let at = |i: usize| 2.0 * (i as f32 + 0.5) / SIZE as f32 - 1.0;
    (0..SIZE * SIZE).map(|i| Ray::new(eye, Vec3::new(at(i % SIZE), at(i / SIZE), 1.0).normalize())).collect()
}

/// A diffuse bounce, and a segment to a light above, from each hit.
fn bounce_rays(shapes: &[Shape], rays: &[Ray], hits: &[Hit]) -> (Vec<Ray>, Vec<Ray>) {
    let mut rng = Rng(1);
    let (mut bounce, mut shadow) = (Vec::new(), Vec::new());
    for (ray, hit) in rays.iter().zip(hits).filter(|(_, hit)| hit.is_some()) {
        let point = shapes[hit.shape as usize].meet(ray, hit.primitive).point;
        let normal = if point.n.dot(ray.d) > 0.0 { -point.n } else { point.n };
        let o = point.origin_towards(normal);
        bounce.push(Ray::new(o, (normal + 0.999 * rng.direction()).normalize()));
        shadow.push(Ray::segment(o, Vec3::new(rng.between(-0.2, 0.2), 0.45, rng.between(-0.2, 0.2))));
    }
    (bounce, shadow)
}

fn time(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    shapes: &[Shape],
    accels: &[Accel],
    rays: &[Ray],
    any: bool,
) {
    let mut answers: Vec<Vec<Hit>> = vec![vec![Hit::NONE; rays.len()]; accels.len()];
    accels.iter().zip(&mut answers).for_each(|(accel, answers)| trace(accel, rays, answers, any));
    if let [embree, native] = &answers[..] {
        let differ = rays.iter().zip(embree.iter().zip(native)).filter(|&(ray, (&embree, &native))| {
            embree != native && (any || oracle::verdict(shapes, ray, &[], embree, native) != Verdict::Tie)
        });
        let differ = differ.count();
        assert!(differ as f64 <= ALLOWED_DIFFERENCES * rays.len() as f64, "{name}: {differ} answers differ");
    }
    group.throughput(Throughput::Elements(rays.len() as u64));
    for (accel, answers) in accels.iter().zip(&mut answers) {
        group.bench_function(BenchmarkId::new(name, accel.name()), |b| b.iter(|| trace(accel, rays, answers, any)));
    }
}

fn trace(accel: &Accel, rays: &[Ray], answers: &mut [Hit], any: bool) {
    let mut occluded = [false; BATCH];
    for (rays, answers) in rays.chunks(BATCH).zip(answers.chunks_mut(BATCH)) {
        if any {
            let occluded = &mut occluded[..rays.len()];
            accel.occluded(rays, occluded);
            for (answer, &occluded) in answers.iter_mut().zip(&*occluded) {
                *answer = if occluded { Hit { shape: 0, primitive: 0 } } else { Hit::NONE };
            }
        } else {
            accel.closest_hits(rays, answers);
        }
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
