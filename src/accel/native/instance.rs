//! Placed groups: a tree over all placements, whose leaves take the ray to the group's space and walk the group's own tree.
//!
//! A group has one tree, however often it is placed. Its primitives are tested in f64 ([`crate::shape::placed`]); its
//! boxes are walked by the ray rounded to f32, for which they are wide enough ([`super::wide`]).

use super::block::{self, BLOCK_SIZE, Block, BlockRay, PlainRay};
use super::item::Item;
use super::spatial::Corners;
use super::wide::{Stack, Tree};
use super::{Nearest, is_mesh, items};
use crate::accel::{Hit, Quality};
use crate::math::ray::{DRay, Ray};
use crate::shape::Shape;
use crate::shape::placed::{Group, Placed};
use crate::shape::triangle::ExactWatertightRay;
use glam::{DAffine3, Vec4};
use std::cell::OnceCell;
use std::collections::HashMap;
use std::sync::Arc;

/// All placements of groups.
#[derive(Debug)]
pub(super) struct Instances {
    tree: Tree<Instance>,
    /// The trees of the groups, each once.
    groups: Vec<Arc<GroupTrees>>,
}

impl Instances {
    /// Of those of `shapes` that are placed; `None` where none is. Shapes that are placed together follow each other, in
    /// the order of their group.
    pub(super) fn build(shapes: &[Shape], quality: Quality) -> Option<Self> {
        let mut groups: Vec<Arc<GroupTrees>> = Vec::new();
        let mut known: HashMap<*const Group, usize> = HashMap::new();
        let (mut instances, mut table) = (Vec::new(), Vec::new());
        for (index, shape) in (0u32..).zip(shapes) {
            let Shape::Placed(placed @ Placed { index: 0, .. }) = shape else { continue };
            let group = *known.entry(Arc::as_ptr(&placed.group)).or_insert_with(|| {
                groups.push(Arc::new(GroupTrees::build(&placed.group, quality)));
                groups.len() - 1
            });
            let bounds = placed.placement.bounds_to_scene(placed.group.bounds());
            instances.push(Item::new(bounds, Hit { shape: table.len() as u32, primitive: 0 }));
            table.push(Instance { first: index, to_group: *placed.placement.to_group(), group: groups[group].clone() });
        }
        Tree::build(instances, &table[..], quality).map(|tree| Self { tree, groups })
    }

    /// See [`super::Native::improve_by_others`].
    pub(super) fn improve_all(&self, rays: &[Ray], from: &[Hit], nearest: &mut [Nearest], stack: &mut Stack) {
        self.tree.improve_all(rays, from, nearest, stack);
    }

    /// See [`super::Native::occluded`].
    pub(super) fn occluded(&self, rays: &[Ray], ends: &[[Hit; 2]], occluded: &mut [bool]) {
        self.tree.occluded(rays, ends, occluded);
    }

    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> u64 {
        self.tree.memory_bytes() + self.groups.iter().map(|group| group.memory_bytes()).sum::<u64>()
    }
}

/// A group where it is placed.
#[derive(Clone, Debug)]
pub(super) struct Instance {
    /// The index of its first shape among those of the scene.
    first: u32,
    /// Here, and not where the placement is: it is read for every ray that comes near.
    to_group: DAffine3,
    group: Arc<GroupTrees>,
}

impl Instance {
    fn local(&self, ray: &PlainRay) -> GroupRay {
        let line = ray.ray.transformed(&self.to_group);
        GroupRay { rounded: line.rounded(), line, watertight: OnceCell::new(), first: self.first, ends: ray.ends }
    }
}

impl Block for Instance {
    type Source = [Self];
    type Ray = PlainRay;
    type Nearest = Nearest;
    type Blocks = Vec<Self>;

    const SIZE: usize = 1;

    fn corners(_: &[Self]) -> Option<Box<Corners<'_>>> {
        None
    }

    fn new(items: &[Item], instances: &[Self]) -> Self {
        instances[items[0].id().shape as usize].clone()
    }

    fn limit(nearest: &Nearest) -> f32 {
        nearest.t
    }

    fn closest(blocks: &[Self], index: u32, ray: &PlainRay, nearest: &mut Nearest, stack: &mut Stack) {
        let instance = &blocks[index as usize];
        instance.group.improve(&instance.local(ray), nearest, stack);
    }

    fn any(blocks: &[Self], index: u32, ray: &PlainRay, stack: &mut Stack) -> bool {
        let instance = &blocks[index as usize];
        instance.group.meets(&instance.local(ray), stack)
    }
}

/// A ray in the space of a group.
#[derive(Clone, Debug)]
struct GroupRay {
    rounded: Ray,
    line: DRay,
    /// Worked out at the first block: most rays pass by all.
    watertight: OnceCell<ExactWatertightRay>,
    /// What the indices of the group's shapes count from.
    first: u32,
    /// The primitives that it starts and ends on, by their numbers in the scene.
    ends: [Hit; 2],
}

