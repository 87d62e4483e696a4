//! Sampling of one triangle, or of a few that are one light, by the solid angle in which a point near them sees their fronts.
//!
//! A triangle is chosen in proportion to its solid angle, and within it a direction uniformly, so that the density of directions
//! is one over the sum of all solid angles, whichever triangle it leads to. Backs have none, and so are never chosen. Far away,
//! where that differs little from choosing by area, points are chosen by area.
//!
//! The map from the square to a spherical triangle abc is Arvo's (1995, *Stratified Sampling of Spherical Triangles*): a part u of
//! its area E is cut off by a great circle from b to a point c' of the side ac, and a direction is found on the arc bc' with a
//! cosine that is uniform. His formulas, by angles, lose their digits where a triangle is small, and pbrt-v4 (section 6.5.4) leaves
//! those alone. Here, instead, all follows from the tangent of half the area of a triangle of which two sides and the angle α between
//! them are known,
//!
//! tan(E/2) = t·t'·sin α / (1 + t·t'·cos α), with t and t' the tangents of half the sides,
//!
//! which is Van Oosterom and Strackee's (1983, *The Solid Angle of a Plane Triangle*) tan(E/2) = a·(b×c)/(1 + a·b + b·c + c·a) if
//! it is applied to all of abc. Applied to the part abc' it says where c' is: the tangent of half the arc ac' is that of half ac times
//!
//! s = k·sin(uE/2) / (k·sin(uE/2) + r·sin((1 − u)E/2)), k = (1 + a·b)(1 + a·c), r² = 2(1 + a·b)(1 + b·c)(1 + c·a).
//!
//! No term is negative, so that no digits cancel however small the triangle is, and its largest solid angle, of 2π, is no exception.
//! (r is the hypotenuse to the two sides whose quotient is tan(E/2).) A point of the arc is then a point of the side, not by its
//! direction, which tells little where the triangle is seen edge-on, but by what of the side is on either hand of it
//! ([`part`]). So only what has to be asked of the distance to the plane is.

use crate::sampling::distribution::Discrete;
use crate::sampling::pdf::{AreaPdf, PointPdf, SolidAnglePdf};
use crate::sampling::warp;
use crate::shape::TriangleMesh;
use crate::shape::offset::SurfacePoint;
use glam::{DVec2, DVec3, Vec2};

/// Points nearer than so many times the radius of a sphere around the triangles sample them by solid angle, if the triangles
/// face much the same way. What arrives from there by area has a standard deviation of about a tenth of the mean, which is less than
/// the noise of anything that is half hidden.
const NEAR: f64 = 3.0;

/// They do if their areas, as vectors, add up to this part of their sum. Of others some of the samples by area show a back:
/// at any distance the standard deviation of a closed mesh is more than the mean.
const SAME_WAY: f64 = 0.9;

/// Some triangles.
#[derive(Clone, Debug)]
pub(super) struct Triangles {
    faces: Vec<Face>,
    areas: Discrete,
    /// One over the area of all.
    uniform: AreaPdf,
    centre: DVec3,
    /// Square of the distance from the centre below which they are sampled by solid angle.
    near_squared: f64,
}

/// A triangle.
#[derive(Clone, Copy, Debug)]
struct Face {
    corners: [DVec3; 3],
    /// Normal of the front, twice as long as the area is large.
    normal: DVec3,
}

/// A triangle as a point sees it.
struct Seen {
    /// Directions to the corners.
    corners: [DVec3; 3],
    distances: [f64; 3],
    /// Half of the solid angle.
    half: f64,
}

impl Triangles {
    /// Most triangles that are sampled by solid angle: to look at so many takes as long as to trace a ray or two.
    pub(super) const MOST: usize = 24;

