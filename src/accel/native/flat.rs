//! A list of triangles without a tree, for scenes of a few dozen: sixteen rays at a time are tested against all.
//!
//! # The test
//!
//! A triangle is stored as three affine functions of a point x: N(x), the signed distance from its plane, and Bᵢ(x) for
//! i = 1, 2, its barycentric coordinates times s, the least of its heights, so that no gradient is longer than 1. Along
//! the ray, N(o + t·d) = N(o) + t·N'(d), so it crosses the plane at t = −N(o)/N'(d), and there Bᵢ has the sign of
//! Uᵢ = Bᵢ(o)·N'(d) − N(o)·Bᵢ'(d), if N'(d) is positive, else the opposite one; U₀ = s·N'(d) − U₁ − U₂. Distances are
//! compared as fractions, crosswise, so that nothing is divided.
//!
//! Two triangles that make a parallelogram take one row: there, b₁ and b₂ are between 0 and 1, and the sign of U₀ tells
//! which of the two it is.
//!
//! # The answer is the tree's
//!
//! What rounding might have decided is in doubt, and is decided again by the exact tests of [`crate::shape::triangle`].
//! Directions are divided by their largest component; let R be the largest coordinate of o plus the largest of the list,
//! and u the unit roundoff. Coefficients are rounded once, sums have four terms of at most R or 1, and a parallelogram's
//! functions are those of its second triangle but for [`PAIR_ROUNDINGS`], here 16: N(o) and Bᵢ(o) are at most 4R and off
//! by less than (22 + 2·16)·u·R, N'(d) and Bᵢ'(d) are at most 2 and off by less than (14 + 16)·u. So U₁ and U₂ are off by
//! less than 2·(54·2 + 4·30)·u·R + 3·8·u·R = 480·u·R, U₀ by less than twice that and 30·u·R, and the crosswise difference
//! of two fractions by less than 480·u·R too, for it is of the same form: [`DOUBT_ROUNDINGS`] bounds them all. Distances
//! that round to the same f32 are in doubt as well: they differ by a part of 2u.

mod row;

use super::Nearest;
use super::item::Item;
use crate::accel::Hit;
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::ray::Ray;
use crate::math::simd;
use crate::shape::Shape;
use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch, f32x16, mask32x16, u32x16};
use row::{NO_ROW, PAIR_ROUNDINGS, Row, Rows, Triangle};

/// Rays tested at once.
const LANES: usize = 16;

/// Up to so many triangles are kept in a list: about where the tree becomes as fast on the machine of docs/benchmarks.md.
const FLAT_LIMIT: usize = 128;

/// Bound on the error of everything that is compared, in units of u·R: derived in the head.
const DOUBT_ROUNDINGS: f32 = 1024.0;
const _: () = assert!(PAIR_ROUNDINGS == 16.0);

/// Where no coordinate and no direction is larger than this or smaller than its inverse, nothing overflows and no bound
/// is lost to underflow; elsewhere everything is in doubt. A power of two far inside the range of f32.
const TAME: f32 = (1u64 << 40) as f32;

/// The triangles of a scene, all of them.
#[derive(Debug)]
pub(super) struct FlatList {
    rows: Rows,
    /// The largest coordinate of anything in it.
    reach: f32,
    level: Level,
}

/// Rays side by side.
#[derive(Debug, Default)]
#[repr(C, align(64))]
struct Rays {
    o: [[f32; LANES]; 3],
    d: [[f32; LANES]; 3],
    tmin: [f32; LANES],
    tmax: [f32; LANES],
    /// The rows that a ray starts and ends on, and so does not meet.
    ends: [[u32; LANES]; 2],
}

