//! Meshes and random numbers for the tests and the benchmark of the accelerators.
#![allow(dead_code, unreachable_pub, reason = "each of its users is a crate of its own and needs a part")]

use glam::{DVec3, Vec3};
use snell::math::ray::Ray;
use snell::shape::offset::SurfacePoint;
use snell::shape::{Shape, TriangleMesh};
use std::collections::HashMap;

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
