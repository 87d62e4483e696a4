//! Leaves of four triangles each, and what a ray meets first of them, mostly without its exact distance.
//!
//! Triangles are stored lane by lane, by their vertices and not by edges: the two triangles at an edge must compute it
//! from the same numbers. Unused lanes repeat the last one.
//!
//! Which triangle counts, and which of two is nearer, is a matter of distances in f64 ([`crate::shape::triangle`]). Bounds of them in
//! f32 decide nearly always; where they overlap, or an edge function is 0, [`settle`] computes them.

use super::block::{BLOCK_SIZE, Block, BlockRay, SceneRay, side_by_side, triangle};
#[cfg(target_arch = "x86_64")]
use super::interleaved::{self, Any, Closest, View};
use super::item::Item;
use super::pages::Pages;
use super::spatial::Corners;
use super::wide::{Stack, Tree};
use super::{CHUNK, Nearest};
use crate::accel::Hit;
use crate::math::ray::Ray;
use crate::shape::Shape;
use crate::shape::triangle::{FourTriangles, Meetings, ShearedRay, WatertightRay};
use bytemuck::{Pod, Zeroable};
use fearless_simd::{prelude::*, u32x4};
use glam::{Vec3, Vec4};

/// Four triangles.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct TriangleBlock {
    /// The vertices. Behind them stand, as bits, the shapes and the primitives of their names and (in the first lane) which lanes are
    /// in use, a bit each: so a ray reads the vertices by three loads of 64 bytes, and the whole takes three lines.
    rows: FourTriangles,
}

/// Of a row, the vector that is not of vertices.
const MORE: usize = 3;

/// A ray as these blocks want it.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriangleRay {
    ray: Ray,
    pub(super) sheared: ShearedRay,
    /// The triangles it starts and ends on.
    pub(super) ends: [Hit; 2],
}

impl BlockRay for TriangleRay {
    #[inline(always)]
    fn line(&self) -> &Ray {
        &self.ray
    }
}

impl SceneRay for TriangleRay {
    #[inline(always)]
    fn new(ray: &Ray, ends: [Hit; 2]) -> Self {
        Self { ray: *ray, sheared: ShearedRay::new(ray), ends }
    }
}

/// The nearest triangle of all so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Best {
    /// Its distance is not below `low` and not above `high`, and is that number, rounded to f32, where they are the same.
    low: f32,
    high: f32,
    /// The number of its lane in all blocks, or [`NOWHERE`].
    place: u32,
}

/// The place of no triangle: blocks have numbers below 2³¹, and far fewer fit into memory.
const NOWHERE: u32 = u32::MAX;

impl Best {
    /// Some triangle, whichever.
    pub(super) const SOME: Self = Self { low: 0.0, high: 0.0, place: 0 };

    /// Whether there is one.
    #[inline(always)]
    pub(super) fn is_some(&self) -> bool {
        self.place != NOWHERE
    }

    /// A distance that it is not beyond.
    #[inline(always)]
    pub(super) fn limit(&self) -> f32 {
        self.high
    }

    /// None, of no ray.
    pub(super) const NONE: Self = Self { low: 0.0, high: 0.0, place: NOWHERE };

    /// None, at the end of the ray.
    #[inline(always)]
    pub(super) fn none(ray: &Ray) -> Self {
        Self { low: ray.tmax, high: ray.tmax, place: NOWHERE }
    }
}

impl Tree<TriangleBlock> {
    /// Tells `take` of the nearest triangle of each ray, in any order.
    #[inline]
    pub(super) fn closest_hits(&self, rays: &[Ray], from: &[Hit], mut take: impl FnMut(usize, &Best)) {
        #[cfg(target_arch = "x86_64")]
        if let Some(view) = self.interleaved() {
            let mut query = Closest { from, take: |i: usize, best: &Best| take(i, best) };
            if interleaved::trace(self.level(), view, rays, &mut query) {
                return;
            }
        }
        let mut stack = Stack::new();
        for (chunk, rays) in rays.chunks(CHUNK).enumerate() {
            let mut best = [Best::NONE; CHUNK];
            best.iter_mut().zip(rays).for_each(|(best, ray)| *best = Best::none(ray));
            let from = from.get(chunk * CHUNK..).unwrap_or(&[]);
            self.improve_all(rays, from, &mut best[..rays.len()], &mut stack);
            best[..rays.len()].iter().enumerate().for_each(|(i, best)| take(chunk * CHUNK + i, best));
        }
    }

