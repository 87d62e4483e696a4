//! The tree that rays walk: nodes of eight boxes over blocks of four primitives.
//!
//! # Conservative boxes
//!
//! A box may be left out only if no primitive in it can have a hit that counts. What counts are points P of primitives
//! at a distance t (in f64) that lie *beside* the ray o + t·d by at most 6·u·M in the two axes that are not dominant
//! (see [`crate::shape::triangle`]; quadrics: by the rounding of f64), u the unit roundoff and M the largest coordinate of
//! P − o. Let S be the largest coordinate of the tree's bounds ([`Tree::reach`]). Then M ≤ |o| + S =: R, in the maximum
//! norm, wherever the origin is.
//!
//! For each axis the test asks for the distances at which the ray enters and leaves a slab [lo, hi], computed as
//! fl(lo·i − fl(o⁺·i)) and fl(hi·i − fl(o⁻·i)), where o^± = fl(o ± p) widens the slab by the padding p and i = fl(1/d')
//! (for d < 0 the ends change places). Taken times |d|, so measured as a length along the axis, the errors against lo − o
//! are
//! * 6·u·R for the point that lies beside the ray,
//! * u·(R + p) for the rounding of o^±,
//! * u·(R + p) for that of its product,
//! * 2·u·R for the reciprocal and the difference, for |lo − o| ≤ R,
//! * u·R for the product lo·i, where it is rounded by itself,
//! * u·R for the rounding of the best distance so far to f32, for t·|d| ≤ R,
//! * 2·u·R in a tree of a group, whose rays are rounded to f32 for the boxes, origin and direction (there, a hit lies on
//!   the ray to the rounding of f64, so that 6·u·R is not needed),
//! * 2⁻⁴⁰·R where a component of d is so small that d' is not d (below).
//!
//! Their sum is below 15·u·R, so p = 16·u·R ([`PADDING_ROUNDINGS`]) makes every computed entry at most, and every computed
//! exit at least, the f32 distance of each hit in the box, on every axis by itself. (Ize 2013, *Robust BVH Ray
//! Traversal*, scales the exit instead, by 1 + 2γ₃; that needs no p for exact points, but our points are not.)
//!
//! Of a triangle that stands in several leaves, each with a box around a part of it ([`super::spatial`]), P is in one of
//! the boxes, and there the whole triangle is tested.
//!
//! *Zero components.* d' is d, but not smaller in size than 2⁻⁴⁰ of the largest component. At any distance that counts,
//! t·|d' − d| ≤ 2⁻⁴⁰·R. So i is finite.
//!
//! *Range.* Where R·i is not between 2⁻¹⁰⁰ and 2¹⁰⁰ ([`TAME`]), a product might overflow, or lose its precision; such an
//! axis is not asked: its i is tiny, and what is added −MAX for the entry and MAX for the exit. As no box is NaN, nothing
//! becomes NaN, and the unused lanes, whose box is (∞, −∞), have ∞ as entry and −∞ as exit.
//!
//! # Depth
//!
//! A node leaves at most seven children on the stack while the eighth is visited, and no path has more nodes than one of
//! the binary tree that it comes from. Where the leaves hold trees themselves ([`super::instance`]), one of these stands
//! above the other on the stack: it has [`STACK_SIZE`] entries.

use super::block::{Block, BlockRay, SceneRay};
use super::build::{self, BinaryNode, Kind, MAX_DEPTH};
use super::collapse::Plans;
use super::item::Item;
use super::pages::{Array, Pages};
use crate::accel::{Hit, Quality};
use crate::math::bounds::Bounds;
use crate::math::float::{UNIT_ROUNDOFF, max};
use crate::math::ray::Ray;
use crate::math::simd;
use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f32x8};
use glam::{BVec4A, Vec4};

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// Padding of the slabs, in unit roundoffs of |o| + S: derived above.
const PADDING_ROUNDINGS: f32 = 16.0;

/// Between its inverse and this, the largest distance of an axis is computed without loss: derived above.
const TAME: f32 = (1u128 << 100) as f32;

/// The least size of a component of d', as a fraction of the largest.
const LEAST_COMPONENT: f32 = 1.0 / (1u64 << 40) as f32;

/// Trees that may stand above each other on a stack.
const LEVELS: usize = 2;

/// See the head.
const STACK_SIZE: usize = LEVELS * ((WIDTH - 1) * MAX_DEPTH + 1);

/// Marks a child reference as one to a block.
pub(super) const BLOCK: u32 = 1 << 31;

