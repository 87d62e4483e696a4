//! Shapes of the compiled scene: what they are, how a ray meets one, and how to sample a point on one.
//!
//! Shapes describe themselves; [`crate::accel`] reads the description. Coordinates are the compiled scene's: f32, the
//! centre of the scene at the origin, the largest coordinate of any surface between one half and one.

pub mod offset;
pub mod sphere;
pub mod surface;
pub mod triangle;

use crate::math::bounds::Bounds;
use crate::math::ray::Ray;
use glam::Vec3;

/// A surface of the compiled scene. Its index in [`crate::scene::Scene::shapes`] is its id.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Triangles.
    Mesh(TriangleMesh),
    /// A sphere.
    Sphere(sphere::Sphere),
}

impl Shape {
    /// How many primitives it has: faces of a mesh, 1 of a sphere.
    pub fn primitive_count(&self) -> usize {
        match self {
            Self::Mesh(mesh) => mesh.faces.len(),
            Self::Sphere(_) => 1,
        }
    }

    /// A box that contains a primitive.
    pub fn primitive_bounds(&self, primitive: u32) -> Bounds {
        match self {
            Self::Mesh(mesh) => Bounds::of(mesh.triangle(primitive)),
            Self::Sphere(sphere) => sphere.bounds(),
        }
    }

    /// Distance, in units of the direction, at which `ray` meets a primitive that an accelerator says it meets; see
    /// [`triangle::resolve`] and [`sphere::Sphere::resolve`].
    #[inline]
    pub fn resolve_distance(&self, primitive: u32, ray: &Ray) -> f64 {
        match self {
            Self::Mesh(mesh) => {
                let [v0, v1, v2] = mesh.triangle(primitive);
                triangle::resolve(ray, v0, v1, v2).t
            }
            Self::Sphere(sphere) => sphere.resolve(ray),
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
    /// The three vertices of a triangle.
    #[inline]
    pub fn triangle(&self, face: u32) -> [Vec3; 3] {
        self.faces[face as usize].map(|i| self.positions[i as usize])
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
        self.planes.get(face as usize).copied().unwrap_or_else(|| self.compute_plane(face))
    }

    fn compute_plane(&self, face: u32) -> Plane {
        let [a, b, c] = self.triangle(face);
        let [e1, e2] = [b, c].map(|v| v.as_dvec3() - a.as_dvec3());
        let n = e1.cross(e2).normalize().as_vec3();
        let n = if self.flip { -n } else { n };
        Plane { n, slack: offset::slack(n, a.max(b).max(c) - a.min(b).min(c)) }
    }
}
