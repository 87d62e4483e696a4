//! How a ray meets a triangle: one watertight decision in f32, and the point of a known hit in f64.
//!
//! # The test
//!
//! After Woop, Benthin and Wald 2013, *Watertight Ray/Triangle Intersection* (section 3). Let z be the axis along which
//! the direction is longest, x and y the others. Vertices are moved so that the ray's origin is at 0 and sheared so that
//! the ray is the z axis: x' = (v.x − o.x) − (d.x/d.z)·(v.z − o.z), and y' likewise. The ray crosses the triangle where
//! the origin of the plane (x', y') lies in the projected triangle, that is where the three edge functions
//! U = x'₂·y'₁ − y'₂·x'₁ and so on have no two opposite signs.
//!
//! *Why no ray slips through a shared edge.* A vertex is sheared by itself: all triangles around it see the same
//! rounded (x', y'). Of these rounded points the sign of each edge function is exact: rounding is monotone, so the
//! difference of two rounded products has the sign of the exact difference or is 0; 0 (and NaN, where a product
//! overflowed) is decided again in f64, where products of two f32 are exact. So the test is an exact one of a slightly
//! moved mesh, the same for all its triangles. `mul_add` would round the two products differently and break this.
//!
//! *How far the vertices are moved.* With u the unit roundoff and M the largest |v − o| of any coordinate, the two
//! differences, the quotient d.x/d.z (at most 1), the product and the last difference give at most
//! u·|v.x − o.x| + 3u·|v.z − o.z| + u·(|v.x − o.x| + |v.z − o.z|) ≤ 6·u·M, to first order ([`SHEAR_ROUNDINGS`]).
//!
//! # The distance
//!
//! It is always computed in f64, by [`resolve`], for the few triangles that pass the test: a grazing ray would otherwise
//! take the triangle it left for one that it meets. It is the depth of the point of the triangle that is nearest to the
//! ray in the sheared plane: where the ray truly crosses the triangle, the crossing; where it only crosses the rounded
//! one, a point at most 6·u·M beside the ray. This is what lets the boxes of `accel::native` be conservative, and it
//! makes the interval test exact for the f32 inputs, but for the rounding of f64.
//!
//! # Bounds of the distance
//!
//! Which of two triangles is nearer, or that one lies in the interval, can mostly be said without it: [`Meetings::distances`]
//! bounds it in f32. Let p be the rounded sheared vertices, P their largest coordinate, z the depths, Z the difference of the
//! largest and the least, M ≥ |v − o|, eᵢ the edge functions and D their sum, e and D as computed from p. The computed
//! depth is T/D, T = Σ eᵢ·zᵢ. Against the depth of the head it is off by
//! * what the roundings of e do to the barycentrics e/D: an edge function is off by 4·u·P², D by 20·u·P² (|D| ≤ 4·P² but for
//!   rounding), so that the three are off by 32·u·P²/|D| together, and P ≤ 2·M;
//! * what moving the vertices does to them: the point of the exact triangle is at most (6·√2 + 6)·u·M, in each
//!   coordinate, from the one with the barycentrics of the rounded triangle, and in a triangle of edges up to 2·√2·P this
//!   moves each barycentric by at most 58·u·M·P/|D|;
//! * 16·u·M for the roundings of z, T, the quotients, the sum of the barycentrics and of the bounds.
//!
//! Barycentrics sum to 1, so their errors weigh differences of depths, that is at most Z. Where |D| > 512·u·M·P, the true |D|
//! are above 0.73 of the computed one, and both errors are below 314·u·M·P·Z/|D|; elsewhere 512·u·M·P/|D| exceeds 1, and
//! a depth is between the least and the largest anyway. So 512·u·M·P·Z/|D| + 16·u·M ([`BARYCENTRIC_ROUNDINGS`],
//! [`DEPTH_ROUNDINGS`]) bounds the error always, unless something overflows or loses its digits ([`LEAST_TAME`]): there the
//! bounds are infinite or not numbers, which decides nothing.

use crate::math::float::UNIT_ROUNDOFF;
use crate::math::ray::{DRay, Line, Ray};
use glam::{DVec3, DVec4, Vec3, Vec4};

