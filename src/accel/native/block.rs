//! The leaves: up to four primitives, lane by lane, with all that their test reads.
//!
//! Triangles store their vertices, not edges: the two triangles at an edge must compute it from the same numbers. Unused
//! lanes repeat the last primitive, which changes no answer.

use super::build::Item;
use super::{Nearest, PreparedRay};
use crate::accel::Hit;
use crate::shape::Shape;
use crate::shape::sphere::Sphere;
use glam::Vec4;

/// Primitives in a leaf.
pub(super) const BLOCK_SIZE: usize = 4;

/// A leaf of a tree.
pub(super) trait Block: Send + Sync + Sized {
    /// Copies what it needs of 1 to [`BLOCK_SIZE`] primitives.
    fn new(items: &[Item], shapes: &[Shape]) -> Self;

    /// Offers all hits inside the ray's interval.
    fn closest(&self, ray: &PreparedRay, nearest: &mut Nearest);

    /// Whether there is a hit inside the ray's interval.
    fn any(&self, ray: &PreparedRay) -> bool;
}

/// The item of a lane, the last one where there are fewer.
fn lane(items: &[Item], lane: usize) -> &Item {
    &items[lane.min(items.len() - 1)]
}

/// Four triangles.
#[derive(Debug)]
#[repr(align(64))]
pub(super) struct TriangleBlock {
    /// `[vertex][axis]`, a lane each.
    vertices: [[Vec4; 3]; 3],
    ids: [Hit; BLOCK_SIZE],
}

impl Block for TriangleBlock {
    fn new(items: &[Item], shapes: &[Shape]) -> Self {
        let ids = std::array::from_fn(|i| lane(items, i).id);
        let mut vertices = [[Vec4::ZERO; 3]; 3];
        for (i, id) in ids.iter().enumerate() {
            let Shape::Mesh(mesh) = &shapes[id.shape as usize] else {
                unreachable!("a block of triangles is built from meshes");
            };
            for (vertex, position) in vertices.iter_mut().zip(mesh.triangle(id.primitive)) {
                for (axis, coordinate) in vertex.iter_mut().zip(position.to_array()) {
                    axis[i] = coordinate;
                }
            }
        }
        Self { vertices, ids }
    }

    #[inline(always)]
    fn closest(&self, ray: &PreparedRay, nearest: &mut Nearest) {
        ray.watertight.intersect4(&self.vertices, |lane, t| {
            nearest.offer(t, self.ids[lane]);
            false
        });
    }

    #[inline(always)]
    fn any(&self, ray: &PreparedRay) -> bool {
        ray.watertight.intersect4(&self.vertices, |_, _| true)
    }
}

/// Four spheres.
#[derive(Debug)]
pub(super) struct SphereBlock {
    spheres: [Sphere; BLOCK_SIZE],
    ids: [Hit; BLOCK_SIZE],
}

impl Block for SphereBlock {
    fn new(items: &[Item], shapes: &[Shape]) -> Self {
        let ids = std::array::from_fn(|i| lane(items, i).id);
        let spheres = ids.map(|id: Hit| {
            let Shape::Sphere(sphere) = shapes[id.shape as usize] else {
                unreachable!("a block of spheres is built from spheres");
            };
            sphere
        });
        Self { spheres, ids }
    }

    #[inline]
    fn closest(&self, ray: &PreparedRay, nearest: &mut Nearest) {
        for (sphere, &id) in self.spheres.iter().zip(&self.ids) {
            if let Some(t) = sphere.intersect(&ray.ray) {
                nearest.offer(t, id);
            }
        }
    }

    #[inline]
    fn any(&self, ray: &PreparedRay) -> bool {
        self.spheres.iter().any(|sphere| sphere.intersect(&ray.ray).is_some())
    }
}
