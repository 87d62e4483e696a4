//! The same radiance from every direction, from infinitely far away.
//!
//! Surfaces that scatter on one side only sample the hemisphere that they face: in combination with bsdf sampling, which finds
//! what is bright along the horizon, in proportion to the cosine, as most of them reflect; alone uniformly.

use super::LightSample;
use crate::math::frame::Frame;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp;
use crate::shape::Hit;
use crate::spectrum::Rgb;
use glam::{Vec2, Vec3};

/// A sky of one colour.
#[derive(Clone, Copy, Debug)]
pub struct ConstantLight {
    /// Radiance in W·sr⁻¹·m⁻².
    pub radiance: Rgb,
}

impl ConstantLight {
    /// A direction for a surface that scatters on the side of the unit normal `n`, or, where that is zero, on both sides;
    /// `combined` with bsdf sampling or not. `None` where its density is zero.
    #[inline(always)]
    pub(super) fn sample(&self, n: Vec3, u: Vec2, combined: bool) -> Option<LightSample> {
        let wi = if n == Vec3::ZERO {
            warp::square_to_uniform_sphere(u)
        } else {
            let hemisphere = match combined {
                true => warp::square_to_cosine_hemisphere(u),
                false => warp::square_to_uniform_hemisphere(u),
            };
            Frame::from_normal(n).to_world(hemisphere)
        };
        let pdf = self.pdf(wi, n, combined);
        (pdf.0 > 0.0).then_some(LightSample { wi, radiance: self.radiance, pdf: Some(pdf), end: None, on: Hit::NONE })
    }

    /// Density with which [`Self::sample`] samples the direction `wi`.
    #[inline(always)]
    pub fn pdf(&self, wi: Vec3, n: Vec3, combined: bool) -> SolidAnglePdf {
        if n == Vec3::ZERO {
            return warp::square_to_uniform_sphere_pdf();
        }
        let local = Vec3::new(0.0, 0.0, n.dot(wi));
        if combined {
            warp::square_to_cosine_hemisphere_pdf(local)
        } else {
            warp::square_to_uniform_hemisphere_pdf(local)
        }
    }
}
