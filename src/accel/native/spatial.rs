//! Spatial splits: a plane cuts the triangles that straddle it, and each side keeps a box around its part alone.
//!
//! After Stich, Friedrich and Dietrich 2009, *Spatial Splits in Bounding Volume Hierarchies*: the planes between bins are
//! tried, counting the parts on either side; and where it is cheaper to keep a triangle whole on one side, it stays whole
//! (their section 4.4). A triangle may so stand in several leaves, which changes no answer: it is offered twice.
//!
//! # Parts cover their triangle
//!
//! The box of a part contains every point of the triangle that lies in the part's former box and on its side of the
//! plane, so each point of a triangle is in the box of one of its parts. For a side of the plane cuts a polygon out of the
//! triangle whose corners are vertices of the triangle and points where an edge crosses the plane. Vertices are exact. A
//! crossing is a + s·(b − a) in f64, with s = (plane − aₓ)/(bₓ − aₓ): with u the unit roundoff of f64 and m the largest
//! size of a and b in the coordinate, the differences, the quotient, the product and the sum of f32 numbers are off by
//! less than 10·u·m in all, and [`CROSSING_ERROR`] takes four times that, before it is rounded outwards.

use super::build::{BINS, PARALLEL_BINNING, blocks, nearest_bins};
use super::item::{Box4, Item, without_name};
use crate::accel::Hit;
use crate::math::bounds::Bounds;
use crate::math::float::{round_down, round_up};
use glam::{Vec3, Vec4};
use rayon::prelude::*;

/// Bound on the error of a coordinate of a crossing, as a fraction of the larger one of the edge's ends: see the head.
const CROSSING_ERROR: f64 = 5.0 / (1u64 << 50) as f64;

/// The corners of a triangle by its name.
pub(super) type Corners<'a> = dyn Fn(Hit) -> [Vec3; 3] + Sync + 'a;

/// A plane to split at, and what lies on its two sides.
#[derive(Clone, Copy)]
pub(super) struct SpatialSplit {
    axis: usize,
    position: f32,
    sides: [Side; 2],
    /// As that of an object split.
    pub(super) cost: f32,
    unit: f32,
}

#[derive(Clone, Copy)]
struct Side {
    bounds: Box4,
    count: usize,
}

impl Side {
    const EMPTY: Self = Self { bounds: Box4::EMPTY, count: 0 };

    fn with(self, bounds: Box4, count: usize) -> Self {
        Self { bounds: self.bounds.union(bounds), count: self.count + count }
    }
}

/// What begins and what ends in a slab, and a box around all parts in it.
#[derive(Clone, Copy)]
struct Bin {
    bounds: Box4,
    begins: usize,
    ends: usize,
}

impl Bin {
    const EMPTY: Self = Self { bounds: Box4::EMPTY, begins: 0, ends: 0 };

    fn union(self, other: Self) -> Self {
        let bounds = self.bounds.union(other.bounds);
        Self { bounds, begins: self.begins + other.begins, ends: self.ends + other.ends }
    }
}

type Bins = [[Bin; BINS]; 3];

/// Slabs of equal thickness across a box.
struct Slabs {
    origin: Vec4,
    extent: Vec4,
    scale: Vec4,
}

impl Slabs {
    fn new(bounds: Bounds) -> Self {
        let Box4 { min, max } = Box4::of(bounds);
        let extent = max - min;
        Self { origin: min, extent, scale: Vec4::splat(BINS as f32) / extent }
    }

    /// The slabs of the coordinates of a point; 0 throughout where the box is flat.
    fn slabs(&self, p: Vec4) -> [usize; 3] {
        nearest_bins(without_name(p - self.origin) * self.scale - 0.5, BINS)
    }

    /// The plane before a slab.
    fn plane(&self, axis: usize, slab: usize) -> f32 {
        self.origin[axis] + self.extent[axis] * (slab as f32 / BINS as f32)
    }

