//! What a file said of textures.

use super::TextureId;
use crate::error::Span;
use crate::image::Raster;
use crate::spectrum::Rgb;
use glam::DAffine2;
use std::sync::Arc;

/// A texture: a colour for each point of a surface.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Where in the file.
    pub at: Span,
    /// What it is.
    pub kind: TextureKind,
    /// Which of a mesh's sets of texture coordinates it lies in: 0 is [`super::Mesh::uvs`], 1 the first of
    /// [`super::Mesh::more_uvs`]; a shape has no others than those of its set 0.
    pub uv_set: u32,
    /// From those texture coordinates (u, v) to the texture's own.
    pub to_uv: DAffine2,
}

/// The kinds of texture.
#[derive(Clone, Debug)]
pub enum TextureKind {
    /// The same colour everywhere.
    Constant(Rgb),
    /// A picture over the unit square, its first row at v = 0.
    Bitmap {
        /// The picture.
        image: Arc<Raster>,
        /// Whether lookups interpolate between pixels.
        bilinear: bool,
        /// What there is outside the unit square, along u and along v.
        wrap: [Wrap; 2],
    },
    /// Squares of half a unit in two colours.
    Checkerboard {
        /// That of the square at the origin, and the other.
        colors: [TextureId; 2],
    },
    /// What a mesh says itself of its vertices or faces.
    Attribute {
        /// The name of one of its [`super::Mesh::attributes`].
        name: String,
        /// A factor on it.
        scale: f64,
    },
    /// The product of two textures.
    Product([TextureId; 2]),
    /// The sum of two textures.
    Sum([TextureId; 2]),
    /// A channel of a texture as a grey.
    Channel {
        /// The texture.
        of: TextureId,
        /// The channel.
        channel: Channel,
    },
    /// One where the number that a texture gives is at least `cutoff`, else zero.
    Threshold {
        /// The texture.
        of: TextureId,
        /// From where it is one.
        cutoff: f64,
    },
}

/// A channel of a texture. Only pictures and attributes of four numbers have an opacity; elsewhere it is one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Linear red.
    Red,
    /// Linear green.
    Green,
    /// Linear blue.
    Blue,
    /// Opacity.
    Alpha,
}

/// What there is of a picture outside the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The same again.
    Repeat,
    /// The same mirrored, and again.
    Mirror,
    /// Its rim.
    Clamp,
}

impl Texture {
    /// The textures that it is made of.
    pub fn parts(&self) -> Vec<TextureId> {
        match self.kind {
            TextureKind::Checkerboard { colors: parts } | TextureKind::Product(parts) | TextureKind::Sum(parts) => {
                parts.to_vec()
            }
            TextureKind::Channel { of, .. } | TextureKind::Threshold { of, .. } => vec![of],
            TextureKind::Constant(_) | TextureKind::Bitmap { .. } | TextureKind::Attribute { .. } => Vec::new(),
        }
    }

    /// Whether it is not the same everywhere.
    pub fn is_varying(&self) -> bool {
        !matches!(self.kind, TextureKind::Constant(_))
    }
}
