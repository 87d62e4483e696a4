//! Rough metal: GGX microfacets that are perfect mirrors of complex index (Walter et al. 2007; Torrance and Sparrow
//! 1967): f = F·D·G / (4·cos θo·cos θi).

use super::ggx::Ggx;
use super::{BsdfSample, Lobes, fresnel};
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::spectrum::Rgb;
use glam::Vec3;

/// Rough metal, black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughConductor {
    facets: Ggx,
    eta: Rgb,
    k: Rgb,
    reflectance: Rgb,
}

impl RoughConductor {
    /// From roughness α, the complex index η − ik relative to the outside, and a factor on the reflection.
    pub fn new(alpha: f32, eta: Rgb, k: Rgb, reflectance: Rgb) -> Self {
        Self { facets: Ggx::new(alpha), eta, k, reflectance }
    }

    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: true, delta: false, transmits: false }
    }

    /// The microfacet normal that mirrors `wo` into `wi`; `None` where either is behind the surface.
    #[inline]
    fn half_vector(wo: Vec3, wi: Vec3) -> Option<Vec3> {
        (wo.z > 0.0 && wi.z > 0.0).then(|| (wo + wi).normalize())
    }

    #[inline]
    fn fresnel(&self, wo: Vec3, m: Vec3) -> Rgb {
        fresnel::conductor(wo.dot(m).clamp(0.0, 1.0), self.eta, self.k) * self.reflectance
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let Some(m) = Self::half_vector(wo, wi) else { return Rgb::BLACK };
        let g = self.facets.g1(wo, m) * self.facets.g1(wi, m);
        self.fresnel(wo, m) * (self.facets.d(m) * g / (4.0 * wo.z))
    }

    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> SolidAnglePdf {
        let Some(m) = Self::half_vector(wo, wi) else { return SolidAnglePdf(0.0) };
        // d(m) / d(wi) = 1 / (4 wo·m) cancels the wo·m of the density of visible normals.
        SolidAnglePdf(self.facets.g1(wo, m) * self.facets.d(m) / (4.0 * wo.z))
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        if !(wo.z > 0.0) {
            return None;
        }
        let m = self.facets.sample_visible(wo, u.direction());
        let wi = (2.0 * wo.dot(m) * m - wo).normalize();
        if !(wi.z > 0.0) {
            return None;
        }
        let weight = self.fresnel(wo, m) * self.facets.g1(wi, m);
        let pdf = self.facets.visible_pdf(wo, m) / (4.0 * wo.dot(m));
        // A microfacet seen edge-on has density zero, and nothing to say.
        (pdf > 0.0).then_some(BsdfSample { wi, weight, pdf: Some(SolidAnglePdf(pdf)), eta: 1.0 })
    }
}
