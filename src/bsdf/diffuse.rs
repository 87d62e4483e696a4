//! Lambertian reflection: the same radiance in every direction of the front side.

use super::{BsdfSample, Lobes};
use crate::math::float::max;
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp;
use crate::spectrum::Rgb;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// Lambertian reflection, black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Albedo.
    pub reflectance: Rgb,
}

impl Diffuse {
    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: true, delta: false, transmits: false }
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        if wo.z > 0.0 { self.reflectance * (FRAC_1_PI * max(wi.z, 0.0)) } else { Rgb::BLACK }
    }

    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> SolidAnglePdf {
        if wo.z > 0.0 { warp::square_to_cosine_hemisphere_pdf(wi) } else { SolidAnglePdf(0.0) }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        let wi = warp::square_to_cosine_hemisphere(u.direction());
        // A direction in the surface has density zero: it can only come from rounding.
        (wo.z > 0.0 && wi.z > 0.0).then(|| BsdfSample {
            wi,
            weight: self.reflectance,
            pdf: Some(warp::square_to_cosine_hemisphere_pdf(wi)),
            eta: 1.0,
        })
    }
}
