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

mod sheared;

use crate::math::ray::{DRay, Line, Ray};
use glam::{DVec3, DVec4, Vec3, Vec4};
use sheared::axes;
#[cfg(target_arch = "x86_64")]
pub use sheared::meet4_avx512;
pub use sheared::{FourTriangles, Meetings, ShearedRay};

/// The number of unit roundoffs of the largest coordinate of v − o that a sheared vertex may be off by.
pub const SHEAR_ROUNDINGS: u32 = 6;

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
        let p = self.sheared.shear([v0, v1, v2]);
        let e = edge_functions(&p);
        let (negative, positive) = (e.iter().any(|&e| e < 0.0), e.iter().any(|&e| e > 0.0));
        if negative && positive {
            return None;
        }
        let certain = e.iter().all(|e| e.abs() > 0.0);
        if !certain && !crosses_in_f64(p.map(|p| p.map(f64::from))) {
            return None;
        }
        let t = self.exact.resolve([v0, v1, v2].map(|v| v.to_array().map(f64::from))).t;
        (t > self.exact.tmin && t < self.exact.tmax).then_some(t as f32)
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
            let row = |axis: usize| [a[axis], b[axis], c[axis], f32::NAN].map(Vec4::splat);
            let meetings = watertight.sheared.meet4(&[row(0), row(1), row(2)]);
            if meetings.candidates == 0 || meetings.certain != 0b1111 {
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
