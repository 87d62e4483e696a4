//! The leaves of trees: what they are to a tree, and those of one quadric each.

use super::Nearest;
use super::item::Item;
use super::pages::Array;
use super::spatial::Corners;
use super::wide::Stack;
use crate::accel::Hit;
use crate::math::ray::Ray;
use crate::shape::Shape;
use glam::{Vec3, Vec4};
use std::fmt::Debug;

/// Triangles in a leaf.
pub(super) const BLOCK_SIZE: usize = 4;

/// A leaf of a tree.
pub(super) trait Block: Send + Sync + Sized {
    /// What it is made from.
    type Source: ?Sized + Sync;

    /// The rays that it is tested against.
    type Ray: BlockRay;

    /// The nearest hit of a ray so far.
    type Nearest: Copy;

    /// Many of them.
    type Blocks: Array<Self> + Send + Sync + Debug;

    /// The most primitives in one.
    const SIZE: usize;

    /// The corners of its primitives by their names, if they are triangles, which may be cut.
    fn corners(source: &Self::Source) -> Option<Box<Corners<'_>>>;

    /// Copies what it needs of 1 to [`Self::SIZE`] primitives.
    fn new(items: &[Item], source: &Self::Source) -> Self;

    /// A distance that the nearest hit so far is not beyond.
    fn limit(nearest: &Self::Nearest) -> f32;

    /// Offers all hits of one of `blocks` inside the ray's interval. What is on the stack is left there.
    fn closest(blocks: &[Self], index: u32, ray: &Self::Ray, nearest: &mut Self::Nearest, stack: &mut Stack);

    /// Whether there is a hit inside the ray's interval.
    fn any(blocks: &[Self], index: u32, ray: &Self::Ray, stack: &mut Stack) -> bool;
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

/// The corners of a triangle of a mesh.
pub(super) fn triangle(shapes: &[Shape], id: Hit) -> [Vec3; 3] {
    let Shape::Mesh(mesh) = &shapes[id.shape as usize] else {
        unreachable!("triangles are parts of meshes");
    };
    mesh.triangle(id.primitive)
}

/// Up to four triangles by their names, and lane by lane as `[vertex][axis]`; unused lanes repeat the last one.
pub(super) fn side_by_side(items: &[Item], shapes: &[Shape]) -> ([Hit; BLOCK_SIZE], [[Vec4; 3]; 3]) {
    let ids = std::array::from_fn(|i| lane(items, i).id());
    let mut vertices = [[Vec4::ZERO; 3]; 3];
    for (i, &id) in ids.iter().enumerate() {
        for (vertex, position) in vertices.iter_mut().zip(triangle(shapes, id)) {
            for (axis, coordinate) in vertex.iter_mut().zip(position.to_array()) {
                axis[i] = coordinate;
            }
        }
    }
    (ids, vertices)
}

/// The corners of the triangle in a lane.
#[inline(always)]
pub(super) fn corners_of([a, b, c]: &[[Vec4; 3]; 3], lane: usize) -> [Vec3; 3] {
    let corner = |v: &[Vec4; 3]| Vec3::new(v[0][lane], v[1][lane], v[2][lane]);
    [corner(a), corner(b), corner(c)]
}

/// A quadric.
#[derive(Debug)]
pub(super) struct QuadricBlock(Shape, Hit);

impl Block for QuadricBlock {
    type Source = [Shape];
    type Ray = PlainRay;
    type Nearest = Nearest;
    type Blocks = Vec<Self>;

    const SIZE: usize = 1;

    fn corners(_: &[Shape]) -> Option<Box<Corners<'_>>> {
        None
    }

    fn limit(nearest: &Nearest) -> f32 {
        nearest.t
    }

    fn new(items: &[Item], shapes: &[Shape]) -> Self {
        Self(shapes[items[0].id().shape as usize].clone(), items[0].id())
    }

    #[inline]
    fn closest(blocks: &[Self], index: u32, ray: &PlainRay, nearest: &mut Nearest, _: &mut Stack) {
        let Self(quadric, id) = &blocks[index as usize];
        if let Some(t) = quadric.intersect(0, &ray.ray) {
            nearest.offer(t, *id);
        }
    }

    #[inline]
    fn any(blocks: &[Self], index: u32, ray: &PlainRay, _: &mut Stack) -> bool {
        blocks[index as usize].0.intersect(0, &ray.ray).is_some()
    }
}
