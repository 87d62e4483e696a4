//! Sampling of parallelograms, of which two triangles of a mesh are one.
//!
//! From some distance, points are sampled with a density that is bilinear between the corners, in proportion there to what a
//! corner sends to the point: cos θ·cos θ'/d² with the angles at either end, the normal there being given. That takes no more
//! than a few products a corner, knows the receiver's cosine, too (Hart, Pharr, Müller, Lopes, McGuire and Shirley 2020,
//! *Practical Product Sampling by Fitting and Composing Warps*, warp the solid angle in this way). Far away it would be nearly
//! uniform, and points are. Near a rectangle, where the corners say nothing of its middle, it is sampled uniformly by the solid angle
//! in which it is seen: Ureña, Fajardo and King 2013, *An Area-Preserving Parametrization for Spherical Rectangles*.
//!
//! Which of the three depends on the point alone, and so do the corners' weights; so the density of a point that was found by
//! other means is that of sampling it.

use crate::math::float::max;
use crate::sampling::pdf::{AreaPdf, PointPdf, SolidAnglePdf};
use crate::sampling::warp::unit_to_linear;
use crate::shape::TriangleMesh;
use crate::shape::offset::SurfacePoint;
use glam::{DVec2, DVec3, Vec2, Vec3, Vec4};
use std::f64::consts::TAU;

/// A rectangle nearer than this part of its diagonal is sampled by solid angle. At that distance, in front of the middle,
/// either has a standard deviation of about a tenth of the mean; at half of it bilinear sampling has twice that of the other.
const NEAR: f64 = 0.5;

/// A parallelogram farther than so many times its diagonal is sampled uniformly: what arrives from its corners differs by about
/// a tenth then, which is less than the noise of anything that is half hidden.
const FAR: f64 = 3.0;

/// Least solid angle, in sr, that is the difference of angles with digits enough: f64 leaves nine.
const LEAST_SOLID_ANGLE: f64 = 1e-6;

/// Least weight of a corner, relative to the largest: below the receiver's horizon there may be nothing, but between two
/// corners there is more than their mean, and a small density in the wrong place is a bright speck.
const LEAST_WEIGHT: f32 = 0.05;

/// By how much four corners may miss a parallelogram, relative to its shorter side, and two sides a right angle: what
/// sampling takes for equal areas differs by about as much.
const ROUNDING: f64 = 1e-5;

/// A parallelogram with corners v₀, v₀ + e₁, v₀ + e₁ + e₂ and v₀ + e₂.
#[derive(Clone, Debug)]
pub(super) struct Quad {
    v0: DVec3,
    /// Edges from v₀.
    edges: [DVec3; 2],
    /// Dual to them in the plane: s = q·dual for the point v₀ + q.
    duals: [DVec3; 2],
    /// Coordinates of the corners, in the order of [`Self`].
    xs: Vec4,
    ys: Vec4,
    zs: Vec4,
    /// Which vertex of the mesh's faces is v₀: of the face with v₀ + e₁, and of that with v₀ + e₂.
    turns: [usize; 2],
    /// One over the area.
    uniform: f32,
    /// Square of the distance below which it is sampled by solid angle; negative where it never is.
    near_squared: f64,
    /// Square of the distance of its centre from which on it is sampled uniformly.
    far_squared: f64,
    centre: DVec3,
}

/// What a point sees of a rectangle near it.
struct Seen {
    /// Distances of the sides from the point along the edges, and of the plane.
    x: [f64; 2],
    y: [f64; 2],
    z: f64,
    /// The solid angle.
    angle: f64,
    /// The paper's b₀, b₁ and k.
    b: [f64; 2],
    k: f64,
}

/// How a point samples a quad.
enum Way {
    Near(Seen),
    /// Weights of the corners.
    Between([f32; 4]),
    Uniform,
}