    /// The triangles of a mesh; `None` where they are too many, or have no area.
    pub(super) fn of(mesh: &TriangleMesh) -> Option<Self> {
        if mesh.faces.len() > Self::MOST {
            return None;
        }
        let faces: Vec<Face> = (0..mesh.faces.len() as u32).map(|face| Face::of(mesh, face)).collect();
        let all = || faces.iter().flat_map(|face| face.corners);
        let (low, high) = all().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let centre = 0.5 * (low + high);
        let radius_squared = all().map(|v| (v - centre).length_squared()).fold(0.0, f64::max);
        let uniform = AreaPdf((1.0 / mesh.areas().sum::<f64>()) as f32);
        let together = faces.iter().map(|face| face.normal).sum::<DVec3>().length();
        let apart = faces.iter().map(|face| face.normal.length()).sum::<f64>();
        let near_squared = if together >= SAME_WAY * apart { NEAR * NEAR * radius_squared } else { f64::INFINITY };
        Some(Self { areas: Discrete::new(mesh.areas())?, faces, uniform, centre, near_squared })
    }

    /// A point of the mesh, its triangle, and the density with which it is found from `p`.
    #[inline(never)]
    pub(super) fn sample(&self, mesh: &TriangleMesh, &p: &DVec3, u: Vec2) -> (u32, SurfacePoint, PointPdf) {
        let mut halves = [0.0; Self::MOST];
        let Some(half) = self.halves(p, &mut halves) else {
            let (face, x) = self.areas.sample(u.x);
            let b = warp::square_to_triangle(Vec2::new(x, u.y)).as_dvec3().to_array();
            return (face as u32, mesh.point(face as u32, b).point, PointPdf::Area(self.uniform));
        };
        let (mut face, mut x) = (0, f64::from(u.x) * half);
        let last = halves.iter().rposition(|&h| h > 0.0).unwrap_or(0);
        while face < last && x >= halves[face] {
            x -= halves[face];
            face += 1;
        }
        let seen = self.faces[face].seen_from(p);
        let b = seen.point(DVec2::new((x / halves[face]).clamp(0.0, 1.0), u.y.into()));
        (face as u32, mesh.point(face as u32, b).point, Self::density(half))
    }

    /// The density with which any point of the mesh that faces `p` is found from there.
    #[inline(never)]
    pub(super) fn pdf(&self, &p: &DVec3) -> PointPdf {
        let mut halves = [0.0; Self::MOST];
        self.halves(p, &mut halves).map_or(PointPdf::Area(self.uniform), Self::density)
    }

    /// Half the solid angle in which each triangle's front is seen, and their sum; `None` where points are sampled by area.
    fn halves(&self, p: DVec3, halves: &mut [f64; Self::MOST]) -> Option<f64> {
        if !((self.centre - p).length_squared() < self.near_squared) {
            return None;
        }
        let mut sum = 0.0;
        for (half, face) in halves.iter_mut().zip(&self.faces) {
            if face.normal.dot(p - face.corners[0]) > 0.0 {
                *half = face.seen_from(p).half;
                sum += *half;
            }
        }
        // A density that is no number in f32 belongs to what is seen edge-on, or, of NaN, to a corner.
        Self::density(sum).is_positive().then_some(sum)
    }

    fn density(half: f64) -> PointPdf {
        PointPdf::SolidAngle(SolidAnglePdf((0.5 / half) as f32))
    }
}

impl Face {
    fn of(mesh: &TriangleMesh, face: u32) -> Self {
        let corners = mesh.triangle(face).map(|v| v.as_dvec3());
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        Self { corners, normal: if mesh.flip { -normal } else { normal } }
    }

    /// What `p`, in front of it, sees of it.
    fn seen_from(&self, p: DVec3) -> Seen {
        // Without `map`, which would be a call for each.
        let [to_a, to_b, to_c] = [self.corners[0] - p, self.corners[1] - p, self.corners[2] - p];
        let distances @ [far_a, far_b, far_c] = [to_a.length(), to_b.length(), to_c.length()];
        let corners @ [a, b, c] = [to_a / far_a, to_b / far_b, to_c / far_c];
        // a·(b×c), all of whose digits that count are those of the distance to the plane.
        let volume = self.normal.dot(-to_a) / (far_a * far_b * far_c);
        let across = a + c;
        let half = libm::atan2(volume, 0.5 * across.length_squared() + b.dot(across));
        Seen { corners, distances, half }
    }
}

