//! Quadrics and placed groups that are hard on accelerators, and what of a shape rays are aimed at.

use super::meshes::{cuboid, displaced_sphere, random_soup, soup};
use super::random::Rng;
use crate::shape::cylinder::Cylinder;
use crate::shape::disk::Disk;
use crate::shape::placed::{Group, Placed, Placement};
use crate::shape::sphere::Sphere;
use crate::shape::{Hit, Shape};
use glam::{DAffine3, DMat3, DVec2, DVec3, Vec3};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

/// Radii of spheres that are somewhere.
const RADII: [f32; 5] = [0.3, 0.1, 1e-2, 1e-3, 1e-4];

/// Lengths that are next to nothing beside others of about 1: half axes of flat ellipses, radii and heights of cylinders.
const THIN: [f64; 4] = [1e-2, 1e-4, 1e-5, 1e-6];

/// Exponents of the sizes, beside its shape, of triangles that touch a quadric.
const TOUCHING: [f32; 2] = [-14.0, 0.0];

/// Exponents of the scales along the axes of what is placed: over three decades.
const SCALES: [f32; 2] = [-11.0, -1.0];

/// Placements, but for the first.
const PLACEMENTS: u32 = 30;

/// Three unit vectors at right angles.
fn frame(rng: &mut Rng) -> [DVec3; 3] {
    let n = rng.direction().as_dvec3().normalize();
    let (u, v) = n.any_orthonormal_pair();
    [u, v, n]
}

/// Spheres, disks and cylinders, with a soup among them.
pub(super) fn quadrics(rng: &mut Rng) -> Vec<Shape> {
    let mut shapes = spheres(rng);
    shapes.push(soup(&random_soup(rng, 100, 0.2)));
    shapes.extend(disks(rng));
    shapes.extend(cylinders(rng));
    shapes
}

/// Anywhere, around one point, through one point, and in rows where they touch and overlap.
fn spheres(rng: &mut Rng) -> Vec<Shape> {
    let sphere = |centre, radius| Shape::Sphere(Sphere { centre, radius, flip: false });
    let anywhere = RADII.map(|radius| [0; 6].map(|_| sphere(rng.in_cube(), radius))).concat();
    let sizes = (0..10).map(|i| libm::exp2f(-f64::from(i) as f32));
    let nested = sizes.clone().map(|size| sphere(Vec3::new(0.25, -0.25, 0.125), 0.5 * size));
    let inside = sizes.map(|size| sphere(Vec3::new(-0.75 + 0.25 * size, 0.5, -0.5), 0.25 * size));
    let row = |radius: f32, z| (0..8).map(move |i| sphere(Vec3::new(-0.875 + 0.25 * i as f32, 0.5, z), radius));
    anywhere.into_iter().chain(nested).chain(inside).chain(row(0.125, 0.25)).chain(row(0.25, 0.75)).collect()
}

/// Circles that overlap in a plane, and ellipses from round to hardly any.
fn disks(rng: &mut Rng) -> Vec<Shape> {
    let mut disks = Vec::new();
    for _ in 0..10 {
        let (c, r) = (rng.in_cube().as_dvec3(), f64::from(rng.between(0.1, 0.5)));
        disks.push(Disk::new(DVec3::new(c.x, -0.5, c.z), r * DVec3::X, r * DVec3::Z, DVec3::Y));
    }
    for thin in THIN {
        for _ in 0..4 {
            let [u, v, n] = frame(rng);
            disks.push(Disk::new(rng.in_cube().as_dvec3(), 0.5 * u, thin * v, n));
        }
    }
    disks.into_iter().flatten().map(Shape::Disk).collect()
}

/// Threads and rings, straight and oblique.
fn cylinders(rng: &mut Rng) -> Vec<Shape> {
    let mut cylinders = Vec::new();
    for thin in THIN {
        for i in 0..6 {
            let [u, v, n] = frame(rng);
            let lean = if i % 2 == 0 { DVec3::ZERO } else { 0.3 * u };
            let axes = if i < 3 { [thin * u, thin * v, n + lean] } else { [0.3 * u, 0.2 * v, thin * (n + lean)] };
            cylinders.push(Cylinder::new((0.5 * rng.in_cube()).as_dvec3(), axes, i == 5));
        }
    }
    cylinders.into_iter().flatten().map(Shape::Cylinder).collect()
}

