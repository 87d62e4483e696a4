//! Shapes of the compiled scene: what they are, how a ray meets one, and how to sample a point on one.
//!
//! Shapes describe themselves; [`crate::accel`] reads the description. Coordinates are the compiled scene's: f32, the
//! centre of the scene at the origin, the largest coordinate of any surface between one half and one.

pub mod cylinder;
pub mod disk;
pub mod offset;
pub mod placed;
pub mod sphere;
pub mod surface;
pub mod tangent;
pub mod touch;
pub mod triangle;
pub mod uv;

use crate::math::bounds::Bounds;
use crate::math::ray::Ray;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Which primitive a ray met.
///
/// Only the identity: the distance and the point are computed from it, once, by [`crate::shape`], so that they do not
/// depend on who found the hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Pod, Zeroable)]
#[repr(C)]
pub struct Hit {
    /// Index of the shape, or [`Hit::NONE`]'s.
    pub shape: u32,
    /// Index of the primitive in the shape: the face of a mesh, 0 of a quadric.
    pub primitive: u32,
}

impl Hit {
    /// No hit.
    pub const NONE: Self = Self { shape: u32::MAX, primitive: u32::MAX };

    /// Whether there is one.
    #[inline]
    pub fn is_some(self) -> bool {
        self.shape != u32::MAX
    }
}

/// A surface of the compiled scene. Its index in [`crate::scene::Scene::shapes`] is its id.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Triangles.
    Mesh(TriangleMesh),
    /// A sphere.
    Sphere(sphere::Sphere),
    /// A flat ellipse.
    Disk(disk::Disk),
    /// The side of a cylinder.
    Cylinder(cylinder::Cylinder),
    /// Any of these, shared with others that are placed elsewhere.
    Placed(placed::Placed),
}

impl Shape {
    /// Whether it is one of the scene's own that is no mesh.
    #[inline(always)]
    pub fn is_quadric(&self) -> bool {
        matches!(self, Self::Sphere(_) | Self::Disk(_) | Self::Cylinder(_))
    }

    /// How many primitives it has: faces of a mesh, 1 of a quadric.
    pub fn primitive_count(&self) -> usize {
        match self {
            Self::Mesh(mesh) => mesh.faces.len(),
            Self::Sphere(_) | Self::Disk(_) | Self::Cylinder(_) => 1,
            Self::Placed(placed) => placed.shape().primitive_count(),
        }
    }

    /// A box around all of it, if it is known without looking at each primitive.
    pub fn known_bounds(&self) -> Option<Bounds> {
        if let Self::Placed(placed) = self { Some(placed.bounds()) } else { None }
    }

    /// A box that contains a primitive.
    pub fn primitive_bounds(&self, primitive: u32) -> Bounds {
        match self {
            Self::Mesh(mesh) => Bounds::of(mesh.triangle(primitive)),
            Self::Sphere(sphere) => sphere.bounds(),
            Self::Disk(disk) => disk.bounds(),
            Self::Cylinder(cylinder) => cylinder.bounds(),
            Self::Placed(placed) => placed.primitive_bounds(primitive),
        }
    }

    /// Distance at which `ray` meets a primitive in its open interval, in units of its direction, rounded from f64.
    #[inline]
    pub fn intersect(&self, primitive: u32, ray: &Ray) -> Option<f32> {
        match self {
            Self::Mesh(mesh) => {
                let [v0, v1, v2] = mesh.triangle(primitive);
                triangle::WatertightRay::new(ray).intersect(v0, v1, v2)
            }
            Self::Sphere(sphere) => sphere.intersect(ray),
            Self::Disk(disk) => disk.intersect(ray),
            Self::Cylinder(cylinder) => cylinder.intersect(ray),
            Self::Placed(placed) => placed.intersect(primitive, ray),
        }
    }