/// The number of unit roundoffs of the largest coordinate of v − o that a sheared vertex may be off by.
pub const SHEAR_ROUNDINGS: u32 = 6;

/// Bound on the error of the barycentrics of [`Meetings::distances`], in unit roundoffs of M·P/|D|: see the head.
const BARYCENTRIC_ROUNDINGS: f32 = 512.0;

/// The same of depths, in unit roundoffs of M.
const DEPTH_ROUNDINGS: f32 = 16.0;

/// Where |D| is above this, M below [`MOST_TAME`] and |d.z| between [`LEAST_DEPTH`] and [`MOST_DEPTH`], nothing that
/// [`Meetings::distances`] computes overflows, but for the bounds themselves, or loses digits that count: |D| ≤ 16·M² is below
/// 2⁸⁴, |D·d.z| below 2¹¹⁴ and above 2⁻⁹⁰, |T| below 2¹²⁴; P² ≥ |D|/4, so P and M exceed 2⁻³², and an absolute error of 2⁻¹⁴⁹
/// divided by |D| is below 2⁻⁸⁹, far below u·M.
const LEAST_TAME: f32 = 1.0 / (1u64 << 60) as f32;

/// See [`LEAST_TAME`].
const MOST_TAME: f32 = (1u64 << 40) as f32;

/// See [`LEAST_TAME`].
const LEAST_DEPTH: f32 = 1.0 / (1u64 << 30) as f32;

/// See [`LEAST_TAME`].
const MOST_DEPTH: f32 = (1u64 << 30) as f32;

/// A projected area below this fraction of the square of its size counts as none in [`resolve`]: of a triangle seen so
/// much edge-on, the crossing is sought on its edges. Barycentrics have an error of about 2⁻⁵⁰/fraction and leaving out
/// the interior one of about the fraction; 2⁻²⁵ makes both half an ulp of f32.
const EDGE_ON: f64 = 1.0 / (1u64 << 25) as f64;

/// A ray, prepared for the triangle test.
#[derive(Clone, Copy, Debug)]
pub struct WatertightRay {
    sheared: ShearedRay,
    /// The same in f64, and the interval.
    exact: ExactRay,
}

/// The line of a ray, as the test in f32 reads it.
#[derive(Clone, Copy, Debug)]
pub struct ShearedRay {
    /// x, y and z of the sheared space, as axes of the world; z is the dominant one.
    pub axes: [usize; 3],
    /// The origin, in the order of `axes`.
    pub origin: [f32; 3],
    /// d.x/d.z and d.y/d.z.
    pub shear: [f32; 2],
    /// d.z where it is not so small or large that a product or quotient with it might overflow or lose digits: there, not a
    /// number.
    pub depth: f32,
}

/// What the test in f32 says of four triangles.
#[derive(Clone, Copy, Debug)]
pub struct Meetings {
    /// The lanes where no two edge functions have certainly opposite signs, one bit each; those with a NaN may be among
    /// them.
    pub candidates: u32,
    /// The sheared (x', y').
    p: [[Vec4; 2]; 3],
    edges: Edges<Vec4>,
    /// v.z − o.z.
    depths: [Vec4; 3],
}

impl Meetings {
    /// With no triangle.
    pub const NONE: Self =
        Self { candidates: 0, p: [[Vec4::ZERO; 2]; 3], edges: [Vec4::ZERO; 3], depths: [Vec4::ZERO; 3] };

    /// The lanes where an edge function is 0 or not a number, so that f64 must decide.
    #[inline(always)]
    pub fn on_rim(&self) -> u32 {
        let [a, b, c] = [self.edges[0].abs(), self.edges[1].abs(), self.edges[2].abs()];
        !(a.cmpgt(Vec4::ZERO) & b.cmpgt(Vec4::ZERO) & c.cmpgt(Vec4::ZERO)).bitmask() & 0b1111
    }

