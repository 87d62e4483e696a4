//! Textures.

use crate::description::{self, SceneDescription, TextureId};
use crate::error::{Error, Result};
use crate::texture::{Bitmap, Channel, Texture, TextureKind, Textures, Wrap};
use glam::DAffine2;

/// An error unless textures refer only to those before them, and emissions to those that are there.
pub(super) fn check(description: &SceneDescription) -> Result<()> {
    for (index, texture) in description.textures.iter().enumerate() {
        if texture.parts().iter().any(|part| part.0 >= index) {
            return Err(Error::scene(&texture.at, "a texture can only be made of textures that stand before it"));
        }
    }
    let grouped = description.groups.iter().flat_map(|group| &group.shapes);
    for shape in description.shapes.iter().chain(grouped) {
        let texture = shape.emission.and_then(|emission| emission.texture);
        if texture.is_some_and(|texture| texture.0 >= description.textures.len()) {
            return Err(Error::scene(&shape.at, "the emission refers to a texture that is not there"));
        }
    }
    Ok(())
}

/// The names of the attributes that textures ask for, each once; a compiled texture knows its place among them.
pub(super) fn attribute_names(description: &SceneDescription) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for texture in &description.textures {
        if let description::TextureKind::Attribute { name, .. } = &texture.kind
            && !names.contains(&name.as_str())
        {
            names.push(name);
        }
    }
    names
}

/// Every texture of the description.
pub(super) fn compile(description: &SceneDescription) -> Textures {
    let names = attribute_names(description);
    Textures::new(description.textures.iter().map(|t| texture(t, &names)).collect())
}

fn texture(texture: &description::Texture, attributes: &[&str]) -> Texture {
    let index = |id: TextureId| id.0 as u32;
    let kind = match &texture.kind {
        &description::TextureKind::Constant(colour) => TextureKind::Constant(colour),
        description::TextureKind::Bitmap { image, bilinear, wrap: sides } => {
            TextureKind::Bitmap(Bitmap { image: image.clone(), bilinear: *bilinear, wrap: sides.map(wrap) })
        }
        description::TextureKind::Checkerboard { colors } => TextureKind::Checkerboard { colors: colors.map(index) },
        description::TextureKind::Attribute { name, scale } => {
            // Every name is in the list.
            let place = attributes.iter().position(|a| a == name).unwrap_or_default();
            TextureKind::Attribute { index: place as u32, scale: *scale as f32 }
        }
        description::TextureKind::Product(factors) => TextureKind::Product(factors.map(index)),
        description::TextureKind::Sum(terms) => TextureKind::Sum(terms.map(index)),
        &description::TextureKind::Channel { of, channel: which } => {
            TextureKind::Channel { of: index(of), channel: channel(which) }
        }
        &description::TextureKind::Threshold { of, cutoff } => {
            TextureKind::Threshold { of: index(of), cutoff: cutoff as f32 }
        }
    };
    let DAffine2 { matrix2, translation } = texture.to_uv;
    let to_uv = glam::Affine2 { matrix2: matrix2.as_mat2(), translation: translation.as_vec2() };
    Texture { kind, uv_set: texture.uv_set, to_uv }
}

fn wrap(wrap: description::Wrap) -> Wrap {
    match wrap {
        description::Wrap::Repeat => Wrap::Repeat,
        description::Wrap::Mirror => Wrap::Mirror,
        description::Wrap::Clamp => Wrap::Clamp,
    }
}

fn channel(channel: description::Channel) -> Channel {
    match channel {
        description::Channel::Red => Channel::Red,
        description::Channel::Green => Channel::Green,
        description::Channel::Blue => Channel::Blue,
        description::Channel::Alpha => Channel::Alpha,
    }
}