    /// Whether each ray meets any triangle. An answer that is true already is left alone.
    pub(super) fn occluded_all(&self, rays: &[Ray], ends: &[[Hit; 2]], occluded: &mut [bool]) {
        #[cfg(target_arch = "x86_64")]
        if let Some(view) = self.interleaved()
            && interleaved::trace(self.level(), view, rays, &mut Any { ends, occluded })
        {
            return;
        }
        self.occluded(rays, ends, occluded);
    }

    /// What it takes to walk it with many rays in turn, if that can be done.
    #[cfg(target_arch = "x86_64")]
    fn interleaved(&self) -> Option<View<'_>> {
        let (nodes, root, reach, depth) = self.parts();
        (depth <= interleaved::MAX_DEPTH).then(|| View { nodes, blocks: self.blocks(), root, reach, depth })
    }

    /// What tells which triangle a ray meets. (To ask for it once a ray would take longer.)
    #[inline]
    pub(super) fn hits(&self) -> impl Fn(&Best) -> Hit {
        let blocks = self.blocks();
        move |best| if best.is_some() { id(blocks, best.place) } else { Hit::NONE }
    }

    /// What a ray meets, and where.
    #[inline]
    pub(super) fn nearest(&self, ray: &Ray, best: &Best) -> Nearest {
        let t = if best.low < best.high { exact_distance(self.blocks(), best.place, ray) } else { None };
        Nearest { t: t.unwrap_or(best.high), hit: self.hits()(best) }
    }
}

#[inline(always)]
fn id(blocks: &[TriangleBlock], place: u32) -> Hit {
    blocks[place as usize / BLOCK_SIZE].id(place as usize % BLOCK_SIZE)
}

/// The distance of a triangle, from f64, if the ray meets it inside its interval.
fn exact_distance(blocks: &[TriangleBlock], place: u32, ray: &Ray) -> Option<f32> {
    let (block, lane) = (&blocks[place as usize / BLOCK_SIZE], place as usize % BLOCK_SIZE);
    let corner = |i: usize| Vec3::new(block.rows[0][i][lane], block.rows[1][i][lane], block.rows[2][i][lane]);
    let [a, b, c] = [corner(0), corner(1), corner(2)];
    WatertightRay::new(ray).intersect(a, b, c)
}

/// Takes the triangle at `place` if it is met and nearer than the best, or as near and of lower id.
#[cold]
#[inline(never)]
fn settle(blocks: &[TriangleBlock], place: u32, ray: &Ray, best: &mut Best) {
    // A triangle that was cut stands in several leaves.
    if best.place != NOWHERE && id(blocks, place) == id(blocks, best.place) {
        return;
    }
    let Some(t) = exact_distance(blocks, place, ray) else { return };
    if best.low < best.high {
        let t = exact_distance(blocks, best.place, ray).unwrap_or(best.high);
        (best.low, best.high) = (t, t);
    }
    let is_lower = || best.place == NOWHERE || id(blocks, place) < id(blocks, best.place);
    if t < best.high || (t == best.high && is_lower()) {
        *best = Best { low: t, high: t, place };
    }
}

impl TriangleRay {
    /// None, to be overwritten.
    pub(super) const EMPTY: Self = Self {
        ray: Ray { o: Vec3::ZERO, tmin: 0.0, d: Vec3::ZERO, tmax: 0.0 },
        sheared: ShearedRay { axes: [0; 3], origin: [0.0; 3], shear: [0.0; 2], depth: 0.0 },
        ends: [Hit::NONE; 2],
    };

    /// Whether it starts or ends on a triangle.
    #[inline(always)]
    fn leaves(&self, id: Hit) -> bool {
        (id == self.ends[0]) | (id == self.ends[1])
    }
}

/// What the triangles of a block may be to a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lanes {
    /// Those that may be nearer than what was found before, a bit each.
    pub(super) rest: u32,
    low: Vec4,
    high: Vec4,
    /// Those whose bounds of the distance begin inside the ray's interval, and that the ray certainly crosses.
    certain: u32,
}

impl Lanes {
    /// None.
    pub(super) const NONE: Self = Self { rest: 0, certain: 0, low: Vec4::ZERO, high: Vec4::ZERO };

    /// Of `meetings`, where what lies beyond `limit` does not matter.
    #[inline(always)]
    pub(super) fn new(meetings: &Meetings, ray: &TriangleRay, limit: f32) -> Self {
        let [low, high] = meetings.distances(&ray.sheared);
        let tmin = Vec4::splat(ray.ray.tmin);
        // NaN says nothing, and stays.
        let outside = low.cmpgt(Vec4::splat(limit)) | high.cmple(tmin);
        Self {
            rest: meetings.candidates & !outside.bitmask(),
            certain: low.cmpgt(tmin).bitmask() & u32::from(meetings.certain),
            low,
            high,
        }
    }
}

