//! Meshes and random numbers for the tests and the benchmark of the accelerators.
#![allow(dead_code, unreachable_pub, reason = "each of its users is a crate of its own and needs a part")]

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec3};
use snell::accel::oracle::{self, Contact, Verdict};
use snell::accel::{Accel, Accelerator, Hit, Quality};
use snell::math::ray::Ray;
use snell::shape::cylinder::Cylinder;
use snell::shape::disk::Disk;
use snell::shape::offset::SurfacePoint;
use snell::shape::placed::{Group, Placed, Placement};
use snell::shape::sphere::Sphere;
use snell::shape::{Shape, TriangleMesh};
use std::collections::HashMap;
use std::sync::Arc;

/// SplitMix64 (Steele, Lea and Flood 2014).
pub struct Rng(pub u64);

impl Rng {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }

    pub fn between(&mut self, a: f32, b: f32) -> f32 {
        a + (b - a) * self.unit()
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// In the cube [−1, 1)³.
    pub fn in_cube(&mut self) -> Vec3 {
        Vec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }

    /// A unit vector.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.in_cube();
            if v.length_squared() > 1e-4 && v.length_squared() <= 1.0 {
                return v.normalize();
            }
        }
    }
}

/// A mesh of separate triangles.
pub fn soup(triangles: &[[Vec3; 3]]) -> Shape {
    Shape::Mesh(TriangleMesh {
        positions: triangles.iter().flatten().copied().collect(),
        faces: (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..Default::default()
    })
}

/// Random triangles of about `size` in the cube [−1, 1]³.
pub fn random_soup(rng: &mut Rng, count: usize, size: f32) -> Vec<[Vec3; 3]> {
    (0..count)
        .map(|_| {
            let centre = rng.in_cube();
            [0; 3].map(|_| centre + size * rng.in_cube())
        })
        .collect()
}

/// A closed mesh of 12·n² triangles: a cube blown up to a sphere with bumps, of radius 0.6 to 1.
pub fn displaced_sphere(n: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let mut places = HashMap::new();
    let mut vertex = |mesh: &mut TriangleMesh, lattice: [u32; 3]| {
        *places.entry(lattice).or_insert_with(|| {
            let p =
                DVec3::from_array(lattice.map(|c| (f64::from(c) / f64::from(n) - 0.5) * std::f64::consts::FRAC_PI_2));
            let p = DVec3::new(p.x.tan(), p.y.tan(), p.z.tan()).normalize();
            let bump =
                (11.0 * p.x).sin() * (13.0 * p.y).sin() * (9.0 * p.z).cos() + 0.2 * (57.0 * (p.x + p.y - p.z)).sin();
            mesh.positions.push((p * (0.8 + 0.16 * bump)).as_vec3());
            mesh.positions.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        for side in [0, n] {
            for i in 0..n {
                for j in 0..n {
                    let corner = |i, j| {
                        let mut lattice = [0; 3];
                        (lattice[axis], lattice[(axis + 1) % 3], lattice[(axis + 2) % 3]) = (side, i, j);
                        lattice
                    };
                    let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]
                        .map(|lattice| vertex(&mut mesh, lattice));
                    mesh.faces.extend(if side == 0 { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] });
                }
            }
        }
    }
    mesh
}

/// A room of 12 triangles with two boxes of 12 in it, in [−1, 1]³.
pub fn boxes() -> Shape {
    let mut triangles = cuboid(Vec3::splat(-1.0), Vec3::splat(1.0));
    triangles.extend(cuboid(Vec3::new(-0.7, -0.999, -0.6), Vec3::new(-0.1, 0.3, 0.0)));
    triangles.extend(cuboid(Vec3::new(0.1, -0.999, 0.0), Vec3::new(0.7, -0.3, 0.6)));
    soup(&triangles)
}

pub fn cuboid(lower: Vec3, upper: Vec3) -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for side in [lower, upper] {
            let corner = |i: usize, j: usize| {
                let mut v = lower;
                v[axis] = side[axis];
                v[(axis + 1) % 3] = [lower, upper][i][(axis + 1) % 3];
                v[(axis + 2) % 3] = [lower, upper][j][(axis + 2) % 3];
                v
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles
}

/// A ray from a random point of a triangle into a random direction, as the renderer spawns it.
pub fn spawned(rng: &mut Rng, v: [Vec3; 3]) -> Ray {
    let p = point(rng, v);
    let d = rng.direction();
    Ray::new(p.origin_towards(d), d)
}

/// A segment between random points of two triangles, as the renderer's shadow rays are.
pub fn segment(rng: &mut Rng, v: [[Vec3; 3]; 2]) -> Ray {
    let (p, q) = (point(rng, v[0]), point(rng, v[1]));
    let w = (q.p - p.p).as_vec3();
    Ray::segment(p.origin_towards(w), q.end_towards(-w, w.abs()))
}

/// A random point of a triangle.
fn point(rng: &mut Rng, v: [Vec3; 3]) -> SurfacePoint {
    let (mut a, mut b) = (rng.unit(), rng.unit());
    if a + b > 1.0 {
        (a, b) = (1.0 - a, 1.0 - b);
    }
    surface_point(v, [a, b].map(f64::from))
}

/// The point of a triangle with these last two barycentric coordinates, as the renderer computes it.
fn surface_point(v: [Vec3; 3], [a, b]: [f64; 2]) -> SurfacePoint {
    let mesh = TriangleMesh { positions: v.to_vec(), faces: vec![[0, 1, 2]], ..TriangleMesh::default() };
    mesh.point(0, [1.0 - a - b, a, b]).point
}

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
                let verdict = oracle::verdict(shapes, ray, *hit, *truth);
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

/// Rays from and to random points in the cube, some with an end.
pub fn random_rays(rng: &mut Rng, count: usize, scale: f32) -> Vec<Ray> {
    (0..count)
        .map(|i| {
            let (o, p) = (scale * 1.5 * rng.in_cube(), scale * rng.in_cube());
            match i % 3 {
                0 => Ray::segment(o, p),
                1 => Ray { tmin: 0.5, ..Ray::new(o, p - o) },
                _ => Ray::new(o, (p - o).normalize()),
            }
        })
        .filter(|ray| ray.d.is_finite() && ray.d != Vec3::ZERO)
        .collect()
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
