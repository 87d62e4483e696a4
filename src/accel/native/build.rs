//! The builder: a binary tree by the surface area heuristic, over bins, in parallel.
//!
//! After Wald 2007, *On fast Construction of SAH-based Bounding Volume Hierarchies*. The tree is a function of the
//! primitives and their order alone: bins are merged by minima, maxima and counts, which do not depend on the order of
//! merging, each half of a split is built by itself, its items have their place before it is built, and its nodes get theirs
//! when both are.
//!
//! Triangles may be cut where that makes boxes overlap much less ([`super::spatial`]). Each subtree has places for as many
//! parts more as its share of all spare ones ([`SPARE`]).
//!
//! Where the heuristic has nothing to go by (all centroids in one point), or has split so often that something must be
//! badly out of proportion ([`SAH_DEPTH`]), the primitives are halved by number; so the depth is bounded
//! ([`MAX_DEPTH`]), whatever the input.

use super::item::{Box4, Item};
use super::spatial::{self, Corners};
use crate::accel::{Accel, Quality};
use crate::math::bounds::Bounds;
use glam::Vec4;
use rayon::prelude::*;

/// Most bins along each axis. More gain under 1 % in ray time and cost as much in build time.
pub(super) const BINS: usize = 16;

/// The same for [`Quality::Low`]; rays take as long as with twice as many, give or take 5 %.
const BINS_OF_LOW: usize = 8;

/// Bins for the fewest primitives, and primitives for each one more: between so few, more planes find nothing better, and most
/// of the nodes are small.
const LEAST_BINS: usize = 4;

/// See [`LEAST_BINS`].
const ITEMS_PER_BIN: usize = 8;

/// A number of which the unit is the last place, and larger than all numbers of bins.
const TO_INTEGER: f32 = (1u32 << 23) as f32;

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
const LEAST_OVERLAP: f32 = 0.25;

/// The same for [`Quality::Medium`]: for a third to half of the time it gains a third (classroom) to four fifths (Sponza) of what
/// cutting gains for rays.
const LEAST_OVERLAP_OF_MEDIUM: f32 = 0.5;

/// ... and by this fraction of the area of the whole tree's: most boxes are small and seldom met. Nor is a block of less area divided.
const LEAST_PART_OF_WHOLE: f32 = 1.0 / (1u32 << 14) as f32;

/// Cutting must take the cost below this part of the other's, to be worth its memory.
const LEAST_GAIN: f32 = 0.95;

/// Where two blocks have together at most this part of the area of the one that would hold all, they are two: what hardly pays by area does by
/// tests in vain (0.7, 0.9, 0.95, 1: first bounces in veach-ajar 11.6, 12.3, 13.3, 12.3 Mrays/s, in Sponza 6.7, 6.5, 6.5, 6.4).
const PART_TO_DIVIDE: f32 = 0.95;

/// A node of the binary tree. The left child comes right after its parent.
#[derive(Clone, Copy, Debug)]
pub(super) struct BinaryNode {
    pub(super) bounds: Bounds,
    pub(super) kind: Kind,
}

impl BinaryNode {
    /// Half of the surface area of its box.
    pub(super) fn area(&self) -> f64 {
        self.bounds.half_area()
    }
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
pub(super) fn build(
    items: &mut Vec<Item>,
    leaf_size: usize,
    corners: Option<&Corners<'_>>,
    quality: Quality,
) -> Vec<BinaryNode> {
    let count = items.len();
    let corners = corners.filter(|_| quality != Quality::Low);
    let most_bins = if quality == Quality::Low { BINS_OF_LOW } else { BINS };
    let least_part = if quality == Quality::High { LEAST_OVERLAP } else { LEAST_OVERLAP_OF_MEDIUM };
    let spare = if corners.is_some() { (count / SPARE).min(Accel::MAX_PRIMITIVES.saturating_sub(count)) } else { 0 };
    items.resize(count + spare, items[0]);
    let whole = Extent::of(&items[..count]);
    let size = (whole.bounds.max - whole.bounds.min).truncate().max_element();
    // All areas of a point are 0, whatever the unit.
    let unit = if size > 0.0 { 1.0 / size } else { 1.0 };
    let least_area = LEAST_PART_OF_WHOLE * whole.bounds.half_area(unit);
    let builder = Builder { leaf_size, most_bins, corners, least_area, least_part, unit };
    let mut nodes = Nodes::default();
    builder.subtree(Places { items, count, first: 0 }, &whole, &mut nodes, 0, &mut { NO_BINS });
    nodes.joined()
}

/// The nodes of a subtree, in pieces that threads of their own have built. How many there will be nobody knows before, and room for as
/// many as there could be would take several times as long to be had as what is needed.
#[derive(Default)]
struct Nodes {
    pieces: Vec<Vec<BinaryNode>>,
    count: usize,
}

impl Nodes {
    /// Appends one.
    fn push(&mut self, node: BinaryNode) {
        if self.pieces.is_empty() {
            self.pieces.push(Vec::new());
        }
        if let Some(last) = self.pieces.last_mut() {
            last.push(node);
        }
        self.count += 1;
    }

