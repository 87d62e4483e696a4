//! Rough metal: microfacets that are perfect mirrors of complex index (Walter et al. 2007; Torrance and Sparrow 1967):
//! f = F·D·G / (4·cos θo·cos θi).

use super::microfacet::Microfacets;
use super::parameter::{Parameter, not_negative, scalar};
use super::{BsdfSample, Lobes, NOTHING, fresnel};
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::spectrum::Rgb;
use glam::Vec3;

/// Rough metal, black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughConductor {
    facets: Microfacets,
    eta: Rgb,
    k: Rgb,
    reflectance: Rgb,
}

impl RoughConductor {
    /// From microfacets, the complex index η − ik relative to the outside, and a factor on the reflection.
    pub fn new(facets: Microfacets, eta: Rgb, k: Rgb, reflectance: Rgb) -> Self {
        Self { facets, eta, k, reflectance }
    }

    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: true, delta: false, transmits: false, anisotropic: self.facets.is_anisotropic() }
    }

    /// Overrides one parameter; whether there is such a one.
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) -> bool {
        match parameter {
            Parameter::AlphaU => self.facets.set_alpha_u(scalar(value)),
            Parameter::AlphaV => self.facets.set_alpha_v(scalar(value)),
            Parameter::Eta => self.eta = not_negative(value),
            Parameter::K => self.k = not_negative(value),
            Parameter::SpecularReflectance => self.reflectance = not_negative(value),
            _ => return false,
        }
        true
    }

    #[inline]
    fn fresnel(&self, wo: Vec3, m: Vec3) -> Rgb {
        fresnel::conductor(wo.dot(m).clamp(0.0, 1.0), self.eta, self.k) * self.reflectance
    }

    #[inline(never)]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        if !(wo.z > 0.0 && wi.z > 0.0) {
            return NOTHING;
        }
        let Some(m) = (wo + wi).try_normalize() else { return NOTHING };
        let view = self.facets.view(wo);
        // d(m) / d(wi) = 1 / (4 wo·m) cancels the wo·m of the density of visible normals. The quotient by the cosine comes
        // first: it stays finite where the cosine is tiny.
        let d = 0.25 * self.facets.d(m);
        let value = d * (view.masking / wo.z) * self.facets.g1(wi, m);
        (self.fresnel(wo, m) * value, SolidAnglePdf(d * (view.visible / wo.z)))
    }

    #[inline(never)]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        if !(wo.z > 0.0) {
            return None;
        }
        let m = self.facets.sample_visible(wo, u.direction());
        let wi = (2.0 * wo.dot(m) * m - wo).normalize();
        if !(wi.z > 0.0) {
            return None;
        }
        let view = self.facets.view(wo);
        let weight = self.fresnel(wo, m) * (self.facets.g1(wi, m) * (view.masking / view.visible));
        let pdf = self.facets.visible_pdf(wo, view, m) / (4.0 * wo.dot(m));
        // A microfacet seen edge-on has density zero, and nothing to say.
        (pdf > 0.0).then_some(BsdfSample { wi, weight, pdf: Some(SolidAnglePdf(pdf)), eta: 1.0 })
    }
}