impl Rays {
    /// At most sixteen; the lanes left over repeat the last one.
    #[inline(always)]
    fn load(&mut self, rays: &[Ray]) {
        for lane in 0..LANES {
            let ray = &rays[lane.min(rays.len() - 1)];
            for axis in 0..3 {
                self.o[axis][lane] = ray.o[axis];
                self.d[axis][lane] = ray.d[axis];
            }
            self.tmin[lane] = ray.tmin;
            self.tmax[lane] = ray.tmax;
        }
    }
}

/// Lanes of which rounding may have decided whether they meet a row, a bit each.
#[derive(Clone, Copy, Debug, Default)]
struct Doubt {
    row: u32,
    lanes: u16,
    /// Those of them that certainly cross the inside of the first triangle, and of the second: the distance alone is in
    /// doubt.
    inside: [u16; 2],
}

/// The doubts of sixteen rays.
#[derive(Debug)]
struct Doubts {
    all: [Doubt; FLAT_LIMIT],
    count: usize,
}

impl Doubts {
    fn new() -> Self {
        Self { all: [Doubt::default(); FLAT_LIMIT], count: 0 }
    }

    /// The distances at which the doubtful lanes truly meet triangles, to `on_hit(lane, triangle, t)`.
    #[inline(always)]
    fn settle(&self, rows: &Rows, rays: &[Ray], mut on_hit: impl FnMut(usize, &Triangle, f32)) {
        for doubt in &self.all[..self.count] {
            let row = doubt.row as usize;
            let [first, second] = &rows.triangles[row];
            let mut lanes = doubt.lanes;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                // The last rays may be fewer than there are lanes.
                let Some(ray) = rays.get(lane) else { break };
                let mut offer = |triangle: &Triangle, t: Option<f32>| {
                    if let Some(t) = t {
                        on_hit(lane, triangle, t);
                    }
                };
                if doubt.inside[0] >> lane & 1 == 1 {
                    offer(first, first.plane_distance(ray));
                } else if doubt.inside[1] >> lane & 1 == 1 {
                    offer(second, second.plane_distance(ray));
                } else {
                    offer(first, first.distance(ray));
                    if row < rows.pairs {
                        offer(second, second.distance(ray));
                    }
                }
            }
        }
    }
}

/// Sixteen rays, ready for the test.
struct Prepared<S: Simd> {
    o: [f32x16<S>; 3],
    /// With 1 as the largest component.
    d: [f32x16<S>; 3],
    /// The interval, in units of `d`.
    start: f32x16<S>,
    end: f32x16<S>,
    /// Rows that are not met.
    ends: [u32x16<S>; 2],
    /// Bounds the error of everything that is compared.
    doubt: f32x16<S>,
}

/// What the test says of sixteen rays and a row.
struct Crossing<S: Simd> {
    /// −N(o) and N'(d), with signs that make the latter positive.
    t: f32x16<S>,
    d: f32x16<S>,
    /// U₀: it is negative where a parallelogram's second triangle is crossed.
    u0: f32x16<S>,
    /// The least of all that must not be negative: the ray crosses the row, ...
    inside: f32x16<S>,
    /// ... and that behind the start of the interval, too.
    least: f32x16<S>,
}

impl<S: Simd> Prepared<S> {
    #[inline(always)]
    fn new(simd: S, rays: &Rays, reach: f32) -> Self {
        let load = Self::load;
        let o = [load(simd, &rays.o[0]), load(simd, &rays.o[1]), load(simd, &rays.o[2])];
        let d = [load(simd, &rays.d[0]), load(simd, &rays.d[1]), load(simd, &rays.d[2])];
        let r = o[0].abs().max(o[1].abs()).max(o[2].abs()) + reach;
        let size = d[0].abs().max(d[1].abs()).max(d[2].abs());
        let wild = r.simd_gt(TAME) | r.simd_lt(1.0 / TAME) | size.simd_gt(TAME) | size.simd_lt(1.0 / TAME);
        let doubt = r * (DOUBT_ROUNDINGS * UNIT_ROUNDOFF);
        // No point of the list is farther from o than 2·√3·R; a start beyond that leaves nothing to be hit.
        let farthest = r * 4.0;
        Self {
            o,
            d: [d[0] / size, d[1] / size, d[2] / size],
            start: (load(simd, &rays.tmin) * size).min(farthest),
            end: (load(simd, &rays.tmax) * size).min(farthest),
            ends: [u32x16::from_slice(simd, &rays.ends[0]), u32x16::from_slice(simd, &rays.ends[1])],
            doubt: wild.select(f32x16::splat(simd, f32::INFINITY), doubt),
        }
    }

