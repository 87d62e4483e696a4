//! The line of a ray in f32, and what it says of four triangles at once: which it may meet, and bounds of how far they are.
//!
//! The same test is here twice, to the same bits: with a vector of four for each number of a vertex, and with vectors of sixteen
//! that hold a number of all three vertices, which needs a third of the instructions.
//!
//! # Bounds of the distance
//!
//! Which of two triangles is nearer, or that one lies in the interval, can mostly be said without it: [`Meetings::distances`]
//! bounds it in f32. Let p be the rounded sheared vertices, P their largest coordinate, z the depths, Z the difference of the
//! largest and the least, M ≥ |v − o|, eᵢ the edge functions and D their sum, e and D as computed from p. The computed
//! depth is T/D, T = Σ eᵢ·zᵢ. Against the depth that [`super`] describes it is off by
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

use super::edge_functions;
use crate::math::float::UNIT_ROUNDOFF;
use crate::math::ray::Ray;
#[cfg(target_arch = "x86_64")]
use fearless_simd::{f32x16, prelude::*};
use glam::{Vec3, Vec4};
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;

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

/// The lanes of a [row](FourTriangles) that are of triangles.
#[cfg(target_arch = "x86_64")]
const USED: u16 = 0x0FFF;

/// Takes to each quarter of a vector the next one of the three.
#[cfg(target_arch = "x86_64")]
const NEXT: i32 = 0b11_00_10_01;

/// Four triangles: for each axis of the world the coordinates of first, second and third vertices, a lane each, and four numbers
/// more that nobody looks at.
pub type FourTriangles = [[Vec4; 4]; 3];

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

/// What the test in f32 says of four triangles. The last vector of each four means nothing.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Meetings {
    /// The edge functions of the edges from first to second vertices, from second to third and from third to first.
    edges: [Vec4; 4],
    /// v.z − o.z.
    depths: [Vec4; 4],
    /// The larger of the sizes of the sheared x' and y' of each vertex.
    sizes: [Vec4; 4],
    /// The lanes where no two edge functions have certainly opposite signs, one bit each; those with a NaN may be among
    /// them.
    pub candidates: u32,
    /// The lanes where no edge function is 0 or not a number; for others f64 must decide.
    pub certain: u8,
}

impl Meetings {
    /// With no triangle.
    pub const NONE: Self =
        Self { edges: [Vec4::ZERO; 4], depths: [Vec4::ZERO; 4], sizes: [Vec4::ZERO; 4], candidates: 0, certain: 0 };

