//! Surfaces that emit the same radiance from every point of their front side, in every direction of that side.

use super::LightSample;
use crate::math::frame::Frame;
use crate::sampling::distribution::Discrete;
use crate::sampling::pdf::{AreaPdf, SolidAnglePdf};
use crate::sampling::warp;
use crate::shape::offset::SurfacePoint;
use crate::shape::sphere::Sphere;
use crate::shape::{Shape, TriangleMesh};
use crate::spectrum::Rgb;
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// A shape that emits.
#[derive(Clone, Debug)]
pub struct AreaLight {
    /// Which shape.
    pub shape: u32,
    /// Radiance of its front side in W·sr⁻¹·m⁻².
    pub radiance: Rgb,
    /// Density of a uniform point of its surface.
    pdf: AreaPdf,
    /// Triangles in proportion to their areas; `None` for a sphere.
    triangles: Option<Discrete>,
}

/// What a point sees of a sphere that it is outside of.
struct Cap {
    /// 1 − cos of the half angle.
    one_minus_cos: f64,
    /// Squared distance to the centre.
    distance_squared: f64,
}

impl AreaLight {
    /// `shape` is the index of `surface`. `None` where the surface has no area.
    pub fn new(shape: u32, surface: &Shape, radiance: Rgb) -> Option<Self> {
        let (area, triangles) = match surface {
            Shape::Mesh(mesh) => (mesh.areas().sum::<f64>(), Some(Discrete::new(mesh.areas())?)),
            Shape::Sphere(s) => (4.0 * PI * f64::from(s.radius) * f64::from(s.radius), None),
        };
        let pdf = AreaPdf((1.0 / area) as f32);
        pdf.0.is_finite().then_some(Self { shape, radiance, pdf, triangles })
    }

    #[inline]
    pub(super) fn sample(&self, surface: &Shape, p: DVec3, u: Vec2) -> Option<LightSample> {
        match surface {
            Shape::Mesh(mesh) => self.towards(p, self.mesh_point(mesh, u)),
            Shape::Sphere(sphere) => match Cap::of(sphere, p) {
                Some(cap) => self.sample_cap(sphere, &cap, p, u),
                None => self.towards(p, sphere.point(warp::square_to_uniform_sphere(u).as_dvec3()).point),
            },
        }
    }

    /// Density with which [`super::Light::sample`] finds the direction from `p` to the point `end` of this light.
    #[inline]
    pub fn pdf(&self, surface: &Shape, p: DVec3, end: &SurfacePoint) -> SolidAnglePdf {
        if let Shape::Sphere(sphere) = surface
            && let Some(cap) = Cap::of(sphere, p)
        {
            return warp::square_to_uniform_cone_pdf(cap.one_minus_cos as f32);
        }
        // The difference is what needs f64; its length does not.
        let to = (end.p - p).as_vec3();
        let distance_squared = to.length_squared();
        self.pdf.to_solid_angle(distance_squared, to.dot(end.n) / distance_squared.sqrt())
    }

    /// Radiance that leaves the surface point with normal `n` in direction `w`.
    #[inline]
    pub fn emitted(&self, n: Vec3, w: Vec3) -> Rgb {
        if n.dot(w) > 0.0 { self.radiance } else { Rgb::BLACK }
    }

    #[inline]
    fn mesh_point(&self, mesh: &TriangleMesh, u: Vec2) -> SurfacePoint {
        let (face, x) = self.triangles.as_ref().map_or((0, u.x), |t| t.sample(u.x));
        let b = warp::square_to_triangle(Vec2::new(x, u.y));
        mesh.point(face as u32, b.to_array().map(f64::from)).point
    }

    /// The sample that leads from `p` to a uniform point of the surface.
    #[inline]
    fn towards(&self, p: DVec3, end: SurfacePoint) -> Option<LightSample> {
        let to = (end.p - p).as_vec3();
        let distance_squared = to.length_squared();
        let wi = to / distance_squared.sqrt();
        let pdf = self.pdf.to_solid_angle(distance_squared, wi.dot(end.n));
        let radiance = self.emitted(end.n, -wi);
        // Seen from behind or edge-on, or p on the surface itself (where wi is NaN).
        (pdf.0 > 0.0 && !radiance.is_black()).then_some(LightSample { wi, radiance, pdf, end: Some(end) })
    }

    /// A direction of the cone in which `p` sees the sphere (pbrt-v4 section 6.2.4), in f64 where digits cancel.
    fn sample_cap(&self, sphere: &Sphere, cap: &Cap, p: DVec3, u: Vec2) -> Option<LightSample> {
        let to_centre = sphere.centre.as_dvec3() - p;
        let frame = Frame::from_normal((to_centre / cap.distance_squared.sqrt()).as_vec3());
        let w = frame.to_world(warp::square_to_uniform_cone(u, cap.one_minus_cos as f32)).as_dvec3().normalize();
        // The nearer crossing; a direction at the rim that rounding has put beside the sphere touches it.
        let along = to_centre.dot(w);
        let beside_squared = (to_centre - along * w).length_squared();
        let half_chord = (f64::from(sphere.radius).powi(2) - beside_squared).max(0.0).sqrt();
        let end = sphere.point((along - half_chord) * w - to_centre).point;
        let radiance = self.emitted(end.n, -w.as_vec3());
        let pdf = warp::square_to_uniform_cone_pdf(cap.one_minus_cos as f32);
        let wi = (end.p - p).normalize().as_vec3();
        (pdf.0.is_finite() && !radiance.is_black()).then_some(LightSample { wi, radiance, pdf, end: Some(end) })
    }
}

impl Cap {
    /// What `p` sees of the sphere; `None` from inside or from the surface.
    #[inline]
    fn of(sphere: &Sphere, p: DVec3) -> Option<Self> {
        let distance_squared = (sphere.centre.as_dvec3() - p).length_squared();
        let sin2 = f64::from(sphere.radius).powi(2) / distance_squared;
        // 1 − √(1 − sin²) without cancellation.
        (sin2 < 1.0).then(|| Self { one_minus_cos: sin2 / (1.0 + (1.0 - sin2).sqrt()), distance_squared })
    }
}

#[cfg(test)]
mod tests;
