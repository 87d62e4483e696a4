//! A pane: two parallel interfaces so close together that light leaves where it entered, in the direction it came in.
//!
//! What enters is reflected to and fro between the interfaces. With F the reflectance of one of them, all that comes back is
//! F + (1−F)²·F·(1 + F² + F⁴ + …) = 2F / (1+F), and the rest, (1−F) / (1+F), passes (Born and Wolf, *Principles of Optics*,
//! section 1.6, without interference).

use super::parameter::{Parameter, not_negative};
use super::{BsdfSample, Lobes, Microfacets, NOTHING, RoughPane, fresnel};
use crate::sampler::BsdfUniforms;
use crate::sampling::pdf::SolidAnglePdf;
use crate::spectrum::Rgb;
use glam::Vec3;

/// A pane, the same from both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinDielectric {
    eta: f32,
    reflectance: Rgb,
    transmittance: Rgb,
}

impl ThinDielectric {
    /// From the index of refraction inside relative to outside, and factors on what is reflected and transmitted.
    pub fn new(eta: f32, reflectance: Rgb, transmittance: Rgb) -> Self {
        Self { eta, reflectance, transmittance }
    }

    /// See [`super::Bsdf::regularized`].
    pub(super) fn regularized(self) -> RoughPane {
        RoughPane::new(Microfacets::of_smooth_twin(), self.eta, self.reflectance, self.transmittance)
    }

    pub(super) fn lobes(&self) -> Lobes {
        Lobes { smooth: false, delta: true, transmits: true, anisotropic: false }
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

    /// What comes back of all light.
    #[inline]
    fn reflected(&self, wo: Vec3) -> f32 {
        let one = fresnel::dielectric(wo.z.abs(), self.eta).reflectance;
        2.0 * one / (1.0 + one)
    }

    /// See [`super::Bsdf::mirror`].
    pub(super) fn mirror(&self, wo: Vec3) -> Option<Rgb> {
        (wo.z != 0.0).then(|| self.reflectance * self.reflected(wo))
    }

    /// See [`super::Bsdf::through`].
    pub(super) fn through(&self, wo: Vec3) -> (Vec3, Rgb) {
        (-wo, self.transmittance * (1.0 - self.reflected(wo)))
    }

    pub(super) fn eval_pdf(&self, _wo: Vec3, _wi: Vec3) -> (Rgb, SolidAnglePdf) {
        NOTHING
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: BsdfUniforms) -> Option<BsdfSample> {
        let (wi, weight) = if u.lobe() < self.reflected(wo) {
            (Vec3::new(-wo.x, -wo.y, wo.z), self.reflectance)
        } else {
            (-wo, self.transmittance)
        };
        Some(BsdfSample { wi, weight, pdf: None, eta: 1.0 })
    }
}
