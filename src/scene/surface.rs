//! What a path needs to know of the point it has reached.

use crate::light::End;
use crate::material::{Scatter, Sides};
use crate::math::frame::Frame;
use crate::math::ray::Ray;
use crate::shape::offset::SurfacePoint;
use crate::shape::surface::ShapePoint;
use glam::{DVec3, Vec3};

/// A point of a surface as seen from a direction.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// The point and its geometric normal (of the front side, wherever it is seen from).
    pub point: SurfacePoint,
    /// Shading frame: world ↔ local directions of the bsdf. Mirrored where a two-sided surface is seen from behind.
    pub frame: Frame,
    /// Direction to the viewer, world space.
    pub wo: Vec3,
    /// How it scatters, on the viewer's side.
    pub bsdf: Scatter<'a>,
    /// Index of the light that the surface is, if any.
    pub light: Option<u32>,
}

impl<'a> Surface<'a> {
    #[inline(always)]
    pub(super) fn new(shape: ShapePoint, wo: Vec3, material: &'a Sides, light: Option<u32>) -> Self {
        let mut frame = Frame::from_normal(shape.shading_normal);
        let (bsdf, mirrored) = material.seen_from(frame.n.dot(wo));
        if mirrored {
            frame.n = -frame.n;
        }
        Self { point: shape.point, frame, wo, bsdf: Scatter::One(bsdf), light }
    }

    /// The point, in the compiled scene's space.
    #[inline]
    pub fn p(&self) -> DVec3 {
        self.point.p
    }

    /// The ray that leaves the surface in direction `w`, not far beside the surface it leaves.
    #[inline(always)]
    pub fn spawn(&self, w: Vec3) -> Ray {
        Ray::new(self.point.origin_towards(w), w)
    }

    /// The ray that is free if and only if a light is visible from here in direction `wi`, which ends on it there.
    #[inline(always)]
    pub fn shadow_ray(&self, wi: Vec3, end: Option<&End>) -> Ray {
        match end {
            None => self.spawn(wi),
            Some(end) => self.ray_to(wi, &end.seen_from(self.point.p, wi)),
        }
    }

    /// The ray that is free if and only if the point `end` of a surface, in direction `wi`, is visible from here.
    #[inline(always)]
    pub fn ray_to(&self, wi: Vec3, end: &SurfacePoint) -> Ray {
        let segment = (end.p - self.point.p).abs().as_vec3();
        Ray::segment(self.point.origin_towards(wi), end.end_towards(-wi, segment))
    }
}
