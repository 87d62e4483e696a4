//! Lambertian reflection: the same radiance in every direction of the front side.

use super::parameter::{Parameter, not_negative};
use super::{BsdfSample, Lobes, NOTHING};
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp;
use crate::spectrum::Rgb;
use glam::Vec3;

/// Lambertian reflection, black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Albedo.
    pub reflectance: Rgb,
}

impl Diffuse {
    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: true, delta: false, transmits: false, anisotropic: false }
    }

    /// Overrides one parameter; whether there is such a one.
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) -> bool {
        match parameter {
            Parameter::Reflectance => self.reflectance = not_negative(value),
            _ => return false,
        }
        true
    }

    #[inline(always)]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        if !(wo.z > 0.0) {
            return NOTHING;
        }
        let pdf = warp::square_to_cosine_hemisphere_pdf(wi);
        (self.reflectance * pdf.0, pdf)
    }

    #[inline(always)]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        let wi = u.hemisphere();
        // A direction in the surface has density zero: it can only come from rounding.
        (wo.z > 0.0 && wi.z > 0.0).then(|| BsdfSample {
            wi,
            weight: self.reflectance,
            pdf: Some(warp::square_to_cosine_hemisphere_pdf(wi)),
            eta: 1.0,
        })
    }
}
