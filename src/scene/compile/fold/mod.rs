//! What of a description is simpler than it looks, or cannot matter, exchanged for what it comes to before it is compiled.
//!
//! The picture stays the one that is expected; its noise and the last bits of what was interpolated between equal numbers may
//! be others. What is exchanged, and why nothing else is:
//!
//! - A texture of one colour is that colour ([`constant`]); so is what is made of such.
//! - A mask of opacity 1 is what it masks, one of opacity 0 nothing at all, a blend of weight 0 or 1 one of its sides, a bump
//!   map without bumps what it bumps ([`materials`]).
//! - A rough mirror or interface whose lobe is narrower than directions in f32 can tell is a smooth one, unless lights without size
//!   would then lose their images in it.
//! - A surface that lets everything straight through is no surface, if that cannot be told: where paths may be of any length,
//!   as it is a vertex; where no light is without size, as shadow rays stop at it, so that such light does not shine through
//!   (Mitsuba's `path` does the same; other light is then found by the bsdf alone); and where no AOV shows it.
//!
//! Lights that are black are told; that they are none is seen to where lights are compiled.

mod constant;
mod materials;

use crate::description::{LightKind, SceneDescription, Shape, TextureId, TextureKind};
use crate::error::Result;
use crate::spectrum::Rgb;
use std::collections::BTreeSet;

/// What else is known of the render to come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Beyond {
    /// A path may have any number of vertices.
    pub any_depth: bool,
    /// Quantities beside radiance are wanted, which show what camera rays meet.
    pub aovs: bool,
}

/// Exchanges all that there is to exchange; also says what that was, a line for each.
///
/// Fails where the description refers to what is not there, as [`super::compile`] does.
pub fn fold(mut description: SceneDescription, beyond: Beyond) -> Result<(SceneDescription, Vec<String>)> {
    super::textures::check(&description)?;
    super::material::check(&description)?;
    let mut notes = Vec::new();
    let constants = constant::textures(&mut description, &mut notes);
    materials::fold(&mut description, &constants, &mut notes);
    emissions(&mut description, &constants, &mut notes);
    transparent_surfaces(&mut description, beyond, &mut notes);
    forget_pictures(&mut description, &mut notes);
    Ok((description, notes))
}

/// Whether there is light that paths cannot run into.
fn has_lights_without_size(description: &SceneDescription) -> bool {
    description.lights.iter().filter(|light| !is_black(&light.kind)).any(|light| match light.kind {
        LightKind::Constant { .. } | LightKind::Environment { .. } => false,
        LightKind::Directional { .. }
        | LightKind::Point { .. }
        | LightKind::Spot { .. }
        | LightKind::Projector { .. } => true,
    })
}

/// Light of one colour has no texture.
fn emissions(description: &mut SceneDescription, constants: &constant::Constants, notes: &mut Vec<String>) {
    for shape in &mut description.shapes {
        let Some(emission) = &mut shape.emission else { continue };
        if let Some(colour) = emission.texture.and_then(|texture| constants.colour(texture)) {
            emission.radiance *= colour.map(|c| c.max(0.0));
            emission.texture = None;
            notes.push(format!("{}: the light of '{}' has one colour: no texture is looked up", shape.at, shape.name));
        }
        if emission.radiance.is_black() {
            notes.push(format!("{}: the light of '{}' is black: it is none", shape.at, shape.name));
        }
    }
    for light in description.lights.iter().filter(|light| is_black(&light.kind)) {
        notes.push(format!("{}: the light is black: it is none", light.at));
    }
}

/// Whether a light sends nothing, as far as that is told without looking at pictures.
fn is_black(kind: &LightKind) -> bool {
    match *kind {
        LightKind::Constant { radiance: colour }
        | LightKind::Directional { irradiance: colour, .. }
        | LightKind::Point { intensity: colour, .. }
        | LightKind::Spot { intensity: colour, .. } => colour.is_black(),
        LightKind::Environment { scale, .. } | LightKind::Projector { scale, .. } => scale == 0.0,
    }
}

/// Leaves out surfaces that cannot be told from nothing.
fn transparent_surfaces(description: &mut SceneDescription, beyond: Beyond, notes: &mut Vec<String>) {
    let bsdfs = &description.bsdfs;
    let nothing = |shape: &Shape| shape.emission.is_none() && materials::is_nothing(bsdfs, shape.bsdf);
    let reason = match () {
        () if !description.shapes.iter().any(nothing) => return,
        () if !beyond.any_depth => "it counts as a vertex of paths, which have a largest depth",
        () if beyond.aovs => "channels beside the picture show it",
        () if has_lights_without_size(description) => "shadow rays to lights without size stop at it",
        () => "",
    };
    description.shapes.retain(|shape| {
        let is_nothing = nothing(shape);
        if is_nothing && reason.is_empty() {
            notes.push(format!("{}: '{}' is fully transparent: no ray meets it", shape.at, shape.name));
        } else if is_nothing {
            notes.push(format!("{}: '{}' is fully transparent, but stays: {reason}", shape.at, shape.name));
        }
        !(is_nothing && reason.is_empty())
    });
}

/// Lets go of pictures that nothing asks any more.
fn forget_pictures(description: &mut SceneDescription, notes: &mut Vec<String>) {
    let grouped = description.groups.iter().flat_map(|group| &group.shapes);
    let mut asked: BTreeSet<TextureId> =
        description.shapes.iter().chain(grouped).flat_map(|shape| description.textures_of(shape)).collect();
    asked.extend(shown(description));
    for (index, texture) in description.textures.iter_mut().enumerate() {
        if let TextureKind::Bitmap { image, .. } = &texture.kind
            && !asked.contains(&TextureId(index))
        {
            let (name, bytes) = (image.name(), image.memory_bytes());
            notes.push(format!("{}: nothing asks {name} any more: {bytes} bytes are free again", texture.at));
            texture.kind = TextureKind::Constant(Rgb::BLACK);
        }
    }
}

/// The textures that spots and projectors show, with those that they are made of.
fn shown(description: &SceneDescription) -> BTreeSet<TextureId> {
    let of = |kind: &LightKind| match *kind {
        LightKind::Spot { texture, .. } => texture.map(|spot| spot.texture),
        LightKind::Projector { texture, .. } => Some(texture),
        _ => None,
    };
    let mut found: BTreeSet<TextureId> = description.lights.iter().filter_map(|light| of(&light.kind)).collect();
    found.retain(|id| id.0 < description.textures.len());
    let mut waiting: Vec<TextureId> = found.iter().copied().collect();
    while let Some(id) = waiting.pop() {
        waiting.extend(description.textures[id.0].parts().into_iter().filter(|part| found.insert(*part)));
    }
    found
}
