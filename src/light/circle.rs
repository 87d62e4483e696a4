//! Sampling of circular disks by the solid angle in which a point near them sees them, or nearly so.
//!
//! The directions to a disk fill a cone with an elliptic cross section, the inside of a spherical ellipse. Its axis halves the
//! angle between the nearest and the farthest point of the rim; with the tangents a ≥ b of its half angles along the ellipse's axes,
//! which lie along the disk and across, it ends at the angle φ around the axis where 1/tan² = w(φ) = cos²φ/a² + sin²φ/b². (The matrix
//! uuᵀ + vvᵀ − ccᵀ of the half axes u and v of the disk and its centre c has these axes as eigenvectors, and a² and b² are
//! quotients of its eigenvalues.)
//!
//! Guillén, Ureña, King, Fajardo, Georgiev, López-Moreno and Jarabo 2017, *Area-Preserving Parameterizations for Spherical Ellipses*,
//! sample that uniformly, by elliptic integrals that have to be inverted step by step or tabulated. Here φ is chosen by another
//! density than the uniform one's, which is in proportion to the cosine's range 1 − cos = 1/e(w), e(w) = 1 + w + √(w(1 + w)): by
//! 1/(e(1/a²)·cos²φ + e(1/b²)·sin²φ), the same along both axes, which is that of a point of a plane ellipse and needs no more than
//! its square roots. The cosine is then uniform. As e is concave, and between 1 + w and 2(1 + w), what results is uniform up
//! to a factor of (1 + √2)/2 between its least and its largest density, wherever the disk is seen from; from its axis it is uniform.

use crate::sampling::pdf::{AreaPdf, PointPdf, SolidAnglePdf};
use crate::sampling::warp;
use crate::shape::disk::Disk;
use crate::shape::offset::SurfacePoint;
use glam::{DVec2, DVec3, Vec2};
use std::f64::consts::TAU;

/// Points nearer to the centre than so many radii sample a disk by solid angle. What arrives from there by area has a standard
/// deviation of a twentieth of the mean in front of the middle.
const NEAR: f64 = 3.0;

/// Largest w: a disk that is seen less than a millionth of a radian high is sampled by area, as a point of it is no longer told
/// by its direction.
const LARGEST: f64 = 1e12;

/// A disk that is a circle.
#[derive(Clone, Debug)]
pub(super) struct Circle {
    centre: DVec3,
    radius: f64,
    /// Unit normal of the front.
    n: DVec3,
    /// One over the area.
    uniform: AreaPdf,
}

/// The directions from a point to a circle.
struct Cone {
    /// Unit vectors: the axis of the cone, and the longer and the shorter axis of the ellipse.
    axis: DVec3,
    long: DVec3,
    short: DVec3,
    /// w along both.
    w: [f64; 2],
    /// e(w) along both.
    e: [f64; 2],
    /// From the point to the centre, and the distance from the plane.
    to_centre: DVec3,
    height: f64,
    /// Unit normal of the front.
    n: DVec3,
}

impl Circle {
    /// The circle that a disk is; `None` if it is something else.
    pub(super) fn of(disk: &Disk) -> Option<Self> {
        let (centre, n, radius) = disk.circle()?;
        Some(Self { centre, radius, n, uniform: AreaPdf((1.0 / disk.area()) as f32) })
    }

    /// A point of the disk, and the density with which it is found from `p`.
    #[inline(never)]
    pub(super) fn sample(&self, disk: &Disk, p: DVec3, u: Vec2) -> (SurfacePoint, PointPdf) {
        let u = warp::square_to_disk(u).as_dvec2();
        match self.cone(p) {
            None => (disk.point(u).point, PointPdf::Area(self.uniform)),
            Some(cone) => {
                let on_disk = disk.coordinates_of(self.centre + cone.offset(u));
                let end = disk.point(on_disk / on_disk.length().max(1.0)).point;
                (end, PointPdf::SolidAngle(cone.pdf(end.p - p)))
            }
        }
    }

    /// The density with which a point of the disk is found from `p`.
    #[inline(never)]
    pub(super) fn pdf(&self, p: DVec3, end: DVec3) -> PointPdf {
        self.cone(p).map_or(PointPdf::Area(self.uniform), |cone| PointPdf::SolidAngle(cone.pdf(end - p)))
    }

