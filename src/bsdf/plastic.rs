//! Smooth plastic: a diffuse base under a smooth dielectric coat.
//!
//! Light is reflected by the coat, or refracted into it, scattered by the base, and refracted out or reflected back to the
//! base, any number of times. With T = 1 − F the coat's transmittance and R its reflectance for diffuse light from inside,
//! f·cos θi = T(θo)·T(θi)/η² · ρ/(1 − ρ·R) · cos θi/π: a geometric series (for example Egan and Hilgeman 1973, *Spectral
//! Reflectance of Particulate Materials*). Unless `nonlinear`, the base's albedo ρ is left out of the denominator, so that
//! its hue is that of the plastic, as in Mitsuba.

use super::parameter::{Parameter, not_negative};
use super::{BsdfSample, Lobes, Microfacets, NOTHING, RoughPlastic, fresnel};
use crate::math::float::{min, sqr};
use crate::math::quadrature::gauss_legendre;
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::sampling::warp;
use crate::spectrum::Rgb;
use glam::Vec3;

/// Smooth plastic, black from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plastic {
    eta: f32,
    base: Base,
    reflectance: Rgb,
}

/// A diffuse base under a dielectric coat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Base {
    /// Its albedo ρ.
    pub(super) reflectance: Rgb,
    /// The coat's reflectance for diffuse light from inside.
    pub(super) inside: f32,
    /// Whether light that was reflected back to the base takes its hue once more.
    pub(super) nonlinear: bool,
}

impl Base {
    /// ρ / (1 − ρ·R), or, if linear, ρ / (1 − R). A base that is brighter than white counts as white in the denominator.
    #[inline]
    pub(super) fn albedo(&self) -> Rgb {
        let inside = self.inside;
        if self.nonlinear {
            self.reflectance.map(|c| c / (1.0 - min(c, 1.0) * inside))
        } else {
            self.reflectance / (1.0 - inside)
        }
    }
}

/// How likely it is that the coat's reflection is sampled, where `reflected` and `refracted` are its reflectance and
/// transmittance. `None` if nothing comes back. As Mitsuba has it.
#[inline]
pub(super) fn coat_probability(coat: Rgb, base: Rgb, reflected: f32, refracted: f32) -> Option<f32> {
    let (coat, base) = (reflected * coat.mean(), refracted * base.mean());
    (coat + base > 0.0).then(|| coat / (coat + base))
}

impl Plastic {
    /// From the index of refraction inside relative to outside, the base's albedo, a factor on the coat's reflection, and
    /// whether to account for the change of hue by scattering inside.
    pub fn new(eta: f32, diffuse_reflectance: Rgb, specular_reflectance: Rgb, nonlinear: bool) -> Self {
        let inside = diffuse_fresnel(1.0 / eta);
        let base = Base { reflectance: diffuse_reflectance, inside, nonlinear };
        Self { eta, base, reflectance: specular_reflectance }
    }