    #[inline(always)]
    fn load(simd: S, values: &[f32; LANES]) -> f32x16<S> {
        f32x16::from_slice(simd, values)
    }

    #[inline(always)]
    fn cross<const PAIR: bool>(&self, row: &Row) -> Crossing<S> {
        let (no, nd) = (self.at(&row.n), self.along(&row.n));
        // N(o) takes the sign of N'(d), which loses it.
        let sign = nd.bitcast::<u32x16<S>>() & SIGN;
        let no = (no.bitcast::<u32x16<S>>() ^ sign).bitcast::<f32x16<S>>();
        let d = nd.abs();
        let u1 = self.at(&row.b[0]) * d - no * self.along(&row.b[0]);
        let u2 = self.at(&row.b[1]) * d - no * self.along(&row.b[1]);
        let whole = d * row.scale;
        let rest = whole - u1;
        let u0 = rest - u2;
        let inside = if PAIR { u1.min(u2).min(rest.min(whole - u2)) } else { u1.min(u2).min(u0) };
        let t = -no;
        Crossing { t, d, u0, inside, least: inside.min(t - self.start * d) }
    }

    /// An affine function at the origin of each ray.
    #[inline(always)]
    fn at(&self, f: &[f32; 4]) -> f32x16<S> {
        self.o[0].mul_add(f[0], self.o[1].mul_add(f[1], self.o[2].mul_add(f[2], f[3])))
    }

    /// How it changes along each direction.
    #[inline(always)]
    fn along(&self, f: &[f32; 4]) -> f32x16<S> {
        self.d[0].mul_add(f[0], self.d[1].mul_add(f[1], self.d[2] * f[2]))
    }
}

/// The sign bit of an f32.
const SIGN: u32 = 1 << 31;

impl FlatList {
    /// Over `items`, all triangles of `shapes`; `None` where there are none, too many, or too thin ones.
    pub(super) fn build(items: &[Item], shapes: &[Shape]) -> Option<Self> {
        if items.len() > FLAT_LIMIT {
            return None;
        }
        let bounds = items.iter().map(|item| item.bounds()).reduce(|a, b| a.union(b))?;
        let reach = bounds.min.abs().max(bounds.max.abs()).max_element();
        let rows = Rows::new(items, shapes, reach, (bounds.max - bounds.min).max_element())?;
        Some(Self { rows, reach, level: simd::level() })
    }

    /// The same list, tested by another instruction set.
    pub(super) fn at_level(self, level: Level) -> Self {
        Self { level, ..self }
    }

    /// Bytes held.
    pub(super) fn memory_bytes(&self) -> u64 {
        let Rows { rows, triangles, .. } = &self.rows;
        (rows.capacity() * size_of::<Row>() + triangles.capacity() * size_of::<[Triangle; 2]>()) as u64
    }

    /// The nearest hit of each ray; its distance only `with_distances`.
    pub(super) fn closest_hits(&self, rays: &[Ray], from: &[Hit], nearest: &mut [Nearest], with_distances: bool) {
        dispatch!(self.level, simd => self.closest_all(simd, rays, from, nearest, with_distances));
    }

    /// Whether each ray meets anything. An answer that is true already is left alone.
    pub(super) fn occluded(&self, rays: &[Ray], ends: &[[Hit; 2]], occluded: &mut [bool]) {
        dispatch!(self.level, simd => self.any_all(simd, rays, ends, occluded));
    }