    fn fill(&self, items: &[Item], corners: &Corners<'_>) -> Bins {
        let mut bins = [[Bin::EMPTY; BINS]; 3];
        for item in items {
            let whole = item.box4();
            let (firsts, lasts) = (self.slabs(whole.min), self.slabs(whole.max));
            let mut triangle = None;
            for axis in 0..3 {
                let (first, last) = (firsts[axis], lasts[axis]);
                let bins = &mut bins[axis];
                bins[first].begins += 1;
                bins[last].ends += 1;
                let mut rest = whole;
                for slab in first + 1..=last {
                    let triangle = match &triangle {
                        Some(triangle) => triangle,
                        None => triangle.insert(as_vectors(corners(item.id()))),
                    };
                    let [part, behind] = rough_cut(rest, triangle, axis, self.plane(axis, slab));
                    bins[slab - 1].bounds = bins[slab - 1].bounds.union(part);
                    rest = behind;
                }
                bins[last].bounds = bins[last].bounds.union(rest);
            }
        }
        bins
    }
}

fn as_vectors([a, b, c]: [Vec3; 3]) -> [Vec4; 3] {
    [a.extend(0.0), b.extend(0.0), c.extend(0.0)]
}

/// [`cut`] without care for rounding: good enough to compare costs.
#[inline]
fn rough_cut(bounds: Box4, triangle: &[Vec4; 3], axis: usize, position: f32) -> [Box4; 2] {
    let at = |p: Vec4| p.to_array()[axis];
    let (mut below, mut above) = (Box4::EMPTY, Box4::EMPTY);
    for i in 0..3 {
        let (a, b) = (triangle[i], triangle[if i == 2 { 0 } else { i + 1 }]);
        let (x, y) = (at(a), at(b));
        if x <= position {
            below = below.with(a);
        }
        if x >= position {
            above = above.with(a);
        }
        if (x < position) != (y < position) {
            let p = a + (b - a) * ((position - x) / (y - x));
            below = below.with(p);
            above = above.with(p);
        }
    }
    let inside = |part: Box4| {
        let part = part.intersection(bounds);
        if part.is_empty() { Box4::EMPTY } else { part }
    };
    [inside(below), inside(above)]
}

/// The boxes of the two parts of what `bounds` holds of a triangle, below and above a plane across an axis; empty where
/// there is none.
fn cut(bounds: Bounds, triangle: &[Vec3; 3], axis: usize, position: f32) -> [Bounds; 2] {
    let [mut below, mut above] = [Bounds::EMPTY; 2];
    for (i, &a) in triangle.iter().enumerate() {
        if a[axis] <= position {
            below = below.with(a);
        }
        if a[axis] >= position {
            above = above.with(a);
        }
        let b = triangle[(i + 1) % 3];
        if (a[axis] < position && position < b[axis]) || (b[axis] < position && position < a[axis]) {
            let crossing = crossing(a, b, axis, position);
            below = below.union(crossing);
            above = above.union(crossing);
        }
    }
    [below, above]
        .map(|part| Bounds { min: part.min.max(bounds.min), max: part.max.min(bounds.max) })
        .map(|part| if part.is_empty() { Bounds::EMPTY } else { part })
}

/// A box around the point where an edge crosses a plane.
fn crossing(a: Vec3, b: Vec3, axis: usize, position: f32) -> Bounds {
    let (from, to) = (a.as_dvec3(), b.as_dvec3());
    let p = from + (to - from) * ((f64::from(position) - from[axis]) / (to[axis] - from[axis]));
    let error = CROSSING_ERROR * from.abs().max(to.abs());
    let (low, high) = (p - error, p + error);
    let mut bounds = Bounds {
        min: Vec3::from_array(low.to_array().map(round_down)),
        max: Vec3::from_array(high.to_array().map(round_up)),
    };
    bounds.min[axis] = position;
    bounds.max[axis] = position;
    bounds
}

/// The cheapest plane, if any has fewer items on each side than there are.
pub(super) fn best(
    items: &[Item],
    bounds: Bounds,
    corners: &Corners<'_>,
    leaf_size: usize,
    unit: f32,
) -> Option<SpatialSplit> {
    let slabs = Slabs::new(bounds);
    let bins = if items.len() <= PARALLEL_BINNING {
        slabs.fill(items, corners)
    } else {
        items.par_chunks(PARALLEL_BINNING).map(|items| slabs.fill(items, corners)).reduce(
            || [[Bin::EMPTY; BINS]; 3],
            |a, b| std::array::from_fn(|axis| std::array::from_fn(|i| a[axis][i].union(b[axis][i]))),
        )
    };
    let mut best: Option<SpatialSplit> = None;
    for (axis, bins) in bins.iter().enumerate() {
        let mut above = [Side::EMPTY; BINS + 1];
        for i in (1..BINS).rev() {
            above[i] = above[i + 1].with(bins[i].bounds, bins[i].ends);
        }
        let mut below = Side::EMPTY;
        for i in 1..BINS {
            below = below.with(bins[i - 1].bounds, bins[i - 1].begins);
            let sides = [below, above[i]];
            let divides = |side: &Side| side.count > 0 && side.count < items.len() && !side.bounds.is_empty();
            if !divides(&sides[0]) || !divides(&sides[1]) {
                continue;
            }
            let of_side = |side: &Side| side.bounds.half_area(unit) * blocks(side.count, leaf_size);
            let cost = of_side(&sides[0]) + of_side(&sides[1]);
            if best.is_none_or(|best| cost < best.cost) {
                best = Some(SpatialSplit { axis, position: slabs.plane(axis, i), sides, cost, unit });
            }
        }
    }
    best
}

