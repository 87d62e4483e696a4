//! Rays that are hard on accelerators, each a function of (seed, mesh, kind, index).

use super::meshes::{CAVITY, Mesh};
use super::random::Rng;
use crate::math::ray::Ray;
use crate::shape::offset::SurfacePoint;
use crate::shape::{Hit, TriangleMesh};
use glam::{DVec3, Vec3};

/// Kinds of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayKind {
    /// Between random points, some with ends.
    Random,
    /// Through a triangle at an angle of 2⁻⁸ to 2⁻³⁰ to its plane, or in it.
    Grazing,
    /// At edges: their midpoints and elsewhere.
    Edge,
    /// At vertices.
    Vertex,
    /// Along an axis, many in the planes of vertices.
    Axis,
    /// With a direction 2²⁰ to 2¹⁰⁰ long.
    Huge,
    /// With a direction 2⁻²⁰ to 2⁻¹⁰⁰ long.
    Tiny,
    /// From 10 to 10⁶ times the size of the mesh away.
    Far,
    /// With denormal components.
    Denormal,
    /// From a surface, as the renderer spawns them.
    Spawned,
    /// Between two surfaces, as the renderer's shadow rays.
    Segment,
    /// The rays of `Spawned`, asked with the primitive that each starts on.
    Left,
    /// The segments of `Segment`, asked with the primitives that each starts and ends on.
    Between,
    /// From one point for each [`BLOCK`], as those of a camera in a block of pixels, and asked as such.
    Camera,
}

impl RayKind {
    /// All there are.
    pub const ALL: [Self; 14] = [
        Self::Random,
        Self::Grazing,
        Self::Edge,
        Self::Vertex,
        Self::Axis,
        Self::Huge,
        Self::Tiny,
        Self::Far,
        Self::Denormal,
        Self::Spawned,
        Self::Segment,
        Self::Left,
        Self::Between,
        Self::Camera,
    ];

    /// One word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Grazing => "grazing",
            Self::Edge => "edge",
            Self::Vertex => "vertex",
            Self::Axis => "axis",
            Self::Huge => "huge",
            Self::Tiny => "tiny",
            Self::Far => "far",
            Self::Denormal => "denormal",
            Self::Spawned => "spawned",
            Self::Segment => "segment",
            Self::Left => "left",
            Self::Between => "between",
            Self::Camera => "camera",
        }
    }

    /// The kind whose rays these are.
    fn rays(self) -> Self {
        match self {
            Self::Left => Self::Spawned,
            Self::Between => Self::Segment,
            kind => kind,
        }
    }
}

/// A ray, and whether it is lost if it meets nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aimed {
    /// The ray.
    pub ray: Ray,
    /// It passes through the inside of a closed mesh, without an end.
    pub must_hit: bool,
    /// The primitives that it starts and ends on, as far as whoever answers is told; else [`Hit::NONE`].
    pub ends: [Hit; 2],
}

/// Rays that are traced together: those whose numbers are the same but for the remainder by this. Of a camera, they are those
/// of a square of pixels with [`SIDE`] of them along an edge.
pub const BLOCK: u64 = SIDE * SIDE;

/// Pixels along an edge of the square that a camera's rays are for.
const SIDE: u64 = 16;

/// Exponents of how far from the middle of that square its edges are, as seen from a distance of 1.
const VIEWS: [f32; 2] = [-16.0, 1.0];

/// Lengths of huge directions are powers of two with exponents between these, of tiny ones their inverse.
const LENGTHS: [f32; 2] = [20.0, 100.0];

/// Exponents of what the size of a mesh and the length of a direction may differ by, so that distances are far from the
/// ends of f32.
const MOST_APART: f32 = 115.0;

/// Exponents of grazing angles.
const SLOPES: [f32; 2] = [-30.0, -8.0];

/// Exponents of how far away a far ray starts.
const DISTANCES: [f32; 2] = [3.0, 20.0];

