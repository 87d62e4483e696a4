//! What a file said of how surfaces scatter.

use super::{BsdfId, Texture, TextureId};
use crate::error::Span;
use crate::parameter::Parameter;
use crate::spectrum::Rgb;

/// A bsdf.
#[derive(Clone, Debug)]
pub struct Bsdf {
    /// Where in the file.
    pub at: Span,
    /// Its `id`, or empty.
    pub name: String,
    /// What it is; of parameters that vary, a constant that stands for them.
    pub kind: BsdfKind,
    /// The parameters that vary over a surface.
    pub varying: Vec<(Parameter, TextureId)>,
}

/// A number of a bsdf that may vary over a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Varying {
    /// The same everywhere.
    Constant(f64),
    /// What a texture gives where a number is asked for: its luminance.
    Texture(TextureId),
}

/// The kinds of bsdf, with Mitsuba's parameters. Colours are linear sRGB.
#[derive(Clone, Debug, PartialEq)]
pub enum BsdfKind {
    /// Lambertian, front side only.
    Diffuse {
        /// Albedo.
        reflectance: Rgb,
    },
    /// A smooth conductor, front side only.
    Conductor {
        /// Real part of the index of refraction relative to the outside.
        eta: Rgb,
        /// Imaginary part.
        k: Rgb,
        /// Factor on the reflection; 1 is physical.
        specular_reflectance: Rgb,
    },
    /// A rough conductor, front side only.
    RoughConductor {
        /// Its microfacets.
        facets: Microfacets,
        /// Real part of the index of refraction relative to the outside.
        eta: Rgb,
        /// Imaginary part.
        k: Rgb,
        /// Factor on the reflection; 1 is physical.
        specular_reflectance: Rgb,
    },
    /// A smooth interface between two dielectrics.
    Dielectric {
        /// Index of refraction inside (where the normal does not point).
        int_ior: f64,
        /// Index of refraction outside.
        ext_ior: f64,
        /// Factor on the reflection; 1 is physical.
        specular_reflectance: Rgb,
        /// Factor on the transmission; 1 is physical.
        specular_transmittance: Rgb,
    },
    /// A rough interface between two dielectrics.
    RoughDielectric {
        /// Its microfacets.
        facets: Microfacets,
        /// Index of refraction inside (where the normal does not point).
        int_ior: f64,
        /// Index of refraction outside; another than inside.
        ext_ior: f64,
        /// Factor on the reflection; 1 is physical.
        specular_reflectance: Rgb,
        /// Factor on the transmission; 1 is physical.
        specular_transmittance: Rgb,
    },
    /// Two interfaces between dielectrics, close together.
    ThinDielectric {
        /// Index of refraction between them.
        int_ior: f64,
        /// Index of refraction outside.
        ext_ior: f64,
        /// Factor on the reflection; 1 is physical.
        specular_reflectance: Rgb,
        /// Factor on the transmission; 1 is physical.
        specular_transmittance: Rgb,
    },
    /// A diffuse base under a smooth coat, front side only.
    Plastic(Plastic),
    /// A diffuse base under a rough coat, front side only.
    RoughPlastic {
        /// The coat's microfacets, isotropic.
        facets: Microfacets,
        /// The rest.
        plastic: Plastic,
    },
    /// Burley's principled bsdf.
    Principled {
        /// What it shares with the thin one.
        shared: PrincipledShared,
        /// Share of metal in [0, 1].
        metallic: f64,
        /// Strength of the clear coat in [0, 1].
        clearcoat: f64,
        /// Gloss of the clear coat in [0, 1].
        clearcoat_gloss: f64,
    },
    /// The same for a sheet.
    PrincipledThin {
        /// What it shares with the solid one.
        shared: PrincipledShared,
        /// How much of the diffuse part is transmitted, in [0, 2].
        diff_trans: f64,
    },
    /// Rough diffuse reflection, front side only; not one of Mitsuba's.
    OrenNayar {
        /// Albedo of the facets.
        reflectance: Rgb,
        /// Roughness in [0, 1]; 0 is Lambertian.
        roughness: f64,
    },
    /// The metallic-roughness material of glTF 2.0 with its extensions.
    Gltf(Gltf),
    /// Lets light pass as if nothing was there.
    Null,
    /// One-sided bsdfs made two-sided.
    TwoSided {
        /// Seen from the front.
        front: BsdfId,
        /// Seen from the back.
        back: BsdfId,
    },
    /// A weighted mean of two bsdfs.
    Blend {
        /// Counts 1 − `weight`, ...
        first: BsdfId,
        /// ... and `weight`.
        second: BsdfId,
        /// Clamped to [0, 1].
        weight: Varying,
    },
    /// A bsdf with holes: what is not opaque lets light straight through.
    Mask {
        /// What is not a hole.
        nested: BsdfId,
        /// Clamped to [0, 1].
        opacity: Varying,
    },
    /// A bsdf with another normal.
    Perturbed {
        /// The bsdf.
        nested: BsdfId,
        /// Where the normal comes from.
        normal: NormalSource,
        /// What happens where it disagrees with the surface's own about who sees whom.
        terminator: Terminator,
    },
}

