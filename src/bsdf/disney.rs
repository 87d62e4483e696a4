//! What the two principled bsdfs share.
//!
//! Burley 2012, *Physically Based Shading at Disney*, and Burley 2015, *Extending the Disney BRDF to a BSDF with Integrated
//! Subsurface Scattering*, with the constants and simplifications of Mitsuba 3, whose pictures are to be met. The model is an
//! artist's, not a physicist's: retroreflection, sheen and tinted Fresnel terms may give back more than came in.

use super::fresnel;
use super::microfacet::{Distribution, Microfacets};
use super::parameter::{Parameter, not_negative, up_to};
use crate::math::float::{max, min, safe_sqrt, sqr};
use crate::spectrum::Rgb;
use std::f32::consts::{FRAC_1_PI, PI};

/// Parameters that both principled bsdfs have. All scalars but `eta` in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disney {
    /// The colour.
    pub base_color: Rgb,
    /// The square root of the microfacets' α.
    pub roughness: f32,
    /// How far α differs along the tangents.
    pub anisotropic: f32,
    /// Share of what is not diffuse but transmits specularly.
    pub spec_trans: f32,
    /// Index of refraction inside relative to outside, positive.
    pub eta: f32,
    /// How far dielectric reflection has the hue of the base.
    pub spec_tint: f32,
    /// Strength of the sheen.
    pub sheen: f32,
    /// How far the sheen has the hue of the base.
    pub sheen_tint: f32,
    /// Share of the diffuse part that looks like subsurface scattering.
    pub flatness: f32,
    /// Whether microfacets and coat are rougher than the numbers say: see [`super::Bsdf::regularized`].
    pub regularized: bool,
}

impl Default for Disney {
    fn default() -> Self {
        Self {
            base_color: Rgb::splat(0.5),
            roughness: 0.5,
            anisotropic: 0.0,
            spec_trans: 0.0,
            eta: 1.5,
            spec_tint: 0.0,
            sheen: 0.0,
            sheen_tint: 0.0,
            flatness: 0.0,
            regularized: false,
        }
    }
}

impl Disney {
    /// See [`super::Bsdf::regularized`]. What is diffuse, and its retroreflection, stays as the roughness says.
    pub(super) fn regularized(self) -> Self {
        Self { regularized: true, ..self }
    }

    /// Overrides one parameter; whether there is such a one.
    pub(super) fn set(&mut self, parameter: Parameter, value: Rgb) -> bool {
        match parameter {
            Parameter::BaseColor => self.base_color = not_negative(value),
            Parameter::Roughness => self.roughness = up_to(1.0, value),
            Parameter::Anisotropic => self.anisotropic = up_to(1.0, value),
            Parameter::SpecTrans => self.spec_trans = up_to(1.0, value),
            // The one that is a colour elsewhere.
            Parameter::Eta => self.eta = max(value.luminance(), 0.0),
            Parameter::SpecTint => self.spec_tint = up_to(1.0, value),
            Parameter::Sheen => self.sheen = up_to(1.0, value),
            Parameter::SheenTint => self.sheen_tint = up_to(1.0, value),
            Parameter::Flatness => self.flatness = up_to(1.0, value),
            _ => return false,
        }
        true
    }

    /// The microfacets of `roughness` (Burley 2012, section 5.4).
    #[inline]
    pub(super) fn facets(&self, roughness: f32) -> Microfacets {
        /// The smallest α, as in Mitsuba.
        const MIN_ALPHA: f32 = 1e-3;
        let alpha = sqr(roughness);
        let (u, v) = if self.anisotropic == 0.0 {
            (alpha, alpha)
        } else {
            let aspect = safe_sqrt(1.0 - 0.9 * self.anisotropic);
            (alpha / aspect, alpha * aspect)
        };
        let facets = Microfacets::new(Distribution::Ggx, max(u, MIN_ALPHA), max(v, MIN_ALPHA));
        if self.regularized { facets.regularized() } else { facets }
    }