/// Components that are next to nothing beside others of 1.
const FAINT: f32 = 1e-30;

/// Directions of this size have no bits but denormal ones; distances up to 1/8 in units of them are below 2¹²⁷.
const DENORMAL_LENGTH: f64 = f32::MIN_POSITIVE as f64 * 0.9;

/// How far before its target a ray with such a direction starts, at most.
const DENORMAL_REACH: f32 = 0.0625;

/// The ray with this index. Its direction is finite and not zero.
pub fn aim(mesh: &Mesh, kind: RayKind, seed: u64, index: u64) -> Aimed {
    let names = [mesh.index as u64, kind.rays() as u64];
    let rng = &mut Rng::of(seed, &[names[0], names[1], index]);
    let free = |ray| Aimed { ray, must_hit: false, ends: [Hit::NONE; 2] };
    let aimed = match kind {
        RayKind::Random => free(random_ray(rng, index, mesh.centre, mesh.size)),
        RayKind::Grazing => free(grazing(rng, mesh)),
        RayKind::Edge | RayKind::Vertex => at_rim(rng, mesh, kind == RayKind::Vertex),
        RayKind::Axis => free(along_axis(rng, mesh)),
        RayKind::Huge | RayKind::Tiny => free(of_length(rng, mesh, kind == RayKind::Tiny)),
        RayKind::Far => free(from_far(rng, mesh)),
        RayKind::Denormal => free(denormal(rng, mesh)),
        RayKind::Spawned | RayKind::Left => {
            let place = rng.below(mesh.triangles.len());
            let start = if kind == RayKind::Left { mesh.ids[place] } else { Hit::NONE };
            Aimed { ends: [start, Hit::NONE], ..free(spawned(rng, mesh.triangles[place])) }
        }
        RayKind::Segment | RayKind::Between => {
            let places = [0; 2].map(|_| rng.below(mesh.triangles.len()));
            let ends = places.map(|i| if kind == RayKind::Between { mesh.ids[i] } else { Hit::NONE });
            Aimed { ends, ..free(segment(rng, places.map(|i| mesh.triangles[i]))) }
        }
        RayKind::Camera => {
            // One more name than a ray has: no ray's numbers.
            let view = &mut Rng::of(seed, &[names[0], names[1], 0, index / BLOCK]);
            free(through_pixel(rng, view, mesh, index % BLOCK))
        }
    };
    if is_ray(&aimed.ray) { aimed } else { free(Ray::new(mesh.place(1.5 * rng.in_cube()), rng.direction())) }
}

fn pick(rng: &mut Rng, mesh: &Mesh) -> [Vec3; 3] {
    mesh.triangles[rng.below(mesh.triangles.len())]
}

/// A random point of a random triangle.
fn target(rng: &mut Rng, mesh: &Mesh) -> Vec3 {
    let triangle = pick(rng, mesh);
    inside(rng, triangle)
}

/// Whether accelerators are asked about such a ray.
fn is_ray(ray: &Ray) -> bool {
    ray.o.is_finite() && ray.d.is_finite() && ray.d != Vec3::ZERO && ray.tmin >= 0.0
}

/// Unit length, whatever the length.
fn unit(v: Vec3) -> Vec3 {
    v.as_dvec3().normalize().as_vec3()
}

/// Rays from and to random points in a cube; of three, one has an end and one a start.
pub fn random_rays(rng: &mut Rng, count: usize, scale: f32) -> Vec<Ray> {
    (0..count as u64).map(|i| random_ray(rng, i, Vec3::ZERO, scale)).filter(is_ray).collect()
}

fn random_ray(rng: &mut Rng, index: u64, centre: Vec3, scale: f32) -> Ray {
    let (o, p) = (centre + scale * 1.5 * rng.in_cube(), centre + scale * rng.in_cube());
    match index % 3 {
        0 => Ray::segment(o, p),
        1 => Ray { tmin: 0.5, ..Ray::new(o, p - o) },
        _ => Ray::new(o, unit(p - o)),
    }
}

