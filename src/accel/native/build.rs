//! The builder: a binary tree by the surface area heuristic, over bins, in parallel.
//!
//! After Wald 2007, *On fast Construction of SAH-based Bounding Volume Hierarchies*. The tree is a function of the
//! primitives and their order alone: bins are merged by minima, maxima and counts, which do not depend on the order of
//! merging, each half of a split is built by itself, and its items and nodes have their place before it is built.
//!
//! Triangles may be cut where that makes boxes overlap much less ([`super::spatial`]). Each subtree has places for as many
//! parts more as its share of all spare ones ([`SPARE`]).
//!
//! Where the heuristic has nothing to go by (all centroids in one point), or has split so often that something must be
//! badly out of proportion ([`SAH_DEPTH`]), the primitives are halved by number; so the depth is bounded
//! ([`MAX_DEPTH`]), whatever the input.

use super::spatial::{self, Corners};
use crate::accel::{Accel, Hit};
use crate::math::bounds::Bounds;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Bins along each axis. More gain under 1 % in ray time and cost as much in build time.
pub(super) const BINS: usize = 16;

/// Splits of the heuristic on one path from the root, after which primitives are halved. A balanced tree of 2³²
/// primitives has 32; good ones of real scenes stay under 60.
const SAH_DEPTH: usize = 64;

/// No path from the root has more inner nodes: halving 2³² primitives down to one takes 32.
pub(super) const MAX_DEPTH: usize = SAH_DEPTH + 32;

/// Fewer primitives than this are built by one thread.
const PARALLEL_SUBTREE: usize = 4096;

/// Primitives that one task bins.
pub(super) const PARALLEL_BINNING: usize = 32 * 1024;

/// One spare place for a part of a cut triangle for so many primitives.
const SPARE: usize = 2;

/// Cutting is tried only where the boxes of the best two sets of whole primitives overlap by this fraction of the area of
/// the box around both, ...
const LEAST_OVERLAP: f64 = 0.25;

/// ... and by this fraction of the area of the whole tree's: most boxes are small and seldom met.
const LEAST_OVERLAP_OF_WHOLE: f64 = 1.0 / (1u64 << 20) as f64;

/// Cutting must take the cost below this part of the other's, to be worth its memory.
const LEAST_GAIN: f64 = 0.95;

/// A primitive to be put into the tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) bounds: Bounds,
    pub(super) id: Hit,
}

impl Item {
    /// Twice the centre of the box.
    #[inline]
    pub(super) fn centroid(&self) -> Vec3 {
        self.bounds.min + self.bounds.max
    }
}

/// A node of the binary tree. The tree over n primitives takes 2n − 1 places of which some stay unused; the left child
/// comes right after its parent.
#[derive(Clone, Copy, Debug)]
pub(super) struct BinaryNode {
    pub(super) bounds: Bounds,
    pub(super) kind: Kind,
}

impl BinaryNode {
    /// Half of the surface area of its box; 0 of an unused place.
    pub(super) fn area(&self) -> f64 {
        if self.bounds.is_empty() { 0.0 } else { half_area(self.bounds) }
    }
}

/// In f64, so that no square of a length in f32 overflows or vanishes. Not for an empty box.
pub(super) fn half_area(bounds: Bounds) -> f64 {
    let e: DVec3 = bounds.extent().as_dvec3();
    e.x * e.y + e.y * e.z + e.z * e.x
}

/// What a node of the binary tree holds.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    /// Children at the next place and `right` places further.
    Inner { right: u32 },
    /// At least one item.
    Leaf { first: u32, count: u32 },
}

/// Builds the binary tree with at most `leaf_size` items a leaf. Reorders `items` to the order of the leaves, with parts of
/// those that it cuts, and maybe with unused ones between, if it is given `corners`. Not for an empty vector.
pub(super) fn build(items: &mut Vec<Item>, leaf_size: usize, corners: Option<&Corners<'_>>) -> Vec<BinaryNode> {
    let count = items.len();
    let spare = if corners.is_some() { (count / SPARE).min(Accel::MAX_PRIMITIVES.saturating_sub(count)) } else { 0 };
    items.resize(count + spare, items[0]);
    let unused = BinaryNode { bounds: Bounds::EMPTY, kind: Kind::Leaf { first: 0, count: 0 } };
    let mut nodes = vec![unused; 2 * items.len() - 1];
    let least_overlap = LEAST_OVERLAP_OF_WHOLE * half_area(Extent::of(&items[..count]).bounds);
    let builder = Builder { leaf_size, corners, least_overlap };
    builder.subtree(Places { items, count, first: 0 }, &mut nodes, 0);
    nodes
}

/// What is the same for all subtrees.
struct Builder<'a> {
    leaf_size: usize,
    corners: Option<&'a Corners<'a>>,
    /// See [`LEAST_OVERLAP_OF_WHOLE`].
    least_overlap: f64,
}