impl SpatialSplit {
    /// Splits the first `count` items, whose parts may take the places behind. Returns where the items of the upper side
    /// begin and where they end; those of the lower come first.
    pub(super) fn partition(&self, items: &mut [Item], count: usize, corners: &Corners<'_>) -> (usize, usize) {
        let (mut lower, mut upper, mut end) = (0, count, count);
        while lower < upper {
            let item = items[lower];
            let bounds = item.bounds();
            let mut is_lower = bounds.max[self.axis] <= self.position;
            if !is_lower && bounds.min[self.axis] < self.position {
                let [below, above] = cut(bounds, &corners(item.id()), self.axis, self.position);
                if above.is_empty() || below.is_empty() {
                    is_lower = above.is_empty();
                } else {
                    let whole_in = self.whole_in(item.box4());
                    if end < items.len() && whole_in.is_none() {
                        items[end] = item.with_bounds(above);
                        end += 1;
                        items[lower] = item.with_bounds(below);
                        lower += 1;
                        continue;
                    }
                    is_lower = whole_in.unwrap_or_else(|| item.centroid()[self.axis] <= 2.0 * self.position);
                }
            }
            if is_lower {
                lower += 1;
            } else {
                upper -= 1;
                items.swap(lower, upper);
            }
        }
        (lower, end)
    }

    /// Whether it is cheaper to keep what has these bounds whole, and then whether below the plane.
    fn whole_in(&self, bounds: Box4) -> Option<bool> {
        let [below, above] = &self.sides;
        let area = |bounds: Box4| bounds.half_area(self.unit);
        let (a, b) = (area(below.bounds), area(above.bounds));
        let (n, m) = (below.count as f32, above.count as f32);
        let cut = a * n + b * m;
        let all_below = area(below.bounds.union(bounds)) * n + b * (m - 1.0);
        let all_above = a * (n - 1.0) + area(above.bounds.union(bounds)) * m;
        if cut <= all_below && cut <= all_above { None } else { Some(all_below <= all_above) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 200 random triangles, each cut at 20 planes: every one of 50 points of it is in the box of the part on its side.
    #[test]
    fn parts_cover_their_triangle() {
        let mut state = 1u64;
        let mut unit = || {
            state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        for round in 0..200 {
            let thin = if round % 3 == 0 { 1.0 / 1024.0 } else { 1.0 };
            let triangle = std::array::from_fn(|_| Vec3::new(thin * unit(), unit(), unit() - 0.5));
            let mut whole = Bounds::of(triangle);
            for cuts in 0..20 {
                let axis = cuts % 3;
                let position = whole.min[axis] + unit() * whole.extent()[axis];
                let parts = cut(whole, &triangle, axis, position);
                for _ in 0..50 {
                    let (s, t) = (f64::from(unit()), f64::from(unit()));
                    let [a, b, c] = triangle.map(Vec3::as_dvec3);
                    let p = a.lerp(b, s).lerp(c, t);
                    let is_in = |bounds: Bounds| {
                        // What f64 rounds is far below the least distance of two f32 numbers here, but not nothing.
                        let slack = CROSSING_ERROR;
                        (p + slack).cmpge(bounds.min.as_dvec3()).all() && (p - slack).cmple(bounds.max.as_dvec3()).all()
                    };
                    if is_in(whole) {
                        assert!(
                            is_in(parts[usize::from(p[axis] > f64::from(position))]),
                            "{triangle:?} {axis} {position}"
                        );
                    }
                }
                whole = if parts[cuts % 2].is_empty() { parts[1 - cuts % 2] } else { parts[cuts % 2] };
            }
        }
    }
}
