//! A pane with rough surfaces: what [`super::thin_dielectric`] does, with each direction spread by microfacets.
//!
//! Facets of a surface reflect 2F/(1+F) and let (1−F)/(1+F) pass, F being the reflectance of one interface under the angle at
//! which they are seen. What passes leaves as if it were reflected and mirrored at the pane, as in the sheets of glTF and of
//! Burley 2015: f·|cos θi| = R·D·G / (4·cos θo) on the viewer's side, and the same with 1 − R and wi mirrored on the other.
//! No file has such a bsdf: it is what paths see of a pane once they are regularized ([`super::Bsdf::regularized`]).

use super::microfacet::Microfacets;
use super::parameter::{Parameter, not_negative};
use super::{BsdfSample, Lobes, NOTHING, fresnel};
use crate::math::float::min;
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::spectrum::Rgb;
use glam::Vec3;

/// A rough pane, the same from both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughPane {
    facets: Microfacets,
    eta: f32,
    reflectance: Rgb,
    transmittance: Rgb,
}

/// A pane seen from above, mirrored at its plane.
const MIRROR: Vec3 = Vec3::new(1.0, 1.0, -1.0);

impl RoughPane {
    /// From microfacets, the index of refraction inside relative to outside, and factors on what is reflected and transmitted.
    pub fn new(facets: Microfacets, eta: f32, reflectance: Rgb, transmittance: Rgb) -> Self {
        Self { facets, eta, reflectance, transmittance }
    }

    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: true, delta: false, transmits: true, anisotropic: self.facets.is_anisotropic() }
    }

    /// Overrides one parameter; whether there is such a one.
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) -> bool {
        match parameter {
            Parameter::SpecularReflectance => self.reflectance = not_negative(value),
            Parameter::SpecularTransmittance => self.transmittance = not_negative(value),
            _ => return false,
        }
        true
    }

    /// Which part facets reflect that are seen under the cosine `cos`.
    #[inline]
    fn reflected(&self, cos: f32) -> f32 {
        let one = fresnel::dielectric(cos, self.eta).reflectance;
        2.0 * one / (1.0 + one)
    }

    #[inline(never)]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        if wo.z == 0.0 || wi.z == 0.0 {
            return NOTHING;
        }
        let side = 1.0f32.copysign(wo.z);
        let (wo, wi) = (wo * side, wi * side);
        let reflects = wi.z > 0.0;
        let above = if reflects { wi } else { wi * MIRROR };
        let Some(m) = (wo + above).try_normalize() else { return NOTHING };
        let reflected = self.reflected(min(wo.dot(m), 1.0));
        let (part, factor) =
            if reflects { (reflected, self.reflectance) } else { (1.0 - reflected, self.transmittance) };
        let view = self.facets.mirrored(wo);
        let d = 0.25 * part * self.facets.d(m);
        (factor * (d * view.masking * self.facets.g1(above, m)), SolidAnglePdf(d * view.density))
    }

    #[inline(never)]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let side = 1.0f32.copysign(wo.z);
        let seen = wo * side;
        let above = self.facets.sample_mirrored(seen, u.direction());
        if !(above.z > 0.0) {
            return None;
        }
        let m = (seen + above).try_normalize()?;
        let reflects = u.lobe() < self.reflected(min(seen.dot(m), 1.0));
        let wi = if reflects { above } else { above * MIRROR } * side;
        let (value, pdf) = self.eval_pdf(wo, wi);
        (pdf.0 > 0.0).then(|| BsdfSample { wi, weight: value / pdf.0, pdf: Some(pdf), eta: 1.0 })
    }
}