/// The low bits of an entry distance that make room for a lane number.
const LANE_BITS: u32 = WIDTH as u32 - 1;

/// Eight boxes and what is in them.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// The lower bounds of all lanes along x, y and z, and from [`UPPER`] the upper ones; (∞, −∞) where there is no child.
    bounds: [f32; 2 * UPPER],
    /// Index of a node, or of a block with [`BLOCK`] set.
    pub(super) children: [u32; WIDTH],
    unused: [u32; WIDTH],
}

/// Where the upper bounds of a node begin.
const UPPER: usize = 3 * WIDTH;

impl Node {
    const EMPTY: Self = {
        let mut bounds = [f32::INFINITY; 2 * UPPER];
        let mut upper = UPPER;
        while upper < bounds.len() {
            bounds[upper] = f32::NEG_INFINITY;
            upper += 1;
        }
        Self { bounds, children: [0; WIDTH], unused: [0; WIDTH] }
    };

    fn set(&mut self, lane: usize, bounds: Bounds, child: u32) {
        for (axis, (lower, upper)) in bounds.min.to_array().into_iter().zip(bounds.max.to_array()).enumerate() {
            self.bounds[axis * WIDTH + lane] = lower;
            self.bounds[UPPER + axis * WIDTH + lane] = upper;
        }
        self.children[lane] = child;
    }

    /// The planes of all lanes that begin at a place.
    #[inline(always)]
    fn planes<S: Simd>(&self, simd: S, start: usize) -> f32x8<S> {
        f32x8::from_slice(simd, &self.bounds[start..start + WIDTH])
    }
}

/// What the slab test reads of a ray; of vectors of four, the last number means nothing.
#[derive(Clone, Copy)]
pub(super) struct Slab {
    /// Where a node has the planes by which the ray enters, and those by which it leaves.
    pub(super) planes: Planes,
    /// −o^±·i, for the plane of entry and that of exit.
    pub(super) entry_start: Vec4,
    pub(super) exit_start: Vec4,
    /// 1/d'.
    pub(super) inverse: Vec4,
    pub(super) tmin: f32,
}

/// Places of planes in a node, for each axis.
#[derive(Clone, Copy)]
#[repr(align(32))]
pub(super) struct Planes {
    pub(super) near: [u32; 3],
    pub(super) far: [u32; 3],
}

/// The planes for all signs of a direction: a bit for each axis along which it is negative.
static PLANES: [Planes; 8] = {
    let mut all = [Planes { near: [0; 3], far: [0; 3] }; 8];
    let mut signs = 0;
    while signs < all.len() {
        let mut axis = 0;
        while axis < 3 {
            let (lower, upper) = ((axis * WIDTH) as u32, (UPPER + axis * WIDTH) as u32);
            let backward = signs >> axis & 1 == 1;
            all[signs].near[axis] = if backward { upper } else { lower };
            all[signs].far[axis] = if backward { lower } else { upper };
            axis += 1;
        }
        signs += 1;
    }
    all
};

impl Slab {
    /// None, to be overwritten.
    pub(super) const EMPTY: Self = Self {
        planes: Planes { near: [0; 3], far: [0; 3] },
        entry_start: Vec4::ZERO,
        exit_start: Vec4::ZERO,
        inverse: Vec4::ZERO,
        tmin: 0.0,
    };

    /// Prepares `ray` for a tree whose largest coordinate is `reach`.
    #[inline(always)]
    pub(super) fn new(ray: &Ray, reach: f32) -> Self {
        // The last numbers must be none that make denormal ones, which take a hundred times as long.
        let [o, d] = ray.halves();
        let xyz = BVec4A::new(true, true, true, false);
        let (o, d) = (Vec4::select(xyz, o, Vec4::ZERO), Vec4::select(xyz, d, Vec4::ONE));
        let largest = |v: Vec4| v.x.abs().max(v.y.abs()).max(v.z.abs());
        let reach = largest(o) + reach;
        let padding = PADDING_ROUNDINGS * UNIT_ROUNDOFF * reach;
        let least = largest(d) * LEAST_COMPONENT;
        let size = 1.0 / d.abs().max(Vec4::splat(least));
        let farthest = reach * size;
        // Chosen, not branched to: of a ray nothing is known before.
        let is_tame = farthest.cmpgt(Vec4::splat(1.0 / TAME)) & farthest.cmplt(Vec4::splat(TAME));
        let inverse = Vec4::select(is_tame, size, Vec4::splat(f32::MIN_POSITIVE)).copysign(d);
        let widening = Vec4::splat(padding).copysign(d);
        Self {
            planes: PLANES[d.is_negative_bitmask() as usize & 7],
            entry_start: Vec4::select(is_tame, -((o + widening) * inverse), Vec4::splat(-f32::MAX)),
            exit_start: Vec4::select(is_tame, -((o - widening) * inverse), Vec4::splat(f32::MAX)),
            inverse,
            // A negative start (or −0) would not sort by its bits.
            tmin: max(ray.tmin, 0.0),
        }
    }
}

