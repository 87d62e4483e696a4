//! Emitters.

use super::colour::colour;
use super::sensor::field_of_view;
use super::texture::{find_texture, texture_of};
use super::{find, misplaced};
use crate::description::{Emission, Light, LightKind, Picture, SpotTexture};
use crate::error::Result;
use crate::loader::build::Builder;
use crate::loader::document::ObjectId;
use crate::loader::params::Params;
use crate::loader::sky::{LEAST_SIZE, read_map};
use crate::loader::source::Loc;
use crate::spectrum::{Rgb, SpectrumRole};
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Arc;

/// What an emitter plugin makes.
pub(crate) enum Emitter {
    /// Emission of the surface it belongs to.
    Area(Emission),
    /// A light of its own.
    Light(LightKind),
}

type EmitterFn = fn(&mut Builder<'_>, &Params<'_>) -> Result<Emitter>;

/// The supported emitter plugins.
const EMITTERS: &[(&str, EmitterFn)] = &[
    ("area", area),
    ("constant", constant),
    ("directional", directional),
    ("envmap", envmap),
    ("point", point),
    ("projector", projector),
    ("spot", spot),
];

/// Largest difference of an entry of MᵀM from that of a multiple of the identity, relative to it, at which the matrix M still
/// neither shears nor scales one axis more than another: files have matrices of few digits.
const SIMILARITY_TOLERANCE: f64 = 1e-3;

/// Degrees from the axis of a spot at which it ends unless given.
const DEFAULT_CUTOFF: f64 = 20.0;

/// The part of them up to which it has its full intensity unless given.
const DEFAULT_BEAM: f64 = 0.75;

