//! Sampling of parallelograms, of which two triangles of a mesh are one.
//!
//! From some distance, points are sampled with a density that is bilinear between the corners, in proportion there to what a
//! corner sends to the point: cos θ·cos θ'/d² with the angles at either end, the normal there being given. That takes no more
//! than a few products a corner, knows the receiver's cosine, too (Hart, Pharr, Müller, Lopes, McGuire and Shirley 2020,
//! *Practical Product Sampling by Fitting and Composing Warps*, warp the solid angle in this way). Far away it would be nearly
//! uniform, and points are. Near a rectangle, where the corners say nothing of its middle, it is sampled uniformly by the solid angle
//! in which it is seen: Ureña, Fajardo and King 2013, *An Area-Preserving Parametrization for Spherical Rectangles*.
//!
//! Which of the three depends on the point and the normal of the receiver, and so do the corners' weights; so the density of a point that
//! was found by other means, by a direction from that receiver, is that of sampling it.
//!
//! All of it is written for several receivers at once, lane by lane in loops without branches, which the compiler turns into vector
//! instructions if there are enough of them: loops over 8 it unrolls, and then it finds no vectors; with 32 a receiver takes a third
//! of the time. The same operations in the same order, so the same bits, whatever the number of lanes.

use crate::math::float::{max, min};
use crate::sampling::pdf::{AreaPdf, PointPdf, SolidAnglePdf};
use crate::sampling::warp::unit_to_linear;
use crate::shape::offset::SurfacePoint;
use crate::shape::{Plane, TriangleMesh};
use glam::{DVec2, DVec3, Vec2, Vec3};
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
pub struct Quad {
    v0: DVec3,
    /// Edges from v₀.
    edges: [DVec3; 2],
    /// Dual to them in the plane: s = q·dual for the point v₀ + q.
    duals: [DVec3; 2],
    /// From v₀ to the far end of the diagonal that divides the mesh.
    diagonal: DVec3,
    /// The corners, in the order of [`Self`].
    corners: [Vec3; 4],
    /// Of the face with v₀ + e₁, and of that with v₀ + e₂.
    planes: [Plane; 2],
    /// Unit vectors along the edges and across, and the lengths of the edges.
    axes: [DVec3; 3],
    lengths: [f64; 2],
    /// One over the area.
    uniform: f32,
    /// Square of the distance below which it is sampled by solid angle; negative where it never is.
    near_squared: f64,
    /// Square of the distance of its centre from which on it is sampled uniformly.
    far_squared: f64,
    centre: DVec3,
}

/// Those who ask for a point, by coordinate and lane. What comes of lanes that nobody was put into does not matter.
#[derive(Clone, Copy, Debug)]
pub struct Receivers<const L: usize> {
    /// Lanes that matter, from the first on.
    pub count: usize,
    /// Where they are.
    pub p: [[f64; L]; 3],
    /// The normals on whose sides they scatter; zero where that is both.
    pub n: [[f32; L]; 3],
    /// Uniform numbers.
    pub u: [[f32; L]; 2],
}

/// What they got, by coordinate and lane.
#[derive(Clone, Copy, Debug)]
pub struct FoundOnQuad<const L: usize> {
    /// Unit vectors towards the points.
    pub wi: [[f32; L]; 3],
    /// Density of that, in sr⁻¹; 0 where the light shows its back or its edge.
    pub pdf: [f32; L],
    /// The points.
    pub end: [[f64; L]; 3],
    /// Whether they are on the first face.
    pub first: [bool; L],
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

impl<const L: usize> Default for Receivers<L> {
    fn default() -> Self {
        Self { count: L, p: [[0.0; L]; 3], n: [[1.0; L]; 3], u: [[0.0; L]; 2] }
    }
}

impl<const L: usize> Default for FoundOnQuad<L> {
    fn default() -> Self {
        Self { wi: [[0.0; L]; 3], pdf: [0.0; L], end: [[0.0; L]; 3], first: [false; L] }
    }
}

impl<const L: usize> Receivers<L> {
    /// Puts one into a lane.
    #[inline(always)]
    pub fn put(&mut self, lane: usize, p: DVec3, n: Vec3, u: Vec2) {
        for axis in 0..3 {
            self.p[axis][lane] = p[axis];
            self.n[axis][lane] = n[axis];
        }
        self.u[0][lane] = u.x;
        self.u[1][lane] = u.y;
    }

