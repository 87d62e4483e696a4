//! How a ray meets a disk: the crossing with its plane, in f64, and whether that lies inside.
//!
//! A disk is the image of the unit disk under an affine map: the points c + a·u + b·v with a² + b² ≤ 1, an ellipse where
//! u and v are not perpendicular and of the same length. Its parameters are f64, so that it meets what it was made to
//! meet (a cylinder that it closes) to the rounding of f64.

use super::offset::SurfacePoint;
use super::surface::ShapePoint;
use crate::math::bounds::Bounds;
use crate::math::float::{UNIT_ROUNDOFF_F64, round_down, round_up};
use crate::math::ray::Line;
use glam::{DAffine3, DVec2, DVec3};

/// A flat ellipse.
#[derive(Clone, Copy, Debug)]
pub struct Disk {
    centre: DVec3,
    /// Conjugate half axes.
    u: DVec3,
    v: DVec3,
    /// Unit normal of the front.
    n: DVec3,
    /// Dual to u and v in the plane: a = q·dual_u, b = q·dual_v for the point c + q.
    dual_u: DVec3,
    dual_v: DVec3,
    area: f64,
}

impl Disk {
    /// Rounded operations behind a² + b²: the difference to the origin and its products with the normal (5), the
    /// quotient, the point (2), the difference to the centre, a product with a dual vector, itself rounded (10), the
    /// square and the sum, with room for the next power of two.
    const RIM_ROUNDINGS: f64 = 32.0;

    /// The disk around `centre` with these conjugate half axes, whose front is where `front` points; `None` where that is
    /// no disk: an axis is too short, too long or not a number, or the two are parallel.
    pub fn new(centre: DVec3, u: DVec3, v: DVec3, front: DVec3) -> Option<Self> {
        let cross = u.cross(v);
        let squared = cross.length_squared();
        let n = cross.try_normalize()?;
        let n = if n.dot(front) < 0.0 { -n } else { n };
        let (dual_u, dual_v) = (v.cross(cross) / squared, cross.cross(u) / squared);
        let area = std::f64::consts::PI * squared.sqrt();
        let fine = centre.is_finite() && dual_u.is_finite() && dual_v.is_finite() && area > 0.0 && area.is_finite();
        fine.then_some(Self { centre, u, v, n, dual_u, dual_v, area })
    }

    /// Distance to the disk, from either side, in the ray's open interval, in units of its direction, rounded from f64.
    /// Its rim is wider by the rounding of f64, so that no ray passes between it and what it touches.
    #[inline]
    pub fn intersect(&self, ray: &impl Line) -> Option<f32> {
        let t = self.resolve(ray);
        // Nothing is inside where the ray is parallel to the plane and t not finite.
        let inside = t.is_finite() && {
            let reach = (self.centre - ray.origin()).length() + (t * ray.direction()).length();
            let slack = Self::RIM_ROUNDINGS * UNIT_ROUNDOFF_F64 * reach * (self.dual_u.length() + self.dual_v.length());
            self.coordinates(ray, t).length() <= 1.0 + slack
        };
        (inside && ray.contains(t)).then_some(t as f32)
    }

    /// Distance at which `ray` crosses the plane, in f64; not finite where it is parallel to it.
    #[inline]
    pub fn resolve(&self, ray: &impl Line) -> f64 {
        self.n.dot(self.centre - ray.origin()) / self.n.dot(ray.direction())
    }

    /// (a, b) of the crossing at distance t.
    #[inline]
    fn coordinates(&self, ray: &impl Line, t: f64) -> DVec2 {
        self.coordinates_of(ray.origin() + t * ray.direction())
    }

    /// (a, b) of a point of its plane.
    #[inline]
    pub fn coordinates_of(&self, p: DVec3) -> DVec2 {
        let q = p - self.centre;
        DVec2::new(q.dot(self.dual_u), q.dot(self.dual_v))
    }

    /// Centre, unit normal of the front, and radius; `None` of an ellipse that is no circle, to the digits of a file.
    pub fn circle(&self) -> Option<(DVec3, DVec3, f64)> {
        /// By how much its half axes may differ from being perpendicular and of the same length, relative to that.
        const ROUNDING: f64 = 1e-5;
        let [u, v] = [self.u.length(), self.v.length()];
        let is_circle = (u - v).abs() <= ROUNDING * u && self.u.dot(self.v).abs() <= ROUNDING * u * v;
        is_circle.then_some((self.centre, self.n, (u * v).sqrt()))
    }

    /// Where a ray that an accelerator says meets the disk meets it.
    #[inline]
    pub fn meet(&self, ray: &impl Line) -> ShapePoint {
        self.point(self.coordinates(ray, self.resolve(ray)))
    }

    /// The point c + a·u + b·v.
    #[inline]
    pub fn point(&self, ab: DVec2) -> ShapePoint {
        let n = self.n.as_vec3();
        let p = self.centre + ab.x * self.u + ab.y * self.v;
        ShapePoint { point: SurfacePoint { p, n, slack: 0.0 }, shading_normal: n }
    }

