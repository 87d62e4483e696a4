//! The names of what may vary over a surface: what a file gives by a texture, and what a bsdf can be told at a point.

/// A parameter of a bsdf, by Mitsuba's name for it or, where Mitsuba has none, glTF's. Colours are linear sRGB; the others
/// are scalars.
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
    /// Strength of a dielectric's reflection in [0, 1].
    Specular,
    /// Colour of that reflection at normal incidence.
    SpecularColor,
    /// Share of what is not reflected by a dielectric that passes, in [0, 1].
    Transmission,
    /// Roughness of a clear coat in [0, 1], the root of its α.
    ClearcoatRoughness,
    /// Strength of sheen, a colour.
    SheenColor,
    /// Roughness of sheen in [0, 1], the root of its α.
    SheenRoughness,
    /// Strength of a thin film's interference in [0, 1].
    Iridescence,
    /// Thickness of a thin film in nanometres.
    IridescenceThickness,
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
                | Self::SpecularColor
                | Self::SheenColor
        )
    }
}
