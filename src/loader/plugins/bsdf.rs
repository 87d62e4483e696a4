//! Bsdfs.

use super::colour::colour;
use super::principled::{fraction, principled, principled_thin};
use super::texture::{find_texture, required_texture, vary, varying};
use crate::description::{
    BsdfId, BsdfKind, MicrofacetDistribution, Microfacets, NormalSource, Parameter, Plastic, Terminator,
};
use crate::error::Result;
use crate::loader::build::Builder;
use crate::loader::conductors::{conductor, conductor_names};
use crate::loader::dielectrics::{dielectric_ior, dielectric_names};
use crate::loader::document::{Category, Value};
use crate::loader::params::Params;
use crate::loader::suggest::suggestion;
use crate::spectrum::{Rgb, SpectrumRole};

type BsdfFn = fn(&mut Builder<'_>, &Params<'_>) -> Result<BsdfKind>;

/// The supported bsdf plugins.
pub(crate) const BSDFS: &[(&str, BsdfFn)] = &[
    ("blendbsdf", blend),
    ("bumpmap", bumpmap),
    ("conductor", smooth_conductor),
    ("dielectric", dielectric),
    ("diffuse", diffuse),
    ("mask", mask),
    ("normalmap", normalmap),
    ("null", null),
    ("oren_nayar", oren_nayar),
    ("plastic", plastic),
    ("principled", principled),
    ("principledthin", principled_thin),
    ("roughconductor", rough_conductor),
    ("roughdielectric", rough_dielectric),
    ("roughplastic", rough_plastic),
    ("thindielectric", thin_dielectric),
    ("twosided", twosided),
];

/// Reflectance of what is diffuse unless given.
pub(super) const DEFAULT_REFLECTANCE: f32 = 0.5;

/// Weight of a blend and opacity of a mask unless given.
const DEFAULT_WEIGHT: f64 = 0.5;

/// Roughness α unless given.
const DEFAULT_ALPHA: f64 = 0.1;

/// Largest roughness α. Reason: no surface is a hundredth as rough, and its fourth power is a number in single precision.
const MAX_ALPHA: f64 = 1e6;

fn diffuse(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    let reflectance =
        reflectance(b, p, Parameter::Reflectance, "reflectance")?.unwrap_or(Rgb::splat(DEFAULT_REFLECTANCE));
    Ok(BsdfKind::Diffuse { reflectance })
}

fn smooth_conductor(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    let (eta, k) = complex_ior(b, p)?;
    let specular_reflectance =
        reflectance(b, p, Parameter::SpecularReflectance, "specular_reflectance")?.unwrap_or(Rgb::WHITE);
    Ok(BsdfKind::Conductor { eta, k, specular_reflectance })
}

fn rough_conductor(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    let facets = microfacets(b, p)?;
    let (eta, k) = complex_ior(b, p)?;
    let specular_reflectance =
        reflectance(b, p, Parameter::SpecularReflectance, "specular_reflectance")?.unwrap_or(Rgb::WHITE);
    Ok(BsdfKind::RoughConductor { facets, eta, k, specular_reflectance })
}

