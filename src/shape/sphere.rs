//! How a ray meets a sphere: the roots, in f64, of |o + t·d − c|² = r².
//!
//! With f = o − c, a = d·d and b = −f·d the roots are (b ± √(a·δ))/a, where δ = r² − |f + (b/a)·d|² is the square of the
//! radius less that of the distance of the line from the centre: unlike b² − a·c it does not cancel for a small or far
//! sphere (Haines, Günther and Akenine-Möller 2019, *Precision Improvements for Ray/Sphere Intersection*). The root of
//! larger size is q/a, q = b + sgn(b)·√(a·δ); the other is (f·f − r²)/q, which is exact near 0 where q/a would cancel.

use crate::math::bounds::Bounds;
use crate::math::ray::Line;
use glam::{DVec3, Vec3};

/// A sphere.
#[derive(Clone, Copy, Debug)]
pub struct Sphere {
    /// Centre.
    pub centre: Vec3,
    /// Radius, positive.
    pub radius: f32,
    /// Whether the front is the inside.
    pub flip: bool,
}

/// By what part of f², f leading from the centre to the origin, the discriminant must be below zero to be so whatever its
/// rounding: dot products of three differences, their product and difference are off by less than 2⁻⁴⁹·a·f² where these
/// are of f32 numbers, and by less than 2⁻⁴⁷·a·f² where they are of f64 ones and rounded themselves.
const CERTAIN_MISS: f64 = 1.0 / (1u64 << 46) as f64;

impl Sphere {
    /// Distance to the nearest point of the surface, met from outside or inside, in the ray's open interval, in units of
    /// its direction, rounded from f64.
    #[inline]
    pub fn intersect(&self, ray: &impl Line) -> Option<f32> {
        if self.is_passed(ray) {
            return None;
        }
        let (discriminant, roots) = self.roots(ray);
        if discriminant < 0.0 {
            return None;
        }
        roots.into_iter().find(|&t| ray.contains(t)).map(|t| t as f32)
    }

    /// Whether the ray certainly meets nothing, for it starts outside and leads away or past: most do, and that takes no
    /// division.
    #[inline]
    fn is_passed(&self, ray: &impl Line) -> bool {
        let d = ray.direction();
        let r = f64::from(self.radius);
        let f: DVec3 = ray.origin() - self.centre.as_dvec3();
        let (a, b, distance2) = (d.dot(d), -f.dot(d), f.dot(f));
        let c = distance2 - r * r;
        c > 0.0 && (b < 0.0 || b * b < a * (c - CERTAIN_MISS * distance2))
    }

    /// Distance at which `ray` meets the sphere that an accelerator says it meets, in f64. Never fails: of a line that
    /// passes beside the sphere it is that of the nearest point, and of roots outside the interval the larger.
    #[inline]
    pub fn resolve(&self, ray: &impl Line) -> f64 {
        let (_, roots) = self.roots(ray);
        if ray.contains(roots[0]) { roots[0] } else { roots[1] }
    }

    /// A box that contains it, whatever the rounding of c ± r.
    pub fn bounds(&self) -> Bounds {
        let outward = |c: f32, r: f32| {
            if r < 0.0 { (c + r).next_down() } else { (c + r).next_up() }
        };
        let (c, r) = (self.centre, self.radius);
        Bounds {
            min: Vec3::new(outward(c.x, -r), outward(c.y, -r), outward(c.z, -r)),
            max: Vec3::new(outward(c.x, r), outward(c.y, r), outward(c.z, r)),
        }
    }

    /// δ, and the roots in ascending order, or twice the nearest point where δ is negative.
    #[inline]
    fn roots(&self, ray: &impl Line) -> (f64, [f64; 2]) {
        let d = ray.direction();
        let r = f64::from(self.radius);
        let f: DVec3 = ray.origin() - self.centre.as_dvec3();
        solve(d.dot(d), -f.dot(d), f.dot(f) - r * r, |t| r * r - (f + t * d).length_squared())
    }
}

/// δ and the roots of a·t² − 2·b·t + c = 0 in ascending order, as the head says; `discriminant(b/a)` is δ. Twice the
/// nearest point where δ is not positive.
#[inline]
pub(super) fn solve(a: f64, b: f64, c: f64, discriminant: impl Fn(f64) -> f64) -> (f64, [f64; 2]) {
    let nearest = b / a;
    let discriminant = discriminant(nearest);
    if discriminant <= 0.0 {
        return (discriminant, [nearest; 2]);
    }
    let root = (a * discriminant).sqrt();
    let q = if b < 0.0 { b - root } else { b + root };
    let (t0, t1) = (c / q, q / a);
    (discriminant, if t0 < t1 { [t0, t1] } else { [t1, t0] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::ray::Ray;

    const SPHERE: Sphere = Sphere { centre: Vec3::ZERO, radius: 1.0, flip: false };

    #[test]
    fn outside_inside_behind_and_beside() {
        let along_x = |x: f32, y: f32| SPHERE.intersect(&Ray::new(Vec3::new(x, y, 0.0), Vec3::X));
        assert_eq!(along_x(-3.0, 0.0), Some(2.0));
        assert_eq!(along_x(0.0, 0.0), Some(1.0));
        assert_eq!(along_x(-1.0, 0.0), Some(2.0));
        assert_eq!(along_x(1.0, 0.0), None);
        assert_eq!(along_x(3.0, 0.0), None);
        assert_eq!(along_x(-3.0, 1.0), Some(3.0));
        assert_eq!(along_x(-3.0, 1.0f32.next_up()), None);
    }

    #[test]
    fn interval_is_open_and_resolve_agrees() {
        let ray = Ray { tmin: 0.0, tmax: 2.0, ..Ray::new(Vec3::new(-3.0, 0.0, 0.0), Vec3::X) };
        assert_eq!(SPHERE.intersect(&ray), None);
        let ray = Ray { tmin: 2.0, tmax: 5.0, ..ray };
        assert_eq!(SPHERE.intersect(&ray), Some(4.0));
        assert_eq!(SPHERE.resolve(&ray), 4.0);
    }

    #[test]
    fn tiny_and_far_keeps_its_precision() {
        let sphere = Sphere { centre: Vec3::new(1000.0, 0.0, 0.0), radius: 1e-3, flip: false };
        let t = sphere.resolve(&Ray::new(Vec3::ZERO, Vec3::X));
        assert!((t - (1000.0 - f64::from(1e-3f32))).abs() < 1e-12, "{t}");
    }
}