impl Seen {
    /// Barycentric coordinates of the point of the triangle in a uniform direction.
    fn point(&self, u: DVec2) -> [f64; 3] {
        let Self { corners: [a, b, c], distances: [far_a, far_b, far_c], half } = *self;
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(v, w)| one_plus_cos(v, w));
        let cut = ab * ca * libm::sin(u.x * half);
        let s = cut / (cut + (2.0 * ab * bc * ca).max(0.0).sqrt() * libm::sin((1.0 - u.x) * half));
        let y = part(s, 0.5 * ca, far_a, far_c);
        // The end c' of the arc, as a point of the side.
        let end = far_a * (1.0 - y) * a + far_c * y * c;
        let far_end = end.length();
        let middle = 0.5 * one_plus_cos(b, end / far_end);
        // 1 − cos of the arc from b is a part of that of all, so this is the quotient of the tangents of their halves.
        let s = (u.y * middle / (1.0 - u.y * (1.0 - middle))).sqrt();
        let x = part(s, middle, far_b, far_end);
        [x * (1.0 - y), 1.0 - x, x * y]
    }
}

/// 1 + v·w of unit vectors, without cancellation.
fn one_plus_cos(v: DVec3, w: DVec3) -> f64 {
    0.5 * (v + w).length_squared()
}