impl Quad {
    /// The parallelogram that a mesh is; `None` if it is something else.
    pub(super) fn of(mesh: &TriangleMesh) -> Option<Self> {
        let &[f, g] = &mesh.faces[..] else { return None };
        let [f, g] = [f, g].map(|face| face.map(|i| mesh.positions[i as usize]));
        // Turned so that the diagonal leads from the first vertex of both to the last of the one and the second of the other.
        let (i, j) = (0..9).map(|k| (k / 3, k % 3)).find(|&(i, j)| f[i] == g[j] && f[(i + 2) % 3] == g[(j + 1) % 3])?;
        let [v0, v1, v2] = [0, 1, 2].map(|k| f[(i + k) % 3].as_dvec3());
        let v3 = g[(j + 2) % 3].as_dvec3();
        let [e1, e2] = [v1 - v0, v3 - v0];
        let shorter = e1.length().min(e2.length());
        let normal = e1.cross(e2);
        let (duals, area) =
            ([e2.cross(normal), normal.cross(e1)].map(|d| d / normal.length_squared()), normal.length());
        let fine =
            duals.iter().all(|d| d.is_finite()) && (1.0 / area) as f32 > 0.0 && ((1.0 / area) as f32).is_finite();
        if !((v0 + e1 + e2 - v2).length() <= ROUNDING * shorter && fine) {
            return None;
        }
        let is_rectangle = e1.dot(e2).abs() <= ROUNDING * e1.length() * e2.length();
        let diagonal_squared = e1.length_squared() + e2.length_squared();
        let corners = [v0, v1, v2, v3].map(|v| v.as_vec3());
        let along = |axis: usize| Vec4::from_array(corners.map(|v| v[axis]));
        Some(Self {
            v0,
            edges: [e1, e2],
            duals,
            xs: along(0),
            ys: along(1),
            zs: along(2),
            turns: [i, j],
            uniform: (1.0 / area) as f32,
            far_squared: FAR * FAR * diagonal_squared,
            centre: v0 + 0.5 * (e1 + e2),
            near_squared: if is_rectangle { NEAR * NEAR * diagonal_squared } else { -1.0 },
        })
    }

    /// A point of the mesh, its face, and the density with which it is found from `p`, where surfaces face `n` or, if that is
    /// zero, all sides; `None` where `p` sees nothing of it.
    #[inline(always)]
    pub(super) fn sample(&self, mesh: &TriangleMesh, p: DVec3, n: Vec3, u: Vec2) -> (u32, SurfacePoint, PointPdf) {
        let (st, pdf) = match self.way(p, n) {
            Way::Near(seen) => {
                (self.near_point(&seen, u), PointPdf::SolidAngle(SolidAnglePdf((1.0 / seen.angle) as f32)))
            }
            Way::Uniform => (u.as_dvec2(), PointPdf::Area(AreaPdf(self.uniform))),
            Way::Between(w) => {
                let [w0, w1, w2, w3] = w;
                let t = unit_to_linear(u.y, w0 + w1, w3 + w2);
                let s = unit_to_linear(u.x, (1.0 - t) * w0 + t * w3, (1.0 - t) * w1 + t * w2);
                let st = DVec2::new(s.into(), t.into());
                (st, PointPdf::Area(self.bilinear_pdf(&w, st)))
            }
        };
        let (s, t) = (st.x, st.y);
        // v₀, the vertex that only this face has, and the far end of the diagonal.
        let (face, weights) = if s >= t { (0, [1.0 - s, s - t, t]) } else { (1, [1.0 - t, s, t - s]) };
        let turn = self.turns[face];
        let mut b = [0.0; 3];
        for (k, weight) in weights.into_iter().enumerate() {
            b[(turn + k) % 3] = weight;
        }
        (face as u32, mesh.point(face as u32, b).point, pdf)
    }

    /// The density with which a point of the mesh is found from `p`.
    #[inline(always)]
    pub(super) fn pdf(&self, p: DVec3, n: Vec3, end: DVec3) -> PointPdf {
        match self.way(p, n) {
            Way::Near(seen) => PointPdf::SolidAngle(SolidAnglePdf((1.0 / seen.angle) as f32)),
            Way::Uniform => PointPdf::Area(AreaPdf(self.uniform)),
            Way::Between(w) => {
                let q = end - self.v0;
                let st = DVec2::from_array(self.duals.map(|dual| q.dot(dual).clamp(0.0, 1.0)));
                PointPdf::Area(self.bilinear_pdf(&w, st))
            }
        }
    }

    /// Decided by `p`; `n` makes no difference to which of both it is.
    #[inline(always)]
    fn way(&self, p: DVec3, n: Vec3) -> Way {
        if (self.centre - p).length_squared() >= self.far_squared {
            return Way::Uniform;
        }
        let corner = self.v0 - p;
        // Farther from every corner than a diagonal and a half is farther than a half from everything.
        if corner.length_squared() < self.near_squared * 9.0
            && let Some(seen) = self.seen_near(&corner)
        {
            return Way::Near(seen);
        }
        let p = p.as_vec3();
        let [x, y, z] = [self.xs - p.x, self.ys - p.y, self.zs - p.z];
        let squared = x * x + y * y + z * z;
        let nearest = squared.min_element();
        if !(nearest > 0.0) {
            return Way::Uniform;
        }
        // Of cos θ = h/d the height h is that of the plane, the same for all corners.
        let ratio = nearest / squared;
        let weights = if n == Vec3::ZERO {
            ratio * Vec4::from_array(ratio.to_array().map(f32::sqrt))
        } else {
            (x * n.x + y * n.y + z * n.z).max(Vec4::ZERO) * ratio * ratio
        };
        let largest = weights.max_element();
        match largest > 0.0 {
            true => Way::Between(weights.max(Vec4::splat(LEAST_WEIGHT * largest)).to_array()),
            // All of it is behind the receiver.
            false => Way::Uniform,
        }
    }