impl GroupRay {
    /// What the scene calls a primitive of the group.
    #[inline]
    fn in_scene(&self, id: Hit) -> Hit {
        Hit { shape: self.first + id.shape, primitive: id.primitive }
    }
}

impl BlockRay for GroupRay {
    #[inline(always)]
    fn line(&self) -> &Ray {
        &self.rounded
    }
}

/// The hierarchies of a group.
#[derive(Debug)]
struct GroupTrees {
    triangles: Option<Tree<GroupTriangles>>,
    quadrics: Option<Tree<GroupQuadric>>,
}

impl GroupTrees {
    fn build(group: &Group, quality: Quality) -> Self {
        let shapes = &group.shapes[..];
        Self {
            triangles: Tree::build(items(shapes, is_mesh), shapes, quality),
            quadrics: Tree::build(items(shapes, |shape| !is_mesh(shape)), shapes, quality),
        }
    }

    fn improve(&self, ray: &GroupRay, nearest: &mut Nearest, stack: &mut Stack) {
        if let Some(tree) = &self.triangles {
            tree.improve(ray, nearest, stack);
        }
        if let Some(tree) = &self.quadrics {
            tree.improve(ray, nearest, stack);
        }
    }

    fn meets(&self, ray: &GroupRay, stack: &mut Stack) -> bool {
        self.triangles.as_ref().is_some_and(|tree| tree.meets(ray, stack))
            || self.quadrics.as_ref().is_some_and(|tree| tree.meets(ray, stack))
    }

    fn memory_bytes(&self) -> u64 {
        self.triangles.as_ref().map_or(0, Tree::memory_bytes) + self.quadrics.as_ref().map_or(0, Tree::memory_bytes)
    }
}

/// Four triangles of a group, stored as those of the scene are.
#[derive(Debug)]
struct GroupTriangles {
    /// `[vertex][axis]`, a lane each.
    vertices: [[Vec4; 3]; 3],
    ids: [Hit; BLOCK_SIZE],
    /// The lanes in use, a bit each.
    used: u32,
}

impl GroupTriangles {
    /// Tells `on_hit` of the triangles that the ray meets, with the distances, until it returns true; returns whether it did.
    #[inline(always)]
    fn hits(&self, ray: &GroupRay, mut on_hit: impl FnMut(f32, Hit) -> bool) -> bool {
        let watertight = ray.watertight.get_or_init(|| ExactWatertightRay::new(&ray.line));
        let mut lanes = watertight.crosses4(&self.vertices) & self.used;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % BLOCK_SIZE;
            lanes &= lanes - 1;
            let id = ray.in_scene(self.ids[lane]);
            if !ray.ends.contains(&id)
                && let Some(t) = watertight.intersect(block::corners_of(&self.vertices, lane))
                && on_hit(t as f32, id)
            {
                return true;
            }
        }
        false
    }
}

impl Block for GroupTriangles {
    type Source = [Shape];
    type Ray = GroupRay;
    type Nearest = Nearest;
    type Blocks = Vec<Self>;

    const SIZE: usize = BLOCK_SIZE;

    fn corners(shapes: &[Shape]) -> Option<Box<Corners<'_>>> {
        Some(Box::new(|id| block::triangle(shapes, id)))
    }

    fn new(items: &[Item], shapes: &[Shape]) -> Self {
        let (ids, vertices) = block::side_by_side(items, shapes);
        Self { vertices, ids, used: (1 << items.len()) - 1 }
    }

    fn limit(nearest: &Nearest) -> f32 {
        nearest.t
    }

    #[inline(always)]
    fn closest(blocks: &[Self], index: u32, ray: &GroupRay, nearest: &mut Nearest, _: &mut Stack) {
        blocks[index as usize].hits(ray, |t, id| {
            nearest.offer(t, id);
            false
        });
    }

    #[inline(always)]
    fn any(blocks: &[Self], index: u32, ray: &GroupRay, _: &mut Stack) -> bool {
        blocks[index as usize].hits(ray, |_, _| true)
    }
}

/// A quadric of a group.
#[derive(Debug)]
struct GroupQuadric(Shape, Hit);

impl Block for GroupQuadric {
    type Source = [Shape];
    type Ray = GroupRay;
    type Nearest = Nearest;
    type Blocks = Vec<Self>;

    const SIZE: usize = 1;

    fn corners(_: &[Shape]) -> Option<Box<Corners<'_>>> {
        None
    }

    fn new(items: &[Item], shapes: &[Shape]) -> Self {
        Self(shapes[items[0].id().shape as usize].clone(), items[0].id())
    }

    fn limit(nearest: &Nearest) -> f32 {
        nearest.t
    }

    fn closest(blocks: &[Self], index: u32, ray: &GroupRay, nearest: &mut Nearest, _: &mut Stack) {
        if let Some(t) = blocks[index as usize].0.intersect_in_group(0, &ray.line) {
            nearest.offer(t, ray.in_scene(blocks[index as usize].1));
        }
    }

    fn any(blocks: &[Self], index: u32, ray: &GroupRay, _: &mut Stack) -> bool {
        blocks[index as usize].0.intersect_in_group(0, &ray.line).is_some()
    }
}
