//! Emitters.

use super::colour::colour;
use super::{find, misplaced};
use crate::description::{Light, LightKind};
use crate::error::Result;
use crate::loader::build::Builder;
use crate::loader::document::ObjectId;
use crate::loader::params::Params;
use crate::loader::source::Loc;
use crate::spectrum::{Rgb, SpectrumRole};
use glam::DVec3;

/// What an emitter plugin makes.
pub(crate) enum Emitter {
    /// Radiance of the surface it belongs to.
    Area(Rgb),
    /// A light of its own.
    Light(LightKind),
}

type EmitterFn = fn(&mut Builder<'_>, &Params<'_>) -> Result<Emitter>;

/// The supported emitter plugins.
const EMITTERS: &[(&str, EmitterFn)] = &[("area", area), ("constant", constant), ("point", point)];

fn area(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Emitter> {
    radiance(b, p).map(Emitter::Area)
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

fn radiance(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Rgb> {
    Ok(colour(b, p, "radiance", SpectrumRole::Emission)?.unwrap_or(Rgb::WHITE))
}

/// The radiance of the emitter of a shape.
pub(crate) fn emission(b: &mut Builder<'_>, id: ObjectId, at: Loc) -> Result<Rgb> {
    b.attach(id, at)?;
    match emitter(b, id)? {
        Emitter::Area(radiance) => Ok(radiance),
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