    /// Appends all of another.
    fn append(&mut self, other: Self) {
        self.pieces.extend(other.pieces);
        self.count += other.count;
    }

    fn joined(mut self) -> Vec<BinaryNode> {
        if self.pieces.len() == 1 {
            return self.pieces.swap_remove(0);
        }
        let mut all = Vec::with_capacity(self.count);
        self.pieces.into_iter().for_each(|piece| all.extend(piece));
        all
    }
}

/// What is the same for all subtrees.
struct Builder<'a> {
    leaf_size: usize,
    /// Along each axis.
    most_bins: usize,
    corners: Option<&'a Corners<'a>>,
    /// See [`LEAST_PART_OF_WHOLE`].
    least_area: f32,
    /// See [`LEAST_OVERLAP`].
    least_part: f32,
    /// One over the size of the whole: areas are computed in f32, and must neither overflow nor vanish.
    unit: f32,
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
    fn subtree(&self, places: Places<'_>, extent: &Extent, nodes: &mut Nodes, depth: usize, bins: &mut Bins) {
        let Places { items, count, first } = places;
        let halves = if count > self.leaf_size {
            Some(self.split(items, count, extent, depth, bins))
        } else {
            self.split_block(&mut items[..count], extent)
        };
        let Some(Halves { middle, end, extents }) = halves else {
            let kind = Kind::Leaf { first: first as u32, count: count as u32 };
            return nodes.push(BinaryNode { bounds: extent.bounds.bounds(), kind });
        };
        let [left_extent, right_extent] = &extents;
        let (left, right) = Places { items, count, first }.divide(middle, end);
        let inner = |right| BinaryNode { bounds: extent.bounds.bounds(), kind: Kind::Inner { right } };
        let larger = left.count.max(right.count);
        if larger < PARALLEL_SUBTREE {
            // All of it in the same piece.
            nodes.push(inner(0));
            let (piece, place) = (nodes.pieces.len() - 1, nodes.pieces[nodes.pieces.len() - 1].len() - 1);
            self.subtree(left, left_extent, nodes, depth + 1, bins);
            let right_place = nodes.pieces[piece].len() - place;
            self.subtree(right, right_extent, nodes, depth + 1, bins);
            nodes.pieces[piece][place] = inner(right_place as u32);
        } else {
            let (mut left_nodes, mut right_nodes) = (Nodes::default(), Nodes::default());
            rayon::join(
                || self.subtree(left, left_extent, &mut left_nodes, depth + 1, bins),
                || self.subtree(right, right_extent, &mut right_nodes, depth + 1, &mut { NO_BINS }),
            );
            nodes.push(inner(left_nodes.count as u32 + 1));
            nodes.append(left_nodes);
            nodes.append(right_nodes);
        }
    }