/// A random point of a triangle.
fn inside(rng: &mut Rng, [a, b, c]: [Vec3; 3]) -> Vec3 {
    a.lerp(b, rng.unit()).lerp(c, rng.unit())
}

fn grazing(rng: &mut Rng, mesh: &Mesh) -> Ray {
    let v = pick(rng, mesh);
    let [a, b, c] = v.map(Vec3::as_dvec3);
    let n = (b - a).cross(c - a);
    let along = (b - a) * f64::from(rng.between(-1.0, 1.0)) + (c - a) * f64::from(rng.between(-1.0, 1.0));
    let slope = if rng.below(8) == 0 { 0.0 } else { rng.power(SLOPES[0], SLOPES[1]) * f64::from(rng.sign()) };
    let d = along.normalize() + n.normalize() * slope;
    let length = f64::from(mesh.size) * f64::from(rng.between(0.0, 2.0));
    let o = (inside(rng, v).as_dvec3() - d * length).as_vec3();
    Ray::new(o, (d * f64::from(rng.between(0.5, 2.0))).as_vec3())
}

/// At an edge or vertex; where the mesh is closed through one of its cavities, before or behind.
fn at_rim(rng: &mut Rng, mesh: &Mesh, vertex: bool) -> Aimed {
    let v = pick(rng, mesh);
    let corner = rng.below(3);
    let (a, b) = (v[corner], v[(corner + 1) % 3]);
    let p = match rng.below(3) {
        _ if vertex => a,
        0 => a * 0.5 + b * 0.5,
        1 => a * 0.75 + b * 0.25,
        _ => a.lerp(b, rng.unit()),
    };
    if !mesh.is_closed() {
        let o = mesh.place(1.5 * rng.in_cube());
        return Aimed { ray: Ray::new(o, p - o), must_hit: false, ends: [Hit::NONE; 2] };
    }
    let q = mesh.cavities[rng.below(mesh.cavities.len())] + mesh.size * CAVITY * rng.in_cube();
    let o = if rng.below(2) == 0 { q } else { p + rng.between(0.1, 2.0) * (p - q) };
    Aimed { ray: Ray::new(o, p - o), must_hit: true, ends: [Hit::NONE; 2] }
}

fn along_axis(rng: &mut Rng, mesh: &Mesh) -> Ray {
    let mut o = mesh.place(1.5 * rng.in_cube());
    for axis in 0..3 {
        if rng.below(3) != 0 {
            o[axis] = pick(rng, mesh)[0][axis];
        }
        if rng.below(8) == 0 {
            o[axis] = o[axis].next_up();
        }
    }
    let axis = rng.below(3);
    let mut d = Vec3::ZERO;
    d[axis] = rng.sign();
    match rng.below(6) {
        0 => d[(axis + 1) % 3] = -0.0,
        1 => d[(axis + 1) % 3] = FAINT * rng.sign(),
        2 => d[(axis + 1) % 3] = rng.between(-1.0, 1.0),
        _ => {}
    }
    Ray::new(o, d)
}

/// At a triangle, with a direction of an odd length.
fn of_length(rng: &mut Rng, mesh: &Mesh, tiny: bool) -> Ray {
    let p = target(rng, mesh);
    let o = mesh.place(1.5 * rng.in_cube());
    let size = libm::log2f(mesh.size);
    let [low, high] = LENGTHS;
    let exponent = if tiny {
        -rng.between(low, high.min((MOST_APART - size).max(low)))
    } else {
        rng.between(low, high.min((MOST_APART + size).max(low)))
    };
    let d = (p.as_dvec3() - o.as_dvec3()).normalize() * libm::exp2(f64::from(exponent));
    Ray::new(o, d.as_vec3())
}

