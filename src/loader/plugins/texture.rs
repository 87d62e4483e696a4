//! Textures.

use super::colour::colour;
use super::find;
use crate::description::{Parameter, Texture, TextureId, TextureKind, Varying, Wrap};
use crate::error::Result;
use crate::image::Raster;
use crate::loader::build::Builder;
use crate::loader::document::{Category, ObjectId, Value};
use crate::loader::params::Params;
use crate::loader::pictures::PictureId;
use crate::spectrum::{Rgb, SpectrumRole};
use glam::{DAffine2, DMat2};
use std::sync::Arc;

/// The kind of a texture, and the picture that it waits for.
type Made = (TextureKind, Option<PictureId>);

type TextureFn = fn(&mut Builder<'_>, &Params<'_>) -> Result<Made>;

/// The supported texture plugins that vary over a surface; those that are one colour are in [`super::colour`].
pub(crate) const TEXTURES: &[(&str, TextureFn)] =
    &[("bitmap", bitmap), ("checkerboard", checkerboard), ("mesh_attribute", mesh_attribute)];

/// The colours of a checkerboard unless given.
const CHECKERBOARD_GREYS: [f32; 2] = [0.4, 0.2];

/// The texture that a parameter is, if it is one that varies.
pub(crate) fn find_texture(b: &Builder<'_>, p: &Params<'_>, name: &'static str) -> Option<ObjectId> {
    match p.find(name)?.value {
        Value::Child(id) => {
            let object = &b.document.objects[id];
            let varies = TEXTURES.iter().any(|row| row.0 == object.plugin);
            (object.category == Category::Texture && varies).then_some(id)
        }
        _ => None,
    }
}

/// Gives `parameter` to a texture, if the file does; whether it did.
pub(crate) fn vary(b: &mut Builder<'_>, p: &Params<'_>, name: &'static str, parameters: &[Parameter]) -> Result<bool> {
    let Some(id) = find_texture(b, p, name) else { return Ok(false) };
    let texture = b.texture(id)?;
    for &parameter in parameters {
        p.vary(parameter, texture);
    }
    Ok(true)
}

/// A number between 0 and 1 that may vary over a surface.
pub(crate) fn varying(b: &mut Builder<'_>, p: &Params<'_>, name: &'static str, default: f64) -> Result<Varying> {
    if let Some(id) = find_texture(b, p, name) {
        return b.texture(id).map(Varying::Texture);
    }
    let value = match p.find(name).map(|param| &param.value) {
        None => default,
        // A colour counts by its luminance.
        Some(Value::Child(_) | Value::Rgb(_) | Value::Spectrum(_)) => {
            colour(b, p, name, SpectrumRole::Reflectance)?.map_or(default, |c| f64::from(c.luminance()))
        }
        Some(_) => p.float(name)?.unwrap_or(default),
    };
    // Outside Mitsuba clamps silently.
    if !(0.0..=1.0).contains(&value) {
        b.warn(p.at(name), &format!("'{name}' is clamped to between 0 and 1"));
    }
    Ok(Varying::Constant(value.clamp(0.0, 1.0)))
}

/// A texture, or a colour as one.
pub(crate) fn texture_of(
    b: &mut Builder<'_>,
    p: &Params<'_>,
    name: &'static str,
    role: SpectrumRole,
    default: f32,
) -> Result<TextureId> {
    if let Some(id) = find_texture(b, p, name) {
        return b.texture(id);
    }
    let colour = colour(b, p, name, role)?.unwrap_or(Rgb::splat(default));
    Ok(b.add_texture(Texture {
        at: p.span(),
        kind: TextureKind::Constant(colour),
        uv_set: 0,
        to_uv: DAffine2::IDENTITY,
    }))
}

/// Makes a texture of an object.
pub(crate) fn texture(b: &mut Builder<'_>, id: ObjectId) -> Result<TextureId> {
    let p = Params::new(b.document, id);
    let (kind, picture) = find(b.document, id, TEXTURES)?(b, &p)?;
    // Of a transformation of space only what it does to the plane.
    let to_uv = p.transform("to_uv")?.map_or(DAffine2::IDENTITY, |m| {
        let [x, y] = [m.matrix3.x_axis, m.matrix3.y_axis].map(|axis| axis.truncate());
        DAffine2 { matrix2: DMat2::from_cols(x, y), translation: m.translation.truncate() }
    });
    let made = Texture { at: p.span(), kind, uv_set: 0, to_uv };
    p.finish(b)?;
    let made = b.add_texture(made);
    if let Some(picture) = picture {
        b.show(made, picture);
    }
    Ok(made)
}

fn bitmap(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Made> {
    let bilinear = p.choice("filter_type", &["bilinear", "nearest"])? == "bilinear";
    let wrap = match p.choice("wrap_mode", &["repeat", "mirror", "clamp"])? {
        "mirror" => Wrap::Mirror,
        "clamp" => Wrap::Clamp,
        _ => Wrap::Repeat,
    };
    let raw = p.boolean("raw", false)?;
    // How Mitsuba stores and looks up its numbers: here they stay those of the file.
    p.choice("format", &["auto", "variant", "fp16"])?;
    p.boolean("accel", true)?;
    let file = p.required_text("filename")?;
    let path = b.document.find_file(file, p.at("filename")).map_err(|m| p.error("filename", m))?;
    let picture = b.picture(&path, raw, p.at("filename"));
    let image = Arc::new(Raster::pending());
    Ok((TextureKind::Bitmap { image, bilinear, wrap: [wrap; 2] }, Some(picture)))
}

fn checkerboard(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Made> {
    let [first, second] = CHECKERBOARD_GREYS;
    let role = SpectrumRole::Reflectance;
    let colors = [texture_of(b, p, "color0", role, first)?, texture_of(b, p, "color1", role, second)?];
    Ok((TextureKind::Checkerboard { colors }, None))
}

fn mesh_attribute(_: &mut Builder<'_>, p: &Params<'_>) -> Result<Made> {
    let name = p.required_text("name")?;
    if !["vertex_", "face_"].iter().any(|start| name.starts_with(start)) {
        return Err(p.error("name", format!("an attribute's name begins with 'vertex_' or 'face_', unlike '{name}'")));
    }
    Ok((TextureKind::Attribute { name: name.to_owned(), scale: p.float("scale")?.unwrap_or(1.0) }, None))
}

/// The texture `name` of an object; without a name, the only texture that it has.
pub(crate) fn required_texture(b: &mut Builder<'_>, p: &Params<'_>, name: Option<&'static str>) -> Result<TextureId> {
    let found =
        match name {
            Some(name) => p.find(name).map(|param| &param.value),
            None => p.object.params.iter().map(|param| &param.value).find(
                |value| matches!(value, Value::Child(id) if b.document.objects[*id].category == Category::Texture),
            ),
        };
    let Some(&Value::Child(id)) = found else {
        let what = name.map_or_else(|| "a texture".into(), |name| format!("a texture '{name}'"));
        return Err(b.document.sources.error(p.object.at, format!("{} needs {what}", p.title())));
    };
    p.children(Category::Texture);
    if TEXTURES.iter().any(|row| row.0 == b.document.objects[id].plugin) {
        return b.texture(id);
    }
    let colour = super::colour::texture(b, id, SpectrumRole::Index)?;
    Ok(b.add_texture(Texture {
        at: p.span(),
        kind: TextureKind::Constant(colour),
        uv_set: 0,
        to_uv: DAffine2::IDENTITY,
    }))
}