    /// For each candidate what its distance is not below, and not above, in units of the direction, if the ray meets it (which
    /// is sure if it is [certain](Self::certain)); NaN or infinite where nothing can be said. See the head.
    #[inline(always)]
    pub fn distances(&self, ray: &ShearedRay) -> [Vec4; 2] {
        let [e2, e0, e1, _] = self.edges;
        let [z0, z1, z2, _] = self.depths;
        let near = z0.min(z1).min(z2);
        let far = z0.max(z1).max(z2);
        let largest = self.sizes[0].max(self.sizes[1]).max(self.sizes[2]);
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

/// The axes of the space that is sheared for direction `d`.
#[inline(always)]
pub(super) fn axes(d: Vec3) -> [usize; 3] {
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
        // As arrays: to index a vector is a chain of branches. As one that is there already, instead of copies.
        let [o, d]: &[[f32; 4]; 2] = bytemuck::cast_ref(ray);
        let is_tame = (d[z].abs() > LEAST_DEPTH) & (d[z].abs() < MOST_DEPTH);
        let depth = if is_tame { d[z] } else { f32::NAN };
        Self { axes, origin: [o[x], o[y], o[z]], shear: [d[x] / d[z], d[y] / d[z]], depth }
    }

    /// The sheared (x', y') of the vertices of a triangle.
    pub(super) fn shear(&self, v: [Vec3; 3]) -> [[f32; 2]; 3] {
        let Self { axes: [x, y, z], origin: [ox, oy, oz], shear: [sx, sy], .. } = *self;
        v.map(|v| [(v[x] - ox) - sx * (v[z] - oz), (v[y] - oy) - sy * (v[z] - oz)])
    }

    /// The same of the vertices of four, and their depths.
    #[inline(always)]
    fn shear4(&self, v: &FourTriangles) -> ([[Vec4; 2]; 3], [Vec4; 3]) {
        let Self { axes: [x, y, z], origin: [ox, oy, oz], shear: [sx, sy], .. } = *self;
        let depths = [v[z][0] - oz, v[z][1] - oz, v[z][2] - oz];
        let mut p = [[Vec4::ZERO; 2]; 3];
        // Not by `map`, whose closure would not be compiled for the caller's instruction set, nor inlined.
        for i in 0..3 {
            p[i] = [(v[x][i] - ox) - sx * depths[i], (v[y][i] - oy) - sy * depths[i]];
        }
        (p, depths)
    }

    /// The test of four triangles at once.
    #[inline(always)]
    pub fn meet4(&self, v: &FourTriangles) -> Meetings {
        let (p, [z0, z1, z2]) = self.shear4(v);
        let [e0, e1, e2] = edge_functions(&p);
        let negative = e0.cmplt(Vec4::ZERO) | e1.cmplt(Vec4::ZERO) | e2.cmplt(Vec4::ZERO);
        let positive = e0.cmpgt(Vec4::ZERO) | e1.cmpgt(Vec4::ZERO) | e2.cmpgt(Vec4::ZERO);
        let [a, b, c] = [e0.abs(), e1.abs(), e2.abs()];
        let certain = a.cmpgt(Vec4::ZERO) & b.cmpgt(Vec4::ZERO) & c.cmpgt(Vec4::ZERO);
        let size = |p: [Vec4; 2]| p[0].abs().max(p[1].abs());
        Meetings {
            edges: [e2, e0, e1, Vec4::ZERO],
            depths: [z0, z1, z2, Vec4::ZERO],
            sizes: [size(p[0]), size(p[1]), size(p[2]), Vec4::ZERO],
            candidates: !(negative & positive).bitmask() & 0b1111,
            certain: certain.bitmask() as u8,
        }
    }
}

#[cfg(target_arch = "x86_64")]
fearless_simd::kernel!(
    /// [`ShearedRay::meet4`] with vectors of sixteen.
    #[inline(always)]
    pub fn meet4_avx512(simd: Avx512, ray: &ShearedRay, v: &FourTriangles) -> Meetings {
        let [x, y, z] = ray.axes;
        let ([ox, oy, oz], [sx, sy]) = (&ray.origin, &ray.shear);
        let all = |x: &f32| _mm512_set1_ps(*x);
        let row = |row: &[Vec4; 4]| f32x16::from_slice(simd, bytemuck::cast_slice(row)).into();
        // What is more than triangles is no number, and might take long.
        let depths = _mm512_maskz_sub_ps(USED, row(&v[z]), all(oz));
        let px = _mm512_sub_ps(_mm512_maskz_sub_ps(USED, row(&v[x]), all(ox)), _mm512_mul_ps(all(sx), depths));
        let py = _mm512_sub_ps(_mm512_maskz_sub_ps(USED, row(&v[y]), all(oy)), _mm512_mul_ps(all(sy), depths));
        let (qx, qy) = (_mm512_shuffle_f32x4::<NEXT>(px, px), _mm512_shuffle_f32x4::<NEXT>(py, py));
        let edges = _mm512_sub_ps(_mm512_mul_ps(qx, py), _mm512_mul_ps(qy, px));
        let negative = u32::from(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(edges, _mm512_setzero_ps()));
        let positive = u32::from(_mm512_cmp_ps_mask::<_CMP_GT_OQ>(edges, _mm512_setzero_ps()));
        let sizes = _mm512_max_ps(_mm512_abs_ps(px), _mm512_abs_ps(py));
        let any = |lanes: u32| lanes | lanes >> 4 | lanes >> 8;
        let certain = negative | positive;
        let quarters = |v: __m512| bytemuck::cast::<[f32; 16], [Vec4; 4]>(f32x16::simd_from(simd, v).into());
        Meetings {
            edges: quarters(edges),
            depths: quarters(depths),
            sizes: quarters(sizes),
            candidates: !(any(negative) & any(positive)) & 0b1111,
            certain: (certain & certain >> 4 & certain >> 8) as u8 & 0b1111,
        }
    }
);

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use fearless_simd::Level;

    /// 100,000 rays and four triangles each, of sizes from 2⁻⁶⁴ to 2⁶⁴, some in line, some with a vertex at the origin: vectors of
    /// sixteen say the same as vectors of four, to the bit.
    #[test]
    fn both_ways_give_the_same_bits() {
        let Some(simd) = Level::new().as_avx512() else { return };
        let mut state = 11u64;
        let mut unit = || {
            state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
            (state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
        };
        let mut met = 0;
        for i in 0..100_000u32 {
            let scale = 2f32.powi(i as i32 % 129 - 64);
            let mut point = || scale * Vec3::new(unit(), unit(), unit());
            let ray = ShearedRay::new(&Ray::new(if i % 7 == 0 { Vec3::ZERO } else { point() }, point()));
            let mut triangles = [[Vec4::splat(f32::from_bits(i)); 4]; 3];
            for lane in 0..4 {
                let (a, b, c) = (point(), point(), point());
                let corners = [a, b, if i % 5 == 0 { a + b } else { c }];
                for (axis, row) in triangles.iter_mut().enumerate() {
                    for (vertices, corner) in row.iter_mut().zip(corners) {
                        vertices[lane] = corner[axis];
                    }
                }
            }
            let (four, sixteen) = (ray.meet4(&triangles), meet4_avx512(simd, &ray, &triangles));
            let parts = |m: &Meetings| {
                let vectors =
                    [&m.edges, &m.depths, &m.sizes].map(|v| [v[0], v[1], v[2]].map(|v| v.to_array().map(f32::to_bits)));
                (m.candidates, m.certain, vectors)
            };
            assert_eq!(parts(&four), parts(&sixteen));
            met += four.candidates.count_ones();
        }
        assert!(met > 10_000, "{met}");
    }
}