    /// For each candidate what its distance is not below, and not above, in units of the direction, if the ray meets it (which
    /// is certain unless it is [on the rim](Self::on_rim)); NaN or infinite where nothing can be said. See the head.
    #[inline(always)]
    pub fn distances(&self, ray: &ShearedRay) -> [Vec4; 2] {
        let [e0, e1, e2] = self.edges;
        let [z0, z1, z2] = self.depths;
        let [[ax, ay], [bx, by], [cx, cy]] = self.p;
        let near = z0.min(z1).min(z2);
        let far = z0.max(z1).max(z2);
        let largest = ax.abs().max(ay.abs()).max(bx.abs().max(by.abs())).max(cx.abs().max(cy.abs()));
        let reach = largest + far.max(-near);
        let sum = e0 + e1 + e2;
        let area = sum.abs();
        let roundings = UNIT_ROUNDOFF * reach;
        // Times |D|.
        let error = (BARYCENTRIC_ROUNDINGS * roundings) * largest * (far - near) + (DEPTH_ROUNDINGS * roundings) * area;
        let scale = 1.0 / (sum * ray.depth);
        let is_tame = area.cmpgt(Vec4::splat(LEAST_TAME)) & reach.cmplt(Vec4::splat(MOST_TAME));
        let error = Vec4::select(is_tame, error * scale.abs(), Vec4::INFINITY);
        let t = (e0 * z0 + e1 * z1 + e2 * z2) * scale;
        [t - error, t + error]
    }
}

/// What the computations in f64 need.
#[derive(Clone, Copy, Debug)]
struct ExactRay {
    /// x, y and z of the sheared space, as axes of the world; z is the dominant one.
    axes: [usize; 3],
    /// In the order of `axes`.
    origin: [f64; 3],
    /// d.x/d.z and d.y/d.z.
    shear: [f64; 2],
    /// 1/d.z.
    depth: f64,
    tmin: f64,
    tmax: f64,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Barycentric coordinates: none negative, their sum is 1 up to rounding.
    pub b: [f64; 3],
    /// Distance in units of the ray's direction.
    pub t: f64,
}

/// The values of the three edge functions, opposite v0, v1 and v2.
type Edges<T> = [T; 3];

impl WatertightRay {
    /// Prepares `ray`, whose direction is not zero.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        Self { sheared: ShearedRay::new(ray), exact: ExactRay::new(ray) }
    }

    /// Distance to the triangle in units of the direction, rounded from f64, where the ray meets it (from either side)
    /// inside its open interval.
    #[inline]
    pub fn intersect(&self, v0: Vec3, v1: Vec3, v2: Vec3) -> Option<f32> {
        let mut distance = None;
        self.intersect4(
            &[v0, v1, v2].map(|v| v.to_array().map(Vec4::splat)),
            |_| true,
            |_, t| {
                distance = Some(t);
                true
            },
        );
        distance
    }

    /// [`Self::intersect`] for four triangles at once, stored as `v[vertex][axis]` with a lane each. Calls `on_hit` with
    /// the lane and the distance of each hit until it returns true; returns whether it did. Lanes that are not `wanted`
    /// are no hits.
    #[inline(always)]
    pub fn intersect4(
        &self,
        v: &[[Vec4; 3]; 3],
        wanted: impl Fn(usize) -> bool,
        mut on_hit: impl FnMut(usize, f32) -> bool,
    ) -> bool {
        let Meetings { mut candidates, p, edges, .. } = self.sheared.meet4(v);
        while candidates != 0 {
            let lane = candidates.trailing_zeros() as usize;
            candidates &= candidates - 1;
            if !wanted(lane) {
                continue;
            }
            let certain = edges.iter().all(|e| e[lane].abs() > 0.0);
            if !certain && !crosses_in_f64(p.map(|p| p.map(|c| f64::from(c[lane])))) {
                continue;
            }
            let vertex = |v: &[Vec4; 3]| [f64::from(v[0][lane]), f64::from(v[1][lane]), f64::from(v[2][lane])];
            let t = self.exact.resolve([vertex(&v[0]), vertex(&v[1]), vertex(&v[2])]).t;
            if t > self.exact.tmin && t < self.exact.tmax && on_hit(lane, t as f32) {
                return true;
            }
        }
        false
    }
}

/// The edge functions of sheared triangles. The two triangles at an edge get exactly opposite values, for the products
/// are the same.
#[inline(always)]
fn edge_functions<T>(p: &[[T; 2]; 3]) -> Edges<T>
where
    T: Copy + std::ops::Mul<Output = T> + std::ops::Sub<Output = T>,
{
    let edge = |a: [T; 2], b: [T; 2]| b[0] * a[1] - b[1] * a[0];
    [edge(p[1], p[2]), edge(p[2], p[0]), edge(p[0], p[1])]
}