/// The items of a subtree, with its spare places behind them.
struct Places<'a> {
    items: &'a mut [Item],
    count: usize,
    /// The number of the first among all.
    first: usize,
}

impl<'a> Places<'a> {
    /// Those of two subtrees: the first `middle` items, and those from there to `end`. Spare places are shared by number.
    fn divide(self, middle: usize, end: usize) -> (Self, Self) {
        let spare = (self.items.len() - end) as u64 * middle as u64 / end as u64;
        let start = middle + spare as usize;
        self.items.copy_within(middle..end, start);
        let (left, right) = self.items.split_at_mut(start);
        (
            Self { items: left, count: middle, first: self.first },
            Self { items: right, count: end - middle, first: self.first + start },
        )
    }
}

impl Builder<'_> {
    fn subtree(&self, places: Places<'_>, nodes: &mut [BinaryNode], depth: usize) {
        let Places { items, count, first } = places;
        let extent = Extent::of(&items[..count]);
        if count <= self.leaf_size {
            let kind = Kind::Leaf { first: first as u32, count: count as u32 };
            nodes[0] = BinaryNode { bounds: extent.bounds, kind };
            return;
        }
        let (middle, end) = self.split(items, count, &extent, depth);
        let (left, right) = Places { items, count, first }.divide(middle, end);
        let (head, rest) = nodes.split_at_mut(1);
        let (left_nodes, right_nodes) = rest.split_at_mut(2 * left.items.len() - 1);
        head[0] = BinaryNode { bounds: extent.bounds, kind: Kind::Inner { right: 2 * left.items.len() as u32 } };
        let larger = left.count.max(right.count);
        let build_left = || self.subtree(left, left_nodes, depth + 1);
        let build_right = || self.subtree(right, right_nodes, depth + 1);
        if larger < PARALLEL_SUBTREE {
            build_left();
            build_right();
        } else {
            rayon::join(build_left, build_right);
        }
    }

    /// Reorders the first `count` items, of which some may be cut, and returns where to split and where they end, with at
    /// least one on each side.
    fn split(&self, items: &mut [Item], count: usize, extent: &Extent, depth: usize) -> (usize, usize) {
        let half = (count / 2, count);
        if depth >= SAH_DEPTH {
            return half;
        }
        let binning = Binning::new(extent, self.leaf_size);
        let split = binning.best_split(&items[..count]);
        if let Some(corners) = self.corners
            && items.len() > count
            && self.may_cut(extent, split.as_ref())
            && let Some(planar) = spatial::best(&items[..count], extent.bounds, corners, |n| n.div_ceil(self.leaf_size))
            && split.as_ref().is_none_or(|split| planar.cost < LEAST_GAIN * split.cost)
        {
            let (middle, end) = planar.partition(items, count, corners);
            return if middle == 0 || middle == end { (end / 2, end) } else { (middle, end) };
        }
        let Some(Split { axis, bin, .. }) = split else {
            return half;
        };
        let middle = partition(&mut items[..count], |item| binning.bin(item)[axis] <= bin);
        if middle == 0 || middle == count { half } else { (middle, count) }
    }

    /// Whether whole primitives make boxes that overlap so much that cutting is worth a try.
    fn may_cut(&self, extent: &Extent, split: Option<&Split>) -> bool {
        let whole = half_area(extent.bounds);
        let overlap = split.map_or(whole, |split| split.overlap);
        overlap > self.least_overlap && overlap > LEAST_OVERLAP * whole
    }
}

/// Moves the items that satisfy `is_left` to the front and returns their number.
fn partition(items: &mut [Item], is_left: impl Fn(&Item) -> bool) -> usize {
    let (mut begin, mut end) = (0, items.len());
    while begin < end {
        if is_left(&items[begin]) {
            begin += 1;
        } else {
            end -= 1;
            items.swap(begin, end);
        }
    }
    begin
}

/// Boxes around items and around their centroids.
#[derive(Clone, Copy)]
struct Extent {
    bounds: Bounds,
    centroids: Bounds,
}

impl Extent {
    const EMPTY: Self = Self { bounds: Bounds::EMPTY, centroids: Bounds::EMPTY };

    fn of(items: &[Item]) -> Self {
        let serial = |items: &[Item]| {
            items.iter().fold(Self::EMPTY, |e, item| Self {
                bounds: e.bounds.union(item.bounds),
                centroids: e.centroids.with(item.centroid()),
            })
        };
        if items.len() <= PARALLEL_BINNING {
            return serial(items);
        }
        items.par_chunks(PARALLEL_BINNING).map(serial).reduce(
            || Self::EMPTY,
            |a, b| Self { bounds: a.bounds.union(b.bounds), centroids: a.centroids.union(b.centroids) },
        )
    }
}

/// The best split between whole primitives.
struct Split {
    axis: usize,
    /// The last on the left.
    bin: usize,
    cost: f64,
    /// Half of the surface area that the boxes of both sides have in common.
    overlap: f64,
}

