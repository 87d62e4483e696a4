//! Smooth metal: a mirror that reflects as Fresnel's equations say.

use super::parameter::{Parameter, not_negative};
use super::{BsdfSample, Lobes, Microfacets, NOTHING, RoughConductor, fresnel};
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::spectrum::Rgb;
use glam::Vec3;

/// Smooth metal, black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    /// Real part of the index of refraction relative to the outside.
    pub eta: Rgb,
    /// Imaginary part: the index is η − ik.
    pub k: Rgb,
    /// Factor on the reflection.
    pub reflectance: Rgb,
}

impl Conductor {
    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: false, delta: true, transmits: false, anisotropic: false }
    }

    /// Overrides one parameter; whether there is such a one.
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) -> bool {
        match parameter {
            Parameter::Eta => self.eta = not_negative(value),
            Parameter::K => self.k = not_negative(value),
            Parameter::SpecularReflectance => self.reflectance = not_negative(value),
            _ => return false,
        }
        true
    }

    /// See [`super::Bsdf::regularized`].
    pub(super) fn regularized(self) -> RoughConductor {
        RoughConductor::new(Microfacets::of_smooth_twin(), self.eta, self.k, self.reflectance)
    }

    /// See [`super::Bsdf::about_albedo`].
    pub(super) fn about_albedo(&self, wo: Vec3) -> f32 {
        (fresnel::conductor(wo.z.min(1.0), self.eta, self.k) * self.reflectance).mean()
    }

    pub(super) fn eval_pdf(&self, _wo: Vec3, _wi: Vec3) -> (Rgb, SolidAnglePdf) {
        NOTHING
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, _u: BsdfUniforms) -> Option<BsdfSample> {
        (wo.z > 0.0).then(|| BsdfSample {
            wi: Vec3::new(-wo.x, -wo.y, wo.z),
            weight: fresnel::conductor(wo.z.min(1.0), self.eta, self.k) * self.reflectance,
            pdf: None,
            eta: 1.0,
        })
    }
}
