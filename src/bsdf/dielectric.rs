//! A smooth interface between two dielectrics: reflection and refraction by Fresnel's and Snell's laws.

use super::parameter::{Parameter, not_negative};
use super::{Bsdf, BsdfSample, Lobes, Microfacets, NOTHING, RoughDielectric, fresnel};
use crate::math::float::sqr;
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::spectrum::Rgb;
use glam::Vec3;

/// A smooth interface; the normal points to the outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    eta: f32,
    reflectance: Rgb,
    transmittance: Rgb,
}

impl Dielectric {
    /// From the index of refraction inside relative to outside, and factors on what is reflected and transmitted.
    pub fn new(eta: f32, reflectance: Rgb, transmittance: Rgb) -> Self {
        Self { eta, reflectance, transmittance }
    }

    /// See [`super::Bsdf::regularized`]. What has next to no contrast stays as it is.
    pub(super) fn regularized(self) -> Bsdf {
        RoughDielectric::bsdf(Microfacets::of_smooth_twin(), self.eta, self.reflectance, self.transmittance)
    }

    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: false, delta: true, transmits: true, anisotropic: false }
    }

    /// Overrides one parameter; whether there is such a one.
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) -> bool {
        match parameter {
            Parameter::SpecularReflectance => self.reflectance = not_negative(value),
            Parameter::SpecularTransmittance => self.transmittance = not_negative(value),
            // A rough interface without contrast has become a smooth one.
            Parameter::AlphaU | Parameter::AlphaV => {}
            _ => return false,
        }
        true
    }

    /// See [`super::Bsdf::mirror`].
    pub(super) fn mirror(&self, wo: Vec3) -> Option<Rgb> {
        (wo.z > 0.0).then(|| self.reflectance * fresnel::dielectric(wo.z, self.eta).reflectance)
    }

    /// Whether the interface is there for form's sake, as that of air to vacuum is (1.000277).
    pub(super) fn hardly_bends(&self) -> bool {
        /// The index of what bends light by less than a degree, but where it grazes.
        const LEAST: f32 = 1.01;
        (1.0 / LEAST..LEAST).contains(&self.eta)
    }

    /// See [`super::Bsdf::through`].
    pub(super) fn through(&self, wo: Vec3) -> Option<(Vec3, Rgb)> {
        let (eta, interface) = self.interface(wo);
        (interface.transmittance > 0.0).then(|| {
            let (wi, weight) = self.refracted(wo, eta, interface.cos_t);
            (wi, weight * interface.transmittance)
        })
    }

    /// The index beyond the interface relative to that on the side of `wo`, and what the interface does.
    #[inline]
    fn interface(&self, wo: Vec3) -> (f32, fresnel::Interface) {
        let eta = if wo.z > 0.0 { self.eta } else { 1.0 / self.eta };
        (eta, fresnel::dielectric(wo.z.abs(), eta))
    }

    /// Where refracted light comes from, and its weight where nothing is reflected.
    #[inline]
    fn refracted(&self, wo: Vec3, eta: f32, cos_t: f32) -> (Vec3, Rgb) {
        let wi = Vec3::new(-wo.x / eta, -wo.y / eta, -cos_t.copysign(wo.z)).normalize();
        // Radiance is compressed into a smaller solid angle on the denser side (Veach 1997, section 5.2).
        (wi, self.transmittance * (1.0 / sqr(eta)))
    }

    pub(super) fn eval_pdf(&self, _wo: Vec3, _wi: Vec3) -> (Rgb, SolidAnglePdf) {
        NOTHING
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        let (eta, interface) = self.interface(wo);
        if u.lobe() < interface.reflectance {
            let wi = Vec3::new(-wo.x, -wo.y, wo.z);
            return Some(BsdfSample { wi, weight: self.reflectance, pdf: None, eta: 1.0 });
        }
        let (wi, weight) = self.refracted(wo, eta, interface.cos_t);
        Some(BsdfSample { wi, weight, pdf: None, eta })
    }
}