/// The material of glTF 2.0 (Khronos Group 2021, *glTF 2.0 Specification*, appendix B) and of its extensions
/// `KHR_materials_clearcoat`, `_ior`, `_iridescence`, `_sheen`, `_specular`, `_transmission` and `_volume`, whose names and
/// defaults these are. Numbers are in [0, 1] unless they say otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gltf {
    /// Colour of the base: albedo, or reflectance of the metal.
    pub base_color: Rgb,
    /// Share of metal.
    pub metallic: f64,
    /// The square root of the microfacets' α.
    pub roughness: f64,
    /// Index of refraction inside relative to outside, at least 1.
    pub ior: f64,
    /// Strength of the dielectric's reflection.
    pub specular: f64,
    /// Its colour at normal incidence, of any size; the reflectance that it makes is at most 1.
    pub specular_color: Rgb,
    /// Share of what is not reflected by the dielectric that passes instead of being scattered.
    pub transmission: f64,
    /// What is inside; `None` for a sheet with nothing inside.
    pub volume: Option<Volume>,
    /// Strength of the coat.
    pub clearcoat: f64,
    /// The square root of its microfacets' α.
    pub clearcoat_roughness: f64,
    /// The coat's own normal; without one it is the surface's shading normal, whatever that of the base.
    pub coat_normal: Option<NormalSource>,
    /// Colour of the sheen.
    pub sheen_color: Rgb,
    /// Roughness of the sheen.
    pub sheen_roughness: f64,
    /// Strength of the thin film's interference.
    pub iridescence: f64,
    /// Index of refraction of the film, at least 1.
    pub iridescence_ior: f64,
    /// Thickness of the film in nanometres.
    pub iridescence_thickness: f64,
}

/// What fills a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// The part of white light that is left after `attenuation_distance`, each in (0, 1].
    pub attenuation_color: Rgb,
    /// In units of length of the file, positive; infinite where nothing is absorbed.
    pub attenuation_distance: f64,
}

impl Default for Gltf {
    fn default() -> Self {
        Self {
            base_color: Rgb::WHITE,
            metallic: 1.0,
            roughness: 1.0,
            ior: 1.5,
            specular: 1.0,
            specular_color: Rgb::WHITE,
            transmission: 0.0,
            volume: None,
            clearcoat: 0.0,
            clearcoat_roughness: 0.0,
            coat_normal: None,
            sheen_color: Rgb::BLACK,
            sheen_roughness: 0.0,
            iridescence: 0.0,
            iridescence_ior: 1.3,
            iridescence_thickness: 400.0,
        }
    }
}

/// What the two kinds of plastic share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plastic {
    /// Index of refraction inside.
    pub int_ior: f64,
    /// Index of refraction outside.
    pub ext_ior: f64,
    /// Albedo of the base.
    pub diffuse_reflectance: Rgb,
    /// Factor on the coat's reflection; 1 is physical.
    pub specular_reflectance: Rgb,
    /// Whether light that is scattered several times inside takes the base's hue as often.
    pub nonlinear: bool,
}

