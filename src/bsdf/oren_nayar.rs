//! Rough diffuse reflection: the energy-preserving Oren–Nayar model, EON (Portsmouth, Kutz and Hill 2024, *EON: A Practical
//! Energy-Preserving Rough Diffuse BRDF*). Not one of Mitsuba's.
//!
//! One scattering by V-shaped cavities is Fujii's form of Oren and Nayar's fit, f₁ = ρ/π·A·(1 + r·s/t) with
//! s = wo·wi − cos θo·cos θi and t = max(cos θo, cos θi) where s > 0, else 1. What it loses is spread so that white returns
//! everything: with E(θ) the albedo of white and ⟨E⟩ its cosine-weighted mean,
//! f₂ = ρ²/π·⟨E⟩/(1 − ρ·(1−⟨E⟩)) · (1−E(θo))·(1−E(θi)) / (1−⟨E⟩).

use super::parameter::{Parameter, not_negative, up_to};
use super::{BsdfSample, Lobes, NOTHING};
use crate::math::float::{max, min};
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp;
use crate::spectrum::Rgb;
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI};

/// How much of what is scattered once the roughness takes away: A = 1 / (1 + (½ − 2/(3π))·r).
const LOSS: f32 = 0.5 - 2.0 / (3.0 * PI);

/// What the roughness adds to the mean albedo: ⟨E⟩ = A·(1 + (2/3 − 28/(15π))·r).
const MEAN: f32 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

/// Rough diffuse reflection, black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrenNayar {
    /// Albedo ρ of the facets of the surface.
    pub reflectance: Rgb,
    /// Roughness r in [0, 1]; 0 is Lambertian.
    pub roughness: f32,
}

impl OrenNayar {
    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: true, delta: false, transmits: false, anisotropic: false }
    }

    /// Overrides one parameter; whether there is such a one.
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) -> bool {
        match parameter {
            Parameter::Reflectance => self.reflectance = not_negative(value),
            Parameter::Roughness => self.roughness = up_to(1.0, value),
            _ => return false,
        }
        true
    }

    /// A of the head of the module.
    #[inline]
    fn scale(&self) -> f32 {
        1.0 / (1.0 + LOSS * self.roughness)
    }

    /// What white of this roughness loses seen under the cosine `cos`, 1 − E: the paper's fit, within 0.1 % of E.
    #[inline]
    fn loss(&self, cos: f32) -> f32 {
        const FIT: [f32; 4] = [0.071_443, -0.332_181_45, 0.491_881_87, 0.057_108_53];
        let x = max(1.0 - cos, 0.0);
        let fit = x * FIT.into_iter().fold(0.0, |sum, c| sum * x + c);
        max(1.0 - self.scale() * (1.0 + self.roughness * fit), 0.0)
    }

    /// How likely it is that a sample is from the uniform hemisphere instead of the cosine-weighted. Reason: grazing light on
    /// a rough surface that is seen at a grazing angle is brighter by 1/cos, and so would the weights be.
    #[inline]
    fn uniform_share(&self) -> f32 {
        const MOST: f32 = 0.2;
        MOST * self.roughness
    }

    #[inline(never)]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        if !(wo.z > 0.0 && wi.z > 0.0) {
            return NOTHING;
        }
        let s = wo.dot(wi) - wo.z * wi.z;
        let slant = if s > 0.0 { s / max(wo.z, wi.z) } else { s };
        let once = self.scale() * (1.0 + self.roughness * slant);
        let mean = self.scale() * (1.0 + MEAN * self.roughness);
        let often = if mean < 1.0 { mean * self.loss(wo.z) * self.loss(wi.z) / (1.0 - mean) } else { 0.0 };
        let value = self
            .reflectance
            .map(|c| (c * once + c * c / (1.0 - min(c, 1.0) * (1.0 - mean)) * often) * (FRAC_1_PI * wi.z));
        let uniform = self.uniform_share();
        let cosine = warp::square_to_cosine_hemisphere_pdf(wi) * (1.0 - uniform);
        (value, SolidAnglePdf(cosine.0 + uniform * warp::square_to_uniform_hemisphere_pdf(wi).0))
    }

    #[inline(never)]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        let wi = if u.lobe() < self.uniform_share() {
            warp::square_to_uniform_hemisphere(u.direction())
        } else {
            u.hemisphere()
        };
        let (value, pdf) = self.eval_pdf(wo, wi);
        (pdf.0 > 0.0).then(|| BsdfSample { wi, weight: value / pdf.0, pdf: Some(pdf), eta: 1.0 })
    }
}