    /// Reorders the first `count` items, of which some may be cut, so that there is at least one on each side.
    fn split(&self, items: &mut [Item], count: usize, extent: &Extent, depth: usize, bins: &mut Bins) -> Halves {
        if depth >= SAH_DEPTH {
            return Halves::new(items, count / 2, count);
        }
        let binning =
            Binning::new(extent, (LEAST_BINS + count / ITEMS_PER_BIN).min(self.most_bins), self.leaf_size, self.unit);
        let split = binning.best_split(&items[..count], bins);
        if let Some(corners) = self.corners
            && items.len() > count
            && self.may_cut(extent, split.as_ref())
            && let Some(planar) =
                spatial::best(&items[..count], extent.bounds.bounds(), corners, self.leaf_size, self.unit)
            && split.as_ref().is_none_or(|split| planar.cost < LEAST_GAIN * split.cost)
        {
            let (middle, end) = planar.partition(items, count, corners);
            return Halves::new(items, if middle == 0 || middle == end { end / 2 } else { middle }, end);
        }
        let Some(Split { axis, bin, bounds, .. }) = split else {
            return Halves::new(items, count / 2, count);
        };
        let middle = partition(&mut items[..count], |item| binning.bins_of(item)[axis] <= bin);
        if middle == 0 || middle == count {
            return Halves::new(items, count / 2, count);
        }
        let extent = |bounds, items| Extent { bounds, centroids: Extent::of_centroids(items) };
        let [left, right] = bounds;
        Halves { middle, end: count, extents: [extent(left, &items[..middle]), extent(right, &items[middle..count])] }
    }

    /// Divides what would fit into a block, in the best of all ways, if it lies so far apart that two blocks together are met
    /// much more seldom.
    fn split_block(&self, items: &mut [Item], extent: &Extent) -> Option<Halves> {
        let area = |bounds: Box4| bounds.half_area(self.unit);
        let whole = area(extent.bounds);
        let most = PART_TO_DIVIDE * whole;
        if items.len() < 2 || whole <= self.least_area || items.iter().any(|item| area(item.box4()) > most) {
            return None;
        }
        // Sets of items, a bit each; the last one is never among the left, so that no way is tried twice.
        let all = 1u32 << (items.len() - 1);
        let cost = |left: u32| {
            let mut sides = [Box4::EMPTY; 2];
            for (i, item) in items.iter().enumerate() {
                let side = &mut sides[usize::from(left >> i & 1 == 0)];
                *side = side.union(item.box4());
            }
            area(sides[0]) + area(sides[1])
        };
        let (least, left) = (1..all).map(|left| (cost(left), left)).min_by(|a, b| a.0.total_cmp(&b.0))?;
        if least > most {
            return None;
        }
        let mut middle = 0;
        for i in (0..items.len()).filter(|i| left >> i & 1 == 1) {
            items.swap(i, middle);
            middle += 1;
        }
        Some(Halves::new(items, middle, items.len()))
    }

    /// Whether whole primitives make boxes that overlap so much that cutting is worth a try.
    fn may_cut(&self, extent: &Extent, split: Option<&Split>) -> bool {
        let whole = extent.bounds.half_area(self.unit);
        let overlap = split.map_or(whole, |split| split.overlap);
        overlap > self.least_area && overlap > self.least_part * whole
    }
}

/// Where items are split, and where they end.
struct Halves {
    middle: usize,
    end: usize,
    extents: [Extent; 2],
}

impl Halves {
    fn new(items: &[Item], middle: usize, end: usize) -> Self {
        Self { middle, end, extents: [Extent::of(&items[..middle]), Extent::of(&items[middle..end])] }
    }
}

/// Moves the items that satisfy `is_left` to the front, and says how many they are. Which do is as good as random, so that a
/// branch would be guessed wrong every other time: each item changes places with the first of the right, and stays there or not.
fn partition(items: &mut [Item], is_left: impl Fn(&Item) -> bool) -> usize {
    let mut middle = 0;
    for i in 0..items.len() {
        // Asked before: where it goes is known only after all that came before it.
        let is_left = is_left(&items[i]);
        items.swap(i, middle);
        middle += usize::from(is_left);
    }
    middle
}

/// Boxes around items and around their centroids.
#[derive(Clone, Copy)]
struct Extent {
    bounds: Box4,
    centroids: Box4,
}

impl Extent {
    const EMPTY: Self = Self { bounds: Box4::EMPTY, centroids: Box4::EMPTY };