/// How centroids map to bins.
struct Binning {
    origin: Vec3,
    scale: Vec3,
    leaf_size: usize,
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Bounds,
    count: usize,
}

impl Bin {
    const EMPTY: Self = Self { bounds: Bounds::EMPTY, count: 0 };

    fn union(self, other: Self) -> Self {
        Self { bounds: self.bounds.union(other.bounds), count: self.count + other.count }
    }

    /// Cost of a node with these primitives, of which a whole block is tested at a time.
    fn cost(&self, leaf_size: usize) -> f64 {
        half_area(self.bounds) * self.count.div_ceil(leaf_size) as f64
    }
}

type Bins = [[Bin; BINS]; 3];

impl Binning {
    fn new(extent: &Extent, leaf_size: usize) -> Self {
        let size = extent.centroids.extent();
        Self { origin: extent.centroids.min, scale: Vec3::splat(BINS as f32) / size, leaf_size }
    }

    /// The bin on each axis; 0 on one along which all centroids are the same.
    #[inline]
    fn bin(&self, item: &Item) -> [usize; 3] {
        // A float-to-integer cast saturates and takes NaN (of 0 · ∞) to 0.
        ((item.centroid() - self.origin) * self.scale).to_array().map(|bin| (bin as usize).min(BINS - 1))
    }

    fn fill(&self, items: &[Item]) -> Bins {
        let mut bins = [[Bin::EMPTY; BINS]; 3];
        for item in items {
            for (bins, bin) in bins.iter_mut().zip(self.bin(item)) {
                let bin = &mut bins[bin];
                bin.bounds = bin.bounds.union(item.bounds);
                bin.count += 1;
            }
        }
        bins
    }

    /// The cheapest split; none where no split has primitives on both sides.
    fn best_split(&self, items: &[Item]) -> Option<Split> {
        let bins = if items.len() <= PARALLEL_BINNING {
            self.fill(items)
        } else {
            items.par_chunks(PARALLEL_BINNING).map(|items| self.fill(items)).reduce(
                || [[Bin::EMPTY; BINS]; 3],
                |a, b| std::array::from_fn(|axis| std::array::from_fn(|i| a[axis][i].union(b[axis][i]))),
            )
        };
        let mut best = None;
        let mut least = f64::INFINITY;
        for (axis, bins) in bins.iter().enumerate() {
            let mut right_costs = [0.0; BINS];
            let mut right = Bin::EMPTY;
            for i in (1..BINS).rev() {
                right = right.union(bins[i]);
                right_costs[i] = if right.count == 0 { f64::INFINITY } else { right.cost(self.leaf_size) };
            }
            let mut left = Bin::EMPTY;
            for i in 0..BINS - 1 {
                left = left.union(bins[i]);
                let cost = if left.count == 0 { f64::INFINITY } else { left.cost(self.leaf_size) + right_costs[i + 1] };
                if cost < least {
                    least = cost;
                    best = Some((axis, i));
                }
            }
        }
        best.map(|(axis, bin)| {
            let side = |bins: &[Bin]| bins.iter().fold(Bin::EMPTY, |a, &b| a.union(b)).bounds;
            let (left, right) = (side(&bins[axis][..=bin]), side(&bins[axis][bin + 1..]));
            let common = Bounds { min: left.min.max(right.min), max: left.max.min(right.max) };
            let overlap = if common.is_empty() { 0.0 } else { half_area(common) };
            Split { axis, bin, cost: least, overlap }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// 60 needles across 600 specks: needles are cut, no more parts are made than there are places for, and no primitive is
    /// lost.
    #[test]
    fn long_triangles_are_cut_and_none_is_lost() {
        let mut state = 1u64;
        let mut unit = || {
            state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let mut point = || Vec3::new(unit(), unit(), unit());
        let triangles: Vec<[Vec3; 3]> = (0..660)
            .map(|i| {
                let (a, b) = (point(), point());
                if i % 11 == 0 { [a, b, b + Vec3::splat(0.01)] } else { [a, a + 0.01 * b, a + 0.01 * point()] }
            })
            .collect();
        let item = |(primitive, triangle): (u32, &[Vec3; 3])| Item {
            bounds: Bounds::of(*triangle),
            id: Hit { shape: 0, primitive },
        };
        let mut items: Vec<Item> = (0..).zip(&triangles).map(item).collect();
        let nodes = build(&mut items, 4, Some(&|id: Hit| triangles[id.primitive as usize]));
        let leaves = nodes.iter().filter_map(|node| match node.kind {
            Kind::Leaf { first, count } => Some(first as usize..(first + count) as usize),
            Kind::Inner { .. } => None,
        });
        let parts: Vec<u32> = leaves.flatten().map(|i| items[i].id.primitive).collect();
        let spare = triangles.len() / SPARE;
        assert!(parts.len() > triangles.len() && parts.len() <= triangles.len() + spare, "{}", parts.len());
        assert_eq!(parts.into_iter().collect::<BTreeSet<u32>>().len(), triangles.len());
    }
}