impl Block for TriangleBlock {
    type Source = [Shape];
    type Ray = TriangleRay;
    type Nearest = Best;
    type Blocks = Pages<Self>;

    const SIZE: usize = BLOCK_SIZE;

    fn corners(shapes: &[Shape]) -> Option<Box<Corners<'_>>> {
        Some(Box::new(|id| triangle(shapes, id)))
    }

    fn new(items: &[Item], shapes: &[Shape]) -> Self {
        let (ids, vertices) = side_by_side(items, shapes);
        let bits = |numbers: [u32; BLOCK_SIZE]| Vec4::from_array(numbers.map(f32::from_bits));
        let more = [ids.map(|id| id.shape), ids.map(|id| id.primitive), [(1 << items.len()) - 1, 0, 0, 0]].map(bits);
        let [a, b, c] = vertices;
        let row = |axis: usize| [a[axis], b[axis], c[axis], more[axis]];
        Self { rows: [row(0), row(1), row(2)] }
    }

    #[inline(always)]
    fn limit(nearest: &Best) -> f32 {
        nearest.high
    }

    #[inline(always)]
    fn closest(blocks: &[Self], index: u32, ray: &TriangleRay, best: &mut Best, _: &mut Stack) {
        let meetings = Self::meetings(blocks, index, ray);
        if meetings.candidates != 0 {
            Self::take_closest::<true>(blocks, index, ray, &Lanes::new(&meetings, ray, best.high), best);
        }
    }

    #[inline(always)]
    fn any(blocks: &[Self], index: u32, ray: &TriangleRay, _: &mut Stack) -> bool {
        let meetings = Self::meetings(blocks, index, ray);
        meetings.candidates != 0
            && Self::meets_any::<true>(blocks, index, ray, &Lanes::new(&meetings, ray, ray.ray.tmax))
    }
}

impl TriangleBlock {
    /// Which a ray may meet.
    #[inline(always)]
    pub(super) fn meetings(blocks: &[Self], index: u32, ray: &TriangleRay) -> Meetings {
        let block = &blocks[index as usize];
        let mut meetings = ray.sheared.meet4(&block.rows);
        meetings.candidates &= block.used();
        meetings
    }

    /// The name of the triangle in a lane.
    #[inline(always)]
    fn id(&self, lane: usize) -> Hit {
        // As arrays: to index a vector is a chain of branches.
        let rows: &[[[u32; BLOCK_SIZE]; 4]; 3] = bytemuck::cast_ref(&self.rows);
        Hit { shape: rows[0][MORE][lane], primitive: rows[1][MORE][lane] }
    }

    /// The lanes in use, a bit each.
    #[inline(always)]
    fn used(&self) -> u32 {
        self.rows[2][MORE].x.to_bits()
    }

    /// The vertices, and more.
    #[inline(always)]
    pub(super) fn rows(&self) -> &FourTriangles {
        &self.rows
    }

    /// The lanes in use that hold none of these triangles, a bit each.
    #[inline(always)]
    pub(super) fn others<const ENDS: usize, S: Simd>(&self, simd: S, ends: &[Hit; ENDS]) -> u32 {
        let shapes = u32x4::from_slice(simd, bytemuck::cast_slice(&self.rows[0][MORE..]));
        let primitives = u32x4::from_slice(simd, bytemuck::cast_slice(&self.rows[1][MORE..]));
        let mut own = shapes.simd_eq(ends[0].shape) & primitives.simd_eq(ends[0].primitive);
        for end in &ends[1..] {
            own |= shapes.simd_eq(end.shape) & primitives.simd_eq(end.primitive);
        }
        self.used() & !(own.to_bitmask() as u32)
    }