    /// Density per area at v₀ + s·e₁ + t·e₂.
    #[inline(always)]
    fn bilinear_pdf(&self, &[w0, w1, w2, w3]: &[f32; 4], st: DVec2) -> AreaPdf {
        let (s, t) = (st.x as f32, st.y as f32);
        let near = w0 + (w1 - w0) * s;
        let far = w3 + (w2 - w3) * s;
        let mean = 0.25 * (w0 + w1 + w2 + w3);
        AreaPdf(max(0.0, near + (far - near) * t) / mean * self.uniform)
    }

    /// What is seen of the rectangle from `-corner` beside v₀, if that is near enough and the solid angle has digits enough.
    #[inline(never)]
    fn seen_near(&self, &corner: &DVec3) -> Option<Seen> {
        let lengths = self.edges.map(|e| e.length());
        let [ex, ey] = [self.edges[0] / lengths[0], self.edges[1] / lengths[1]];
        let (x0, y0, z) = (corner.dot(ex), corner.dot(ey), corner.dot(ex.cross(ey)));
        let (x, y) = ([x0, x0 + lengths[0]], [y0, y0 + lengths[1]]);
        let beside = |[a, b]: [f64; 2]| a.max(-b).max(0.0);
        if !(beside(x).powi(2) + beside(y).powi(2) + z * z < self.near_squared && z != 0.0) {
            return None;
        }
        let z = -z.abs();
        // The z components of the normals of the planes through the point and the sides y₀, x₁, y₁ and x₀.
        let over = |a: f64| a / (a * a + z * z).sqrt();
        let normals = [-over(y[0]), over(x[1]), over(y[1]), -over(x[0])];
        let angle = |i: usize| libm::acos((-normals[i] * normals[(i + 1) % 4]).clamp(-1.0, 1.0));
        let k = TAU - angle(2) - angle(3);
        let solid_angle = angle(0) + angle(1) - k;
        (solid_angle >= LEAST_SOLID_ANGLE).then_some(Seen {
            x,
            y,
            z,
            angle: solid_angle,
            b: [normals[0], normals[2]],
            k,
        })
    }