/// A [`Slab`] in all lanes.
struct SlabRay<S: Simd> {
    /// Where a node has the planes by which the ray enters, and those by which it leaves.
    near: [usize; 3],
    far: [usize; 3],
    /// −o^±·i, for the plane of entry and that of exit.
    entry_start: [f32x8<S>; 3],
    exit_start: [f32x8<S>; 3],
    /// 1/d'.
    inverse: [f32x8<S>; 3],
    tmin: f32x8<S>,
}

impl<S: Simd> SlabRay<S> {
    #[inline(always)]
    fn new(simd: S, slab: &Slab) -> Self {
        let all = |v: Vec4| [f32x8::splat(simd, v.x), f32x8::splat(simd, v.y), f32x8::splat(simd, v.z)];
        let Planes { near: [nx, ny, nz], far: [fx, fy, fz] } = slab.planes;
        Self {
            near: [nx as usize, ny as usize, nz as usize],
            far: [fx as usize, fy as usize, fz as usize],
            entry_start: all(slab.entry_start),
            exit_start: all(slab.exit_start),
            inverse: all(slab.inverse),
            tmin: f32x8::splat(simd, slab.tmin),
        }
    }

    /// The children that the ray meets before `tmax`, one bit a lane, and the distances of entry of all.
    #[inline(always)]
    fn meets(&self, simd: S, node: &Node, tmax: f32) -> (u32, [f32; WIDTH]) {
        let mut entry = self.tmin;
        let mut exit = f32x8::splat(simd, tmax);
        for axis in 0..3 {
            let (near, far) = (node.planes(simd, self.near[axis]), node.planes(simd, self.far[axis]));
            entry = entry.max(near.mul_add(self.inverse[axis], self.entry_start[axis]));
            exit = exit.min(far.mul_add(self.inverse[axis], self.exit_start[axis]));
        }
        let mut distances = [0.0; WIDTH];
        entry.store_slice(&mut distances);
        (entry.simd_le(exit).to_bitmask() as u32, distances)
    }
}

/// Subtrees still to visit, with their entry distances. Kept from ray to ray.
#[derive(Debug)]
pub(crate) struct Stack {
    entries: Box<[(f32, u32); STACK_SIZE]>,
    len: usize,
}

impl Stack {
    /// An empty stack.
    pub(crate) fn new() -> Self {
        Self { entries: Box::new([(0.0, 0); STACK_SIZE]), len: 0 }
    }

    #[inline(always)]
    fn push(&mut self, entry: f32, child: u32) {
        self.entries[self.len] = (entry, child);
        self.len += 1;
    }

    /// The last of the entries after the first `base`.
    #[inline(always)]
    fn pop(&mut self, base: usize) -> Option<(f32, u32)> {
        if self.len <= base {
            return None;
        }
        self.len -= 1;
        Some(self.entries[self.len])
    }
}

/// A hierarchy over blocks of one kind of primitive.
#[derive(Debug)]
pub(super) struct Tree<B: Block> {
    nodes: Pages<Node>,
    blocks: B::Blocks,
    /// Reference to the root, in the form of [`Node::children`].
    root: u32,
    reach: f32,
    /// The most nodes on a path from the root.
    depth: usize,
    level: Level,
}

impl<B: Block> Tree<B> {
    /// Builds over `items`; none where there are none.
    pub(super) fn build(mut items: Vec<Item>, source: &B::Source, quality: Quality) -> Option<Self> {
        if items.is_empty() {
            return None;
        }
        let corners = B::corners(source);
        let binary = build::build(&mut items, B::SIZE, corners.as_deref(), quality);
        let mut layout = Layout { binary: &binary, plans: Plans::new(&binary), nodes: Vec::new(), leaves: Vec::new() };
        let (root, depth) = layout.add(0);
        // What the plans take is given back before there are blocks.
        let Layout { nodes, leaves, .. } = layout;
        let blocks = B::Blocks::made(leaves.len(), |i| B::new(&items[leaves[i].clone()], source));
        let Bounds { min, max } = binary[0].bounds;
        Some(Self {
            nodes: Pages::made(nodes.len(), |i| nodes[i]),
            blocks,
            root,
            reach: min.abs().max(max.abs()).max_element(),
            depth,
            level: simd::level(),
        })
    }