fn microfacets(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Microfacets> {
    let distribution = match p.choice("distribution", &["beckmann", "ggx"])? {
        "ggx" => MicrofacetDistribution::Ggx,
        _ => MicrofacetDistribution::Beckmann,
    };
    // How normals are sampled changes the noise, not the picture.
    if !p.boolean("sample_visible", true)? {
        b.warn(
            p.at("sample_visible"),
            "visible normals are sampled all the same: the picture is the same, its noise less",
        );
    }
    let (alpha_u, alpha_v) = match (roughness(b, p, "alpha")?, roughness(b, p, "alpha_u")?, roughness(b, p, "alpha_v")?)
    {
        (alpha, None, None) => (alpha.unwrap_or(DEFAULT_ALPHA), alpha.unwrap_or(DEFAULT_ALPHA)),
        (None, Some(u), Some(v)) => (u, v),
        (Some(_), ..) => return Err(p.error("alpha", "'alpha' excludes 'alpha_u' and 'alpha_v'")),
        (None, Some(_), None) => return Err(p.error("alpha_u", "'alpha_u' needs 'alpha_v'")),
        (None, None, Some(_)) => return Err(p.error("alpha_v", "'alpha_v' needs 'alpha_u'")),
    };
    let multiple_scattering = multiple_scattering(p, alpha_u)?;
    Ok(Microfacets { distribution, alpha_u, alpha_v, multiple_scattering })
}

/// Whether light counts that facets scatter several times: not one of Mitsuba's parameters.
fn multiple_scattering(p: &Params<'_>, alpha: f64) -> Result<bool> {
    const NAME: &str = "multiple_scattering";
    let asked = p.boolean(NAME, false)?;
    if asked && p.find("alpha_u").is_some() {
        return Err(p.error(NAME, "'multiple_scattering' needs 'alpha' instead of 'alpha_u' and 'alpha_v'"));
    }
    if asked && alpha > 1.0 {
        return Err(p.error("alpha", format!("'multiple_scattering' needs an 'alpha' of at most 1, not {alpha}")));
    }
    Ok(asked)
}

fn roughness(b: &mut Builder<'_>, p: &Params<'_>, name: &'static str) -> Result<Option<f64>> {
    let parameters: &[Parameter] = match name {
        "alpha_u" => &[Parameter::AlphaU],
        "alpha_v" => &[Parameter::AlphaV],
        _ => &[Parameter::AlphaU, Parameter::AlphaV],
    };
    if vary(b, p, name, parameters)? {
        return Ok(Some(DEFAULT_ALPHA));
    }
    let value = match p.find(name).map(|param| &param.value) {
        // A texture of one colour.
        Some(Value::Child(_)) => colour(b, p, name, SpectrumRole::Index)?.map(|c| f64::from(c.luminance())),
        _ => p.float(name)?,
    };
    if value.is_some_and(|v| !(0.0..=MAX_ALPHA).contains(&v)) {
        return Err(p.error(name, format!("'{name}' must be between 0 and {MAX_ALPHA}")));
    }
    Ok(value)
}

fn complex_ior(b: &mut Builder<'_>, p: &Params<'_>) -> Result<(Rgb, Rgb)> {
    let mut index = |parameter, name| match vary(b, p, name, &[parameter])? {
        // Whatever it is: the texture takes its place.
        true => Ok(Some(Rgb::WHITE)),
        false => colour(b, p, name, SpectrumRole::Index),
    };
    let (eta, k) = (index(Parameter::Eta, "eta")?, index(Parameter::K, "k")?);
    let material = p.text("material")?;
    if material.is_some() && (eta.is_some() || k.is_some()) {
        return Err(p.error("material", "'material' excludes 'eta' and 'k'"));
    }
    let name = material.unwrap_or("none");
    let Some((preset_eta, preset_k)) = conductor(name) else {
        let hint = suggestion(name, conductor_names());
        return Err(p.error("material", format!("unknown material '{name}'{hint}")));
    };
    let rgb = |[r, g, b]: [f32; 3]| Rgb::new(r, g, b);
    Ok((eta.unwrap_or(rgb(preset_eta)), k.unwrap_or(rgb(preset_k))))
}

/// What is between two dielectrics.
struct Interface {
    int_ior: f64,
    ext_ior: f64,
    specular_reflectance: Rgb,
    specular_transmittance: Rgb,
}

fn interface(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Interface> {
    let (int_ior, ext_ior) = (ior(p, "int_ior", "bk7")?, ior(p, "ext_ior", "air")?);
    let reflectance_of = Parameter::SpecularReflectance;
    let transmittance_of = Parameter::SpecularTransmittance;
    Ok(Interface {
        int_ior,
        ext_ior,
        specular_reflectance: reflectance(b, p, reflectance_of, "specular_reflectance")?.unwrap_or(Rgb::WHITE),
        specular_transmittance: reflectance(b, p, transmittance_of, "specular_transmittance")?.unwrap_or(Rgb::WHITE),
    })
}

fn dielectric(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    let Interface { int_ior, ext_ior, specular_reflectance, specular_transmittance } = interface(b, p)?;
    Ok(BsdfKind::Dielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance })
}

fn rough_dielectric(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    let facets = microfacets(b, p)?;
    let Interface { int_ior, ext_ior, specular_reflectance, specular_transmittance } = interface(b, p)?;
    if int_ior == ext_ior {
        return Err(p.error("int_ior", "'int_ior' and 'ext_ior' of a rough dielectric must differ"));
    }
    Ok(BsdfKind::RoughDielectric { facets, int_ior, ext_ior, specular_reflectance, specular_transmittance })
}

fn thin_dielectric(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    let Interface { int_ior, ext_ior, specular_reflectance, specular_transmittance } = interface(b, p)?;
    Ok(BsdfKind::ThinDielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance })
}

fn plastic(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    plastic_parameters(b, p).map(BsdfKind::Plastic)
}