/// What the two principled bsdfs share. All numbers but `eta` are in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipledShared {
    /// The colour.
    pub base_color: Rgb,
    /// The square root of the microfacets' α.
    pub roughness: f64,
    /// How far α differs along the tangents.
    pub anisotropic: f64,
    /// Share of what is not diffuse but transmits specularly.
    pub spec_trans: f64,
    /// Index of refraction inside relative to outside.
    pub eta: f64,
    /// How far dielectric reflection has the hue of the base.
    pub spec_tint: f64,
    /// Strength of the sheen.
    pub sheen: f64,
    /// How far the sheen has the hue of the base.
    pub sheen_tint: f64,
    /// Share of the diffuse part that looks like subsurface scattering.
    pub flatness: f64,
}

/// What happens where a perturbed normal looks elsewhere than the surface's own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Terminator {
    /// Light from behind either is cut off, as Mitsuba 3.9 does.
    Cut {
        /// Whether a normal that looks away from the viewer is turned round the surface's own (Schüssler et al. 2017).
        flip_invalid: bool,
        /// Whether light fades out towards the terminator of the surface's own normal (Estevez et al. 2019).
        shadowing: bool,
    },
    /// The normal is bent towards the surface's own until a mirror would show the viewer what is above the surface (Keller et
    /// al. 2017, *The Iray Light Transport Simulation and Rendering System*); light from behind either is cut off.
    Bend,
}

/// Where a perturbed normal comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NormalSource {
    /// From the three channels of a texture, as (n + 1)/2, in the surface's shading frame.
    Map {
        /// The texture.
        texture: TextureId,
        /// A factor on the components along the surface.
        scale: f64,
    },
    /// From a height, in units of length of the file, along the surface's normal.
    Bump {
        /// The height.
        height: TextureId,
        /// A factor on it.
        scale: f64,
    },
}

impl NormalSource {
    /// The texture that it asks.
    pub fn texture(self) -> TextureId {
        match self {
            Self::Map { texture: id, .. } | Self::Bump { height: id, .. } => id,
        }
    }
}

/// What a surface must know of itself for its bsdf.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SurfaceNeeds {
    /// Texture coordinates.
    pub uvs: bool,
    /// Where its tangents point.
    pub tangents: bool,
}

impl SurfaceNeeds {
    fn or(self, other: Self) -> Self {
        Self { uvs: self.uvs || other.uvs, tangents: self.tangents || other.tangents }
    }
}

impl Bsdf {
    /// The bsdfs that it is made of.
    pub fn parts(&self) -> Vec<BsdfId> {
        match self.kind {
            BsdfKind::TwoSided { front, back } => vec![front, back],
            BsdfKind::Blend { first, second, .. } => vec![first, second],
            BsdfKind::Mask { nested, .. } | BsdfKind::Perturbed { nested, .. } => vec![nested],
            _ => Vec::new(),
        }
    }

    /// The textures that it asks itself.
    pub fn asked_textures(&self) -> Vec<TextureId> {
        let number = |v: Varying| if let Varying::Texture(id) = v { Some(id) } else { None };
        let own = match self.kind {
            BsdfKind::Blend { weight, .. } => number(weight),
            BsdfKind::Mask { opacity, .. } => number(opacity),
            BsdfKind::Perturbed { normal, .. } => Some(normal.texture()),
            BsdfKind::Gltf(gltf) => gltf.coat_normal.map(NormalSource::texture),
            _ => None,
        };
        own.into_iter().chain(self.varying.iter().map(|(_, id)| *id)).collect()
    }

