//! Parameters that are colours: numbers, `<rgb>`, `<spectrum>` and the plugins that stand for one.

use super::find;
use crate::error::{Error, Result};
use crate::error::{Position, Span};
use crate::loader::build::Builder;
use crate::loader::document::{Category, Spectrum, Value};
use crate::loader::params::Params;
use crate::loader::source::{Loc, MAX_DATA_BYTES};
use crate::loader::values;
use crate::spectrum::{Rgb, SpectrumRole, equal_energy_to_rgb, tabulated_to_rgb};

/// What stands for a texture where `--lenient` may.
const TEXTURE_STAND_IN: f64 = 0.5;

type ColourFn = fn(&mut Builder<'_>, &Params<'_>, SpectrumRole) -> Result<Rgb>;

/// Textures and spectra that are one colour.
const COLOURS: &[(&str, ColourFn)] =
    &[("d65", d65), ("rawconstant", raw_constant), ("srgb", srgb), ("uniform", uniform)];

/// A colour parameter, if it is there.
pub(crate) fn colour(
    b: &mut Builder<'_>,
    p: &Params<'_>,
    name: &'static str,
    role: SpectrumRole,
) -> Result<Option<Rgb>> {
    let Some(param) = p.find(name) else { return Ok(None) };
    let at = param.value_at;
    let rgb = match &param.value {
        Value::Float(v) => [*v; 3],
        Value::Integer(v) => [*v as f64; 3],
        Value::Rgb(rgb) => {
            if role == SpectrumRole::Reflectance && rgb.iter().any(|v| *v > 1.0) {
                return Err(p.error(name, format!("the channels of '{name}' must be between 0 and 1")));
            }
            *rgb
        }
        Value::Spectrum(Spectrum::Uniform(v)) if role == SpectrumRole::Emission => equal_energy_to_rgb(*v),
        Value::Spectrum(Spectrum::Uniform(v)) => [*v; 3],
        Value::Spectrum(Spectrum::Table(samples)) => tabulated(b, at, samples, role),
        Value::Spectrum(Spectrum::File(file)) => {
            let samples = read_spectrum(b, at, file)?;
            tabulated(b, at, &samples, role)
        }
        Value::Child(id) if b.document.objects[*id].category == Category::Texture => {
            return texture(b, *id, role).map(Some);
        }
        other => {
            let message = format!("'{name}' must be a colour (<rgb>, <spectrum> or <float>), not a <{}>", other.tag());
            return Err(p.error(name, message));
        }
    };
    checked(p, name, rgb).map(Some)
}

fn checked(p: &Params<'_>, name: &str, rgb: [f64; 3]) -> Result<Rgb> {
    let [r, g, b] = rgb.map(|v| v as f32);
    let colour = Rgb::new(r, g, b);
    if rgb.iter().any(|v| *v < 0.0) {
        return Err(p.error(name, format!("'{name}' must not be negative")));
    }
    if !colour.is_finite() {
        return Err(p.error(name, format!("'{name}' is too large")));
    }
    Ok(colour)
}

fn tabulated(b: &mut Builder<'_>, at: Loc, samples: &[(f64, f64)], role: SpectrumRole) -> [f64; 3] {
    let (rgb, clamped) = tabulated_to_rgb(samples, role);
    if clamped {
        b.warn(at, "the spectrum is outside the gamut of sRGB and was clamped, as in Mitsuba");
    }
    rgb
}

fn read_spectrum(b: &Builder<'_>, at: Loc, file: &str) -> Result<Vec<(f64, f64)>> {
    let sources = &b.document.sources;
    let path = b.document.find_file(file, at).map_err(|m| sources.error(at, m))?;
    let bytes = b
        .document
        .files
        .read(&path, MAX_DATA_BYTES)
        .map_err(|m| sources.error(at, format!("cannot read '{}': {m}", path.display())))?;
    values::spectrum_file(&String::from_utf8_lossy(&bytes)).map_err(|(line, message)| {
        let line = u32::try_from(line).unwrap_or(u32::MAX);
        Error::scene(&Span { file: path.into(), position: Position::Line(line) }, message)
    })
}

/// The colour of a texture or spectrum that is one colour.
pub(super) fn texture(b: &mut Builder<'_>, id: usize, role: SpectrumRole) -> Result<Rgb> {
    let make = match find(b.document, id, COLOURS) {
        Err(Error::Unsupported { what, hint, .. }) if role == SpectrumRole::Reflectance => {
            let at = b.document.objects[id].plugin_at;
            b.approximate(at, &what, &hint, "a uniform grey")?;
            return Ok(Rgb::splat(TEXTURE_STAND_IN as f32));
        }
        made => made?,
    };
    let params = Params::new(b.document, id);
    let colour = make(b, &params, role)?;
    params.finish(b)?;
    Ok(colour)
}

fn uniform(_: &mut Builder<'_>, p: &Params<'_>, _: SpectrumRole) -> Result<Rgb> {
    let Some(value) = p.float("value")? else {
        return Err(p.error("value", format!("{} needs the parameter 'value' (a <float>)", p.title())));
    };
    checked(p, "value", [value; 3])
}

/// Three numbers, or one, that are no colour.
fn raw_constant(_: &mut Builder<'_>, p: &Params<'_>, _: SpectrumRole) -> Result<Rgb> {
    let value = match p.find("value").map(|param| &param.value) {
        Some(Value::Vector(v)) => v.to_array(),
        Some(Value::Rgb(rgb)) => *rgb,
        _ => match p.float("value")? {
            Some(value) => [value; 3],
            None => {
                let message = format!("{} needs the parameter 'value' (a <float> or <vector>)", p.title());
                return Err(p.error("value", message));
            }
        },
    };
    checked(p, "value", value)
}

/// Bounded, whatever it is for.
fn srgb(b: &mut Builder<'_>, p: &Params<'_>, _: SpectrumRole) -> Result<Rgb> {
    let Some(value) = colour(b, p, "color", SpectrumRole::Reflectance)? else {
        return Err(p.error("color", format!("{} needs the parameter 'color' (an <rgb>)", p.title())));
    };
    Ok(value)
}

/// The white of sRGB, or a colour seen under it.
fn d65(b: &mut Builder<'_>, p: &Params<'_>, _: SpectrumRole) -> Result<Rgb> {
    let colour = colour(b, p, "color", SpectrumRole::Index)?.unwrap_or(Rgb::WHITE);
    let scale = p.float("scale")?.unwrap_or(1.0);
    checked(p, "scale", colour.to_array().map(|v| f64::from(v) * scale))
}