    #[inline(always)]
    fn at(&self, lane: usize) -> DVec3 {
        DVec3::new(self.p[0][lane], self.p[1][lane], self.p[2][lane])
    }
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
        let lengths = [e1.length(), e2.length()];
        let shorter = lengths[0].min(lengths[1]);
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
        let [ex, ey] = [e1 / lengths[0], e2 / lengths[1]];
        Some(Self {
            v0,
            edges: [e1, e2],
            duals,
            diagonal: v2 - v0,
            corners: [v0, v1, v2, v3].map(|v| v.as_vec3()),
            planes: [0, 1].map(|face| mesh.plane(face)),
            axes: [ex, ey, ex.cross(ey)],
            lengths,
            uniform: (1.0 / area) as f32,
            far_squared: FAR * FAR * diagonal_squared,
            centre: v0 + 0.5 * (e1 + e2),
            near_squared: if is_rectangle { NEAR * NEAR * diagonal_squared } else { -1.0 },
        })
    }

    /// Points for several receivers.
    #[inline(always)]
    pub fn sample<const L: usize>(&self, receivers: &Receivers<L>) -> FoundOnQuad<L> {
        let Receivers { p, u, .. } = receivers;
        let (mut near, mut weights) = ([const { None }; L], [[1.0; L]; 4]);
        self.ways(receivers, &mut near, &mut weights);
        let [w0, w1, w2, w3] = &weights;
        let (mut s, mut t, mut pdf) = ([0.0f64; L], [0.0f64; L], [0.0f32; L]);
        for i in 0..L {
            let v = unit_to_linear(u[1][i], w0[i] + w1[i], w3[i] + w2[i]);
            let across = [(1.0 - v) * w0[i] + v * w3[i], (1.0 - v) * w1[i] + v * w2[i]];
            let h = unit_to_linear(u[0][i], across[0], across[1]);
            pdf[i] = self.bilinear_pdf([w0[i], w1[i], w2[i], w3[i]], h, v).0;
            (s[i], t[i]) = (h.into(), v.into());
        }
        for (i, seen) in near.iter().enumerate() {
            if let Some(seen) = seen {
                let st = self.near_point(seen, Vec2::new(u[0][i], u[1][i]));
                (s[i], t[i]) = (st.x, st.y);
            }
        }
        // On the first face at v₀ + (s − t)·e₁ + t·d, on the second at v₀ + s·d + (t − s)·e₂.
        let mut found = FoundOnQuad::default();
        let (mut along, mut beside) = ([0.0f64; L], [0.0f64; L]);
        for i in 0..L {
            found.first[i] = s[i] >= t[i];
            along[i] = if s[i] >= t[i] { t[i] } else { s[i] };
            beside[i] = (s[i] - t[i]).abs();
        }
        let (mut to, mut n) = ([[0.0f32; L]; 3], [[0.0f32; L]; 3]);
        for axis in 0..3 {
            let (v0, diagonal) = (self.v0[axis], self.diagonal[axis]);
            let [e1, e2] = [self.edges[0][axis], self.edges[1][axis]];
            let [n1, n2] = [self.planes[0].n[axis], self.planes[1].n[axis]];
            for i in 0..L {
                let edge = if found.first[i] { e1 } else { e2 };
                found.end[axis][i] = v0 + diagonal * along[i] + edge * beside[i];
                to[axis][i] = (found.end[axis][i] - p[axis][i]) as f32;
                n[axis][i] = if found.first[i] { n1 } else { n2 };
            }
        }
        for i in 0..L {
            let squared = to[0][i] * to[0][i] + to[1][i] * to[1][i] + to[2][i] * to[2][i];
            let distance = squared.sqrt();
            // A grazing cosine is all rounding, but the same rounding as for points that are found.
            let cos = (to[0][i] * n[0][i] + to[1][i] * n[1][i] + to[2][i] * n[2][i]) / distance;
            found.wi[0][i] = to[0][i] / distance;
            found.wi[1][i] = to[1][i] / distance;
            found.wi[2][i] = to[2][i] / distance;
            let pdf = AreaPdf(pdf[i]).to_solid_angle(squared, cos).0;
            // From behind nothing comes, nor where it is NaN, on the light itself.
            found.pdf[i] = if cos < 0.0 { pdf } else { 0.0 };
        }
        for (i, seen) in near.iter().enumerate() {
            if let Some(seen) = seen
                && found.pdf[i] > 0.0
            {
                found.pdf[i] = (1.0 / seen.angle) as f32;
            }
        }
        found
    }

    /// A point that was found.
    #[inline(always)]
    pub(super) fn point<const L: usize>(&self, found: &FoundOnQuad<L>, lane: usize) -> (u32, SurfacePoint) {
        let face = u32::from(!found.first[lane]);
        let Plane { n, slack } = self.planes[face as usize];
        let p = DVec3::new(found.end[0][lane], found.end[1][lane], found.end[2][lane]);
        (face, SurfacePoint { p, n, slack })
    }

