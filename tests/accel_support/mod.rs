//! Shapes, beside those of `snell::check`, for the tests and the benchmark of the accelerators.
#![allow(
    dead_code,
    unreachable_pub,
    unused_imports,
    reason = "each of its users is a crate of its own and needs a part"
)]

pub use snell::check::meshes::{boxes, cuboid, degenerate, displaced_sphere, layers, random_soup, slivers, soup};
pub use snell::check::random::Rng;
pub use snell::check::rays::{random_rays, segment, spawned};

use glam::{DAffine3, DMat3, DVec2, DVec3};
use snell::accel::oracle::{self, Contact, Verdict};
use snell::accel::{Accel, Accelerator, Hit, Quality};
use snell::math::ray::Ray;
use snell::shape::Shape;
use snell::shape::cylinder::Cylinder;
use snell::shape::disk::Disk;
use snell::shape::offset::SurfacePoint;
use snell::shape::placed::{Group, Placed, Placement};
use snell::shape::sphere::Sphere;
use std::sync::Arc;

/// A sphere in the cube [−1, 1]³, of a radius up to `size`.
pub fn random_sphere(rng: &mut Rng, size: f32) -> Shape {
    Shape::Sphere(Sphere { centre: rng.in_cube(), radius: size * rng.between(0.02, 1.0), flip: false })
}

/// A disk or ellipse around a point of the cube [−1, 1]³.
pub fn random_disk(rng: &mut Rng, size: f32) -> Shape {
    loop {
        let [u, v, n] = random_axes(rng, size);
        if let Some(disk) = Disk::new(rng.in_cube().as_dvec3(), u, v, n) {
            return Shape::Disk(disk);
        }
    }
}

/// A cylinder, mostly oblique, from a point of the cube [−1, 1]³.
pub fn random_cylinder(rng: &mut Rng, size: f32) -> Shape {
    loop {
        let axes = random_axes(rng, size);
        if let Some(cylinder) = Cylinder::new(rng.in_cube().as_dvec3(), axes, false) {
            return Shape::Cylinder(cylinder);
        }
    }
}

/// Three vectors of up to `size`, none nearly in the plane of the others.
pub fn random_axes(rng: &mut Rng, size: f32) -> [DVec3; 3] {
    loop {
        let axes = [0; 3].map(|_| f64::from(size * rng.between(0.05, 1.0)) * rng.direction().as_dvec3());
        let volume = axes[0].cross(axes[1]).dot(axes[2]).abs();
        if volume > 0.05 * axes.map(DVec3::length).iter().product::<f64>() {
            return axes;
        }
    }
}

/// A cylinder with a disk at each end, fronts outside.
pub fn closed_cylinder(base: DVec3, [u, v, h]: [DVec3; 3]) -> [Shape; 3] {
    [
        Shape::Cylinder(Cylinder::new(base, [u, v, h], false).expect("its axes are none too short")),
        Shape::Disk(Disk::new(base, u, v, -h).expect("its axes are none too short")),
        Shape::Disk(Disk::new(base + h, u, v, h).expect("its axes are none too short")),
    ]
}

/// A quadric with all its lengths multiplied by a power of two.
pub fn scaled(shape: &Shape, scale: f32) -> Shape {
    let s = f64::from(scale);
    match shape {
        Shape::Mesh(_) | Shape::Placed(_) => panic!("not a quadric"),
        Shape::Sphere(q) => Shape::Sphere(Sphere { centre: q.centre * scale, radius: q.radius * scale, flip: q.flip }),
        Shape::Disk(q) => {
            let at = |a, b| q.point(DVec2::new(a, b)).point.p;
            let (c, n) = (at(0.0, 0.0), q.point(DVec2::ZERO).point.n.as_dvec3());
            Shape::Disk(
                Disk::new(c * s, (at(1.0, 0.0) - c) * s, (at(0.0, 1.0) - c) * s, n)
                    .expect("its axes are none too short"),
            )
        }
        Shape::Cylinder(q) => {
            let at = |x, y, z| q.point(DVec2::new(x, y), z).point.p;
            let base = 0.5 * (at(1.0, 0.0, 0.0) + at(-1.0, 0.0, 0.0));
            let axes = [at(1.0, 0.0, 0.0) - base, at(0.0, 1.0, 0.0) - base, at(1.0, 0.0, 1.0) - at(1.0, 0.0, 0.0)];
            Shape::Cylinder(
                Cylinder::new(base * s, axes.map(|a| a * s), q.is_flipped()).expect("its axes are none too short"),
            )
        }
    }
}