/// The lanes where no two edge functions have certainly opposite signs, one bit each; those with a NaN may be among them.
#[inline(always)]
fn candidates(e: &Edges<Vec4>) -> u32 {
    let negative = e[0].cmplt(Vec4::ZERO) | e[1].cmplt(Vec4::ZERO) | e[2].cmplt(Vec4::ZERO);
    let positive = e[0].cmpgt(Vec4::ZERO) | e[1].cmpgt(Vec4::ZERO) | e[2].cmpgt(Vec4::ZERO);
    !(negative & positive).bitmask() & 0b1111
}

/// Whether the origin lies in the triangle of these sheared vertices, which are f32, or on its rim, exactly.
#[cold]
fn crosses_in_f64(p: [[f64; 2]; 3]) -> bool {
    crosses(p)
}

/// Whether no two of the edge functions of these sheared vertices have opposite signs; false for a triangle without area. The
/// signs are exact.
#[inline]
fn crosses(p: [[f64; 2]; 3]) -> bool {
    let mut e = edge_functions(&p);
    if e.contains(&0.0) {
        e = [edge_sign(p[1], p[2], e[0]), edge_sign(p[2], p[0], e[1]), edge_sign(p[0], p[1], e[2])];
    }
    let negative = e.iter().any(|&e| e < 0.0);
    let positive = e.iter().any(|&e| e > 0.0);
    negative != positive
}

/// A number with the sign of the edge function of a and b, which is rounded to `e`. Products that round to different numbers are in
/// their order; of equal ones, what each was rounded by decides, which a fused operation tells exactly. (Without it, all
/// that lies in the plane of a triangle crosses it, as far beside it as it may be.)
#[cold]
fn edge_sign(a: [f64; 2], b: [f64; 2], e: f64) -> f64 {
    if e != 0.0 {
        return e;
    }
    let (p, q) = (b[0] * a[1], b[1] * a[0]);
    b[0].mul_add(a[1], -p) - b[1].mul_add(a[0], -q)
}

/// The axes of the space that is sheared for direction `d`.
#[inline(always)]
fn axes(d: Vec3) -> [usize; 3] {
    /// In the order of the dominant one.
    const AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];
    let size = d.abs();
    // No branches: which it is cannot be foreseen.
    let others = 2 - usize::from(size.y > size.z);
    AXES[if (size.x > size.y) & (size.x > size.z) { 0 } else { others }]
}

impl ShearedRay {
    /// Prepares the line of `ray`, whose direction is not zero.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        let axes = axes(ray.d);
        let [x, y, z] = axes;
        // As arrays: to index a vector is a chain of branches.
        let (o, d) = (ray.o.to_array(), ray.d.to_array());
        let is_tame = (d[z].abs() > LEAST_DEPTH) & (d[z].abs() < MOST_DEPTH);
        let depth = if is_tame { d[z] } else { f32::NAN };
        Self { axes, origin: [o[x], o[y], o[z]], shear: [d[x] / d[z], d[y] / d[z]], depth }
    }

    /// The test of four triangles at once, stored as `v[vertex][axis]` with a lane each.
    #[inline(always)]
    pub fn meet4(&self, v: &[[Vec4; 3]; 3]) -> Meetings {
        let Self { axes: [x, y, z], origin: [ox, oy, oz], shear: [sx, sy], .. } = *self;
        let depths = [v[0][z] - oz, v[1][z] - oz, v[2][z] - oz];
        // Not by `map`, whose closure would not be compiled for the caller's instruction set, nor inlined.
        let shear = |v: &[Vec4; 3], depth: Vec4| [(v[x] - ox) - sx * depth, (v[y] - oy) - sy * depth];
        let p = [shear(&v[0], depths[0]), shear(&v[1], depths[1]), shear(&v[2], depths[2])];
        let edges = edge_functions(&p);
        Meetings { candidates: candidates(&edges), p, edges, depths }
    }
}

