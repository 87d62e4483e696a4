//! The principled bsdfs.

use super::bsdf::{DEFAULT_REFLECTANCE, reflectance};
use super::colour::colour;
use super::texture::vary;
use crate::description::{BsdfKind, Parameter, PrincipledShared};
use crate::error::Result;
use crate::loader::build::Builder;
use crate::loader::document::Value;
use crate::loader::params::Params;
use crate::spectrum::{Rgb, SpectrumRole};

/// Roughness unless given.
const DEFAULT_ROUGHNESS: f64 = 0.5;

/// Reflectance at normal incidence, over 0.08, unless given.
const DEFAULT_SPECULAR: f64 = 0.5;

/// Index of refraction of a sheet unless given.
const DEFAULT_ETA: f64 = 1.5;

/// What takes the place of an index of 1, and of a `specular` of 0, where something is transmitted; Mitsuba's numbers.
const LEAST_ETA: f64 = 1.001;
const LEAST_SPECULAR: f64 = 1e-3;

/// What stands for a number that a texture gives: whatever depends on it happening somewhere does.
const STAND_IN: f64 = 0.5;

pub(super) fn principled(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    // How often lobes are sampled changes the noise, not the picture, and we have other means.
    p.accept(&["main_specular_sampling_rate", "clearcoat_sampling_rate", "diffuse_reflectance_sampling_rate"]);
    let spec_trans = fraction(b, p, Parameter::SpecTrans, "spec_trans", 0.0)?;
    let eta = solid_eta(p, spec_trans > 0.0)?;
    Ok(BsdfKind::Principled {
        shared: shared(b, p, spec_trans, eta)?,
        metallic: fraction(b, p, Parameter::Metallic, "metallic", 0.0)?,
        clearcoat: fraction(b, p, Parameter::Clearcoat, "clearcoat", 0.0)?,
        clearcoat_gloss: fraction(b, p, Parameter::ClearcoatGloss, "clearcoat_gloss", 0.0)?,
    })
}

/// The index of refraction, given as such or by `specular`.
fn solid_eta(p: &Params<'_>, transmits: bool) -> Result<f64> {
    let specular = p.float("specular")?;
    if p.find("eta").is_some() {
        if specular.is_some() {
            return Err(p.error("specular", "'specular' excludes 'eta'"));
        }
        let eta = p.positive("eta", DEFAULT_ETA)?;
        return Ok(if transmits && eta == 1.0 { LEAST_ETA } else { eta });
    }
    let specular = specular.unwrap_or(DEFAULT_SPECULAR);
    check(p, "specular", specular, 1.0)?;
    let specular = if transmits && specular == 0.0 { LEAST_SPECULAR } else { specular };
    // Burley 2012, *Physically Based Shading at Disney*, section 5.4.
    Ok(2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0)
}

pub(super) fn principled_thin(b: &mut Builder<'_>, p: &Params<'_>) -> Result<BsdfKind> {
    p.accept(&[
        "specular_reflectance_sampling_rate",
        "specular_transmittance_sampling_rate",
        "diffuse_transmittance_sampling_rate",
        "diffuse_reflectance_sampling_rate",
    ]);
    let spec_trans = fraction(b, p, Parameter::SpecTrans, "spec_trans", 0.0)?;
    let eta = match vary(b, p, "eta", &[Parameter::Eta])? {
        true => DEFAULT_ETA,
        false => p.positive("eta", DEFAULT_ETA)?,
    };
    Ok(BsdfKind::PrincipledThin {
        shared: shared(b, p, spec_trans, eta)?,
        diff_trans: number(b, p, Parameter::DiffTrans, "diff_trans", 0.0, 2.0)?,
    })
}

fn shared(b: &mut Builder<'_>, p: &Params<'_>, spec_trans: f64, eta: f64) -> Result<PrincipledShared> {
    Ok(PrincipledShared {
        base_color: reflectance(b, p, Parameter::BaseColor, "base_color")?.unwrap_or(Rgb::splat(DEFAULT_REFLECTANCE)),
        roughness: fraction(b, p, Parameter::Roughness, "roughness", DEFAULT_ROUGHNESS)?,
        anisotropic: fraction(b, p, Parameter::Anisotropic, "anisotropic", 0.0)?,
        spec_trans,
        eta,
        spec_tint: fraction(b, p, Parameter::SpecTint, "spec_tint", 0.0)?,
        sheen: fraction(b, p, Parameter::Sheen, "sheen", 0.0)?,
        sheen_tint: fraction(b, p, Parameter::SheenTint, "sheen_tint", 0.0)?,
        flatness: fraction(b, p, Parameter::Flatness, "flatness", 0.0)?,
    })
}

/// A number between 0 and 1, which a texture may give as `parameter`.
pub(super) fn fraction(
    b: &mut Builder<'_>,
    p: &Params<'_>,
    parameter: Parameter,
    name: &'static str,
    default: f64,
) -> Result<f64> {
    number(b, p, parameter, name, default, 1.0)
}

/// A number between 0 and `most`, which a texture may give as `parameter`.
fn number(
    b: &mut Builder<'_>,
    p: &Params<'_>,
    parameter: Parameter,
    name: &'static str,
    default: f64,
    most: f64,
) -> Result<f64> {
    if vary(b, p, name, &[parameter])? {
        return Ok(STAND_IN);
    }
    let value = match p.find(name).map(|param| &param.value) {
        // A colour counts by its luminance.
        Some(Value::Child(_) | Value::Rgb(_) | Value::Spectrum(_)) => {
            colour(b, p, name, SpectrumRole::Index)?.map(|c| f64::from(c.luminance()))
        }
        _ => p.float(name)?,
    };
    let value = value.unwrap_or(default);
    check(p, name, value, most)?;
    Ok(value)
}

/// Complains about a number that is not between 0 and `most`.
fn check(p: &Params<'_>, name: &str, value: f64, most: f64) -> Result<()> {
    if (0.0..=most).contains(&value) {
        return Ok(());
    }
    Err(p.error(name, format!("'{name}' must be between 0 and {most}, not {value}")))
}