/// A random point of a quadric, as the renderer computes it.
pub fn on_surface(rng: &mut Rng, shape: &Shape) -> Option<SurfacePoint> {
    let bounds = shape.primitive_bounds(0);
    let aim = bounds.min + (bounds.max - bounds.min) * (0.5 * rng.in_cube() + 0.5);
    let origin = aim + 2.0 * rng.direction();
    let ray = Ray::new(origin, aim - origin);
    shape.intersect(0, &ray).map(|_| shape.meet(&ray, 0).point)
}

/// Length, in units of d, of the chord of a sphere or cylinder that leaves `p` on it along d.
pub fn chord(shape: &Shape, p: DVec3, d: DVec3) -> f64 {
    match shape {
        Shape::Sphere(q) => -2.0 * (p - q.centre.as_dvec3()).dot(d) / d.length_squared(),
        Shape::Cylinder(q) => {
            let (xy, along) = (q.project(p), q.project(p + d) - q.project(p));
            -2.0 * xy.dot(along) / along.length_squared()
        }
        _ => panic!("no chord"),
    }
}

/// Those that this build has.
pub fn accelerators() -> Vec<Accelerator> {
    if cfg!(feature = "embree") { vec![Accelerator::Native, Accelerator::Embree] } else { vec![Accelerator::Native] }
}

pub fn build(which: Accelerator, shapes: &[Shape]) -> Accel {
    Accel::build(which, shapes, 2, Quality::default()).expect("builds")
}

pub fn closest(accel: &Accel, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::NONE; rays.len()];
    accel.closest_hits(rays, &mut hits);
    hits
}

pub fn occluded(accel: &Accel, rays: &[Ray]) -> Vec<bool> {
    let mut answers = vec![true; rays.len()];
    accel.occluded(rays, &mut answers);
    answers
}

/// Both accelerators find what the oracle finds, but for ties and rims, and any-hit agrees with closest hit. Our own
/// must agree with itself exactly.
pub fn check(shapes: &[Shape], rays: &[Ray]) {
    let truth: Vec<Hit> =
        rays.iter().map(|ray| oracle::closest(shapes, ray).map_or(Hit::NONE, |(hit, _)| hit)).collect();
    for which in accelerators() {
        let accel = build(which, shapes);
        let hits = closest(&accel, rays);
        let answers = occluded(&accel, rays);
        for (((ray, hit), truth), answer) in rays.iter().zip(&hits).zip(&truth).zip(&answers) {
            if hit != truth {
                let verdict = oracle::verdict(shapes, ray, &[], *hit, *truth);
                assert!(
                    matches!(verdict, Verdict::Tie | Verdict::Edge),
                    "{which:?}: {verdict:?} for {ray:?}: {hit:?}, but {truth:?}: {:?}",
                    oracle::contact(shapes, *if hit.is_some() { hit } else { truth }, ray),
                );
            }
            if which == Accelerator::Native || hit == truth && is_inside(shapes, *hit, ray) {
                assert_eq!(hit.is_some(), *answer, "{which:?}: any hit of {ray:?}");
            }
        }
    }
}

pub fn is_inside(shapes: &[Shape], hit: Hit, ray: &Ray) -> bool {
    hit.is_some() && matches!(oracle::contact(shapes, hit, ray), Contact::Inside(..))
}

/// A group of everything, placed `count` times by random maps: stretched, sheared, half of them mirrored.
pub fn random_instances(rng: &mut Rng, count: usize) -> Vec<Shape> {
    let mut members = vec![soup(&random_soup(rng, 60, 0.4)), Shape::Mesh(displaced_sphere(6))];
    members.extend([random_sphere(rng, 0.5), random_disk(rng, 0.5), random_cylinder(rng, 0.5)]);
    let group = Arc::new(Group::new(members));
    let mut shapes = vec![soup(&random_soup(rng, 200, 0.1)), random_sphere(rng, 0.2)];
    for _ in 0..count {
        let [x, y, z] = random_axes(rng, 0.5);
        let map = DAffine3 { matrix3: DMat3::from_cols(x, y, z), translation: (0.5 * rng.in_cube()).as_dvec3() };
        let placement = Arc::new(Placement::new(map).expect("no axis is too short"));
        let place = |index| Placed { group: group.clone(), index, placement: placement.clone() };
        shapes.extend((0..group.shapes.len() as u32).map(|index| Shape::Placed(place(index))));
    }
    shapes
}
