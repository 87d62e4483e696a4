//! How a ray meets the side of a cylinder: the roots of a quadratic in the cylinder's own space, in f64.
//!
//! A cylinder is the image of the unit one under an affine map: the points b + x·u + y·v + z·h with x² + y² = 1 and
//! 0 ≤ z ≤ 1. It is round and straight where u, v and h are perpendicular and |u| = |v|; any other affine image is
//! treated just as exactly. Both its ends are open.
//!
//! Distances along a ray do not change under affine maps, so the ray is taken to the cylinder's space, where it is
//! projected to the x-y plane: with f the projected origin, d the direction, a = d·d and β = −f·d the roots are
//! (β ± √(a·δ))/a, where δ = 1 − |f + (β/a)·d|², computed so that nothing cancels for a thin or far cylinder; see
//! [`super::sphere`], from where the argument and its source carry over.

use super::disk::ellipse_bounds;
use super::offset::{self, SurfacePoint};
use super::surface::ShapePoint;
use crate::math::bounds::Bounds;
use crate::math::float::UNIT_ROUNDOFF_F64;
use crate::math::ray::Line;
use glam::{DAffine3, DMat3, DVec2, DVec3};

/// The side of a cylinder.
#[derive(Clone, Copy, Debug)]
pub struct Cylinder {
    base: DVec3,
    /// Conjugate half axes of the cross section.
    u: DVec3,
    v: DVec3,
    /// From the middle of one end to that of the other.
    h: DVec3,
    /// The rows of the inverse map: x = q·dual\[0\] for the point b + q, and so on.
    dual: [DVec3; 3],
    /// |det| of the map.
    volume: f64,
    /// Whether the front is the inside.
    flip: bool,
}

impl Cylinder {
    /// Rounded operations behind z: the difference to the origin, the product with a dual vector, itself rounded (10),
    /// the same of the direction, the distance (8), product and sum, with room for the next power of two.
    const RIM_ROUNDINGS: f64 = 32.0;

    /// The cylinder from `base` along `h`, with these conjugate half axes of its cross section; its front is the outside
    /// unless `flip`. `None` where that is no cylinder: something is too short, too long or not a number.
    pub fn new(base: DVec3, [u, v, h]: [DVec3; 3], flip: bool) -> Option<Self> {
        let det = u.cross(v).dot(h);
        let dual = [v.cross(h) / det, h.cross(u) / det, u.cross(v) / det];
        let fine = base.is_finite() && det != 0.0 && det.is_finite() && dual.iter().all(|d| d.is_finite());
        fine.then_some(Self { base, u, v, h, dual, volume: det.abs(), flip })
    }

    /// Distance to the nearest point of the surface, met from outside or inside, in the ray's open interval, in units of
    /// its direction, rounded from f64. Its ends are farther by the rounding of z in f64, so that no ray passes between
    /// them and what they touch (but for that part which the distance of a grazing ray magnifies).
    #[inline]
    pub fn intersect(&self, ray: &impl Line) -> Option<f32> {
        let local = self.localize(ray);
        let (discriminant, roots) = roots(&local);
        // Also where the ray is parallel to the axis and the discriminant NaN.
        if !(discriminant >= 0.0) {
            return None;
        }
        roots.into_iter().find(|&t| self.counts(ray, &local, t)).map(|t| t as f32)
    }

    /// Distance at which `ray` meets the cylinder that an accelerator says it meets, in f64: that of the first root that
    /// counts, or else of the larger. Not finite where it is parallel to the axis.
    #[inline]
    pub fn resolve(&self, ray: &impl Line) -> f64 {
        let local = self.localize(ray);
        let (_, roots) = roots(&local);
        if self.counts(ray, &local, roots[0]) { roots[0] } else { roots[1] }
    }

    /// Where a ray that an accelerator says meets the cylinder meets it.
    #[inline]
    pub fn meet(&self, ray: &impl Line) -> ShapePoint {
        let local = self.localize(ray);
        let q = local.o + self.resolve(ray) * local.d;
        self.point(q.truncate(), q.z.clamp(0.0, 1.0))
    }

    /// The point at height z, in 0..1, in the direction `xy` of the cross section's own plane, not zero, of any length.
    #[inline]
    pub fn point(&self, xy: DVec2, z: f64) -> ShapePoint {
        let xy = xy.normalize();
        let p = self.base + xy.x * self.u + xy.y * self.v + z * self.h;
        let n = self.radial(xy).normalize().as_vec3();
        let n = if self.flip { -n } else { n };
        let slack = offset::sagitta(p, self.curvature(xy));
        ShapePoint { point: SurfacePoint { p, n, slack }, shading_normal: n }
    }