    /// The density with which the point `end` of the mesh is found from `p`, where surfaces face `n` or, if that is zero, all sides.
    #[inline(always)]
    pub(super) fn pdf(&self, p: DVec3, n: Vec3, end: DVec3) -> PointPdf {
        let mut receiver = Receivers::<1>::default();
        receiver.put(0, p, n, Vec2::ZERO);
        let (mut near, mut weights) = ([None], [[1.0]; 4]);
        self.ways(&receiver, &mut near, &mut weights);
        let [[w0], [w1], [w2], [w3]] = weights;
        if let [Some(seen)] = near {
            return PointPdf::SolidAngle(SolidAnglePdf((1.0 / seen.angle) as f32));
        }
        let q = end - self.v0;
        let [s, t] = self.duals.map(|dual| q.dot(dual).clamp(0.0, 1.0) as f32);
        PointPdf::Area(self.bilinear_pdf([w0, w1, w2, w3], s, t))
    }

    /// How receivers sample it: by what they see of it, if it is near, else by these weights of the corners, which are all 1, as they are
    /// to be before, where it is sampled uniformly. Which of them it is depends on where they are and on their normals.
    #[inline(always)]
    fn ways<const L: usize>(
        &self,
        receivers: &Receivers<L>,
        near: &mut [Option<Seen>; L],
        weights: &mut [[f32; L]; 4],
    ) {
        let Receivers { p, n, .. } = receivers;
        let (mut close, mut far) = ([false; L], [false; L]);
        for i in 0..L {
            let squared = |v: DVec3| {
                let [x, y, z] = [v.x - p[0][i], v.y - p[1][i], v.z - p[2][i]];
                x * x + y * y + z * z
            };
            far[i] = squared(self.centre) >= self.far_squared;
            // Farther from every corner than a diagonal and a half is farther than a half from everything.
            close[i] = squared(self.v0) < self.near_squared * 9.0;
        }
        let mut uniform = true;
        for i in 0..L {
            if close[i] && !far[i] && i < receivers.count {
                near[i] = self.seen_near(&(self.v0 - receivers.at(i)));
            }
            uniform &= far[i] || near[i].is_some();
        }
        if uniform {
            return;
        }
        let (mut squared, mut heights) = ([[0.0f32; L]; 4], [[0.0f32; L]; 4]);
        for (corner, v) in self.corners.iter().enumerate() {
            for i in 0..L {
                let [x, y, z] = [v.x - p[0][i] as f32, v.y - p[1][i] as f32, v.z - p[2][i] as f32];
                squared[corner][i] = x * x + y * y + z * z;
                heights[corner][i] = x * n[0][i] + y * n[1][i] + z * n[2][i];
            }
        }
        let (mut nearest, mut both_sides) = ([0.0f32; L], false);
        for i in 0..L {
            nearest[i] = min(min(squared[0][i], squared[1][i]), min(squared[2][i], squared[3][i]));
            both_sides |= n[0][i] == 0.0 && n[1][i] == 0.0 && n[2][i] == 0.0;
        }
        // Of cos θ = h/d the height h over the light is that of its plane, the same for all corners.
        for corner in 0..4 {
            for i in 0..L {
                let ratio = nearest[i] / squared[corner][i];
                weights[corner][i] = max(heights[corner][i], 0.0) * ratio * ratio;
            }
        }
        if both_sides {
            for (corner, weights) in weights.iter_mut().enumerate() {
                for i in 0..L {
                    let ratio = nearest[i] / squared[corner][i];
                    let is_zero = n[0][i] == 0.0 && n[1][i] == 0.0 && n[2][i] == 0.0;
                    weights[i] = if is_zero { ratio * ratio.sqrt() } else { weights[i] };
                }
            }
        }
        let mut least = [0.0f32; L];
        for i in 0..L {
            let largest = max(max(weights[0][i], weights[1][i]), max(weights[2][i], weights[3][i]));
            // Far away, at a corner, or with all of it behind: uniformly.
            let between = !far[i] && nearest[i] > 0.0 && largest > 0.0;
            least[i] = if between { LEAST_WEIGHT * largest } else { -1.0 };
        }
        for weights in weights {
            for i in 0..L {
                weights[i] = if least[i] > 0.0 { max(weights[i], least[i]) } else { 1.0 };
            }
        }
    }

    /// Density per area at v₀ + s·e₁ + t·e₂.
    #[inline(always)]
    fn bilinear_pdf(&self, [w0, w1, w2, w3]: [f32; 4], s: f32, t: f32) -> AreaPdf {
        let near = w0 + (w1 - w0) * s;
        let far = w3 + (w2 - w3) * s;
        let mean = 0.25 * (w0 + w1 + w2 + w3);
        AreaPdf(max(0.0, near + (far - near) * t) / mean * self.uniform)
    }