fn from_far(rng: &mut Rng, mesh: &Mesh) -> Ray {
    let p = target(rng, mesh);
    let distance = rng.power(DISTANCES[0], DISTANCES[1]) as f32;
    let o = mesh.place(distance * rng.direction());
    Ray::new(o, if rng.below(2) == 0 { p - o } else { unit(p - o) })
}

fn denormal(rng: &mut Rng, mesh: &Mesh) -> Ray {
    /// A number that is denormal, or 0.
    fn faint(rng: &mut Rng) -> f32 {
        rng.sign() * f32::from_bits((rng.next() >> 41) as u32 >> rng.below(23))
    }
    let p = target(rng, mesh);
    let o = mesh.place(1.5 * rng.in_cube());
    let mut ray = Ray::new(o, p - o);
    match rng.below(4) {
        0 if mesh.size <= 1.0 => {
            let d = rng.direction();
            ray.o = p - DENORMAL_REACH * mesh.size * rng.unit() * d;
            ray.d = (d.as_dvec3() * DENORMAL_LENGTH).as_vec3();
        }
        1 => {
            ray.o[rng.below(3)] = faint(rng);
            ray.d = p - ray.o;
        }
        2 => ray.tmin = faint(rng).abs(),
        _ => {
            ray.d[rng.below(3)] = faint(rng);
            ray.d[rng.below(3)] = faint(rng);
        }
    }
    ray
}

/// A camera's ray through a point of a pixel, of the square that `view` chooses: in its middle some triangle is seen.
fn through_pixel(rng: &mut Rng, view: &mut Rng, mesh: &Mesh, pixel: u64) -> Ray {
    let o = mesh.place(1.5 * view.in_cube());
    let forward = (target(view, mesh).as_dvec3() - o.as_dvec3()).normalize();
    let (right, up) = forward.any_orthonormal_pair();
    let size = view.power(VIEWS[0], VIEWS[1]);
    let mut along = |pixel: u64| size * ((pixel as f64 + f64::from(rng.unit())) * (2.0 / SIDE as f64) - 1.0);
    let d = forward + along(pixel % SIDE) * right + along(pixel / SIDE) * up;
    Ray::new(o, d.normalize().as_vec3())
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
    let w: DVec3 = q.p - p.p;
    let w = w.as_vec3();
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
pub fn surface_point(v: [Vec3; 3], [a, b]: [f64; 2]) -> SurfacePoint {
    let mesh = TriangleMesh { positions: v.to_vec(), faces: vec![[0, 1, 2]], ..TriangleMesh::default() };
    mesh.point(0, [1.0 - a - b, a, b]).point
}

#[cfg(test)]
mod tests {
    use super::super::meshes::MESHES;
    use super::*;

    /// 300 rays of each kind and mesh are what accelerators may be asked about, and most of the aimed ones are as wanted.
    #[test]
    fn rays_are_rays() {
        for mesh in (0..MESHES.len()).map(|index| Mesh::new(index, 0)) {
            for kind in RayKind::ALL {
                let rays: Vec<Aimed> = (0..300).map(|index| aim(&mesh, kind, 7, index)).collect();
                assert!(rays.iter().all(|aimed| is_ray(&aimed.ray)), "{} {}", mesh.name, kind.name());
                let must = rays.iter().filter(|aimed| aimed.must_hit).count();
                let at_rim = matches!(kind, RayKind::Edge | RayKind::Vertex) && mesh.is_closed();
                assert!(must == if at_rim { 300 } else { 0 }, "{} {}", mesh.name, kind.name());
                let tiny = rays.iter().filter(|aimed| aimed.ray.d.abs().max_element() < f32::MIN_POSITIVE).count();
                assert_eq!(tiny > 30, kind == RayKind::Denormal && mesh.size <= 1.0, "{} {}", mesh.name, kind.name());
            }
        }
    }
}