    #[inline(always)]
    fn closest_all<S: Simd>(&self, simd: S, rays: &[Ray], from: &[Hit], nearest: &mut [Nearest], with_distances: bool) {
        let (mut lanes, mut doubts) = (Rays::default(), Doubts::new());
        for (block, (rays, nearest)) in rays.chunks(LANES).zip(nearest.chunks_mut(LANES)).enumerate() {
            lanes.load(rays);
            lanes.ends = [[NO_ROW; LANES]; 2];
            for (row, &from) in lanes.ends[0].iter_mut().zip(from.iter().skip(block * LANES)) {
                *row = self.rows.of(from);
            }
            let prepared = Prepared::new(simd, &lanes, self.reach);
            let mut best = Best::new(simd, &prepared);
            doubts.count = 0;
            for (row, index) in self.rows.rows[..self.rows.pairs].iter().zip(0..) {
                best.improve::<true>(simd, &prepared, row, index, &mut doubts);
            }
            for (row, index) in self.rows.rows[self.rows.pairs..].iter().zip(self.rows.pairs as u32..) {
                best.improve::<false>(simd, &prepared, row, index, &mut doubts);
            }
            let certain = best.certain();
            for (nearest, certain) in nearest.iter_mut().zip(&certain) {
                *nearest = Nearest { t: f32::NAN, hit: self.certain(certain).map_or(Hit::NONE, |t| t.id) };
            }
            if with_distances {
                for ((nearest, ray), certain) in nearest.iter_mut().zip(rays).zip(&certain) {
                    nearest.t = self.certain_distance(ray, certain);
                }
            }
            doubts.settle(&self.rows, rays, |lane, triangle, t| {
                let nearest = &mut nearest[lane];
                if nearest.t.is_nan() {
                    nearest.t = self.certain_distance(&rays[lane], &certain[lane]);
                }
                nearest.offer(t, triangle.id);
            });
        }
    }

    /// The triangle of a hit that is certain.
    #[inline(always)]
    fn certain(&self, &(row, u0): &(u32, f32)) -> Option<&Triangle> {
        self.rows.triangles.get(row as usize).map(|pair| &pair[usize::from(u0 < 0.0)])
    }

    /// Its exact distance, or that of the ray's end where nothing certain is met.
    #[inline]
    fn certain_distance(&self, ray: &Ray, certain: &(u32, f32)) -> f32 {
        self.certain(certain).and_then(|triangle| triangle.plane_distance(ray)).unwrap_or(ray.tmax)
    }

    #[inline(always)]
    fn any_all<S: Simd>(&self, simd: S, rays: &[Ray], ends: &[[Hit; 2]], occluded: &mut [bool]) {
        let (mut lanes, mut doubts) = (Rays::default(), Doubts::new());
        for (block, (rays, occluded)) in rays.chunks(LANES).zip(occluded.chunks_mut(LANES)).enumerate() {
            lanes.load(rays);
            lanes.ends = [[NO_ROW; LANES]; 2];
            for (lane, ends) in ends.iter().skip(block * LANES).take(LANES).enumerate() {
                lanes.ends[0][lane] = self.rows.of(ends[0]);
                lanes.ends[1][lane] = self.rows.of(ends[1]);
            }
            let prepared = Prepared::new(simd, &lanes, self.reach);
            let mut hits = 0;
            doubts.count = 0;
            for (row, index) in self.rows.rows[..self.rows.pairs].iter().zip(0..) {
                hits |= prepared.any::<true>(row, index, &mut doubts);
            }
            for (row, index) in self.rows.rows[self.rows.pairs..].iter().zip(self.rows.pairs as u32..) {
                hits |= prepared.any::<false>(row, index, &mut doubts);
            }
            for (lane, occluded) in occluded.iter_mut().enumerate() {
                *occluded |= hits >> lane & 1 == 1;
            }
            doubts.settle(&self.rows, rays, |lane, _, _| occluded[lane] = true);
        }
    }
}