    /// What is seen of the rectangle from `-corner` beside v₀, if that is near enough and the solid angle has digits enough.
    #[inline(never)]
    fn seen_near(&self, &corner: &DVec3) -> Option<Seen> {
        let (lengths, [x0, y0, z]) = (self.lengths, self.axes.map(|axis| corner.dot(axis)));
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

    const TOGETHER: usize = 32;

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

    fn found(quad: &Quad, p: DVec3, n: Vec3, u: Vec2) -> FoundOnQuad<1> {
        let mut receiver = Receivers::default();
        receiver.put(0, p, n, u);
        quad.sample(&receiver)
    }

    proptest! {
        /// From anywhere, at any scale, on the light itself and in its plane, too, points are on the quad, and their density is
        /// a finite number, positive in front, that of sampling and that of finding.
        #[test]
        fn densities_agree_and_are_numbers(
            x in -2.0_f64..3.0, y in -2.0_f64..3.0, z in -30_i32..2, scale in -12_i32..1, skew in prop::bool::ANY,
            in_plane in prop::bool::ANY, n in [-1.0_f32..1.0, -1.0..1.0, -1.0..1.0], u in [0.0_f32..1.0, 0.0..1.0],
        ) {
            let size = libm::ldexpf(1.0, scale);
            let e2 = Vec3::new(if skew { 0.4 } else { 0.0 }, 1.0, 0.0);
            let mesh = mesh(Vec3::ZERO, Vec3::X * size, e2 * size);
            let quad = Quad::of(&mesh).unwrap();
            let height = if in_plane { 0.0 } else { libm::ldexp(1.0, z) };
            let p = DVec3::new(x, y, height) * f64::from(size);
            for n in [Vec3::ZERO, Vec3::from(n).normalize_or_zero()] {
                let sampled = found(&quad, p, n, Vec2::from(u));
                let (face, end) = quad.point(&sampled, 0);
                let to = (end.p - p).as_vec3();
                let at_point = quad.pdf(p, n, end.p).to_solid_angle(to.length_squared(), to.dot(end.n) / to.length()).0;
                let sampled = sampled.pdf[0];
                prop_assert!(at_point.is_finite() && sampled.is_finite() && (sampled > 0.0) != in_plane, "{sampled} {at_point}");
                prop_assert!(in_plane || (sampled - at_point).abs() <= 1e-4 * sampled, "{sampled} {at_point}");
                let [a, b, c] = mesh.triangle(face).map(|v| v.as_dvec3());
                let inside = [(a, b), (b, c), (c, a)].iter().all(|(a, b)| (*b - *a).cross(end.p - *a).z >= -1e-9);
                prop_assert!(inside && end.p.z == 0.0, "{end:?}");
            }
        }

        /// However many are sampled for together, near and far, on one side and on both, each gets the same bits.
        #[test]
        fn lanes_do_not_matter(
            all in prop::collection::vec(
                ([-4.0_f64..5.0, -4.0..5.0, -1.0..4.0], [-1.0_f32..1.0, -1.0..1.0, -1.0..1.0], [0.0_f32..1.0, 0.0..1.0]),
                TOGETHER,
            ),
        ) {
            let quad = Quad::of(&square()).unwrap();
            let mut together = Receivers::<TOGETHER>::default();
            let of = |i: usize| {
                let (p, n, u) = all[i];
                let n = if i == 3 { Vec3::ZERO } else { Vec3::from(n).normalize_or_zero() };
                // One on the light, one at its corner.
                let on = [DVec3::new(0.3, 0.4, 0.0), DVec3::ONE.with_z(0.0)];
                (on.get(i).copied().unwrap_or(DVec3::from(p)), n, Vec2::from(u))
            };
            for i in 0..TOGETHER {
                let (p, n, u) = of(i);
                together.put(i, p, n, u);
            }
            let shared = quad.sample(&together);
            for i in 0..TOGETHER {
                let (p, n, u) = of(i);
                let alone = found(&quad, p, n, u);
                prop_assert_eq!(shared.pdf[i].to_bits(), alone.pdf[0].to_bits());
                prop_assert_eq!(shared.first[i], alone.first[0]);
                for axis in 0..3 {
                    prop_assert_eq!(shared.end[axis][i].to_bits(), alone.end[axis][0].to_bits());
                    prop_assert!(shared.pdf[i] == 0.0 || shared.wi[axis][i].to_bits() == alone.wi[axis][0].to_bits());
                }
            }
        }
    }
}
