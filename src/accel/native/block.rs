//! The leaves: up to four triangles or one of anything else, with all that their test reads.
//!
//! Triangles are stored lane by lane, by their vertices and not by edges: the two triangles at an edge must compute it
//! from the same numbers. Unused lanes repeat the last one, which changes no answer.

use super::build::Item;
use super::spatial::Corners;
use super::wide::Stack;
use super::{Nearest, PreparedRay};
use crate::accel::Hit;
use crate::math::ray::Ray;
use crate::shape::Shape;
use crate::shape::triangle::WatertightRay;
use glam::{Vec3, Vec4};

/// Triangles in a leaf.
pub(super) const BLOCK_SIZE: usize = 4;

/// A leaf of a tree.
pub(super) trait Block: Send + Sync + Sized {
    /// What it is made from.
    type Source: ?Sized + Sync;

    /// The rays that it is tested against.
    type Ray: BlockRay;

    /// The most primitives in one.
    const SIZE: usize;

    /// The corners of its primitives by their names, if they are triangles, which may be cut.
    fn corners(source: &Self::Source) -> Option<Box<Corners<'_>>>;

    /// Copies what it needs of 1 to [`Self::SIZE`] primitives.
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

/// A ray as blocks want it that are not inside a group.
pub(super) trait SceneRay: BlockRay {
    /// Prepares a ray, with the primitives that it starts and ends on.
    fn new(ray: &Ray, ends: [Hit; 2]) -> Self;
}

impl BlockRay for PreparedRay {
    #[inline(always)]
    fn line(&self) -> &Ray {
        &self.ray
    }
}

impl SceneRay for PreparedRay {
    #[inline(always)]
    fn new(ray: &Ray, ends: [Hit; 2]) -> Self {
        Self { ray: *ray, watertight: WatertightRay::new(ray), ends }
    }
}

/// A ray that needs no more preparation.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlainRay {
    pub(super) ray: Ray,
    /// The primitives that it starts and ends on.
    pub(super) ends: [Hit; 2],
}

impl BlockRay for PlainRay {
    #[inline(always)]
    fn line(&self) -> &Ray {
        &self.ray
    }
}

impl SceneRay for PlainRay {
    #[inline(always)]
    fn new(ray: &Ray, ends: [Hit; 2]) -> Self {
        Self { ray: *ray, ends }
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

/// The corners of a triangle of a mesh.
pub(super) fn triangle(shapes: &[Shape], id: Hit) -> [Vec3; 3] {
    let Shape::Mesh(mesh) = &shapes[id.shape as usize] else {
        unreachable!("triangles are parts of meshes");
    };
    mesh.triangle(id.primitive)
}

impl Block for TriangleBlock {
    type Source = [Shape];
    type Ray = PreparedRay;

    const SIZE: usize = BLOCK_SIZE;

    fn corners(shapes: &[Shape]) -> Option<Box<Corners<'_>>> {
        Some(Box::new(|id| triangle(shapes, id)))
    }

    fn new(items: &[Item], shapes: &[Shape]) -> Self {
        let ids = std::array::from_fn(|i| lane(items, i).id);
        let mut vertices = [[Vec4::ZERO; 3]; 3];
        for (i, &id) in ids.iter().enumerate() {
            for (vertex, position) in vertices.iter_mut().zip(triangle(shapes, id)) {
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

/// A quadric.
#[derive(Debug)]
pub(super) struct QuadricBlock(Shape, Hit);

impl Block for QuadricBlock {
    type Source = [Shape];
    type Ray = PlainRay;

    const SIZE: usize = 1;

    fn corners(_: &[Shape]) -> Option<Box<Corners<'_>>> {
        None
    }

    fn new(items: &[Item], shapes: &[Shape]) -> Self {
        Self(shapes[items[0].id.shape as usize].clone(), items[0].id)
    }

    #[inline]
    fn closest(&self, ray: &PlainRay, nearest: &mut Nearest, _: &mut Stack) {
        if let Some(t) = self.0.intersect(0, &ray.ray) {
            nearest.offer(t, self.1);
        }
    }

    #[inline]
    fn any(&self, ray: &PlainRay, _: &mut Stack) -> bool {
        self.0.intersect(0, &ray.ray).is_some()
    }
}