    /// Distance, in units of the direction, at which `ray` meets a primitive that an accelerator says it meets; see
    /// [`triangle::resolve`], [`sphere::Sphere::resolve`], [`disk::Disk::resolve`] and [`cylinder::Cylinder::resolve`].
    #[inline]
    pub fn resolve_distance(&self, primitive: u32, ray: &Ray) -> f64 {
        match self {
            Self::Mesh(mesh) => {
                let [v0, v1, v2] = mesh.triangle(primitive);
                triangle::resolve(ray, v0, v1, v2).t
            }
            Self::Sphere(sphere) => sphere.resolve(ray),
            Self::Disk(disk) => disk.resolve(ray),
            Self::Cylinder(cylinder) => cylinder.resolve(ray),
            Self::Placed(placed) => placed.resolve_distance(primitive, ray),
        }
    }
}

/// Triangles with shared vertices. No triangle has zero area (exactly, in f64, of the f32 vertices).
#[derive(Clone, Debug, Default)]
pub struct TriangleMesh {
    /// Vertices.
    pub positions: Vec<Vec3>,
    /// Unit shading normals, one a vertex; empty where the triangles are flat.
    pub normals: Vec<Vec3>,
    /// Vertex indices of each triangle, counter-clockwise seen from the front.
    pub faces: Vec<[u32; 3]>,
    /// Whether the front is the other side: the geometric normal is the negative of the triangle's own. (The vertex
    /// normals are flipped already.)
    pub flip: bool,
    /// The plane of each triangle, or nothing: then planes are computed when asked for. See [`Self::with_planes`].
    pub planes: Vec<Plane>,
}

/// The plane of a triangle, as far as shading and the offsets of rays need it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal of the front side.
    pub n: Vec3,
    /// What an f32 intersection test may displace the triangle by, along its normal; see [`offset`].
    pub slack: f32,
}

impl TriangleMesh {
    /// Bytes held.
    pub fn memory_bytes(&self) -> u64 {
        let of = |bytes: usize| bytes as u64;
        of(size_of_val(&self.positions[..]))
            + of(size_of_val(&self.normals[..]))
            + of(size_of_val(&self.faces[..]))
            + of(size_of_val(&self.planes[..]))
    }

    /// The three vertices of a triangle.
    #[inline]
    pub fn triangle(&self, face: u32) -> [Vec3; 3] {
        let [a, b, c] = self.faces[face as usize];
        [self.positions[a as usize], self.positions[b as usize], self.positions[c as usize]]
    }

    /// This mesh with its planes computed once and for all: 16 bytes a triangle for a square root and a division a hit.
    #[must_use]
    pub fn with_planes(mut self) -> Self {
        self.planes = (0..self.faces.len() as u32).map(|face| self.compute_plane(face)).collect();
        self
    }

    /// Whether the vertex normals are those of the triangles themselves, within rounding, and so say nothing.
    pub fn is_flat(&self) -> bool {
        /// Each normal is rounded to f32 and normalised, twice over: a few units in the last place.
        const SAME_NORMAL: f32 = 4.0 * f32::EPSILON;
        (0..self.faces.len() as u32).zip(&self.faces).all(|(face, corners)| {
            let n = self.plane(face).n;
            corners.iter().all(|&i| (self.normals[i as usize] - n).abs().max_element() <= SAME_NORMAL)
        })
    }

    /// The plane of a triangle.
    #[inline]
    pub fn plane(&self, face: u32) -> Plane {
        if self.planes.is_empty() { self.compute_plane(face) } else { self.planes[face as usize] }
    }

    fn compute_plane(&self, face: u32) -> Plane {
        let [a, b, c] = self.triangle(face);
        let [e1, e2] = [b, c].map(|v| v.as_dvec3() - a.as_dvec3());
        let n = e1.cross(e2).normalize().as_vec3();
        let n = if self.flip { -n } else { n };
        Plane { n, slack: offset::slack(n, a.max(b).max(c) - a.min(b).min(c)) }
    }
}
