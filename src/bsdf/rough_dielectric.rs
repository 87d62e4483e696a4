//! A rough interface between two dielectrics: microfacets that reflect and refract by Fresnel's and Snell's laws (Walter
//! et al. 2007).
//!
//! With η the index of refraction beyond the interface relative to that on the side of wo, the generalised half vector is
//! h = wo + wi for reflection and h = wo + η·wi for refraction; m is its direction. Radiance that enters a denser medium is
//! compressed by η² (Veach 1997, section 5.2), which cancels the η² of Walter's equation 21:
//!
//! reflection  f·|cos θi| = R·F·D·G / (4·|cos θo|), refraction  f·|cos θi| = T·(1−F)·D·G·|wo·m|·|wi·m| / (|cos θo|·|h|²).

use super::energy::{self, Interface, Spread};
use super::microfacet::{Microfacets, View};
use super::parameter::{Parameter, not_negative, scalar};
use super::{Bsdf, BsdfSample, Dielectric, Lobes, NOTHING, fresnel};
use crate::math::float::{ONE_MINUS_EPSILON, max, min, sqr};
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp;
use crate::spectrum::Rgb;
use glam::Vec3;

/// A rough interface; the normal points to the outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDielectric {
    facets: Microfacets,
    eta: f32,
    reflectance: Rgb,
    transmittance: Rgb,
    /// The tables of what is scattered several times, if that counts.
    several: Option<&'static Interface>,
}

/// What facets scatter several times, seen from a side.
struct Several {
    /// What one scattering loses, and its mean over all directions on this side and on the other.
    lost: f32,
    means: [f32; 2],
    /// The part of it that crosses.
    crosses: f32,
}

/// One way through the interface.
pub(super) struct Crossing {
    /// Index beyond relative to that on the side of wo.
    pub(super) eta: f32,
    /// wo·m, positive.
    pub(super) cos_o: f32,
    /// |wi·m|.
    pub(super) cos_i: f32,
}

impl Crossing {
    /// d(m)/d(wi) (Walter et al. 2007, equation 17), without the η² of the denser side: |wi·m| / |h|².
    #[inline]
    pub(super) fn jacobian(&self) -> f32 {
        // |h| = |cos_o − η·cos_i|, which by Snell's law is |η² − 1| / (cos_o + η·cos_i): no cancellation near η = 1.
        self.cos_i * sqr((self.cos_o + self.eta * self.cos_i) / ((self.eta - 1.0) * (self.eta + 1.0)))
    }
}

impl RoughDielectric {
    /// The narrowest lobe of refraction that directions in f32 can tell anything about, as |η − 1|·min(α, 1). Reason: the half
    /// vector of refraction is a difference of size |η − 1|, in which a direction's rounding of 2⁻²⁴ must be well below α.
    pub(super) const NARROWEST_LOBE: f32 = 4e-6;

    /// From microfacets, the index of refraction inside relative to outside, and factors on what is reflected and
    /// transmitted. Where there is next to no contrast the interface is a smooth one, which then looks the same.
    pub fn bsdf(facets: Microfacets, eta: f32, reflectance: Rgb, transmittance: Rgb) -> Bsdf {
        if (eta - 1.0).abs() * min(facets.smallest_alpha(), 1.0) < Self::NARROWEST_LOBE {
            return Bsdf::Dielectric(Dielectric::new(eta, reflectance, transmittance));
        }
        Bsdf::RoughDielectric(Self { facets, eta, reflectance, transmittance, several: None })
    }

    /// The same with what is scattered several times.
    pub(super) fn with_multiple_scattering(mut self) -> Self {
        let tables = Interface::of(self.facets.distribution(), self.eta);
        self.several = Some(tables);
        // Makes the tables of both sides.
        self.scattered_often(tables, Vec3::Z);
        self
    }