    fn of(items: &[Item]) -> Self {
        let with = |a: Self, item: &Item| Self {
            bounds: a.bounds.union(item.box4()),
            centroids: a.centroids.with(item.centroid()),
        };
        let both =
            |a: Self, b: Self| Self { bounds: a.bounds.union(b.bounds), centroids: a.centroids.union(b.centroids) };
        gathered(items, Self::EMPTY, with, both)
    }

    /// The box around centroids alone.
    fn of_centroids(items: &[Item]) -> Box4 {
        gathered(items, Box4::EMPTY, |a, item| a.with(item.centroid()), Box4::union)
    }
}

/// What `with` makes of all items, from `empty` on; many are taken in parallel.
fn gathered<T: Copy + Send + Sync>(
    items: &[Item],
    empty: T,
    with: impl Fn(T, &Item) -> T + Sync,
    both: impl Fn(T, T) -> T + Send + Sync,
) -> T {
    let serial = |items: &[Item]| {
        let mut all = empty;
        for item in items {
            all = with(all, item);
        }
        all
    };
    if items.len() <= PARALLEL_BINNING {
        return serial(items);
    }
    items.par_chunks(PARALLEL_BINNING).map(serial).reduce(|| empty, both)
}

/// The best split between whole primitives.
struct Split {
    axis: usize,
    /// The last on the left.
    bin: usize,
    /// Around what is on the left and on the right.
    bounds: [Box4; 2],
    cost: f32,
    /// Half of the surface area that the boxes of both sides have in common.
    overlap: f32,
}

/// Blocks that so many primitives take, of `leaf_size` each, which is a power of two: a division would take longer than all
/// the rest of a cost.
#[inline(always)]
pub(super) fn blocks(count: usize, leaf_size: usize) -> f32 {
    ((count + leaf_size - 1) >> leaf_size.trailing_zeros()) as i32 as f32
}

/// The first three numbers, rounded to those of so many bins. NaN (of 0 · ∞) becomes 0.
#[inline(always)]
pub(super) fn nearest_bins(place: Vec4, bins: usize) -> [usize; 3] {
    // A sum with [`TO_INTEGER`] rounds to an integer that stands in its lowest bits: a cast to one takes several times as long.
    let [x, y, z, _] = (place.max(Vec4::ZERO).min(Vec4::splat((bins - 1) as f32)) + TO_INTEGER).to_array();
    let bin = |x: f32| x.to_bits() as usize % BINS;
    [bin(x), bin(y), bin(z)]
}

/// How centroids map to bins.
struct Binning {
    origin: Vec4,
    scale: Vec4,
    /// Bins in use.
    bins: usize,
    leaf_size: usize,
    unit: f32,
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Box4,
    count: usize,
}

impl Bin {
    const EMPTY: Self = Self { bounds: Box4::EMPTY, count: 0 };

    #[inline(always)]
    fn union(self, other: Self) -> Self {
        Self { bounds: self.bounds.union(other.bounds), count: self.count + other.count }
    }
}

type Bins = [[Bin; BINS]; 3];

const NO_BINS: Bins = [[Bin::EMPTY; BINS]; 3];

impl Binning {
    fn new(extent: &Extent, bins: usize, leaf_size: usize, unit: f32) -> Self {
        let size = extent.centroids.max - extent.centroids.min;
        Self { origin: extent.centroids.min, scale: Vec4::splat(bins as f32) / size, bins, leaf_size, unit }
    }

    /// The bins along the axes; 0 along one where all centroids are the same.
    #[inline(always)]
    fn bins_of(&self, item: &Item) -> [usize; 3] {
        nearest_bins((item.centroid() - self.origin) * self.scale - 0.5, self.bins)
    }

    /// Sorts items into the bins in use, which are emptied first.
    fn fill(&self, items: &[Item], bins: &mut Bins) {
        let last = self.bins - 1;
        for bins in &mut *bins {
            bins[..=last].fill(Bin::EMPTY);
        }
        for item in items {
            let places = self.bins_of(item);
            for axis in 0..3 {
                let bin = &mut bins[axis][places[axis]];
                bin.bounds = bin.bounds.union(item.box4());
                bin.count += 1;
            }
        }
    }