    /// See [`super::Bsdf::regularized`].
    pub(super) fn regularized(self) -> RoughPlastic {
        RoughPlastic::returning_all(Microfacets::of_smooth_twin(), self.eta, self.base, self.reflectance)
    }

    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: true, delta: true, transmits: false, anisotropic: false }
    }

    /// Overrides one parameter; whether there is such a one.
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) -> bool {
        match parameter {
            Parameter::DiffuseReflectance => self.base.reflectance = not_negative(value),
            Parameter::SpecularReflectance => self.reflectance = not_negative(value),
            _ => return false,
        }
        true
    }

    /// See [`super::Bsdf::about_albedo`].
    pub(super) fn about_albedo(&self, wo: Vec3) -> f32 {
        let coat = fresnel::dielectric(wo.z, self.eta);
        self.reflectance.mean() * coat.reflectance + self.base.reflectance.mean() * coat.transmittance
    }

    /// See [`super::Bsdf::mirror`].
    pub(super) fn mirror(&self, wo: Vec3) -> Option<Rgb> {
        (wo.z > 0.0).then(|| self.reflectance * fresnel::dielectric(wo.z, self.eta).reflectance)
    }

    /// The base's value over the density of cosine-weighted directions, where the coat lets `through` pass to the viewer.
    #[inline]
    fn diffuse(&self, through: f32, wi: Vec3) -> Rgb {
        let from_light = fresnel::dielectric(wi.z, self.eta).transmittance;
        self.base.albedo() * (through * from_light / sqr(self.eta))
    }

    #[inline(never)]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, SolidAnglePdf) {
        if !(wo.z > 0.0 && wi.z > 0.0) {
            return NOTHING;
        }
        let coat = fresnel::dielectric(wo.z, self.eta);
        let (reflected, refracted) = (coat.reflectance, coat.transmittance);
        let Some(mirror) = coat_probability(self.reflectance, self.base.reflectance, reflected, refracted) else {
            return NOTHING;
        };
        let cosine = warp::square_to_cosine_hemisphere_pdf(wi);
        (self.diffuse(refracted, wi) * cosine.0, cosine * (1.0 - mirror))
    }

    #[inline(never)]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        if !(wo.z > 0.0) {
            return None;
        }
        let coat = fresnel::dielectric(wo.z, self.eta);
        let (reflected, refracted) = (coat.reflectance, coat.transmittance);
        let mirror = coat_probability(self.reflectance, self.base.reflectance, reflected, refracted)?;
        if u.lobe() < mirror {
            let wi = Vec3::new(-wo.x, -wo.y, wo.z);
            return Some(BsdfSample { wi, weight: self.reflectance * (reflected / mirror), pdf: None, eta: 1.0 });
        }
        let wi = u.hemisphere();
        let pdf = warp::square_to_cosine_hemisphere_pdf(wi) * (1.0 - mirror);
        let weight = self.diffuse(refracted, wi) / (1.0 - mirror);
        // A direction in the surface has density zero: it can only come from rounding.
        (wi.z > 0.0).then_some(BsdfSample { wi, weight, pdf: Some(pdf), eta: 1.0 })
    }
}

/// Where the first fit ends. Reason: near 1/4 it exceeds 1, and nothing but semiconductors refracts more than this.
const FIT_ENDS: f32 = 0.3;

/// Reflectance of a smooth interface for diffuse light, where `eta` is the index beyond relative to that in front: the fits
/// that Mitsuba takes, whose pictures are to be met. Above 1 that of d'Eon and Irving 2011, *A Quantized-Diffusion Model for
/// Rendering Translucent Materials*, within 0.5 %. Below 1 that of Egan and Hilgeman 1973, within 0.6 % from 1/2.4: white plastic
/// of index 1.5 returns 0.12 % too much, of index 2.4 2.8 %. *Where we depart:* below [`FIT_ENDS`] we integrate.
fn diffuse_fresnel(eta: f32) -> f32 {
    const EGAN_HILGEMAN: [f32; 4] = [-1.4399, 0.7099, 0.6681, 0.0636];
    const EON_IRVING: [f32; 6] = [-1.368_81, 4.985_54, -7.809_89, 6.753_35, -3.479_3, 0.919_317];
    let horner = |coefficients: &[f32], x: f32| coefficients.iter().fold(0.0, |sum, c| sum * x + c);
    if eta < FIT_ENDS {
        integrated_fresnel(eta)
    } else if eta < 1.0 {
        // A polynomial, but for its last term.
        horner(&EGAN_HILGEMAN, eta) / eta
    } else {
        horner(&EON_IRVING, 1.0 / eta)
    }
}

/// Reflectance of a smooth interface for diffuse light, ∫ F(cos θ)·2 cos θ d(cos θ).
fn integrated_fresnel(eta: f32) -> f32 {
    /// Enough for f32 where nothing is reflected totally.
    const NODES: usize = 128;
    if eta < 1.0 {
        // What gets through is the same both ways, but from inside all of it is within the critical angle.
        return 1.0 - sqr(eta) * (1.0 - integrated_fresnel(1.0 / eta));
    }
    let term = |(x, w): &(f64, f64)| 2.0 * x * w * f64::from(fresnel::dielectric(*x as f32, eta).reflectance);
    gauss_legendre(NODES).iter().map(term).sum::<f64>() as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fits_are_as_good_as_they_are_said_to_be() {
        for (eta, error) in
            [(1.0 / 1.05, 6e-3), (1.0 / 1.5, 1e-3), (1.0 / 2.4, 5e-3), (1.05, 5e-3), (1.5, 1e-3), (2.4, 1e-3)]
        {
            let (fit, exact) = (diffuse_fresnel(eta), integrated_fresnel(eta));
            assert!((fit / exact - 1.0).abs() < error, "{eta}: {fit} instead of {exact}");
        }
    }
}