    /// The same tree, walked by another instruction set.
    pub(super) fn at_level(self, level: Level) -> Self {
        Self { level, ..self }
    }

    /// The processor's instruction set.
    pub(super) fn level(&self) -> Level {
        self.level
    }

    /// Its nodes, the reference to the root, the largest coordinate, and the most nodes on a path.
    pub(super) fn parts(&self) -> (&[Node], u32, f32, usize) {
        (&self.nodes, self.root, self.reach, self.depth)
    }

    /// Its leaves.
    pub(super) fn blocks(&self) -> &[B] {
        &self.blocks
    }

    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> u64 {
        (self.nodes.memory_bytes() + size_of_val::<[B]>(&self.blocks)) as u64
    }

    /// Offers every hit that can be the nearest.
    pub(super) fn improve(&self, ray: &B::Ray, nearest: &mut B::Nearest, stack: &mut Stack) {
        dispatch!(self.level, simd => self.closest(simd, ray, nearest, stack));
    }

    #[inline(always)]
    fn closest<S: Simd>(&self, simd: S, ray: &B::Ray, nearest: &mut B::Nearest, stack: &mut Stack) {
        let (nodes, blocks): (&[Node], &[B]) = (&self.nodes, &self.blocks);
        let slab = SlabRay::new(simd, &Slab::new(ray.line(), self.reach));
        let base = stack.len;
        stack.push(0.0, self.root);
        while let Some((entry, mut child)) = stack.pop(base) {
            if entry > B::limit(nearest) {
                continue;
            }
            while child & BLOCK == 0 {
                let node = &nodes[child as usize];
                match descend(node, slab.meets(simd, node, B::limit(nearest)), stack) {
                    Some(next) => child = next,
                    None => break,
                }
            }
            if child & BLOCK != 0 {
                B::closest(blocks, child & !BLOCK, ray, nearest, stack);
            }
        }
    }

    /// Whether a ray meets anything.
    pub(super) fn meets(&self, ray: &B::Ray, stack: &mut Stack) -> bool {
        dispatch!(self.level, simd => self.any(simd, ray, stack))
    }

    /// Whether anything is hit.
    #[inline(always)]
    fn any<S: Simd>(&self, simd: S, ray: &B::Ray, stack: &mut Stack) -> bool {
        let (nodes, blocks): (&[Node], &[B]) = (&self.nodes, &self.blocks);
        let slab = SlabRay::new(simd, &Slab::new(ray.line(), self.reach));
        let base = stack.len;
        stack.push(0.0, self.root);
        while let Some((_, mut child)) = stack.pop(base) {
            while child & BLOCK == 0 {
                let node = &nodes[child as usize];
                match descend_any(node, slab.meets(simd, node, ray.line().tmax).0, stack) {
                    Some(next) => child = next,
                    None => break,
                }
            }
            if child & BLOCK != 0 && B::any(blocks, child & !BLOCK, ray, stack) {
                stack.len = base;
                return true;
            }
        }
        false
    }
}

impl<B: Block<Ray: SceneRay>> Tree<B> {
    /// Offers to `nearest` the hits of each ray that can be the nearest.
    pub(super) fn improve_all(&self, rays: &[Ray], from: &[Hit], nearest: &mut [B::Nearest], stack: &mut Stack) {
        dispatch!(self.level, simd => self.closest_all(simd, rays, from, nearest, stack));
    }

    #[inline(always)]
    fn closest_all<S: Simd>(&self, simd: S, rays: &[Ray], from: &[Hit], nearest: &mut [B::Nearest], stack: &mut Stack) {
        for i in 0..rays.len().min(nearest.len()) {
            let from = if i < from.len() { from[i] } else { Hit::NONE };
            self.closest(simd, &B::Ray::new(&rays[i], [from, Hit::NONE]), &mut nearest[i], stack);
        }
    }

    /// Whether each ray meets anything. An answer that is true already is left alone.
    pub(super) fn occluded(&self, rays: &[Ray], ends: &[[Hit; 2]], occluded: &mut [bool]) {
        dispatch!(self.level, simd => self.any_all(simd, rays, ends, occluded));
    }