fn area(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Emitter> {
    if let Some(id) = find_texture(b, p, "radiance") {
        let texture = Some(b.texture(id)?);
        return Ok(Emitter::Area(Emission { texture, ..Emission::uniform(Rgb::WHITE) }));
    }
    radiance(b, p).map(Emission::uniform).map(Emitter::Area)
}

fn constant(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Emitter> {
    let radiance = radiance(b, p)?;
    Ok(Emitter::Light(LightKind::Constant { radiance }))
}

/// The light is at the origin of `to_world`, or at `position`, but not both.
fn point(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Emitter> {
    let (to_world, position) = (p.transform("to_world")?, p.vector("position")?);
    let position = match (to_world, position) {
        (Some(_), Some(_)) => return Err(p.error("position", "a point light has a position or a to_world, not both")),
        (Some(m), None) => m.translation,
        (None, position) => position.unwrap_or(DVec3::ZERO),
    };
    let intensity = colour(b, p, "intensity", SpectrumRole::Emission)?.unwrap_or(Rgb::WHITE);
    Ok(Emitter::Light(LightKind::Point { position, intensity }))
}

/// A map of radiance around the scene.
fn envmap(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Emitter> {
    // As Mitsuba does, which interpolates between two columns and three rows at least.
    let (width, height) = LEAST_SIZE;
    let map = Arc::new(map(b, p)?.padded(width, height));
    let scale = scale(p)?;
    let m = p.transform("to_world")?.unwrap_or(DAffine3::IDENTITY).matrix3;
    let Some(size) = uniform_scale(m) else {
        return Err(p.error("to_world", "the to_world of an envmap may only rotate"));
    };
    if (size - 1.0).abs() > SIMILARITY_TOLERANCE {
        b.warn(p.at("to_world"), "that to_world scales an envmap changes nothing, for it is infinitely far away");
    }
    // Mitsuba's default is false: it asks those who know that they combine. Here the integrators themselves say so.
    let mis_compensation = p.boolean("mis_compensation", true)?;
    Ok(Emitter::Light(LightKind::Environment { map, scale, to_world: m * size.recip(), mis_compensation }))
}

/// The picture that the parameter 'filename' names.
fn map(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Picture> {
    let name = p.required_text("filename")?;
    let at = p.at("filename");
    let path = b.document.find_file(name, at).map_err(|m| p.error("filename", m))?;
    let (map, negative) = read_map(&b.document.files, &path).map_err(|m| p.error("filename", m))?;
    if negative > 0 {
        b.warn(at, &format!("{negative} pixels of '{name}' have negative values, which are taken for 0"));
    }
    Ok(map)
}

fn scale(p: &Params<'_>) -> Result<f64> {
    let scale = p.float("scale")?.unwrap_or(1.0);
    if !(scale >= 0.0) {
        return Err(p.error("scale", "'scale' must not be negative"));
    }
    if scale > f64::from(f32::MAX) {
        return Err(p.error("scale", "'scale' is too large"));
    }
    Ok(scale)
}

/// The factor by which a matrix scales, if it does nothing else but rotate and reflect.
fn uniform_scale(m: DMat3) -> Option<f64> {
    let size = libm::cbrt(m.determinant().abs());
    let unit = m * size.recip();
    // Written so that NaN is no similarity.
    (unit.transpose() * unit).abs_diff_eq(DMat3::IDENTITY, SIMILARITY_TOLERANCE).then_some(size)
}

/// The light shines along +z of `to_world`, or along `direction`, but not both.
fn directional(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Emitter> {
    let (to_world, direction) = (p.transform("to_world")?, p.vector("direction")?);
    let (name, direction) = match (to_world, direction) {
        (Some(_), Some(_)) => {
            return Err(p.error("direction", "a directional light has a direction or a to_world, not both"));
        }
        (None, Some(direction)) => ("direction", direction),
        (to_world, None) => ("to_world", to_world.map_or(DVec3::Z, |m| m.matrix3.z_axis)),
    };
    let direction = checked_direction(p, name, direction)?;
    let irradiance = colour(b, p, "irradiance", SpectrumRole::Emission)?.unwrap_or(Rgb::WHITE);
    Ok(Emitter::Light(LightKind::Directional { direction, irradiance }))
}

fn checked_direction(p: &Params<'_>, name: &'static str, direction: DVec3) -> Result<DVec3> {
    direction.try_normalize().ok_or_else(|| p.error(name, "the direction of a light must be neither zero nor infinite"))
}

/// A cone around +z of `to_world`.
fn spot(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Emitter> {
    let to_world = p.transform("to_world")?.unwrap_or(DAffine3::IDENTITY);
    if uniform_scale(to_world.matrix3).is_none() {
        return Err(p.error("to_world", "the to_world of a spot may only move, rotate and scale uniformly"));
    }
    let intensity = colour(b, p, "intensity", SpectrumRole::Emission)?.unwrap_or(Rgb::WHITE);
    let texture = match find_texture(b, p, "texture") {
        Some(id) => {
            let texture = b.texture(id)?;
            Some(SpotTexture { texture, across: [to_world.matrix3.x_axis, to_world.matrix3.y_axis] })
        }
        None if p.find("texture").is_some() => {
            return Err(p.error("texture", "the 'texture' of a spot must be one that varies, as a 'bitmap' does"));
        }
        None => None,
    };
    let cutoff_angle = p.float("cutoff_angle")?.unwrap_or(DEFAULT_CUTOFF);
    if !(cutoff_angle > 0.0 && cutoff_angle <= 180.0) {
        return Err(p.error("cutoff_angle", "'cutoff_angle' must be larger than 0 and at most 180 degrees"));
    }
    let beam_width = p.float("beam_width")?.unwrap_or(DEFAULT_BEAM * cutoff_angle);
    if !(0.0..=cutoff_angle).contains(&beam_width) {
        let message = format!("'beam_width' must be between 0 and 'cutoff_angle' ({cutoff_angle} degrees)");
        return Err(p.error("beam_width", message));
    }
    let position = to_world.translation;
    let direction = checked_direction(p, "to_world", to_world.matrix3.z_axis)?;
    Ok(Emitter::Light(LightKind::Spot { position, direction, intensity, cutoff_angle, beam_width, texture }))
}

/// A pinhole camera that shines.
fn projector(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Emitter> {
    let to_world = p.transform("to_world")?.unwrap_or(DAffine3::IDENTITY);
    if !uniform_scale(to_world.matrix3).is_some_and(|size| (size - 1.0).abs() <= SIMILARITY_TOLERANCE) {
        return Err(p.error("to_world", "the to_world of a projector may only move and rotate"));
    }
    let texture = texture_of(b, p, "irradiance", SpectrumRole::Emission, 1.0)?;
    let scale = scale(p)?;
    let fov = field_of_view(p)?;
    Ok(Emitter::Light(LightKind::Projector { texture, scale, to_world, fov }))
}

fn radiance(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Rgb> {
    Ok(colour(b, p, "radiance", SpectrumRole::Emission)?.unwrap_or(Rgb::WHITE))
}

/// Whether an emitter's radiance varies over the surface it belongs to.
pub(crate) fn is_textured(b: &Builder<'_>, id: ObjectId) -> bool {
    find_texture(b, &Params::new(b.document, id), "radiance").is_some()
}

/// What the emitter of a shape emits.
pub(crate) fn emission(b: &mut Builder<'_>, id: ObjectId, at: Loc) -> Result<Emission> {
    b.attach(id, at)?;
    match emitter(b, id)? {
        Emitter::Area(emission) => Ok(emission),
        Emitter::Light(_) => Err(misplaced(b.document, id, at, "a shape")),
    }
}

/// An emitter of the scene's own.
pub(crate) fn light(b: &mut Builder<'_>, id: ObjectId) -> Result<Light> {
    let at = b.document.objects[id].at;
    match emitter(b, id)? {
        Emitter::Light(kind) => Ok(Light { at: b.document.sources.span(at), kind }),
        Emitter::Area(_) => Err(misplaced(b.document, id, at, "the scene itself")),
    }
}

fn emitter(b: &mut Builder<'_>, id: ObjectId) -> Result<Emitter> {
    let p = Params::new(b.document, id);
    let made = find(b.document, id, EMITTERS)?(b, &p)?;
    // How often an emitter is sampled changes the noise, not the picture.
    p.float("sampling_weight")?;
    p.finish(b)?;
    Ok(made)
}