    /// The base colour with a luminance of one; white if it is black.
    #[inline]
    fn hue(&self) -> Rgb {
        /// What each channel adds to luminance, in Mitsuba's digits.
        const LUMINANCE: [f32; 3] = [0.212_671, 0.715_160, 0.072_169];
        let luminance = self.base_color.to_array().into_iter().zip(LUMINANCE).map(|(c, l)| c * l).sum::<f32>();
        if luminance > 0.0 { self.base_color / luminance } else { Rgb::WHITE }
    }

    /// Dielectric reflection tinted with the base's hue, by Schlick's approximation, for light from outside.
    #[inline]
    pub(super) fn tinted_fresnel(&self, cos: f32) -> Rgb {
        self.schlick(self.hue() * sqr((self.eta - 1.0) / (self.eta + 1.0)), cos)
    }

    /// Schlick's approximation of a reflectance that is `normal` at normal incidence, for light from outside: in terms of
    /// the cosine on the side of the rarer medium.
    #[inline]
    pub(super) fn schlick(&self, normal: Rgb, cos: f32) -> Rgb {
        let cos = if self.eta > 1.0 { cos } else { fresnel::dielectric(cos, self.eta).cos_t };
        let w = schlick_weight(cos);
        normal.map(|r| w + (1.0 - w) * r)
    }

    /// Diffuse reflection times cos θi, with retroreflection, part of it flattened (Burley 2015, equations 4 and 5;
    /// Burley 2012, section 5.3), where `cos_d` is the cosine between wi and the half vector.
    #[inline]
    pub(super) fn diffuse(&self, cos_o: f32, cos_i: f32, cos_d: f32) -> Rgb {
        let (weight_o, weight_i) = (schlick_weight(cos_o), schlick_weight(cos_i));
        let lambert = (1.0 - 0.5 * weight_i) * (1.0 - 0.5 * weight_o);
        let rough = 2.0 * self.roughness * sqr(cos_d);
        let retro = rough * (weight_o + weight_i + weight_o * weight_i * (rough - 1.0));
        if !(self.flatness > 0.0) {
            return self.base_color * (FRAC_1_PI * ((lambert + retro) * cos_i));
        }
        // After Hanrahan and Krueger 1993. The quotient of cosines stays finite where both are tiny.
        let flat_at = |w: f32| 1.0 - w + w * 0.5 * rough;
        let flat = flat_at(weight_o) * flat_at(weight_i);
        let flat = 1.25 * (flat * (cos_i / (cos_o + cos_i) - 0.5 * cos_i) + 0.5 * cos_i);
        let blend = (1.0 - self.flatness) * (lambert + retro) * cos_i + self.flatness * flat;
        self.base_color * (FRAC_1_PI * blend)
    }

    /// Sheen (Burley 2012, section 5.5), where `cos_d` is the cosine between wi and the half vector.
    #[inline]
    pub(super) fn sheen(&self, cos_d: f32) -> Rgb {
        if !(self.sheen > 0.0) {
            return Rgb::BLACK;
        }
        let strength = self.sheen * schlick_weight(cos_d);
        self.hue().map(|h| strength * (1.0 - self.sheen_tint + self.sheen_tint * h))
    }

    /// About the share of light that diffuse reflection and sheen return.
    #[inline]
    pub(super) fn diffuse_albedo(&self, cos_o: f32) -> f32 {
        /// At grazing angles: most light then comes from far away from wo, under a half vector of 45°.
        const SHEEN: f32 = 0.05 * PI;
        self.base_color.mean() + SHEEN * self.sheen * schlick_weight(cos_o)
    }
}

/// (1 − cos)⁵ (Schlick 1994, *An Inexpensive BRDF Model for Physically-based Rendering*).
#[inline]
pub(super) fn schlick_weight(cos: f32) -> f32 {
    let x = min(max(1.0 - cos, 0.0), 1.0);
    sqr(sqr(x)) * x
}

/// How often a lobe is sampled that returns about `albedo` of the light, if it `exists` at all; relative to the others.
#[inline]
pub(super) fn share(exists: bool, albedo: f32) -> f32 {
    /// Albedos are guesses: a lobe that they underrate must not be rare, for its samples would weigh the more.
    const LEAST: f32 = 0.05;
    if exists { max(albedo, LEAST) } else { 0.0 }
}