    /// See [`super::Bsdf::regularized`].
    pub(super) fn regularized(self) -> Self {
        Self { facets: self.facets.regularized(), ..self }
    }

    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: true, delta: false, transmits: true, anisotropic: self.facets.is_anisotropic() }
    }

    /// Overrides one parameter; whether there is such a one.
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) -> bool {
        match parameter {
            Parameter::AlphaU => self.facets.set_alpha_u(self.wide_enough(scalar(value))),
            Parameter::AlphaV => self.facets.set_alpha_v(self.wide_enough(scalar(value))),
            Parameter::SpecularReflectance => self.reflectance = not_negative(value),
            Parameter::SpecularTransmittance => self.transmittance = not_negative(value),
            _ => return false,
        }
        true
    }

    /// A roughness, or the smallest one whose lobe is no narrower than [`Self::NARROWEST_LOBE`]; that is below 1, as what
    /// has less contrast is no rough interface.
    #[inline]
    fn wide_enough(&self, alpha: f32) -> f32 {
        max(alpha, Self::NARROWEST_LOBE / (self.eta - 1.0).abs())
    }

    /// Index beyond the interface relative to that on the side of `w`.
    #[inline]
    fn eta_seen_from(&self, w: Vec3) -> f32 {
        if w.z > 0.0 { self.eta } else { 1.0 / self.eta }
    }

    /// What is scattered several times, seen from `wo`.
    fn scattered_often(&self, tables: &Interface, wo: Vec3) -> Several {
        let (outside, alpha) = (wo.z > 0.0, energy::tabulated(&self.facets));
        let lost = tables.lost(outside, alpha, min(wo.z.abs(), 1.0)).bare(self.eta);
        let means = [outside, !outside].map(|side| tables.mean_lost(side, alpha).bare(self.eta));
        Several { lost, means, crosses: tables.crosses(outside, means, tables.through()) }
    }

    /// Value and density of what is scattered several times.
    #[inline(never)]
    fn eval_often(&self, tables: &Interface, several: &Several, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        let reflects = (wo.z > 0.0) == (wi.z > 0.0);
        let alpha = energy::tabulated(&self.facets);
        let lost = tables.lost(wi.z > 0.0, alpha, min(wi.z.abs(), 1.0)).bare(self.eta);
        let above = Vec3::new(wi.x, wi.y, wi.z.abs());
        let (factor, part, mean) = if reflects {
            (self.reflectance, 1.0 - several.crosses, several.means[0])
        } else {
            (self.transmittance * (1.0 / sqr(self.eta_seen_from(wo))), several.crosses, several.means[1])
        };
        let cosine = warp::square_to_cosine_hemisphere_pdf(above).0;
        (factor * (part * energy::missing(several.lost, lost, mean) * cosine), part * Spread::new(alpha).pdf(above))
    }

    #[inline(never)]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        if wo.z == 0.0 || wi.z == 0.0 {
            return NOTHING;
        }
        let Some(tables) = self.several else { return self.eval_pdf_once(wo, wi) };
        let several = self.scattered_often(tables, wo);
        let ((value, pdf), (more, density)) = (self.eval_pdf_once(wo, wi), self.eval_often(tables, &several, wo, wi));
        let often = several.lost;
        (value + more, SolidAnglePdf((1.0 - often) * pdf.0 + often * density))
    }

    /// Value and density of one scattering.
    #[inline(always)]
    fn eval_pdf_once(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        if wo.z == 0.0 || wi.z == 0.0 {
            return NOTHING;
        }
        let reflects = (wo.z > 0.0) == (wi.z > 0.0);
        let eta = self.eta_seen_from(wo);
        let Some(m) = (if reflects { wo + wi } else { wo + eta * wi }).try_normalize() else { return NOTHING };
        let m = if m.z < 0.0 { -m } else { m };
        let (dot_o, dot_i) = (wo.dot(m), wi.dot(m));
        // Microfacets are seen from the same side as the surface, both ways.
        if !(dot_o * wo.z > 0.0 && dot_i * wi.z > 0.0) {
            return NOTHING;
        }
        let (cos_o, cos_i) = (min(dot_o.abs(), 1.0), dot_i.abs());
        let view = self.facets.view(wo);
        let d = self.facets.d(m);
        let (masking, visible) = (view.masking / wo.z.abs() * self.facets.g1(wi, m), view.visible / wo.z.abs());
        if reflects {
            let p = 0.25 * d * fresnel::dielectric(cos_o, eta).reflectance;
            (self.reflectance * (p * masking), SolidAnglePdf(p * visible))
        } else {
            // Both cosines are known; Snell's law would lose the digits of the one near the critical angle.
            let transmittance = fresnel::refraction(cos_o, cos_i, eta).transmittance;
            let p = transmittance * d * cos_o * Crossing { eta, cos_o, cos_i }.jacobian();
            (self.transmittance * (p * masking), SolidAnglePdf(p * visible * sqr(eta)))
        }
    }

    #[inline(never)]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        match self.several {
            None => self.sample_once(wo, u),
            Some(tables) => self.sample_several(tables, wo, u),
        }
    }

    /// A direction by one scattering or by several.
    #[inline(never)]
    fn sample_several(&self, tables: &Interface, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        let several = self.scattered_often(tables, wo);
        let rest = u.lobe() - several.lost;
        let (wi, eta) = if rest < 0.0 {
            let through = u.lobe() < several.lost * several.crosses;
            let side = if through { -wo.z } else { wo.z };
            let wi = Spread::new(energy::tabulated(&self.facets)).sample(u.direction());
            let eta = if through { self.eta_seen_from(wo) } else { 1.0 };
            (Vec3::new(wi.x, wi.y, wi.z.copysign(side)), eta)
        } else {
            let once = self.sample_once(wo, u.with_lobe(min(rest / (1.0 - several.lost), ONE_MINUS_EPSILON)))?;
            (once.wi, once.eta)
        };
        let (value, pdf) = self.eval_pdf(wo, wi);
        (pdf.0 > 0.0).then(|| BsdfSample { wi, weight: value / pdf.0, pdf: Some(pdf), eta })
    }

    /// A direction by one scattering.
    #[inline(always)]
    fn sample_once(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        // Seen from below everything is mirrored, and the distribution is its own mirror image.
        let side = 1.0f32.copysign(wo.z);
        let mirror = Vec3::new(1.0, 1.0, side);
        let above = wo * mirror;
        let m = self.facets.sample_visible(above, u.direction());
        let cos_o = min(above.dot(m), 1.0);
        if !(cos_o > 0.0) {
            return None;
        }
        let eta = self.eta_seen_from(wo);
        let interface = fresnel::dielectric(cos_o, eta);
        let view = self.facets.view(above);
        let density = self.facets.visible_pdf(above, view, m);
        let sample = if u.lobe() < interface.reflectance {
            let wi = (2.0 * cos_o * m - above).normalize();
            let pdf = interface.reflectance * density / (4.0 * cos_o);
            (wi.z > 0.0).then(|| self.sample_of(wi, view, m, self.reflectance, pdf, 1.0))
        } else {
            let wi = ((cos_o / eta - interface.cos_t) * m - above / eta).normalize();
            let jacobian = Crossing { eta, cos_o, cos_i: interface.cos_t }.jacobian() * sqr(eta);
            let pdf = interface.transmittance * density * jacobian;
            (wi.z < 0.0).then(|| self.sample_of(wi, view, m, self.transmittance, pdf, eta))
        };
        sample.map(|s| BsdfSample { wi: s.wi * mirror, ..s }).filter(|s| s.pdf.is_some_and(|p| p.0 > 0.0))
    }

    /// The sample of a direction with density `pdf`, across which the index of refraction changes by `eta`.
    #[inline]
    fn sample_of(&self, wi: Vec3, view: View, m: Vec3, factor: Rgb, pdf: f32, eta: f32) -> BsdfSample {
        let g = self.facets.g1(wi, m) * (view.masking / view.visible);
        BsdfSample { wi, weight: factor * (g / sqr(eta)), pdf: Some(SolidAnglePdf(pdf)), eta }
    }
}