    /// What `p` sees of the front; `None` where points are sampled by area.
    fn cone(&self, p: DVec3) -> Option<Cone> {
        let to_centre = self.centre - p;
        let height = -self.n.dot(to_centre);
        let radius = self.radius;
        if !(height > 0.0 && to_centre.length_squared() < (NEAR * radius).powi(2)) {
            return None;
        }
        let aside = to_centre + height * self.n;
        let e = aside.try_normalize().unwrap_or_else(|| self.n.any_orthonormal_vector());
        let aside = aside.length();
        // In the plane of the normal and the centre: to the nearest and the farthest point of the rim.
        let [nearest, farthest] = [aside - radius, aside + radius].map(|x| DVec2::new(x, height));
        let [x, z] = (nearest.normalize() + farthest.normalize()).normalize().to_array();
        // The eigenvalues but radius² and the sign of the negative one: their sum and their product are known.
        let sum = (radius - aside) * (radius + aside) - height * height;
        let larger = 0.5 * (sum.abs() + nearest.length() * farthest.length());
        let smaller = (height * radius).powi(2) / larger;
        let [positive, negative] = if sum > 0.0 { [larger, smaller] } else { [smaller, larger] };
        let w = [negative / (radius * radius), negative / positive];
        // NaN, too, on the rim itself.
        (w[1] <= LARGEST).then(|| Cone {
            axis: x * e - z * self.n,
            long: self.n.cross(e),
            short: z * e + x * self.n,
            w,
            e: w.map(inverse_range),
            to_centre,
            height,
            n: self.n,
        })
    }
}

impl Cone {
    /// From the centre to the point of the plane that is seen in the direction for a point of the unit disk.
    fn offset(&self, u: DVec2) -> DVec3 {
        // Where the boundary is met at this angle, from the axis of the cone.
        let [x, y] = [u.x / self.e[0].sqrt(), u.y / self.e[1].sqrt()];
        let around = DVec2::new(x, y).try_normalize().unwrap_or(DVec2::X);
        let range = 1.0 / inverse_range(self.w_at(around));
        let below = u.length_squared() * range;
        let aside = (below * (2.0 - below)).max(0.0).sqrt() * around;
        let direction = (1.0 - below) * self.axis + aside.x * self.long + aside.y * self.short;
        direction * (self.height / -self.n.dot(direction)) - self.to_centre
    }

    /// w at the angle around the axis of this unit vector.
    fn w_at(&self, around: DVec2) -> f64 {
        self.w[0] * around.x * around.x + self.w[1] * around.y * around.y
    }

    /// Density of the direction of a vector that leads into the cone.
    fn pdf(&self, to: DVec3) -> SolidAnglePdf {
        // On the axis, where any angle is right, the one that sampling takes.
        let around = DVec2::new(to.dot(self.long), to.dot(self.short)).try_normalize().unwrap_or(DVec2::X);
        let [long, short] = self.e;
        let of_angle = (long * short).sqrt() / (TAU * (long * around.x * around.x + short * around.y * around.y));
        SolidAnglePdf((of_angle * inverse_range(self.w_at(around))) as f32)
    }
}