    /// Whether it lets light through. `bsdfs` are those that it may refer to.
    pub fn transmits(&self, bsdfs: &[Self]) -> bool {
        let of = |id: &BsdfId| bsdfs[id.0].transmits(bsdfs);
        match &self.kind {
            BsdfKind::Dielectric { .. }
            | BsdfKind::RoughDielectric { .. }
            | BsdfKind::ThinDielectric { .. }
            | BsdfKind::PrincipledThin { .. }
            | BsdfKind::Null
            | BsdfKind::Mask { .. } => true,
            BsdfKind::Diffuse { .. }
            | BsdfKind::OrenNayar { .. }
            | BsdfKind::Conductor { .. }
            | BsdfKind::RoughConductor { .. }
            | BsdfKind::Plastic { .. }
            | BsdfKind::RoughPlastic { .. } => false,
            // Where a texture says how much, a constant that is not zero stands for it.
            BsdfKind::Principled { shared, .. } => shared.spec_trans > 0.0,
            BsdfKind::Gltf(gltf) => gltf.transmission > 0.0,
            BsdfKind::TwoSided { front, back } => of(front) || of(back),
            BsdfKind::Blend { first, second, .. } => of(first) || of(second),
            BsdfKind::Perturbed { nested, .. } => of(nested),
        }
    }

    /// What a surface must know of itself for this bsdf. `bsdfs` and `textures` are those that it may refer to.
    pub fn needs(&self, bsdfs: &[Self], textures: &[Texture]) -> SurfaceNeeds {
        let of = |id: &BsdfId| bsdfs[id.0].needs(bsdfs, textures);
        let texture = |id: TextureId| SurfaceNeeds { uvs: textures[id.0].is_varying(), tangents: false };
        let number = |v: &Varying| match v {
            Varying::Constant(_) => SurfaceNeeds::default(),
            Varying::Texture(id) => texture(*id),
        };
        let own = match &self.kind {
            BsdfKind::RoughConductor { facets, .. } | BsdfKind::RoughDielectric { facets, .. } => {
                let texture = |p| self.varying.iter().find(|(parameter, _)| *parameter == p).map(|(_, t)| *t);
                let isotropic =
                    facets.alpha_u == facets.alpha_v && texture(Parameter::AlphaU) == texture(Parameter::AlphaV);
                SurfaceNeeds { uvs: false, tangents: !isotropic }
            }
            BsdfKind::TwoSided { front, back } => of(front).or(of(back)),
            BsdfKind::Blend { first, second, weight } => of(first).or(of(second)).or(number(weight)),
            BsdfKind::Mask { nested, opacity } => of(nested).or(number(opacity)),
            BsdfKind::Perturbed { nested, .. } => of(nested).or(SurfaceNeeds { uvs: true, tangents: true }),
            BsdfKind::Gltf(gltf) => {
                let coated = gltf.coat_normal.is_some();
                SurfaceNeeds { uvs: coated, tangents: coated }
            }
            BsdfKind::Principled { shared, .. } | BsdfKind::PrincipledThin { shared, .. } => {
                SurfaceNeeds { uvs: false, tangents: shared.anisotropic > 0.0 }
            }
            BsdfKind::Diffuse { .. }
            | BsdfKind::OrenNayar { .. }
            | BsdfKind::Conductor { .. }
            | BsdfKind::Dielectric { .. }
            | BsdfKind::ThinDielectric { .. }
            | BsdfKind::Plastic { .. }
            | BsdfKind::RoughPlastic { .. }
            | BsdfKind::Null => SurfaceNeeds::default(),
        };
        let anisotropic = self.varying.iter().any(|(p, _)| *p == Parameter::Anisotropic);
        let own = own.or(SurfaceNeeds { uvs: false, tangents: anisotropic });
        self.varying.iter().fold(own, |needs, (_, id)| needs.or(texture(*id)))
    }
}

/// A distribution of microfacets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacets {
    /// Its shape.
    pub distribution: MicrofacetDistribution,
    /// Roughness α (the square of what artists call roughness) along ∂p/∂u, not negative.
    pub alpha_u: f64,
    /// Roughness across it.
    pub alpha_v: f64,
    /// Whether light counts that facets scatter several times, which Mitsuba leaves out; then both roughnesses are equal and
    /// at most 1.
    pub multiple_scattering: bool,
}

/// The shapes of a distribution of microfacets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MicrofacetDistribution {
    /// Beckmann's.
    Beckmann,
    /// GGX, that is, Trowbridge's and Reitz'.
    Ggx,
}
