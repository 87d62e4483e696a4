//! The leaves: up to four primitives, with all that their test reads.
//!
//! Triangles are stored lane by lane, by their vertices and not by edges: the two triangles at an edge must compute it
//! from the same numbers. Unused lanes repeat the last one, which changes no answer.

use super::build::Item;
use super::wide::Stack;
use super::{Nearest, PreparedRay};
use crate::accel::Hit;
use crate::math::ray::Ray;
use crate::shape::Shape;
use glam::Vec4;

/// Primitives in a leaf.
pub(super) const BLOCK_SIZE: usize = 4;

/// A leaf of a tree.
pub(super) trait Block: Send + Sync + Sized {
    /// What it is made from.
    type Source: ?Sized + Sync;

    /// The rays that it is tested against.
    type Ray: BlockRay;

    /// Copies what it needs of 1 to [`BLOCK_SIZE`] primitives.
    fn new(items: &[Item], source: &Self::Source) -> Self;

    /// Offers all hits inside the ray's interval. What is on the stack is left there.
    fn closest(&self, ray: &Self::Ray, nearest: &mut Nearest, stack: &mut Stack);

    /// Whether there is a hit inside the ray's interval.
    fn any(&self, ray: &Self::Ray, stack: &mut Stack) -> bool;
}

/// A ray as blocks want it.
pub(super) trait BlockRay {
    /// The ray, as the tree's boxes want it.
    fn line(&self) -> &Ray;
}

impl BlockRay for PreparedRay {
    #[inline(always)]
    fn line(&self) -> &Ray {
        &self.ray
    }
}

/// The item of a lane, the last one where there are fewer.
pub(super) fn lane(items: &[Item], lane: usize) -> &Item {
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
    type Source = [Shape];
    type Ray = PreparedRay;

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
    fn closest(&self, ray: &PreparedRay, nearest: &mut Nearest, _: &mut Stack) {
        let other = |lane: usize| !ray.ends.contains(&self.ids[lane]);
        ray.watertight.intersect4(&self.vertices, other, |lane, t| {
            nearest.offer(t, self.ids[lane]);
            false
        });
    }

    #[inline(always)]
    fn any(&self, ray: &PreparedRay, _: &mut Stack) -> bool {
        let other = |lane: usize| !ray.ends.contains(&self.ids[lane]);
        ray.watertight.intersect4(&self.vertices, other, |_, _| true)
    }
}

/// Up to four quadrics.
#[derive(Debug)]
pub(super) struct QuadricBlock(Vec<(Shape, Hit)>);

impl Block for QuadricBlock {
    type Source = [Shape];
    type Ray = PreparedRay;

    fn new(items: &[Item], shapes: &[Shape]) -> Self {
        Self(items.iter().map(|item| (shapes[item.id.shape as usize].clone(), item.id)).collect())
    }

    #[inline]
    fn closest(&self, ray: &PreparedRay, nearest: &mut Nearest, _: &mut Stack) {
        for &(ref quadric, id) in &self.0 {
            if let Some(t) = quadric.intersect(0, &ray.ray) {
                nearest.offer(t, id);
            }
        }
    }

    #[inline]
    fn any(&self, ray: &PreparedRay, _: &mut Stack) -> bool {
        self.0.iter().any(|(quadric, _)| quadric.intersect(0, &ray.ray).is_some())
    }
}