/// e(w): one over the range of the cosine, 1 − cos, at the end of which 1/tan² is w.
fn inverse_range(w: f64) -> f64 {
    1.0 + w + (w * (1.0 + w)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{Sampler, SamplerKind};
    use proptest::prelude::*;

    fn uniform(i: u32) -> Vec2 {
        Sampler { kind: SamplerKind::Independent, seed: 37 }.stream(0, 0, i).light(0).point()
    }

    fn unit_disk(size: f64) -> (Disk, Circle) {
        let disk = Disk::new(DVec3::ZERO, DVec3::X * size, DVec3::Y * size, DVec3::Z).unwrap();
        let circle = Circle::of(&disk).unwrap();
        (disk, circle)
    }

    #[test]
    fn only_circles_are_circles() {
        let of = |u, v| Circle::of(&Disk::new(DVec3::ONE, u, v, DVec3::Z).unwrap()).is_some();
        assert!(of(DVec3::X, DVec3::Y) && of(DVec3::new(0.6, 0.8, 0.0), DVec3::new(-0.8, 0.6, 0.0)));
        assert!(!of(DVec3::X, 1.1 * DVec3::Y) && !of(DVec3::X, DVec3::new(0.6, 0.8, 0.0)));
    }

    /// In front of the middle all directions of a circular cone are alike: 1/(2π(1 − cos)).
    #[test]
    fn from_its_axis_a_disk_is_a_cone() {
        let (disk, circle) = unit_disk(1.0);
        for height in [1e-6_f64, 0.01, 0.5, 2.0, 2.9] {
            let expected = 1.0 / (TAU * (1.0 - height / (1.0 + height * height).sqrt()));
            for i in 0..100 {
                let (_, pdf) = circle.sample(&disk, DVec3::Z * height, uniform(i));
                let PointPdf::SolidAngle(pdf) = pdf else { panic!("{height}") };
                assert!((f64::from(pdf.0) / expected - 1.0).abs() < 1e-6, "{height}: {pdf:?}, {expected}");
            }
        }
        for (p, what) in
            [(DVec3::Z * 5.0, "far"), (-DVec3::Z, "behind"), (2.0 * DVec3::X, "edge-on"), (DVec3::X, "the rim")]
        {
            assert!(circle.cone(p).is_none(), "{what}");
        }
    }

    /// The bound of the module's head, and what it is good for: the noise of a disk that all directions
    /// see alike, beside that of sampling by area.
    #[test]
    fn directions_are_nearly_uniform_wherever_a_disk_is_seen_from() {
        let (disk, circle) = unit_disk(1.0);
        let bound = 0.5 * (1.0 + std::f64::consts::SQRT_2);
        let near =
            [(0.0, 0.1), (0.5, 0.1), (0.9, 0.01), (0.999, 1e-4), (0.5, 1e-5), (1.1, 0.1), (2.0, 0.3), (1.001, 1e-4)];
        for (x, z) in near.into_iter().chain([(2.9, 1e-3), (2.0, 2.0)]) {
            let p = DVec3::new(x, 0.0, z);
            let weights = |by_area: bool| {
                (0..2048)
                    .map(uniform)
                    .map(|u| {
                        let (end, pdf) = match by_area {
                            true => {
                                (disk.point(warp::square_to_disk(u).as_dvec2()).point, PointPdf::Area(circle.uniform))
                            }
                            false => circle.sample(&disk, p, u),
                        };
                        let to = end.p - p;
                        f64::from(1.0 / pdf.to_solid_angle(to.length_squared() as f32, to.normalize().z as f32).0)
                    })
                    .collect::<Vec<f64>>()
            };
            let [solid, area] = [false, true].map(weights);
            let (low, high) = solid.iter().fold((f64::INFINITY, 0.0f64), |(l, h), &w| (l.min(w), h.max(w)));
            assert!(high / low <= bound * (1.0 + 1e-6), "{p}: from {low} to {high}");
            let deviation = |values: &[f64]| {
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                (values.iter().map(|w| (w - mean) * (w - mean)).sum::<f64>() / values.len() as f64).sqrt() / mean
            };
            let [solid, area] = [deviation(&solid), deviation(&area)];
            assert!(solid < 0.07 && solid < 0.3 * area, "{p}: {solid} against {area}");
        }
    }

    proptest! {
        /// From anywhere, at any scale, on the light itself and in its plane, too, points are on the disk, and their density is
        /// positive and finite, that of sampling and that of finding; and all of it is the same bits at another power of two.
        #[test]
        fn densities_agree_and_are_numbers(
            x in -3.0_f64..3.0, y in -3.0_f64..3.0, z in -40_i32..3, scale in -12_i32..3, in_plane in prop::bool::ANY,
            u in [0.0_f32..1.0, 0.0..1.0],
        ) {
            let at = |scale: i32| {
                let size = libm::ldexp(1.0, scale);
                let (disk, circle) = unit_disk(size);
                let height = if in_plane { 0.0 } else { libm::ldexp(1.0, z) };
                let p = DVec3::new(x, y, height) * size;
                let (end, sampled) = circle.sample(&disk, p, Vec2::from(u));
                let densities = [sampled, circle.pdf(p, end.p)].map(|pdf| match pdf {
                    PointPdf::Area(pdf) => f64::from(pdf.0) * size * size,
                    PointPdf::SolidAngle(pdf) => f64::from(pdf.0),
                });
                (end.p / size, densities)
            };
            let (end, [sampled, found]) = at(scale);
            prop_assert!(end.z == 0.0 && end.length() <= 1.0 + 1e-12, "{end}");
            prop_assert!(sampled > 0.0 && sampled.is_finite(), "{sampled}");
            prop_assert!((sampled - found).abs() <= 1e-4 * sampled, "{sampled} {found}");
            prop_assert_eq!(at(0), (end, [sampled, found]));
        }
    }
}