impl ExactRay {
    #[inline(always)]
    fn new(ray: &impl Line) -> Self {
        let (o, d) = (ray.origin(), ray.direction());
        // Which is the dominant component need not be decided in f64.
        let axes = axes(d.as_vec3());
        let d = axes.map(|axis| d[axis]);
        let depth = 1.0 / d[2];
        let [tmin, tmax] = ray.interval();
        Self { axes, origin: axes.map(|axis| o[axis]), shear: [d[0] * depth, d[1] * depth], depth, tmin, tmax }
    }

    /// See [`resolve`]; `v[vertex][axis]`.
    #[inline(always)]
    fn resolve(&self, v: [[f64; 3]; 3]) -> TriangleHit {
        let (p, depth) = self.shear(v);
        self.locate(&p, depth)
    }

    /// The sheared (x', y') of the vertices, and their depths.
    #[inline(always)]
    fn shear(&self, v: [[f64; 3]; 3]) -> ([[f64; 2]; 3], [f64; 3]) {
        let [x, y, z] = self.axes;
        let depth = v.map(|v| v[z] - self.origin[2]);
        let mut p = [[0.0; 2]; 3];
        for i in 0..3 {
            p[i][0] = (v[i][x] - self.origin[0]) - self.shear[0] * depth[i];
            p[i][1] = (v[i][y] - self.origin[1]) - self.shear[1] * depth[i];
        }
        (p, depth)
    }

    /// The point of a sheared triangle that is nearest to the ray.
    #[inline(always)]
    fn locate(&self, p: &[[f64; 2]; 3], depth: [f64; 3]) -> TriangleHit {
        let e = edge_functions(p);
        let size = p.iter().flatten().fold(0.0, |m: f64, c| if c.abs() > m { c.abs() } else { m });
        let area = e[0] + e[1] + e[2];
        let inside = (e[0] >= 0.0 && e[1] >= 0.0 && e[2] >= 0.0) || (e[0] <= 0.0 && e[1] <= 0.0 && e[2] <= 0.0);
        let b = if inside && area.abs() > EDGE_ON * size * size {
            let inverse = 1.0 / area;
            [e[0] * inverse, e[1] * inverse, e[2] * inverse]
        } else {
            nearest_on_rim(p)
        };
        TriangleHit { b, t: (b[0] * depth[0] + b[1] * depth[1] + b[2] * depth[2]) * self.depth }
    }
}

/// A ray in f64 coordinates, prepared for the test of triangles with f32 vertices.
///
/// It is the test of [`WatertightRay`] with f64 in place of f32, and so watertight for the same reason: where an edge
/// function is 0, be it by rounding, both triangles at the edge are met.
#[derive(Clone, Copy, Debug)]
pub struct ExactWatertightRay(ExactRay);

impl ExactWatertightRay {
    /// Prepares `ray`.
    #[inline]
    pub fn new(ray: &DRay) -> Self {
        Self(ExactRay::new(ray))
    }

    /// Those of four triangles, stored as `v[vertex][axis]` with a lane each, where no two edge functions have certainly opposite
    /// signs, a bit each: all others [`Self::intersect`] does not find.
    #[inline(always)]
    pub fn crosses4(&self, v: &[[Vec4; 3]; 3]) -> u32 {
        let Self(ExactRay { axes: [x, y, z], origin: [ox, oy, oz], shear: [sx, sy], .. }) = *self;
        let sheared = |v: &[Vec4; 3]| {
            let depth = v[z].as_dvec4() - oz;
            [(v[x].as_dvec4() - ox) - sx * depth, (v[y].as_dvec4() - oy) - sy * depth]
        };
        let e = edge_functions(&[sheared(&v[0]), sheared(&v[1]), sheared(&v[2])]);
        let negative = e[0].cmplt(DVec4::ZERO) | e[1].cmplt(DVec4::ZERO) | e[2].cmplt(DVec4::ZERO);
        let positive = e[0].cmpgt(DVec4::ZERO) | e[1].cmpgt(DVec4::ZERO) | e[2].cmpgt(DVec4::ZERO);
        !(negative & positive).bitmask() & 0b1111
    }