    /// A bound on its curvature in the direction `xy` of unit length. A point that is moved along the surface by e is moved in the
    /// unit circle's plane by at most e·√(|dual₀|² + |dual₁|²), which is squared there and halved; along n, the distance to the
    /// circle changes by the length of the normal's image.
    #[inline]
    pub(super) fn curvature(&self, xy: DVec2) -> f64 {
        (self.dual[0].length_squared() + self.dual[1].length_squared()) / self.radial(xy).length()
    }

    /// Where `p` is as seen along the axis: outside of the (endless) cylinder if longer than 1.
    #[inline]
    pub fn project(&self, p: DVec3) -> DVec2 {
        let q = p - self.base;
        DVec2::new(q.dot(self.dual[0]), q.dot(self.dual[1]))
    }

    /// Area per angle (of the cross section's own plane) and height around the direction `xy` of unit length, in the
    /// compiled scene's length²: |∂p/∂φ × ∂p/∂z| is |det| times the length of the image of the normal.
    #[inline]
    pub fn area_element(&self, xy: DVec2) -> f64 {
        self.volume * self.radial(xy).length()
    }

    /// The vector along the cross section's rim at a point of the surface, as a function of the point: at angle φ,
    /// cos φ·v − sin φ·u.
    pub fn circles(&self) -> DAffine3 {
        let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
        let linear = outer(self.v, self.dual[0]) - outer(self.u, self.dual[1]);
        DAffine3 { matrix3: linear, translation: -(linear * self.base) }
    }

    /// Area, in the compiled scene's length².
    pub fn area(&self) -> f64 {
        /// Points of the trapezoidal rule, which converges exponentially for a periodic analytic function: for a cross
        /// section of 1 : 10 it is exact to f64, for 1 : 1000 to 10⁻⁶ (an elliptic integral has no closed form).
        const POINTS: u32 = 512;
        let step = std::f64::consts::TAU / f64::from(POINTS);
        let element = |i: u32| {
            let (y, x) = libm::sincos(f64::from(i) * step);
            self.area_element(DVec2::new(x, y))
        };
        (0..POINTS).map(element).sum::<f64>() * step
    }

    /// Whether the front is the inside.
    #[inline]
    pub fn is_flipped(&self) -> bool {
        self.flip
    }

    /// A box that contains it, whatever the rounding.
    pub fn bounds(&self) -> Bounds {
        ellipse_bounds(self.base, self.u, self.v).union(ellipse_bounds(self.base + self.h, self.u, self.v))
    }

    /// The image of the outward normal: normals are covectors, and move with the inverse transpose.
    #[inline]
    fn radial(&self, xy: DVec2) -> DVec3 {
        xy.x * self.dual[0] + xy.y * self.dual[1]
    }

    /// The ray in the cylinder's space.
    #[inline]
    fn localize(&self, ray: &impl Line) -> LocalRay {
        let to_local = |q: DVec3| DVec3::new(q.dot(self.dual[0]), q.dot(self.dual[1]), q.dot(self.dual[2]));
        LocalRay { o: to_local(ray.origin() - self.base), d: to_local(ray.direction()) }
    }

    /// Whether a root lies in the ray's interval and between the ends.
    #[inline]
    fn counts(&self, ray: &impl Line, local: &LocalRay, t: f64) -> bool {
        let z = local.o.z + t * local.d.z;
        let reach = (ray.origin() - self.base).length() + (t * ray.direction()).length();
        let slack = Self::RIM_ROUNDINGS * UNIT_ROUNDOFF_F64 * reach * self.dual[2].length();
        ray.contains(t) && z >= -slack && z <= 1.0 + slack
    }
}

/// A ray in the space where the cylinder is the unit one.
#[derive(Clone, Copy, Debug)]
struct LocalRay {
    o: DVec3,
    d: DVec3,
}