/// The nearest certain hits so far.
struct Best<S: Simd> {
    /// The distance as a fraction.
    t: f32x16<S>,
    d: f32x16<S>,
    row: u32x16<S>,
    u0: f32x16<S>,
}

impl<S: Simd> Best<S> {
    /// None: the ends of the intervals.
    #[inline(always)]
    fn new(simd: S, rays: &Prepared<S>) -> Self {
        let one = f32x16::splat(simd, 1.0);
        Self { t: rays.end, d: one, row: u32x16::splat(simd, NO_ROW), u0: one }
    }

    /// Takes the row where it is certainly met and nearer, and puts down where that is in doubt.
    #[inline(always)]
    fn improve<const PAIR: bool>(&mut self, simd: S, rays: &Prepared<S>, row: &Row, index: u32, doubts: &mut Doubts) {
        let crossing = rays.cross::<PAIR>(row);
        let least = crossing.least.min(self.t * crossing.d - crossing.t * self.d);
        let certain = crossing.decide::<PAIR>(least, rays, index, doubts);
        self.t = certain.select(crossing.t, self.t);
        self.d = certain.select(crossing.d, self.d);
        self.row = certain.select(u32x16::splat(simd, index), self.row);
        if PAIR {
            self.u0 = certain.select(crossing.u0, self.u0);
        } else {
            self.u0 = certain.select(f32x16::splat(simd, 1.0), self.u0);
        }
    }

    /// Row and sign of U₀ of every lane.
    #[inline(always)]
    fn certain(&self) -> [(u32, f32); LANES] {
        let (mut rows, mut u0) = ([0; LANES], [0.0; LANES]);
        self.row.store_slice(&mut rows);
        self.u0.store_slice(&mut u0);
        let mut both = [(0, 0.0); LANES];
        for lane in 0..LANES {
            both[lane] = (rows[lane], u0[lane]);
        }
        both
    }
}

impl<S: Simd> Prepared<S> {
    /// The lanes that certainly meet the row in their intervals, a bit each; puts down where that is in doubt.
    #[inline(always)]
    fn any<const PAIR: bool>(&self, row: &Row, index: u32, doubts: &mut Doubts) -> u64 {
        let crossing = self.cross::<PAIR>(row);
        let least = crossing.least.min(self.end * crossing.d - crossing.t);
        crossing.decide::<PAIR>(least, self, index, doubts).to_bitmask()
    }
}

impl<S: Simd> Crossing<S> {
    /// Where the row certainly counts, `least` being the least of all that must not be negative; puts down the lanes
    /// where rounding might decide.
    #[inline(always)]
    fn decide<const PAIR: bool>(
        &self,
        least: f32x16<S>,
        rays: &Prepared<S>,
        row: u32,
        doubts: &mut Doubts,
    ) -> mask32x16<S> {
        let sure = if PAIR { least.min(self.u0.abs()) } else { least };
        let own = rays.ends[0].simd_eq(row) | rays.ends[1].simd_eq(row);
        let certain = sure.simd_gt(rays.doubt) & !own;
        let impossible = least.simd_lt(-rays.doubt) | own;
        let lanes = !(certain | impossible).to_bitmask() as u16;
        if lanes != 0 {
            let inside = self.inside.simd_gt(rays.doubt);
            let second = if PAIR { self.u0.simd_lt(-rays.doubt).to_bitmask() } else { 0 };
            let first = if PAIR { self.u0.simd_gt(rays.doubt).to_bitmask() } else { u64::MAX };
            let inside = inside.to_bitmask();
            doubts.all[doubts.count] =
                Doubt { row, lanes, inside: [(inside & first) as u16, (inside & second) as u16] };
            doubts.count += 1;
        }
        certain
    }
}
