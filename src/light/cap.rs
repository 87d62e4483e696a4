//! A sphere as a point outside sees it: a cone of directions, all alike.

use crate::math::frame::Frame;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp;
use crate::shape::offset::SurfacePoint;
use crate::shape::sphere::Sphere;
use glam::{DVec3, Vec2, Vec3};

/// The cone in which a point outside a sphere sees it.
pub(super) struct Cap {
    /// Unit vector to the centre.
    axis: Vec3,
    /// 1 − cos of the half angle.
    one_minus_cos: f32,
}

impl Cap {
    /// What `p` sees of the sphere's front; `None` from inside, from the surface, and where the front is the inside.
    ///
    /// A point of the surface itself is inside or outside by rounding: if the front is the outside, it sees nothing of it
    /// either way; if it is the inside, it sees all of it, of which a cap would be the wrong side.
    #[inline]
    pub(super) fn of(sphere: &Sphere, p: DVec3) -> Option<Self> {
        // In f64, where digits cancel: in the difference of near points, and in 1 − sin² from near the surface.
        let to_centre = sphere.centre.as_dvec3() - p;
        let per_distance_squared = 1.0 / to_centre.length_squared();
        let sin2 = f64::from(sphere.radius).powi(2) * per_distance_squared;
        (sin2 < 1.0 && !sphere.flip).then(|| Self {
            axis: (to_centre * per_distance_squared.sqrt()).as_vec3(),
            // 1 − √(1 − sin²) without cancellation.
            one_minus_cos: (sin2 / (1.0 + (1.0 - sin2).sqrt())) as f32,
        })
    }

    /// A uniform direction of the cone (pbrt-v4 section 6.2.4).
    #[inline]
    pub(super) fn direction(&self, u: Vec2) -> Vec3 {
        Frame::from_normal(self.axis).to_world(warp::square_to_uniform_cone(u, self.one_minus_cos))
    }

    /// Density of [`Self::direction`] in the cone.
    #[inline]
    pub(super) fn pdf(&self) -> SolidAnglePdf {
        warp::square_to_uniform_cone_pdf(self.one_minus_cos)
    }
}

/// Least cosine of the angle between the normal of a point and the way back: so that even the f32 normal faces an f32
/// direction, both of which are off by some 2⁻²³.
const LEAST_COSINE: f64 = 1.0 / (1u32 << 20) as f64;

/// Where the ray from `p` outside the sphere in a direction of the cone meets it first, in f64. A direction that rounding has
/// put to the rim or beside it meets it just before the rim.
#[inline]
pub(super) fn nearest(sphere: &Sphere, p: DVec3, w: Vec3) -> SurfacePoint {
    let (to_centre, w) = (sphere.centre.as_dvec3() - p, w.as_dvec3().normalize());
    let radius = f64::from(sphere.radius);
    let along = to_centre.dot(w);
    let beside = to_centre - along * w;
    let half_chord = (radius * radius - beside.length_squared()).max(0.0).sqrt().max(LEAST_COSINE * radius);
    sphere.point(-beside - half_chord * w).point
}