    /// Distance to the triangle in units of the direction, where the ray meets it (from either side) inside its open
    /// interval.
    #[inline]
    pub fn intersect(&self, v: [Vec3; 3]) -> Option<f64> {
        let (p, depth) = self.0.shear(v.map(|v| v.to_array().map(f64::from)));
        if !crosses(p) {
            return None;
        }
        let t = self.0.locate(&p, depth).t;
        (t > self.0.tmin && t < self.0.tmax).then_some(t)
    }
}

/// Barycentric coordinates of the point of the triangle's rim that is nearest to the origin.
#[cold]
fn nearest_on_rim(p: &[[f64; 2]; 3]) -> [f64; 3] {
    let mut nearest = [1.0, 0.0, 0.0];
    let mut least = f64::INFINITY;
    for i in 0..3 {
        let j = (i + 1) % 3;
        let edge = [p[j][0] - p[i][0], p[j][1] - p[i][1]];
        let length2 = edge[0] * edge[0] + edge[1] * edge[1];
        let along = -(p[i][0] * edge[0] + p[i][1] * edge[1]);
        let s = if length2 > 0.0 { (along / length2).clamp(0.0, 1.0) } else { 0.0 };
        let at = [p[i][0] + s * edge[0], p[i][1] + s * edge[1]];
        let distance2 = at[0] * at[0] + at[1] * at[1];
        if distance2 < least {
            least = distance2;
            nearest = [0.0; 3];
            nearest[i] = 1.0 - s;
            nearest[j] = s;
        }
    }
    nearest
}

/// The point at which `ray` meets a triangle that an accelerator says it meets, in f64, from the f32 vertices.
///
/// Never fails: where the ray passes beside the triangle, within rounding or not, it is the triangle's nearest point as
/// seen along the ray. The distance need not lie in the ray's interval.
#[inline(never)]
pub fn resolve(ray: &impl Line, v0: Vec3, v1: Vec3, v2: Vec3) -> TriangleHit {
    ExactRay::new(ray).resolve([v0, v1, v2].map(|v| v.to_array().map(f64::from)))
}

/// A vertex and the edges from there to the others.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) v0: DVec3,
    /// v₁ − v₀.
    pub(super) e1: DVec3,
    /// v₂ − v₀.
    pub(super) e2: DVec3,
}

