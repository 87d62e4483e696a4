//! Rays per second of one thread, for both accelerators: camera, first-bounce and shadow rays, on a mesh of a million
//! triangles and on a room of 36. Each answer is checked: it must be the same for both, but for ties and the few rays that
//! Embree loses.
//!
//! Figures are the best of several rounds, the accelerators taking turns, in CPU time of the machine it runs on: ratios
//! are what counts. Run by `cargo bench --bench accel [-- triangles along one edge]`.
#![allow(clippy::print_stdout, reason = "prints its measurements")]

#[path = "../tests/accel_support/mod.rs"]
mod accel_support;

use accel_support::{Rng, boxes, displaced_sphere};
use glam::Vec3;
use snell::accel::oracle::{self, Verdict};
use snell::accel::{Accel, Accelerator, Hit};
use snell::math::ray::Ray;
use snell::shape::Shape;
use std::time::Instant;

/// Rays in a batch, as the integrator has them.
const BATCH: usize = 256;

/// Rows and columns of the camera's picture.
const SIZE: usize = 640;

/// Timed rounds.
const ROUNDS: usize = 7;

/// The fraction of answers that may differ between the accelerators, ties aside: rays that Embree loses.
const ALLOWED_DIFFERENCES: f64 = 1e-4;

fn main() {
    let n = std::env::args().skip(1).find_map(|arg| arg.parse().ok()).unwrap_or(296);
    let inside = Vec3::new(0.05, 0.02, 0.03);
    measure("displaced sphere", &[Shape::Mesh(displaced_sphere(n))], inside);
    measure("two boxes in a room", &[boxes()], Vec3::new(0.0, 0.2, -0.95));
}

fn measure(name: &str, shapes: &[Shape], eye: Vec3) {
    let triangles: usize = shapes.iter().map(Shape::primitive_count).sum();
    println!("\n{name}, {triangles} triangles");
    let which =
        if cfg!(feature = "embree") { &[Accelerator::Embree, Accelerator::Native][..] } else { &[Accelerator::Native] };
    let accels: Vec<Accel> = which
        .iter()
        .map(|&which| {
            let start = Instant::now();
            let accel = Accel::build(which, shapes, 0).expect("the accelerator can be built");
            let seconds = start.elapsed().as_secs_f64();
            let bytes = accel.memory_bytes() as f64 / triangles as f64;
            println!("  {}: built in {:.0} ms, {bytes:.0} bytes a triangle", accel.name(), seconds * 1e3);
            accel
        })
        .collect();
    let camera = camera_rays(eye);
    let mut hits = vec![Hit::NONE; camera.len()];
    accels[0].closest_hits(&camera, &mut hits);
    let (bounce, shadow) = bounce_rays(shapes, &camera, &hits);
    report("camera", shapes, &accels, &camera, false);
    report("1st bounce", shapes, &accels, &bounce, false);
    report("shadow", shapes, &accels, &shadow, true);
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

fn report(name: &str, shapes: &[Shape], accels: &[Accel], rays: &[Ray], any: bool) {
    let mut best = vec![f64::INFINITY; accels.len()];
    let mut answers: Vec<Vec<Hit>> = vec![vec![Hit::NONE; rays.len()]; accels.len()];
    for _ in 0..ROUNDS {
        for ((accel, best), answers) in accels.iter().zip(&mut best).zip(&mut answers) {
            let start = Instant::now();
            trace(accel, rays, answers, any);
            *best = best.min(start.elapsed().as_secs_f64());
        }
    }
    let speeds: Vec<f64> = best.iter().map(|seconds| rays.len() as f64 / seconds * 1e-6).collect();
    let met = answers[0].iter().filter(|hit| hit.is_some()).count() as f64 / rays.len() as f64;
    print!("  {name:10} ({:2.0} % hit):", 100.0 * met);
    for (accel, speed) in accels.iter().zip(&speeds) {
        print!("  {} {speed:.2}", accel.name());
    }
    if let [embree, native] = speeds[..] {
        let differ = (0..rays.len()).filter(|&i| {
            let (embree, native) = (answers[0][i], answers[1][i]);
            embree != native && (any || oracle::verdict(shapes, &rays[i], embree, native) != Verdict::Tie)
        });
        let differ = differ.count();
        println!(" Mray/s, ratio {:.2}; {differ} answers differ", native / embree);
        assert!(differ as f64 <= ALLOWED_DIFFERENCES * rays.len() as f64, "{differ} answers differ");
    } else {
        println!(" Mray/s");
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
