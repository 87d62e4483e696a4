//! Rough metal: microfacets that are perfect mirrors of complex index (Walter et al. 2007; Torrance and Sparrow 1967):
//! f = F·D·G / (4·cos θo·cos θi). On demand also what they scatter several times ([`super::energy`]).

use super::energy::{self, Mirrors, Spread};
use super::microfacet::Microfacets;
use super::parameter::{Parameter, not_negative, scalar};
use super::{BsdfSample, Gloss, Lobes, NOTHING, fresnel};
use crate::math::float::{max, min};
use crate::math::quadrature::gauss_legendre;
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp;
use crate::spectrum::Rgb;
use glam::Vec3;
use std::sync::LazyLock;

/// Rough metal, black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughConductor {
    facets: Microfacets,
    eta: Rgb,
    k: Rgb,
    reflectance: Rgb,
    /// What is scattered several times, if that counts.
    several: Option<Several>,
}

/// What metal scatters several times.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Several {
    /// The mean over the hemisphere of the reflectance of smooth metal.
    mean: Rgb,
}

impl RoughConductor {
    /// From microfacets, the complex index η − ik relative to the outside, and a factor on the reflection.
    pub fn new(facets: Microfacets, eta: Rgb, k: Rgb, reflectance: Rgb) -> Self {
        Self { facets, eta, k, reflectance, several: None }
    }

    /// The same with what is scattered several times.
    pub(super) fn with_multiple_scattering(mut self) -> Self {
        self.several = Some(self.mean());
        self
    }

    /// See [`super::Bsdf::regularized`].
    pub(super) fn regularized(self) -> Self {
        Self { facets: self.facets.regularized(), ..self }
    }

    /// The mean reflectance of smooth metal: 2·∫F·μ dμ.
    fn mean(&self) -> Several {
        /// Nodes: the error is below 10⁻⁴.
        const NODES: usize = 8;
        static RULE: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| gauss_legendre(NODES));
        let mut mean = Rgb::BLACK;
        for &(mu, weight) in RULE.iter() {
            mean += fresnel::conductor(mu as f32, self.eta, self.k) * (2.0 * mu * weight) as f32;
        }
        Several { mean: (mean * self.reflectance).map(|c| min(c, 1.0)) }
    }

    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: true, delta: false, transmits: false, anisotropic: self.facets.is_anisotropic() }
    }

    /// See [`super::Bsdf::scatters_everywhere`].
    pub(super) fn scatters_everywhere(&self) -> bool {
        self.facets.scatters_everywhere(false)
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
        if self.several.is_some() {
            self.several = Some(self.mean());
        }
        true
    }

    /// See [`super::Bsdf::about_albedo`].
    pub(super) fn about_albedo(&self, wo: Vec3) -> f32 {
        self.fresnel(wo, Vec3::Z).mean()
    }

    /// See [`super::Bsdf::gloss`].
    pub(super) fn gloss(&self) -> Gloss {
        Gloss { alpha_squared: self.facets.alpha_squared(), share: 1.0 }
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
        let view = self.facets.mirrored(wo);
        let d = 0.25 * self.facets.d(m);
        let value = d * view.masking * self.facets.g1(wi, m);
        let once = (self.fresnel(wo, m) * value, SolidAnglePdf(d * view.density));
        match &self.several {
            None => once,
            Some(several) => self.with_several(several, once, wo, wi),
        }
    }

    /// Value and density, given those of one scattering.
    #[inline(never)]
    fn with_several(
        &self,
        several: &Several,
        (value, pdf): (Rgb, SolidAnglePdf),
        wo: Vec3,
        wi: Vec3,
    ) -> (Rgb, SolidAnglePdf) {
        let (mirrors, alpha) = (Mirrors::of(self.facets.distribution()), energy::tabulated(&self.facets));
        let lost = |w: Vec3| 1.0 - mirrors.returned(alpha, min(w.z, 1.0));
        let mean = mirrors.mean_returned(alpha);
        let lobe = energy::missing(lost(wo), lost(wi), 1.0 - mean) * warp::square_to_cosine_hemisphere_pdf(wi).0;
        let often = self.often(several, wo);
        let pdf = (1.0 - often) * pdf.0 + often * Spread::new(alpha).pdf(wi);
        (value + energy::several(several.mean, mean) * lobe, SolidAnglePdf(pdf))
    }

    /// How often it is several scatterings that are sampled.
    fn often(&self, several: &Several, wo: Vec3) -> f32 {
        let (mirrors, alpha) = (Mirrors::of(self.facets.distribution()), energy::tabulated(&self.facets));
        let returned = mirrors.returned(alpha, min(wo.z, 1.0));
        let often = energy::several(several.mean, mirrors.mean_returned(alpha)).mean() * (1.0 - returned);
        // 0/0 is none.
        max(often / (often + returned * several.mean.mean()), 0.0)
    }

    #[inline(never)]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        if !(wo.z > 0.0) {
            return None;
        }
        if let Some(several) = &self.several {
            return self.sample_several(several, wo, u);
        }
        let wi = self.facets.sample_mirrored(wo, u.direction());
        if !(wi.z > 0.0) {
            return None;
        }
        let m = (wo + wi).try_normalize()?;
        let view = self.facets.mirrored(wo);
        let weight = self.fresnel(wo, m) * (self.facets.g1(wi, m) * (view.masking / view.density));
        let pdf = 0.25 * self.facets.d(m) * view.density;
        // A microfacet seen edge-on has density zero, and nothing to say.
        (pdf > 0.0).then_some(BsdfSample { wi, weight, pdf: Some(SolidAnglePdf(pdf)), eta: 1.0 })
    }

    /// A direction by one scattering or by several.
    #[inline(never)]
    fn sample_several(&self, several: &Several, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        let wi = if u.lobe() < self.often(several, wo) {
            Spread::new(energy::tabulated(&self.facets)).sample(u.direction())
        } else {
            self.facets.sample_mirrored(wo, u.direction())
        };
        let (value, pdf) = self.eval_pdf(wo, wi);
        (pdf.0 > 0.0).then(|| BsdfSample { wi, weight: value / pdf.0, pdf: Some(pdf), eta: 1.0 })
    }
}