    #[inline(always)]
    fn any_all<S: Simd>(&self, simd: S, rays: &[Ray], ends: &[[Hit; 2]], occluded: &mut [bool]) {
        let mut stack = Stack::new();
        for i in 0..rays.len().min(occluded.len()) {
            let ends = if i < ends.len() { ends[i] } else { [Hit::NONE; 2] };
            occluded[i] = occluded[i] || self.any(simd, &B::Ray::new(&rays[i], ends), &mut stack);
        }
    }
}

/// Returns the nearest child that is met and leaves the others on the stack, the farthest lowest.
#[inline(always)]
fn descend(node: &Node, (met, entry): (u32, [f32; WIDTH]), stack: &mut Stack) -> Option<u32> {
    if met == 0 {
        return None;
    }
    let first = met.trailing_zeros() as usize;
    let others = met & (met - 1);
    if others == 0 {
        return Some(node.children[first]);
    }
    if others & (others - 1) == 0 {
        let second = others.trailing_zeros() as usize;
        let (near, far) = if entry[first] <= entry[second] { (first, second) } else { (second, first) };
        stack.push(entry[far], node.children[far]);
        return Some(node.children[near]);
    }
    Some(descend_sorted(node, met, &entry, stack))
}

/// Returns the first child that is met and leaves the others on the stack.
#[inline(always)]
fn descend_any(node: &Node, mut met: u32, stack: &mut Stack) -> Option<u32> {
    if met == 0 {
        return None;
    }
    loop {
        let child = node.children[(met.trailing_zeros() & LANE_BITS) as usize];
        met &= met - 1;
        if met == 0 {
            return Some(child);
        }
        stack.push(0.0, child);
    }
}

/// [`descend`] for three children and more.
#[inline(always)]
fn descend_sorted(node: &Node, mut met: u32, entry: &[f32; WIDTH], stack: &mut Stack) -> u32 {
    // The bits of a distance that is not negative sort like the distance; the lane takes the lowest.
    let mut next = || {
        let lane = met.trailing_zeros();
        met &= met.wrapping_sub(1);
        (entry[(lane & LANE_BITS) as usize].to_bits() & !LANE_BITS) | lane
    };
    let [mut a, mut b, mut c] = [next(), next(), next()];
    sort(&mut a, &mut b);
    sort(&mut b, &mut c);
    sort(&mut a, &mut b);
    let mut sorted = [a, b, c, 0, 0, 0, 0, 0];
    let mut count = 3;
    while met != 0 {
        let lane = met.trailing_zeros();
        met &= met - 1;
        let key = (entry[lane as usize].to_bits() & !LANE_BITS) | lane;
        let mut place = count;
        while place > 0 && sorted[place - 1] < key {
            sorted[place] = sorted[place - 1];
            place -= 1;
        }
        sorted[place] = key;
        count += 1;
    }
    for &key in &sorted[..count - 1] {
        stack.push(f32::from_bits(key & !LANE_BITS), node.children[(key & LANE_BITS) as usize]);
    }
    node.children[(sorted[count - 1] & LANE_BITS) as usize]
}

/// Puts the larger one first, without a branch.
#[inline(always)]
fn sort(a: &mut u32, b: &mut u32) {
    (*a, *b) = ((*a).max(*b), (*a).min(*b));
}

/// Lays the nodes out depth first.
struct Layout<'a> {
    binary: &'a [BinaryNode],
    plans: Plans,
    nodes: Vec<Node>,
    /// The items of each block.
    leaves: Vec<std::ops::Range<usize>>,
}

impl Layout<'_> {
    /// Adds the subtree of a binary node and returns the reference to it, and the most nodes on a path in it.
    fn add(&mut self, index: usize) -> (u32, usize) {
        if let Kind::Leaf { first, count } = self.binary[index].kind {
            self.leaves.push(first as usize..(first + count) as usize);
            return ((self.leaves.len() as u32 - 1) | BLOCK, 0);
        }
        let mut children = Vec::with_capacity(WIDTH);
        self.plans.children(self.binary, index, &mut children);
        // A shadow ray takes what it meets in this order: leaves first, and large ones before small ones. Against any other
        // order that was tried, it visits fewest nodes.
        let is_inner = |&child: &usize| matches!(self.binary[child].kind, Kind::Inner { .. });
        let area = |&child: &usize| self.binary[child].area();
        children.sort_by(|a, b| is_inner(a).cmp(&is_inner(b)).then(area(b).total_cmp(&area(a))));
        let place = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let mut depth = 0;
        for (lane, &child) in children.iter().enumerate() {
            let (reference, below) = self.add(child);
            depth = depth.max(below);
            self.nodes[place].set(lane, self.binary[child].bounds, reference);
        }
        (place as u32, depth + 1)
    }
}
