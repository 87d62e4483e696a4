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
    /// From a surface's texture coordinates (u, v) to the texture's own.
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
        /// What there is outside the unit square.
        wrap: Wrap,
    },
    /// Squares of half a unit in two colours.
    Checkerboard {
        /// That of the square at the origin, and the other.
        colors: [TextureId; 2],
    },
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
    /// Whether it is not the same everywhere.
    pub fn is_varying(&self) -> bool {
        !matches!(self.kind, TextureKind::Constant(_))
    }
}
