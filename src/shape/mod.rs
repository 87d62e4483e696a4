//! Shapes of the compiled scene: what they are, how a ray meets one, and how to sample a point on one.
//!
//! Shapes describe themselves; [`crate::accel`] reads the description. Coordinates are the compiled scene's: f32, the
//! centre of the scene at the origin, the largest coordinate of any surface between one half and one.

pub mod sphere;
pub mod triangle;

use glam::Vec3;

/// A surface of the compiled scene. Its index in [`crate::scene::Scene::shapes`] is its id.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Triangles.
    Mesh(TriangleMesh),
    /// A sphere.
    Sphere(sphere::Sphere),
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
}

impl TriangleMesh {
    /// The three vertices of a triangle.
    #[inline]
    pub fn triangle(&self, face: u32) -> [Vec3; 3] {
        self.faces[face as usize].map(|i| self.positions[i as usize])
    }
}