    /// [`Block::closest`] of those that may be nearer; they may be the ray's `OWN`.
    #[inline(always)]
    pub(super) fn take_closest<const OWN: bool>(
        blocks: &[Self],
        index: u32,
        ray: &TriangleRay,
        lanes: &Lanes,
        best: &mut Best,
    ) {
        let (low, high) = (lanes.low.to_array(), lanes.high.to_array());
        let mut rest = lanes.rest;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % BLOCK_SIZE;
            rest &= rest - 1;
            if OWN && ray.leaves(blocks[index as usize].id(lane)) {
                continue;
            }
            let place = index * BLOCK_SIZE as u32 + lane as u32;
            if lanes.certain >> lane & 1 == 1 && high[lane] < best.low {
                *best = Best { low: low[lane], high: high[lane], place };
            } else if low[lane] > best.high {
                // Beyond what this block itself has brought.
            } else {
                settle(blocks, place, &ray.ray, best);
            }
        }
    }

    /// [`Block::any`] of those that may be met; they may be the ray's `OWN`.
    #[inline(always)]
    pub(super) fn meets_any<const OWN: bool>(blocks: &[Self], index: u32, ray: &TriangleRay, lanes: &Lanes) -> bool {
        let high = lanes.high.to_array();
        let mut rest = lanes.rest;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % BLOCK_SIZE;
            rest &= rest - 1;
            if OWN && ray.leaves(blocks[index as usize].id(lane)) {
                continue;
            }
            let is_certain = lanes.certain >> lane & 1 == 1 && high[lane] < ray.ray.tmax;
            if is_certain || meets_exactly(blocks, index * BLOCK_SIZE as u32 + lane as u32, &ray.ray) {
                return true;
            }
        }
        false
    }
}

/// Whether the ray meets a triangle inside its interval.
#[cold]
#[inline(never)]
fn meets_exactly(blocks: &[TriangleBlock], place: u32, ray: &Ray) -> bool {
    exact_distance(blocks, place, ray).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::Quality;
    use crate::accel::native::{is_mesh, items};
    use crate::math::simd;
    use crate::shape::TriangleMesh;
    use fearless_simd::Level;

    /// 20,000 rays and segments through 3,000 triangles of very different sizes, some of them twice, some of them flat or
    /// without area: every instruction set, and rays in turn as rays one by one, give the same answers.
    #[test]
    fn all_levels_agree() {
        let mut state = 7u64;
        let mut unit = || {
            state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let mut point = || Vec3::new(unit(), unit(), unit()) - 0.5;
        let mut mesh = TriangleMesh::default();
        for i in 0..3000u32 {
            let size = [1.0, 0.1, 0.01][i as usize % 3];
            let (a, b, c) = (point(), size * point(), size * point());
            let again = mesh.positions.len().saturating_sub(3);
            match i % 50 {
                0 if again > 0 => mesh.positions.extend_from_within(again..),
                1 => mesh.positions.extend([a, a + b, a + 2.0 * b]),
                2 => mesh.positions.extend([a, a + b * Vec3::new(1.0, 1.0, 0.0), a + c * Vec3::new(1.0, 1.0, 0.0)]),
                _ => mesh.positions.extend([a, a + b, a + c]),
            }
            mesh.faces.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        let shapes = [Shape::Mesh(mesh)];
        let rays: Vec<Ray> = (0..20_000)
            .map(|i| {
                let (o, d) = (2.0 * point(), point());
                match i % 4 {
                    0 => Ray::segment(o, d),
                    1 => Ray::new(o, Vec3::new(0.0, 0.0, d.z)),
                    _ => Ray::new(o, d),
                }
            })
            .collect();
        let build = || {
            Tree::<TriangleBlock>::build(items(&shapes, is_mesh), &shapes[..], Quality::High)
                .expect("there are triangles")
        };
        let answers = |level: Level, from: &[Hit]| {
            let tree = build().at_level(level);
            let mut hits = vec![Nearest { t: 0.0, hit: Hit::NONE }; rays.len()];
            tree.closest_hits(&rays, from, |i, best| hits[i] = tree.nearest(&rays[i], best));
            let hits: Vec<(u32, Hit)> = hits.iter().map(|nearest| (nearest.t.to_bits(), nearest.hit)).collect();
            let ends: Vec<[Hit; 2]> = from.iter().map(|&from| [Hit::NONE, from]).collect();
            let mut occluded = vec![false; rays.len()];
            tree.occluded_all(&rays, &ends, &mut occluded);
            (hits, occluded)
        };
        let (first, occluded) = answers(Level::baseline(), &[]);
        let met = first.iter().filter(|(_, hit)| hit.is_some()).count();
        assert!(met > 5_000 && met < 19_000, "{met}");
        assert!(first.iter().zip(&occluded).all(|((_, hit), &occluded)| hit.is_some() == occluded));
        let from: Vec<Hit> = first.iter().map(|&(_, hit)| hit).collect();
        let without = answers(Level::baseline(), &from);
        for level in simd::levels() {
            assert!(answers(level, &[]) == (first.clone(), occluded.clone()), "{}", simd::name(level));
            assert!(answers(level, &from) == without, "{}", simd::name(level));
        }
    }
}