/// Where between the ends of a side, at these distances, the point is that is seen on the arc between them where the tangent of half
/// the arc from the first is `s` times that of half of all, whose cosine has the square `middle`.
///
/// With t the tangent of half the arc, the sines of both parts of it are in the ratio of s·(1 + t²) to (1 − s)·(1 + s·t²), and those
/// times the distances of their ends are as the parts of the side. A side that is seen as half a circle has no t; it has t·cos.
fn part(s: f64, middle: f64, first: f64, second: f64) -> f64 {
    let near = s * first;
    let far = (1.0 - s) * (middle + s * (1.0 - middle)) * second;
    let part = near / (near + far);
    // Of 0/0: where the point is on the side.
    if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.5 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{Sampler, SamplerKind};
    use glam::Vec3;
    use proptest::prelude::*;

    fn mesh(positions: &[Vec3], faces: &[[u32; 3]]) -> TriangleMesh {
        TriangleMesh { positions: positions.to_vec(), faces: faces.to_vec(), ..TriangleMesh::default() }
    }

    /// The half of the unit square in the plane z = 0 that is below the diagonal.
    fn right_triangle() -> TriangleMesh {
        mesh(&[Vec3::ZERO, Vec3::X, Vec3::Y], &[[0, 1, 2]])
    }

    fn octahedron() -> TriangleMesh {
        let corners = [Vec3::X, Vec3::Y, Vec3::NEG_X, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        let faces: Vec<[u32; 3]> = (0..4).flat_map(|i| [[i, (i + 1) % 4, 4], [(i + 1) % 4, i, 5]]).collect();
        mesh(&corners, &faces)
    }

    fn uniform(i: u32) -> Vec2 {
        Sampler { kind: SamplerKind::Independent, seed: 31 }.stream(0, 0, i).light(0).point()
    }

    /// In front of the right angle at height h, a right triangle with unit legs is seen as what
    /// is left of π/2 by the angle at the other corners: Girard's theorem.
    fn seen_from_above_the_corner(h: f64) -> f64 {
        // The planes through the point and a leg are vertical; between each and that through the hypotenuse there is this angle.
        let n = DVec3::new(h, h, 1.0).normalize();
        std::f64::consts::FRAC_PI_2 + 2.0 * libm::acos(n.x) - std::f64::consts::PI
    }

    #[test]
    fn triangles_are_seen_in_their_solid_angle() {
        let triangles = Triangles::of(&right_triangle()).unwrap();
        for h in [1e-9, 1e-4, 0.1, 0.5, 1.0, 1.5] {
            let PointPdf::SolidAngle(pdf) = triangles.pdf(&DVec3::new(0.0, 0.0, h)) else { panic!("{h}") };
            let expected = seen_from_above_the_corner(h);
            assert!((f64::from(pdf.0) * expected - 1.0).abs() < 1e-6, "{h}: {pdf:?}, {expected}");
        }
        for (p, what) in
            [(DVec3::Z * 5.0, "far"), (-DVec3::Z, "behind"), (DVec3::X, "at a corner"), (DVec3::NEG_X, "edge-on")]
        {
            assert!(matches!(triangles.pdf(&p), PointPdf::Area(_)), "{what}");
        }
        // From within, an octahedron turned inside out is all around.
        let inside = Triangles::of(&TriangleMesh { flip: true, ..octahedron() }).unwrap();
        let PointPdf::SolidAngle(pdf) = inside.pdf(&DVec3::new(0.1, -0.2, 0.3)) else { panic!() };
        assert!((pdf.0 * 4.0 * std::f32::consts::PI - 1.0).abs() < 1e-6, "{pdf:?}");
    }

    /// Hypothesis: directions are uniform in triangles from the tiny to those of nearly 2π, of which one corner, side or face is
    /// near: the area of abc' is the part u of the whole, and the cosine of b with the point is uniform; both to 2⁻²⁴ and better,
    /// on a grid. (The test of samples, in the table of the lights, has fewer digits.)
    #[test]
    fn the_map_preserves_area() {
        let above = |x, y, z| DVec3::new(x, y, z);
        let points = [
            above(0.2, 0.3, 1e-6),
            above(0.2, 0.3, 0.2),
            above(0.5, 1e-4, 1e-4),
            above(1e-3, 1e-3, 1e-3),
            above(0.6, 0.6, 1e-3),
            above(-1.0, -1.0, 0.5),
            above(0.3, 0.3, 100.0),
            above(-2.0, 0.1, 1e-3),
        ];
        let face = Face::of(&right_triangle(), 0);
        for p in points {
            let seen = face.seen_from(p);
            for (i, j) in (0..=8).flat_map(|i| (0..=8).map(move |j| (i, j))) {
                let u = DVec2::new(f64::from(i) / 8.0, f64::from(j) / 8.0);
                let at = |b: [f64; 3]| (0..3).map(|k| b[k] * face.corners[k]).sum::<DVec3>();
                let (point, end) = (at(seen.point(u)), at(seen.point(DVec2::new(u.x, 1.0))));
                let part = Face { corners: [face.corners[0], face.corners[1], end], ..face };
                // Its normal is that of a smaller triangle.
                let scale = (end - part.corners[0]).dot(DVec3::Y);
                let part = Face { normal: face.normal * scale, ..part }.seen_from(p);
                assert!((part.half - u.x * seen.half).abs() < 1e-9 * seen.half, "{p} {u}: {} {}", part.half, seen.half);
                let chord = |q: DVec3| ((q - p).normalize() - seen.corners[1]).length_squared();
                let expected = u.y * chord(end);
                assert!(
                    (chord(point) - expected).abs() < 1e-7 * chord(end) + 1e-15,
                    "{p} {u}: {} {expected}",
                    chord(point)
                );
            }
        }
    }

    /// What one sample says of the light that arrives, per radiance: cos θ over the density.
    fn estimate(triangles: &Triangles, mesh: &TriangleMesh, p: DVec3, n: DVec3, u: Vec2) -> f64 {
        let (_, end, pdf) = triangles.sample(mesh, &p, u);
        let to = end.p - p;
        let cos = -to.normalize().dot(end.n.as_dvec3());
        let pdf = pdf.to_solid_angle(to.length_squared() as f32, cos as f32);
        if cos > 0.0 { n.dot(to.normalize()).max(0.0) / f64::from(pdf.0) } else { 0.0 }
    }

    /// Standard deviation over the mean of what a surface near the light that faces it receives, by solid angle and by area. Of
    /// 4,096 independent samples of a fixed seed, the standard error of a deviation is a few per cent of it; the bounds
    /// leave room for ten of them.
    #[test]
    fn near_triangles_are_less_noisy_than_by_area() {
        for (name, mesh, p, n) in [
            ("triangle", right_triangle(), DVec3::new(0.2, 0.3, 0.05), DVec3::NEG_Z),
            ("triangle, from its rim", right_triangle(), DVec3::new(0.6, 0.6, 0.2), DVec3::NEG_Z),
            ("octahedron", octahedron(), DVec3::new(0.2, 0.3, 0.9), DVec3::NEG_Z),
            ("octahedron, from its size away", octahedron(), DVec3::new(1.0, 1.0, 1.5), DVec3::NEG_ONE.normalize()),
        ] {
            let triangles = Triangles::of(&mesh).unwrap();
            let by_area = Triangles { near_squared: 0.0, ..triangles.clone() };
            let [(solid, mean), (area, area_mean)] = [triangles, by_area].map(|triangles| {
                let values = (0..4096).map(|i| estimate(&triangles, &mesh, p, n, uniform(i)));
                let [sum, squares] = values.fold([0.0, 0.0], |[s, q], x| [s + x, q + x * x]);
                let mean = sum / 4096.0;
                ((squares / 4096.0 - mean * mean).sqrt() / mean, mean)
            });
            assert!(solid < 0.6 * area, "{name}: {solid} against {area}");
            // The same light: six standard errors of the noisier.
            assert!((mean / area_mean - 1.0).abs() < 6.0 * area / 64.0, "{name}: {mean} and {area_mean}");
        }
    }

    proptest! {
        /// From anywhere, at any scale, on the light itself and in its plane, too, points are on the triangle, and their density
        /// is positive and finite, that of sampling and that of finding; and all of it is the same bits at another power of two.
        #[test]
        fn densities_agree_and_are_numbers(
            x in -2.0_f64..3.0, y in -2.0_f64..3.0, z in -40_i32..3, scale in -12_i32..3, in_plane in prop::bool::ANY,
            third in [-1.0_f32..2.0, 0.01..2.0], u in [0.0_f32..1.0, 0.0..1.0],
        ) {
            let at = |scale: i32| {
                let size = libm::ldexpf(1.0, scale);
                let corners = [Vec3::ZERO, Vec3::X, Vec3::new(third[0], third[1], 0.0)].map(|v| v * size);
                let mesh = mesh(&corners, &[[0, 1, 2]]);
                let height = if in_plane { 0.0 } else { libm::ldexp(1.0, z) };
                let p = DVec3::new(x, y, height) * f64::from(size);
                let triangles = Triangles::of(&mesh).unwrap();
                let (face, end, sampled) = triangles.sample(&mesh, &p, Vec2::from(u));
                let [a, b, c] = mesh.triangle(face).map(|v| v.as_dvec3());
                let room = 1e-12 * f64::from(size * size);
                let inside = [(a, b), (b, c), (c, a)].iter().all(|(a, b)| (*b - *a).cross(end.p - *a).z >= -room);
                assert!(inside && end.p.z == 0.0, "{end:?}");
                (end.p / f64::from(size), [sampled, triangles.pdf(&p)].map(|pdf| match pdf {
                    PointPdf::Area(pdf) => pdf.0 * size * size,
                    PointPdf::SolidAngle(pdf) => pdf.0,
                }))
            };
            let (end, [sampled, found]) = at(scale);
            prop_assert!(sampled > 0.0 && sampled.is_finite(), "{sampled}");
            prop_assert_eq!(sampled, found);
            prop_assert_eq!(at(0), (end, [sampled, found]));
        }
    }
}
