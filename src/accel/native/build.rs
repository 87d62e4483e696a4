//! The builder: a binary tree by the surface area heuristic, over bins, in parallel.
//!
//! After Wald 2007, *On fast Construction of SAH-based Bounding Volume Hierarchies*. The tree is a function of the
//! primitives and their order alone: bins are merged by minima, maxima and counts, which do not depend on the order of
//! merging, each half of a split is built by itself, and its nodes have their place before it is built.
//!
//! Where the heuristic has nothing to go by (all centroids in one point), or has split so often that something must be
//! badly out of proportion ([`SAH_DEPTH`]), the primitives are halved by number; so the depth is bounded
//! ([`MAX_DEPTH`]), whatever the input.

use super::block::BLOCK_SIZE;
use crate::accel::Hit;
use crate::math::bounds::Bounds;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Bins along each axis. More gain under 1 % in ray time and cost as much in build time.
const BINS: usize = 16;

/// Splits of the heuristic on one path from the root, after which primitives are halved. A balanced tree of 2³²
/// primitives has 32; good ones of real scenes stay under 60.
const SAH_DEPTH: usize = 64;

/// No path from the root has more inner nodes: halving 2³² primitives down to one takes 32.
pub(super) const MAX_DEPTH: usize = SAH_DEPTH + 32;

/// Fewer primitives than this are built by one thread.
const PARALLEL_SUBTREE: usize = 4096;

/// Primitives that one task bins.
const PARALLEL_BINNING: usize = 32 * 1024;

/// A primitive to be put into the tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) bounds: Bounds,
    pub(super) id: Hit,
}

impl Item {
    /// Twice the centre of the box.
    #[inline]
    fn centroid(&self) -> Vec3 {
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
fn half_area(bounds: Bounds) -> f64 {
    let e: DVec3 = bounds.extent().as_dvec3();
    e.x * e.y + e.y * e.z + e.z * e.x
}

/// What a node of the binary tree holds.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    /// Children at the next place and `right` places further.
    Inner { right: u32 },
    /// 1 to [`BLOCK_SIZE`] items.
    Leaf { first: u32, count: u32 },
}

/// Builds the binary tree; reorders `items` to the order of the leaves. Not for an empty slice.
pub(super) fn build(items: &mut [Item]) -> Vec<BinaryNode> {
    let unused = BinaryNode { bounds: Bounds::EMPTY, kind: Kind::Leaf { first: 0, count: 0 } };
    let mut nodes = vec![unused; 2 * items.len() - 1];
    subtree(items, 0, &mut nodes, 0);
    nodes
}

fn subtree(items: &mut [Item], first: u32, nodes: &mut [BinaryNode], depth: usize) {
    let extent = Extent::of(items);
    if items.len() <= BLOCK_SIZE {
        nodes[0] = BinaryNode { bounds: extent.bounds, kind: Kind::Leaf { first, count: items.len() as u32 } };
        return;
    }
    let middle = split(items, &extent, depth);
    let (left, right) = items.split_at_mut(middle);
    let (head, rest) = nodes.split_at_mut(1);
    let (left_nodes, right_nodes) = rest.split_at_mut(2 * middle - 1);
    head[0] = BinaryNode { bounds: extent.bounds, kind: Kind::Inner { right: 2 * middle as u32 } };
    let larger = middle.max(right.len());
    let mut build_left = || subtree(left, first, left_nodes, depth + 1);
    let mut build_right = || subtree(right, first + middle as u32, right_nodes, depth + 1);
    if larger < PARALLEL_SUBTREE {
        build_left();
        build_right();
    } else {
        rayon::join(build_left, build_right);
    }
}

/// Reorders items and returns where to split, with at least one on each side.
fn split(items: &mut [Item], extent: &Extent, depth: usize) -> usize {
    let half = items.len() / 2;
    if depth >= SAH_DEPTH {
        return half;
    }
    let binning = Binning::new(extent);
    let Some((axis, bin)) = binning.best_split(items) else {
        return half;
    };
    let middle = partition(items, |item| binning.bin(item)[axis] <= bin);
    if middle == 0 || middle == items.len() { half } else { middle }
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

/// How centroids map to bins.
struct Binning {
    origin: Vec3,
    scale: Vec3,
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
    fn cost(&self) -> f64 {
        half_area(self.bounds) * self.count.div_ceil(BLOCK_SIZE) as f64
    }
}

type Bins = [[Bin; BINS]; 3];

impl Binning {
    fn new(extent: &Extent) -> Self {
        let size = extent.centroids.extent();
        Self { origin: extent.centroids.min, scale: Vec3::splat(BINS as f32) / size }
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

    /// Axis and last bin of the left side of the cheapest split; none where no split has primitives on both sides.
    fn best_split(&self, items: &[Item]) -> Option<(usize, usize)> {
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
                right_costs[i] = if right.count == 0 { f64::INFINITY } else { right.cost() };
            }
            let mut left = Bin::EMPTY;
            for i in 0..BINS - 1 {
                left = left.union(bins[i]);
                let cost = if left.count == 0 { f64::INFINITY } else { left.cost() + right_costs[i + 1] };
                if cost < least {
                    least = cost;
                    best = Some((axis, i));
                }
            }
        }
        best
    }
}