    /// Cost of a node with these primitives, of which a whole block is tested at a time.
    #[inline(always)]
    fn cost(&self, bin: &Bin) -> f32 {
        // The area of nothing is infinite; without a branch, as nobody could guess which bins are empty.
        bin.bounds.half_area(self.unit) * blocks(bin.count.max(1), self.leaf_size)
    }

    /// The cheapest split; none where no split has primitives on both sides. `bins` is room for them, whatever it holds: to empty
    /// those that a small node does not use would take as long as the node.
    fn best_split(&self, items: &[Item], bins: &mut Bins) -> Option<Split> {
        if items.len() <= PARALLEL_BINNING {
            self.fill(items, bins);
        } else {
            let fill = |items: &[Item]| {
                let mut bins = NO_BINS;
                self.fill(items, &mut bins);
                bins
            };
            *bins = items.par_chunks(PARALLEL_BINNING).map(fill).reduce(
                || NO_BINS,
                |a, b| std::array::from_fn(|axis| std::array::from_fn(|i| a[axis][i].union(b[axis][i]))),
            );
        }
        let mut best = None;
        let mut least = f32::INFINITY;
        for (axis, bins) in bins.iter().enumerate() {
            let mut right_costs = [0.0; BINS];
            let mut right = Bin::EMPTY;
            for i in (1..self.bins).rev() {
                right = right.union(bins[i]);
                right_costs[i] = self.cost(&right);
            }
            let mut left = Bin::EMPTY;
            for i in 0..self.bins - 1 {
                left = left.union(bins[i]);
                let cost = self.cost(&left) + right_costs[i + 1];
                if cost < least {
                    least = cost;
                    best = Some((axis, i));
                }
            }
        }
        best.map(|(axis, bin)| {
            let side = |bins: &[Bin]| bins.iter().fold(Bin::EMPTY, |a, &b| a.union(b)).bounds;
            let bounds = [side(&bins[axis][..=bin]), side(&bins[axis][bin + 1..self.bins])];
            let common = bounds[0].intersection(bounds[1]);
            let overlap = if common.is_empty() { 0.0 } else { common.half_area(self.unit) };
            Split { axis, bin, bounds, cost: least, overlap }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::Hit;
    use glam::Vec3;
    use std::collections::BTreeSet;

    /// Two small triangles far apart, and two that are not.
    #[test]
    fn blocks_of_what_lies_far_apart_are_divided() {
        for (distance, leaves) in [(8.0, 2), (0.5, 1)] {
            let triangle = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::new(x + 1.0, 0.0, 0.0), Vec3::new(x, 1.0, 0.5)];
            let bounds = [0.0, distance, distance + 0.25, 0.25].map(|x| Bounds::of(triangle(x)));
            let mut items: Vec<Item> =
                (0..).zip(bounds).map(|(i, b)| Item::new(b, Hit { shape: 0, primitive: i })).collect();
            let nodes = build(&mut items, 4, None, Quality::Low);
            let counts = nodes.iter().filter_map(|node| match node.kind {
                Kind::Leaf { count, .. } => Some(count),
                Kind::Inner { .. } => None,
            });
            let counts: Vec<u32> = counts.collect();
            assert_eq!(counts, vec![4 / leaves; leaves as usize]);
        }
    }

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
        let item =
            |(primitive, triangle): (u32, &[Vec3; 3])| Item::new(Bounds::of(*triangle), Hit { shape: 0, primitive });
        let mut items: Vec<Item> = (0..).zip(&triangles).map(item).collect();
        let nodes = build(&mut items, 4, Some(&|id: Hit| triangles[id.primitive as usize]), Quality::High);
        let leaves = nodes.iter().filter_map(|node| match node.kind {
            Kind::Leaf { first, count } => Some(first as usize..(first + count) as usize),
            Kind::Inner { .. } => None,
        });
        let parts: Vec<u32> = leaves.flatten().map(|i| items[i].id().primitive).collect();
        let spare = triangles.len() / SPARE;
        assert!(parts.len() > triangles.len() && parts.len() <= triangles.len() + spare, "{}", parts.len());
        assert_eq!(parts.into_iter().collect::<BTreeSet<u32>>().len(), triangles.len());
    }
}