fn plastic_parameters(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Plastic> {
    Ok(Plastic {
        int_ior: ior(p, "int_ior", "polypropylene")?,
        ext_ior: ior(p, "ext_ior", "air")?,
        diffuse_reflectance: reflectance(b, p, Parameter::DiffuseReflectance, "diffuse_reflectance")?
            .unwrap_or(Rgb::splat(DEFAULT_REFLECTANCE)),
        specular_reflectance: reflectance(b, p, Parameter::SpecularReflectance, "specular_reflectance")?
            .unwrap_or(Rgb::WHITE),
        nonlinear: p.boolean("nonlinear", false)?,
    })
}

fn rough_plastic(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    // The coat's transmittance is tabulated, so that its roughness must be the same everywhere; in Mitsuba, too.
    for name in ["alpha", "alpha_u", "alpha_v"] {
        if find_texture(b, p, name).is_some() {
            return Err(p.error(name, format!("'{name}' of rough plastic must be a number, not a texture")));
        }
    }
    let facets = microfacets(b, p)?;
    if facets.alpha_u != facets.alpha_v {
        return Err(p.error("alpha_u", "'alpha_u' and 'alpha_v' of rough plastic must be equal"));
    }
    let plastic = plastic_parameters(b, p)?;
    if plastic.int_ior == plastic.ext_ior {
        return Err(p.error("int_ior", "'int_ior' and 'ext_ior' of rough plastic must differ"));
    }
    Ok(BsdfKind::RoughPlastic { facets, plastic })
}

/// Not one of Mitsuba's.
fn oren_nayar(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    const DEFAULT_ROUGHNESS: f64 = 0.5;
    Ok(BsdfKind::OrenNayar {
        reflectance: reflectance(b, p, Parameter::Reflectance, "reflectance")?
            .unwrap_or(Rgb::splat(DEFAULT_REFLECTANCE)),
        roughness: fraction(b, p, Parameter::Roughness, "roughness", DEFAULT_ROUGHNESS)?,
    })
}

fn null(_: &mut Builder<'_>, _: &Params<'_>) -> Result<BsdfKind> {
    Ok(BsdfKind::Null)
}

fn ior(p: &Params<'_>, name: &'static str, default: &str) -> Result<f64> {
    let is_text = p.find(name).is_none_or(|param| matches!(param.value, Value::Text(_)));
    if !is_text {
        return p.positive(name, 1.0);
    }
    let material = p.text(name)?.unwrap_or(default);
    dielectric_ior(material).ok_or_else(|| {
        let hint = suggestion(&material.to_lowercase(), dielectric_names());
        p.error(name, format!("unknown dielectric '{material}'{hint}"))
    })
}

fn twosided(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    let children = p.children(Category::Bsdf);
    let at = |i: usize| children.get(i).map_or(p.object.at, |child| child.1);
    if children.len() > 2 {
        return Err(b.document.sources.error(at(2), "twosided takes at most two bsdfs"));
    }
    let mut sides = Vec::new();
    for (id, at) in &children {
        let made = b.bsdf(*id)?;
        if b.transmits(made) {
            return Err(b.document.sources.error(*at, "twosided takes only bsdfs that do not transmit"));
        }
        sides.push(match b.bsdf_kind(made) {
            // Each side is seen as a front: of a two-sided one inside only the front can be seen.
            BsdfKind::TwoSided { front, .. } => *front,
            _ => made,
        });
    }
    let front: Option<&BsdfId> = sides.first();
    let Some(&front) = front else {
        return Err(b.document.sources.error(p.object.at, "twosided needs a bsdf inside"));
    };
    Ok(BsdfKind::TwoSided { front, back: sides.get(1).copied().unwrap_or(front) })
}

/// The one bsdf inside another.
fn nested(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfId> {
    match p.child(Category::Bsdf)? {
        Some((id, _)) => b.bsdf(id),
        None => Err(b.document.sources.error(p.object.at, format!("{} needs a bsdf inside", p.object.plugin))),
    }
}

/// As in Mitsuba, the two count in the order of their names, in which those without one come in the order of the file.
fn blend(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    let weight = varying(b, p, "weight", DEFAULT_WEIGHT)?;
    let children = p.children(Category::Bsdf);
    let [(first, _), (second, _)] = children[..] else {
        let message = format!("blendbsdf takes exactly two bsdfs, not {}", children.len());
        return Err(b.document.sources.error(p.object.at, message));
    };
    Ok(BsdfKind::Blend { first: b.bsdf(first)?, second: b.bsdf(second)?, weight })
}

fn mask(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    let opacity = varying(b, p, "opacity", DEFAULT_WEIGHT)?;
    Ok(BsdfKind::Mask { nested: nested(b, p)?, opacity })
}

fn normalmap(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    let normal = NormalSource::Map { texture: required_texture(b, p, Some("normalmap"))?, scale: 1.0 };
    perturbed(b, p, normal)
}

fn bumpmap(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    let height = required_texture(b, p, None)?;
    let scale = p.float("scale")?.unwrap_or(1.0);
    perturbed(b, p, NormalSource::Bump { height, scale })
}

fn perturbed(b: &mut Builder<'_>, p: &Params<'_>, normal: NormalSource) -> Result<BsdfKind> {
    let flip_invalid = p.boolean("flip_invalid_normals", true)?;
    let shadowing = p.boolean("use_shadowing_function", true)?;
    let terminator = Terminator::Cut { flip_invalid, shadowing };
    Ok(BsdfKind::Perturbed { nested: nested(b, p)?, normal, terminator })
}

/// A reflectance, which a texture may give as `parameter`; a constant above 1 makes light from nothing, which Mitsuba lets
/// pass, too.
pub(super) fn reflectance(
    b: &mut Builder<'_>,
    p: &Params<'_>,
    parameter: Parameter,
    name: &'static str,
) -> Result<Option<Rgb>> {
    if vary(b, p, name, &[parameter])? {
        return Ok(None);
    }
    let value = colour(b, p, name, SpectrumRole::Reflectance)?;
    if value.is_some_and(|v| v.max_component() > 1.0) {
        b.warn(p.at(name), &format!("'{name}' is larger than 1: the surface creates energy"));
    }
    Ok(value)
}
