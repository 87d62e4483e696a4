//! The numbers of a bsdf that may vary over a surface, and how one is overridden where a texture says so.

use super::{Bsdf, each};
use crate::math::float::{max, min};
use crate::spectrum::Rgb;

/// A parameter of a bsdf, by Mitsuba's name for it. Colours are linear sRGB; the others are scalars.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// Albedo, a colour.
    Reflectance,
    /// Factor on a specular reflection, a colour.
    SpecularReflectance,
    /// Factor on a specular transmission, a colour.
    SpecularTransmittance,
    /// Albedo below a coat, a colour.
    DiffuseReflectance,
    /// Roughness α along ∂p/∂u.
    AlphaU,
    /// Roughness α across it.
    AlphaV,
    /// Index of refraction relative to the outside; of metal its real part, a colour.
    Eta,
    /// Imaginary part of a metal's index, a colour.
    K,
    /// Colour of a principled bsdf.
    BaseColor,
    /// Roughness in [0, 1]: of a principled bsdf the root of α, of rough diffuse reflection its r.
    Roughness,
    /// How far α differs along the tangents, in [0, 1].
    Anisotropic,
    /// Share of metal in [0, 1].
    Metallic,
    /// Share of glass in [0, 1].
    SpecTrans,
    /// How far specular reflection has the base colour's hue, in [0, 1].
    SpecTint,
    /// Strength of sheen in [0, 1].
    Sheen,
    /// How far sheen has the base colour's hue, in [0, 1].
    SheenTint,
    /// Share of the diffuse part that looks like subsurface scattering, in [0, 1].
    Flatness,
    /// Strength of a clear coat in [0, 1].
    Clearcoat,
    /// Gloss of a clear coat in [0, 1].
    ClearcoatGloss,
    /// Diffuse transmission in [0, 2]: 2 lets everything through.
    DiffTrans,
}

impl Parameter {
    /// Whether it is a colour; all others are scalars.
    pub fn is_colour(self) -> bool {
        matches!(
            self,
            Self::Reflectance
                | Self::SpecularReflectance
                | Self::SpecularTransmittance
                | Self::DiffuseReflectance
                | Self::Eta
                | Self::K
                | Self::BaseColor
        )
    }
}

impl Bsdf {
    /// Overrides one parameter. A scalar is the first channel of `value`. What is out of the parameter's range is brought
    /// into it; a parameter that this bsdf does not have is left alone.
    pub fn set(&mut self, parameter: Parameter, value: Rgb) {
        let known = each!(self, b => b.set(parameter, value));
        debug_assert!(known, "{self:?} has no {parameter:?}");
    }
}

/// `value` without negative channels; NaN counts as 0.
#[inline]
pub(super) fn not_negative(value: Rgb) -> Rgb {
    value.map(|c| max(c, 0.0))
}

/// The scalar that `value` stands for.
#[inline]
pub(super) fn scalar(value: Rgb) -> f32 {
    value.0.x
}

/// The scalar that `value` stands for, brought into [0, `most`]; NaN counts as 0.
#[inline]
pub(super) fn up_to(most: f32, value: Rgb) -> f32 {
    min(max(scalar(value), 0.0), most)
}