/// Barycentric coordinates of [`resolve`], faster where the ray truly crosses the triangle: by Möller and Trumbore 1997,
/// *Fast, Minimum Storage Ray/Triangle Intersection*, in f64. Whatever a nearly edge-on view does to their accuracy, none
/// is negative and their sum is 1, so the point they give is a point of the triangle. `None` where the ray passes beside
/// it.
#[inline(always)]
pub(super) fn barycentrics(ray: &impl Line, &Corner { v0, e1, e2 }: &Corner) -> Option<[f64; 3]> {
    let d = ray.direction();
    let s = ray.origin() - v0;
    let p = d.cross(e2);
    let inverse = 1.0 / e1.dot(p);
    let b1 = s.dot(p) * inverse;
    let b2 = d.dot(s.cross(e1)) * inverse;
    let b0 = 1.0 - b1 - b2;
    // Also where they are not numbers.
    (b0 >= 0.0 && b1 >= 0.0 && b2 >= 0.0).then_some([b0, b1, b2])
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

    fn hit(o: [f32; 3], d: [f32; 3]) -> Option<f32> {
        WatertightRay::new(&Ray::new(o.into(), d.into())).intersect(TRIANGLE[0], TRIANGLE[1], TRIANGLE[2])
    }

    #[test]
    fn meets_inside_rim_and_corners_from_both_sides() {
        for (x, y) in [(0.25, 0.25), (0.5, 0.5), (0.0, 0.5), (0.5, 0.0), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
            assert_eq!(hit([x, y, 2.0], [0.0, 0.0, -1.0]), Some(2.0));
            assert_eq!(hit([x, y, -2.0], [0.0, 0.0, 2.0]), Some(1.0));
            assert_eq!(hit([x, y, -2.0], [0.0, 0.0, -1.0]), None);
        }
        for (x, y) in [(0.75, 0.5), (-1e-30, 0.5), (0.5, -1e-30)] {
            assert_eq!(hit([x, y, 2.0], [0.0, 0.0, -1.0]), None);
        }
    }

    #[test]
    fn edge_on_is_a_miss_and_resolves_all_the_same() {
        let ray = Ray::new(Vec3::new(-1.0, 0.25, 0.0), Vec3::X);
        assert_eq!(WatertightRay::new(&ray).intersect(TRIANGLE[0], TRIANGLE[1], TRIANGLE[2]), None);
        let TriangleHit { b, t } = resolve(&ray, TRIANGLE[0], TRIANGLE[1], TRIANGLE[2]);
        assert!((1.0..=1.75).contains(&t), "{t}");
        assert_eq!(b.iter().sum::<f64>(), 1.0);
    }

    #[test]
    fn interval_is_open() {
        let [a, b, c] = TRIANGLE;
        let ray = Ray { tmin: 2.0, ..Ray::new(Vec3::new(0.25, 0.25, 2.0), Vec3::NEG_Z) };
        assert_eq!(WatertightRay::new(&ray).intersect(a, b, c), None);
        let ray = Ray { tmin: 0.0, tmax: 2.0, ..ray };
        assert_eq!(WatertightRay::new(&ray).intersect(a, b, c), None);
        let ray = Ray { tmax: 2.0f32.next_up(), ..ray };
        assert_eq!(WatertightRay::new(&ray).intersect(a, b, c), Some(2.0));
    }

    /// 400,000 triangles near the origin, of sizes from 10⁻⁶ to 1 and down to a millionth as high as long, each with a ray at a
    /// point of it from a millionth to a thousand away, with a direction of any length: the distance in f64 is never outside
    /// of its bounds in f32, and they are finite for nearly all.
    #[test]
    fn distances_lie_within_their_bounds() {
        let mut state = 3u64;
        let mut unit = || {
            state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let (mut bounded, mut crossed) = (0, 0);
        for _ in 0..400_000 {
            let mut point = || 2.0 * Vec3::new(unit(), unit(), unit()) - 1.0;
            let (a, e, f, from, aside) = (point(), point(), point(), point(), point());
            let mut power = |least: f32, most: f32| 10f32.powf(least + (most - least) * unit());
            let (size, height, distance, length) =
                (power(-6.0, 0.0), power(-6.0, 0.0), power(-6.0, 3.0), power(-6.0, 6.0));
            let b = a + size * e;
            let c = a + size * (0.5 * e + height * f);
            let target = a + (b - a) * (0.1 + 0.4 * unit()) + (c - a) * (0.1 + 0.4 * unit());
            let ray = Ray::new(target + distance * from + 1e-3 * size * aside, -length * from);
            let watertight = WatertightRay::new(&ray);
            let meetings = watertight.sheared.meet4(&[a, b, c].map(|v| v.to_array().map(Vec4::splat)));
            if meetings.candidates == 0 || meetings.on_rim() != 0 {
                continue;
            }
            let [low, high] = meetings.distances(&watertight.sheared).map(|bound| f64::from(bound.x));
            let t = resolve(&ray, a, b, c).t;
            crossed += 1;
            bounded += u32::from(low.is_finite() && high.is_finite());
            assert!(!(t < low || t > high), "{low} {t} {high}: {:?} {ray:?}", [a, b, c]);
        }
        assert!(crossed > 100_000 && bounded > crossed / 10 * 9, "{bounded} of {crossed}");
    }

    /// A ray in the plane of a triangle, to the rounding of f64, that passes a third of its size beside it.
    #[test]
    fn what_lies_beside_in_the_plane_is_not_met() {
        let ray = DRay {
            o: DVec3::new(-1.0830913282875372, 2.684664642740074, -0.11841873927153301),
            d: DVec3::new(1.654560002015387, -2.4789389839231717, 0.49391303176389556),
            tmin: 0.0,
            tmax: f32::INFINITY,
        };
        let v = [
            Vec3::new(0.22092235, 0.23420656, 0.17124414),
            Vec3::new(-0.630731, -0.22170639, -0.4302802),
            Vec3::new(0.47744536, -0.87851465, 0.10175955),
        ];
        assert_eq!(ExactWatertightRay::new(&ray).intersect(v), None);
        // Whichever way round it is.
        assert_eq!(ExactWatertightRay::new(&ray).intersect([v[2], v[1], v[0]]), None);
    }
}