    /// The vector from the centre to a point, as a function of the point.
    pub fn radii(&self) -> DAffine3 {
        DAffine3::from_translation(-self.centre)
    }

    /// Area of one side, in the compiled scene's length².
    #[inline]
    pub fn area(&self) -> f64 {
        self.area
    }

    /// A box that contains it, whatever the rounding.
    pub fn bounds(&self) -> Bounds {
        ellipse_bounds(self.centre, self.u, self.v)
    }
}

/// A box around the points c + a·u + b·v with a² + b² = 1, whatever the rounding: along axis i they reach √(uᵢ² + vᵢ²).
pub(super) fn ellipse_bounds(c: DVec3, u: DVec3, v: DVec3) -> Bounds {
    let reach = (u * u + v * v).map(f64::sqrt);
    // The rounding of f64 is below an ulp of f32, except of a coordinate near 0 beside which the others are large: that
    // is what the padding of the hierarchies is for.
    let (low, high) = (c - reach, c + reach);
    Bounds {
        min: low.to_array().map(|x| round_down(x).next_down()).into(),
        max: high.to_array().map(|x| round_up(x).next_up()).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::ray::Ray;
    use glam::Vec3;

    fn ellipse() -> Disk {
        Disk::new(DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.3, 0.2, 0.0), DVec3::Z).unwrap()
    }

    #[test]
    fn met_from_both_sides_inside_its_rim_only() {
        let disk = Disk::new(DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z).unwrap();
        let down = |x: f32, y: f32| disk.intersect(&Ray::new(Vec3::new(x, y, 2.0), Vec3::NEG_Z));
        assert_eq!(down(0.0, 0.0), Some(2.0));
        assert_eq!(down(0.5999, -0.8), Some(2.0));
        assert_eq!(down(1.0, 0.0), Some(2.0));
        assert_eq!(down(1.0f32.next_up(), 0.0), None);
        assert_eq!(down(0.8, 0.7), None);
        assert_eq!(disk.intersect(&Ray::new(Vec3::new(0.0, 0.0, -2.0), Vec3::Z)), Some(2.0));
        assert_eq!(disk.intersect(&Ray::new(Vec3::new(0.5, 0.0, 0.0), Vec3::X)), None, "in its plane");
        assert_eq!(disk.intersect(&Ray::new(Vec3::new(0.5, 0.0, 0.0), Vec3::Z)), None, "from its plane");
        assert_eq!(disk.intersect(&Ray::new(Vec3::new(0.0, 0.0, 2.0), Vec3::Z)), None, "behind");
    }

    #[test]
    fn front_area_and_points() {
        let disk = ellipse();
        assert!((disk.area() - std::f64::consts::PI * 0.1).abs() < 1e-15);
        assert_eq!(disk.point(DVec2::ZERO).point.n, Vec3::Z);
        let back = Disk::new(disk.centre, disk.u, disk.v, DVec3::NEG_Z).unwrap();
        assert_eq!(back.point(DVec2::ZERO).point.n, Vec3::NEG_Z);
        let ab = DVec2::new(-0.3, 0.7);
        let p = disk.point(ab).point.p;
        let ray = Ray::new((p + DVec3::new(0.3, 0.1, 2.0)).as_vec3(), Vec3::new(-0.3, -0.1, -2.0));
        assert!((disk.meet(&ray).point.p - p).length() < 1e-7);
    }

    #[test]
    fn bounds_are_tight_and_contain_the_rim() {
        let disk = ellipse();
        let b = disk.bounds();
        let mut seen = Bounds::EMPTY;
        for i in 0..1000 {
            let (s, c) = (f64::from(i) * std::f64::consts::TAU / 1000.0).sin_cos();
            let p = disk.point(DVec2::new(c, s)).point.p;
            assert!(p.cmpge(b.min.as_dvec3()).all() && p.cmple(b.max.as_dvec3()).all(), "{p} outside {b:?}");
            seen = Bounds { min: seen.min.min(p.as_vec3()), max: seen.max.max(p.as_vec3()) };
        }
        assert!((b.min - seen.min).abs().max_element() < 1e-5 && (b.max - seen.max).abs().max_element() < 1e-5);
    }

    #[test]
    fn what_is_no_disk_is_refused() {
        let make = |u: DVec3, v: DVec3| Disk::new(DVec3::ZERO, u, v, DVec3::Z);
        assert!(make(DVec3::X, 2.0 * DVec3::X).is_none());
        assert!(make(DVec3::X, DVec3::ZERO).is_none());
        assert!(make(DVec3::X, DVec3::NAN).is_none());
        assert!(make(1e-200 * DVec3::X, 1e-200 * DVec3::Y).is_none());
        assert!(make(1e300 * DVec3::X, 1e300 * DVec3::Y).is_none());
    }
}
