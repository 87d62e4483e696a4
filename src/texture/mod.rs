//! Textures: a colour for each point of a surface, from its texture coordinates.

mod bitmap;

pub use bitmap::{Bitmap, Wrap};

use crate::spectrum::Rgb;
use glam::{Affine2, Vec2};

/// Where a texture is asked.
#[derive(Clone, Copy, Debug)]
pub struct TexturePoint {
    /// Texture coordinates of the surface.
    pub uv: Vec2,
}

/// A texture and where its coordinates lie.
#[derive(Clone, Debug)]
pub struct Texture {
    /// What it is.
    pub kind: TextureKind,
    /// From a surface's texture coordinates to its own.
    pub to_uv: Affine2,
}

/// The kinds of texture.
#[derive(Clone, Debug)]
pub enum TextureKind {
    /// The same colour everywhere.
    Constant(Rgb),
    /// A picture.
    Bitmap(Bitmap),
    /// Squares of half a unit in two colours.
    Checkerboard {
        /// Indices into the table of textures: of the square at the origin, and of its neighbours.
        colors: [u32; 2],
    },
}

/// Every texture of a scene. A texture refers only to those before it.
#[derive(Clone, Debug, Default)]
pub struct Textures(Vec<Texture>);

impl Textures {
    /// The table of `textures`, each of which refers only to those before it.
    pub fn new(textures: Vec<Texture>) -> Self {
        Self(textures)
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The linear colour of texture `index` at a point.
    pub fn colour(&self, index: u32, at: &TexturePoint) -> Rgb {
        let texture = &self.0[index as usize];
        let uv = texture.to_uv.transform_point2(at.uv);
        match &texture.kind {
            TextureKind::Constant(colour) => *colour,
            TextureKind::Bitmap(bitmap) => bitmap.colour(uv),
            TextureKind::Checkerboard { colors } => {
                // The colours' textures lie in the surface's coordinates, not in the squares'.
                self.colour(colors[usize::from(is_odd_square(uv))], at)
            }
        }
    }

    /// The number that it gives where a number is asked for: its luminance. As in Mitsuba 3.9, a checkerboard then gives
    /// the number of its *second* colour where it would give the first as a colour, and the other way round: scenes are
    /// made with the picture in view, and theirs is that.
    pub fn number(&self, index: u32, at: &TexturePoint) -> f32 {
        let texture = &self.0[index as usize];
        match &texture.kind {
            TextureKind::Checkerboard { colors } => {
                let uv = texture.to_uv.transform_point2(at.uv);
                self.number(colors[usize::from(!is_odd_square(uv))], at)
            }
            TextureKind::Constant(_) | TextureKind::Bitmap(_) => self.colour(index, at).luminance(),
        }
    }

    /// How its luminance changes with the surface's texture coordinates: the gradient of the interpolated picture, and zero
    /// for what has steps only.
    pub fn gradient(&self, index: u32, at: &TexturePoint) -> Vec2 {
        let texture = &self.0[index as usize];
        let uv = texture.to_uv.transform_point2(at.uv);
        match &texture.kind {
            TextureKind::Bitmap(bitmap) => texture.to_uv.matrix2.transpose() * bitmap.gradient(uv),
            TextureKind::Constant(_) | TextureKind::Checkerboard { .. } => Vec2::ZERO,
        }
    }
}

/// Whether exactly one coordinate lies in the second half of its unit interval.
fn is_odd_square(uv: Vec2) -> bool {
    let cell = uv - uv.floor();
    (cell.x > 0.5) != (cell.y > 0.5)
}

#[cfg(test)]
mod tests;