/// δ, and the roots in ascending order, or twice the nearest point where δ is negative.
#[inline]
fn roots(ray: &LocalRay) -> (f64, [f64; 2]) {
    let (f, d) = (ray.o.truncate(), ray.d.truncate());
    super::sphere::solve(d.dot(d), -f.dot(d), f.dot(f) - 1.0, |t| 1.0 - (f + t * d).length_squared())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::ray::Ray;
    use glam::Vec3;

    const UNIT: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];

    fn oblique() -> Cylinder {
        let axes = [DVec3::new(0.4, 0.1, 0.0), DVec3::new(-0.1, 0.2, 0.1), DVec3::new(0.1, 0.0, 0.6)];
        Cylinder::new(DVec3::new(0.2, -0.1, 0.3), axes, false).unwrap()
    }

    #[test]
    fn outside_inside_through_the_ends_and_beside() {
        let cylinder = Cylinder::new(DVec3::ZERO, UNIT, false).unwrap();
        let ray = |o: [f32; 3], d: [f32; 3]| cylinder.intersect(&Ray::new(o.into(), d.into()));
        assert_eq!(ray([-3.0, 0.0, 0.5], [1.0, 0.0, 0.0]), Some(2.0));
        assert_eq!(ray([0.0, 0.0, 0.5], [1.0, 0.0, 0.0]), Some(1.0));
        assert_eq!(ray([-1.0, 0.0, 0.5], [1.0, 0.0, 0.0]), Some(2.0));
        assert_eq!(ray([1.0, 0.0, 0.5], [1.0, 0.0, 0.0]), None);
        assert_eq!(ray([-3.0, 0.0, 1.0], [1.0, 0.0, 0.0]), Some(2.0));
        assert_eq!(ray([-3.0, 0.0, 1.0f32.next_up()], [1.0, 0.0, 0.0]), None);
        assert_eq!(ray([-3.0, 1.0, 0.5], [1.0, 0.0, 0.0]), Some(3.0));
        assert_eq!(ray([-3.0, 1.0f32.next_up(), 0.5], [1.0, 0.0, 0.0]), None);
        assert_eq!(ray([0.5, 0.0, -3.0], [0.0, 0.0, 1.0]), None, "through both ends");
        assert_eq!(ray([1.0, 0.0, -3.0], [0.0, 0.0, 1.0]), None, "along the surface");
        assert_eq!(ray([-2.0, 0.0, 2.0], [1.0, 0.0, -1.0]), Some(1.0));
        assert_eq!(ray([-2.0, 0.0, 2.5], [1.0, 0.0, -1.0]), Some(3.0).filter(|_| false), "in above, out below");
        assert_eq!(ray([-2.0, 0.0, 2.25], [1.0, 0.0, -0.5]), Some(3.0), "in through the open end");
    }

    #[test]
    fn normals_points_and_areas_of_an_oblique_one() {
        let c = oblique();
        let (mut area, n) = (0.0, 4000);
        for i in 0..n {
            let (y, x) = (f64::from(i) * std::f64::consts::TAU / f64::from(n)).sin_cos();
            let here = c.point(DVec2::new(x, y), 0.3).point;
            let along = -y * c.u + x * c.v;
            let normal = along.cross(c.h).normalize();
            assert!((here.n.as_dvec3() - normal).length() < 1e-6, "{} against {normal}", here.n);
            assert!((c.project(here.p) - DVec2::new(x, y)).length() < 1e-14);
            area += along.cross(c.h).length();
        }
        area *= std::f64::consts::TAU / f64::from(n);
        assert!((c.area() / area - 1.0).abs() < 1e-12);
        let round = Cylinder::new(DVec3::ONE, [2.0 * DVec3::X, 2.0 * DVec3::Y, 3.0 * DVec3::Z], true).unwrap();
        assert!((round.area() / (12.0 * std::f64::consts::PI) - 1.0).abs() < 1e-14);
        assert_eq!(round.point(DVec2::X, 0.5).point.n, Vec3::NEG_X);
    }

    #[test]
    fn circles_follow_the_angle() {
        let c = oblique();
        for i in 0..20 {
            let (sin, cos) = f64::from(i).sin_cos();
            let point = c.point(DVec2::new(cos, sin), 0.05 * f64::from(i)).point;
            let rim = c.circles().transform_point3(point.p);
            assert!((rim - (cos * c.v - sin * c.u)).length() < 1e-14, "{rim}");
            assert!(rim.normalize().dot(point.n.as_dvec3()).abs() < 1e-6);
        }
    }

    #[test]
    fn a_thread_of_one_millionth_keeps_its_precision() {
        let axes = [1e-6 * DVec3::X, 1e-6 * DVec3::Y, DVec3::Z];
        let thread = Cylinder::new(DVec3::ZERO, axes, false).unwrap();
        let ray = Ray::new(Vec3::new(-1000.0, 0.0, 0.5), Vec3::X);
        let t = thread.resolve(&ray);
        assert!((t - (1000.0 - 1e-6)).abs() < 1e-12, "{t}");
        assert!((thread.meet(&ray).point.p - DVec3::new(-1e-6, 0.0, 0.5)).length() < 1e-12);
    }

    #[test]
    fn what_is_no_cylinder_is_refused() {
        assert!(Cylinder::new(DVec3::ZERO, [DVec3::X, DVec3::X, DVec3::Z], false).is_none());
        assert!(Cylinder::new(DVec3::ZERO, [DVec3::X, DVec3::Y, DVec3::ZERO], false).is_none());
        assert!(Cylinder::new(DVec3::NAN, UNIT, false).is_none());
        assert!(Cylinder::new(DVec3::ZERO, UNIT.map(|a| 1e-150 * a), false).is_none());
    }
}