    /// The point (s, t) of the rectangle for a uniform number of its solid angle (the paper's section 3).
    #[inline(never)]
    fn near_point(&self, seen: &Seen, u: Vec2) -> DVec2 {
        let &Seen { x: [x0, x1], y: [y0, y1], z, angle, b: [b0, b1], k } = seen;
        let (sin, cos) = libm::sincos(f64::from(u.x) * angle + k);
        let f = (cos * b0 - b1) / sin;
        let c = (1.0 / (f * f + b0 * b0).sqrt()).min(1.0).copysign(f);
        // Where c is ±1 the quotient is not finite, and the clamp does the rest.
        let x = (-c * z / (1.0 - c * c).max(0.0).sqrt()).clamp(x0, x1);
        let d_squared = x * x + z * z;
        let h = |y: f64| y / (d_squared + y * y).sqrt();
        let v = h(y0) + f64::from(u.y) * (h(y1) - h(y0));
        let y = (v * (d_squared / (1.0 - v * v)).sqrt()).clamp(y0, y1);
        let part = |a: f64, low: f64, high: f64| ((a - low) / (high - low)).clamp(0.0, 1.0);
        DVec2::new(part(x, x0, x1), part(y, y0, y1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn mesh(v0: Vec3, e1: Vec3, e2: Vec3) -> TriangleMesh {
        let positions = vec![v0, v0 + e1, v0 + e1 + e2, v0 + e2];
        TriangleMesh { positions, faces: vec![[2, 0, 1], [0, 2, 3]], ..TriangleMesh::default() }
    }

    /// The unit square in the plane z = 0.
    fn square() -> TriangleMesh {
        mesh(Vec3::ZERO, Vec3::X, Vec3::Y)
    }

    #[test]
    fn only_parallelograms_are_quads() {
        let of = |positions: [[f32; 2]; 4], faces: &[[u32; 3]]| {
            let positions = positions.map(|[x, y]| Vec3::new(x, y, x + 2.0 * y)).to_vec();
            Quad::of(&TriangleMesh { positions, faces: faces.to_vec(), ..TriangleMesh::default() }).is_some()
        };
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        // Whichever vertex a triangle begins with, and whichever diagonal divides the square.
        for turn in 0..3 {
            let turned = |f: [u32; 3]| [f[turn], f[(turn + 1) % 3], f[(turn + 2) % 3]];
            assert!(of(square, &[turned([0, 1, 2]), [0, 2, 3]]) && of(square, &[[1, 2, 3], turned([0, 1, 3])]));
        }
        assert!(of([[0.0, 0.0], [1.0, 0.0], [1.5, 1.0], [0.5, 1.0]], &[[0, 1, 2], [0, 2, 3]]));
        assert!(!of([[0.0, 0.0], [1.0, 0.0], [1.0, 1.1], [0.0, 1.0]], &[[0, 1, 2], [0, 2, 3]]));
        assert!(!of(square, &[[0, 1, 2], [0, 3, 2]]), "two sides");
        assert!(!of(square, &[[0, 1, 2]]) && !of(square, &[[0, 1, 2], [0, 1, 2]]));
    }

    /// The solid angle that a point sees of a rectangle from in front of its corner, in closed form:
    /// atan(ab/(h·√(a² + b² + h²))).
    #[test]
    fn near_rectangles_are_seen_in_their_solid_angle() {
        let quad = Quad::of(&square()).unwrap();
        for (x, y, h) in [(0.5, 0.5, 0.3), (0.1, 0.8, 1e-3), (0.3, 0.3, 1e-8), (0.999, 0.5, 0.01), (0.5, 0.5, 0.7)] {
            let corner = |a: f64, b: f64| libm::atan(a * b / (h * (a * a + b * b + h * h).sqrt()));
            let expected = corner(x, y) + corner(1.0 - x, y) + corner(x, 1.0 - y) + corner(1.0 - x, 1.0 - y);
            for side in [h, -h] {
                let seen = quad.seen_near(&-DVec3::new(x, y, side)).unwrap();
                assert!((seen.angle / expected - 1.0).abs() < 1e-9, "{x} {y} {h}: {} {expected}", seen.angle);
            }
        }
        assert!(quad.seen_near(&-DVec3::new(0.5, 0.5, 0.8)).is_none(), "far");
        assert!(quad.seen_near(&-DVec3::new(0.5, 0.5, 0.0)).is_none(), "on it");
        assert!(quad.seen_near(&-DVec3::new(1.2, 0.5, 1e-9)).is_none(), "edge-on");
    }

    /// The density per area at the point for which these numbers stand, of both ways, and of the point found.
    fn densities(mesh: &TriangleMesh, p: DVec3, n: Vec3, u: Vec2) -> [f64; 2] {
        let quad = Quad::of(mesh).unwrap();
        let (_, end, sampled) = quad.sample(mesh, p, n, u);
        [sampled, quad.pdf(p, n, end.p)].map(|pdf| {
            let to = end.p - p;
            let cos = (to.dot(end.n.as_dvec3()) / to.length()).abs();
            match pdf {
                PointPdf::Area(pdf) => pdf.0.into(),
                PointPdf::SolidAngle(pdf) => f64::from(pdf.0) * cos / to.length_squared(),
            }
        })
    }

    proptest! {
        /// From anywhere, at any scale, on the light itself and in its plane, too, points are on the quad, and their density is
        /// positive and finite, that of sampling and that of finding.
        #[test]
        fn densities_agree_and_are_numbers(
            x in -2.0_f64..3.0, y in -2.0_f64..3.0, z in -30_i32..2, scale in -12_i32..1, skew in prop::bool::ANY,
            in_plane in prop::bool::ANY, n in [-1.0_f32..1.0, -1.0..1.0, -1.0..1.0], u in [0.0_f32..1.0, 0.0..1.0],
        ) {
            let size = libm::ldexpf(1.0, scale);
            let e2 = Vec3::new(if skew { 0.4 } else { 0.0 }, 1.0, 0.0);
            let mesh = mesh(Vec3::ZERO, Vec3::X * size, e2 * size);
            let height = if in_plane { 0.0 } else { libm::ldexp(1.0, z) };
            let p = DVec3::new(x, y, height) * f64::from(size);
            for n in [Vec3::ZERO, Vec3::from(n).normalize_or_zero()] {
                let [sampled, found] = densities(&mesh, p, n, Vec2::from(u));
                prop_assert!(sampled.is_finite() && found.is_finite() && found >= 0.0, "{sampled} {found}");
                prop_assert!((sampled - found).abs() <= 1e-4 * sampled, "{sampled} {found}");
                let (face, end, _) = Quad::of(&mesh).unwrap().sample(&mesh, p, n, Vec2::from(u));
                let [a, b, c] = mesh.triangle(face).map(|v| v.as_dvec3());
                let inside = [(a, b), (b, c), (c, a)].iter().all(|(a, b)| (*b - *a).cross(end.p - *a).z >= -1e-9);
                prop_assert!(inside && end.p.z == 0.0, "{end:?}");
            }
        }
    }
}