/// A group of a closed mesh with bumps, a box and a sphere in many places, the first of them around all others.
pub(super) fn placed(rng: &mut Rng) -> Vec<Shape> {
    let members = vec![
        Shape::Mesh(displaced_sphere(3)),
        soup(&cuboid(Vec3::splat(-0.5), Vec3::new(0.5, 0.625, 0.75))),
        Shape::Sphere(Sphere { centre: Vec3::new(0.25, 0.0, -0.25), radius: 0.5, flip: false }),
    ];
    let group = Arc::new(Group::new(members));
    // Mirrored, and without any rounding.
    let mut placements = vec![Arc::new(place(DMat3::from_diagonal(DVec3::new(1.0, -1.0, 0.5)), DVec3::ZERO))];
    for i in 0..PLACEMENTS {
        let map = if i % 3 == 0 { quarter_turned(rng) } else { stretched(rng) };
        let at = (0.5 * rng.in_cube()).as_dvec3();
        // Some with coordinates that are good numbers, so that there are planes that axes lie in.
        let at = if i % 3 == 0 { (at * 8.0).round() / 8.0 } else { at };
        placements.push(Arc::new(place(map, at)));
    }
    let members = |placement: Arc<Placement>| {
        let group = group.clone();
        let member = move |index| Placed { group: group.clone(), index, placement: placement.clone() };
        [0, 1, 2].map(|index| Shape::Placed(member(index)))
    };
    placements.into_iter().flat_map(members).collect()
}

#[allow(clippy::expect_used, reason = "the maps of this file flatten nothing")]
fn place(map: DMat3, at: DVec3) -> Placement {
    Placement::new(DAffine3 { matrix3: map, translation: at }).expect("no axis is too short")
}

/// A turn by a right angle whose sine and cosine are rounded, as they are where angles are given, and a power of two.
fn quarter_turned(rng: &mut Rng) -> DMat3 {
    let turns = f64::from(rng.next() as u32 % 4);
    let turn = [DMat3::from_rotation_x, DMat3::from_rotation_y, DMat3::from_rotation_z][rng.below(3)];
    turn(turns * FRAC_PI_2) * (f64::from(rng.sign()) * libm::exp2(-1.0 - f64::from(rng.next() as u32 % 4)))
}

/// Scales along axes that are askew, then a shear; half of them mirror.
fn stretched(rng: &mut Rng) -> DMat3 {
    let axes = DMat3::from_cols_array_2d(&frame(rng).map(|axis| axis.to_array()));
    let scales = DVec3::from_array([0; 3].map(|_| rng.power(SCALES[0], SCALES[1]) * f64::from(rng.sign())));
    let [a, b] = [0; 2].map(|_| f64::from(rng.between(-1.0, 1.0)));
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(a, 1.0, 0.0), DVec3::new(0.0, b, 1.0));
    shear * axes * DMat3::from_diagonal(scales)
}

/// What rays are aimed at of the shape with this index, with the primitive it is: see [`super::meshes::Mesh::triangles`].
pub(super) fn targets(rng: &mut Rng, index: u32, shape: &Shape) -> Vec<(Hit, [Vec3; 3])> {
    match shape {
        Shape::Mesh(mesh) => {
            let faces = 0..mesh.faces.len() as u32;
            faces.map(|primitive| (Hit { shape: index, primitive }, mesh.triangle(primitive))).collect()
        }
        Shape::Placed(placed) => {
            let to_scene = |v: Vec3| placed.placement.point_to_scene(v.as_dvec3()).as_vec3();
            let targets = targets(rng, index, placed.shape());
            targets.into_iter().map(|(hit, triangle)| (hit, triangle.map(to_scene))).collect()
        }
        quadric => proxies(rng, quadric).map(|triangle| (Hit::NONE, triangle)).to_vec(),
    }
}

/// A triangle between points of a quadric, and some that touch it.
fn proxies(rng: &mut Rng, quadric: &Shape) -> [[Vec3; 3]; 4] {
    let inscribed = [0; 3].map(|_| tangents(rng, quadric)[0].as_vec3());
    let mut touching = || {
        let [p, e1, e2] = tangents(rng, quadric);
        let size = rng.power(TOUCHING[0], TOUCHING[1]);
        [p - size * (e1 + e2), p + size * e1, p + size * e2].map(DVec3::as_vec3)
    };
    [inscribed, touching(), touching(), touching()]
}

/// A random point of a quadric, of a disk on its rim, and two vectors along it there, of about its size.
fn tangents(rng: &mut Rng, quadric: &Shape) -> [DVec3; 3] {
    let (y, x) = libm::sincos(TAU * f64::from(rng.unit()));
    match quadric {
        Shape::Sphere(sphere) => {
            let [u, v, n] = frame(rng).map(|axis| axis * f64::from(sphere.radius));
            [sphere.centre.as_dvec3() + n, u, v]
        }
        Shape::Disk(disk) => {
            let at = |x, y| disk.point(DVec2::new(x, y)).point.p;
            [at(x, y), at(-y, x) - at(0.0, 0.0), at(0.0, 0.0) - at(x, y)]
        }
        Shape::Cylinder(cylinder) => {
            let at = |z| cylinder.point(DVec2::new(x, y), z).point.p;
            let p = at([0.0, 1.0, f64::from(rng.unit())][rng.below(3)]);
            [p, cylinder.circles().transform_point3(p), at(1.0) - at(0.0)]
        }
        Shape::Mesh(_) | Shape::Placed(_) => unreachable!("it is no quadric"),
    }
}
