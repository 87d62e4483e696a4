//! Textures: a colour for each point of a surface, from its texture coordinates or from numbers of its mesh.

mod bitmap;
mod extent;
mod mesh;

pub use bitmap::{Bitmap, Wrap};
pub use mesh::{Attribute, MeshPoint, MeshValues};

use crate::spectrum::Rgb;
use bitmap::Cell;
use glam::{Affine2, Vec2, Vec4};

/// Where a texture is asked.
#[derive(Clone, Copy, Debug)]
pub struct TexturePoint<'a> {
    /// Texture coordinates of the surface, of its first set.
    pub uv: Vec2,
    /// Where on its mesh, if that gives more than those.
    pub mesh: Option<MeshPoint<'a>>,
    /// Lookups of some of its textures there that have been found ahead.
    pub ahead: &'a [Lookup],
}

impl TexturePoint<'_> {
    /// A point of a surface that gives no more than texture coordinates.
    pub fn new(uv: Vec2) -> Self {
        Self { uv, mesh: None, ahead: &[] }
    }
}

/// A texture and where its coordinates lie.
#[derive(Clone, Debug)]
pub struct Texture {
    /// What it is.
    pub kind: TextureKind,
    /// Which set of a surface's texture coordinates it lies in.
    pub uv_set: u32,
    /// From those to its own.
    pub to_uv: Affine2,
}

impl Texture {
    /// Its own coordinates at a point.
    fn uv(&self, at: &TexturePoint<'_>) -> Vec2 {
        let uv = match (&at.mesh, self.uv_set) {
            (Some(mesh), set @ 1..) => mesh.uv(set),
            _ => at.uv,
        };
        self.to_uv.transform_point2(uv)
    }
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
    /// Numbers of the surface's mesh.
    Attribute {
        /// Which of the scene's attributes.
        index: u32,
        /// A factor on it.
        scale: f32,
    },
    /// The product of two textures.
    Product([u32; 2]),
    /// The sum of two textures.
    Sum([u32; 2]),
    /// A channel of a texture as a grey.
    Channel {
        /// The texture.
        of: u32,
        /// The channel.
        channel: Channel,
    },
    /// One where the number of a texture is at least `cutoff`, else zero.
    Threshold {
        /// The texture.
        of: u32,
        /// From where it is one.
        cutoff: f32,
    },
}

/// A channel of a texture.
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

/// A lookup in a texture that is a picture, before it is wanted.
#[derive(Clone, Copy, Debug)]
pub struct Lookup {
    texture: u32,
    cell: Cell,
    /// What it reads, if that has been read and lies there.
    pixels: Option<[[[u8; 4]; 2]; 2]>,
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
    pub fn colour(&self, index: u32, at: &TexturePoint<'_>) -> Rgb {
        let texture = &self.0[index as usize];
        match &texture.kind {
            TextureKind::Constant(colour) => *colour,
            TextureKind::Bitmap(bitmap) => match at.ahead.iter().find(|lookup| lookup.texture == index) {
                Some(Lookup { cell, pixels: Some(pixels), .. }) => bitmap.colour_of(*pixels, cell),
                _ => bitmap.colour(texture.uv(at)),
            },
            TextureKind::Checkerboard { colors } => {
                // The colours' textures lie in the surface's coordinates, not in the squares'.
                self.colour(colors[usize::from(is_odd_square(texture.uv(at)))], at)
            }
            TextureKind::Attribute { index, scale } => Rgb(attribute(*index, at).truncate() * *scale),
            TextureKind::Product(factors) => {
                let [a, b] = factors.map(|factor| self.colour(factor, at));
                a * b
            }
            TextureKind::Sum(terms) => {
                let [a, b] = terms.map(|term| self.colour(term, at));
                a + b
            }
            TextureKind::Channel { .. } | TextureKind::Threshold { .. } => Rgb::splat(self.number(index, at)),
        }
    }

    /// The number that it gives where a number is asked for: its luminance. As in Mitsuba 3.9, a checkerboard then gives
    /// the number of its *second* colour where it would give the first as a colour, and the other way round: scenes are
    /// made with the picture in view, and theirs is that.
    pub fn number(&self, index: u32, at: &TexturePoint<'_>) -> f32 {
        let texture = &self.0[index as usize];
        match &texture.kind {
            TextureKind::Checkerboard { colors } => {
                self.number(colors[usize::from(!is_odd_square(texture.uv(at)))], at)
            }
            TextureKind::Constant(_) | TextureKind::Bitmap(_) | TextureKind::Attribute { .. } => {
                self.colour(index, at).luminance()
            }
            // Where a number is asked for, the factors are greys.
            TextureKind::Product(factors) => factors.iter().map(|factor| self.number(*factor, at)).product(),
            TextureKind::Sum(terms) => terms.iter().map(|term| self.number(*term, at)).sum(),
            TextureKind::Channel { of, channel } => match channel {
                Channel::Red => self.colour(*of, at).0.x,
                Channel::Green => self.colour(*of, at).0.y,
                Channel::Blue => self.colour(*of, at).0.z,
                Channel::Alpha => self.alpha(*of, at),
            },
            TextureKind::Threshold { of, cutoff } => f32::from(u8::from(self.number(*of, at) >= *cutoff)),
        }
    }

    /// Opacity of texture `index` at a point: 1 where it has none.
    fn alpha(&self, index: u32, at: &TexturePoint<'_>) -> f32 {
        let texture = &self.0[index as usize];
        match &texture.kind {
            TextureKind::Bitmap(bitmap) => bitmap.alpha(texture.uv(at)),
            TextureKind::Attribute { index, .. } => attribute(*index, at).w,
            TextureKind::Product(factors) => factors.iter().map(|factor| self.alpha(*factor, at)).product(),
            TextureKind::Constant(_)
            | TextureKind::Checkerboard { .. }
            | TextureKind::Sum(_)
            | TextureKind::Channel { .. }
            | TextureKind::Threshold { .. } => 1.0,
        }
    }

    /// Adds the lookup of texture `index` at a point; of a picture, not of what is made of some.
    #[inline]
    pub fn find_lookup(&self, index: u32, at: &TexturePoint<'_>, lookups: &mut Vec<Lookup>) {
        let texture = &self.0[index as usize];
        if let TextureKind::Bitmap(bitmap) = &texture.kind {
            lookups.push(Lookup { texture: index, cell: bitmap.cell(texture.uv(at)), pixels: None });
        }
    }

    /// Reads what a lookup does. Some bits of it, if that is not kept but only near now.
    #[inline]
    pub fn read(&self, lookup: &mut Lookup) -> u32 {
        let TextureKind::Bitmap(bitmap) = &self.0[lookup.texture as usize].kind else { return 0 };
        lookup.pixels = bitmap.read(&lookup.cell);
        let Cell { x, y, .. } = lookup.cell;
        let touch = |i: usize| bitmap.image.touch(x[i], y[i]);
        if lookup.pixels.is_some() { 0 } else { touch(0) ^ touch(1) }
    }

    /// How its luminance changes with the surface's texture coordinates: the gradient of the interpolated picture, and zero
    /// for what has steps only, and for all that is not a picture: those are not heights of a bump map.
    pub fn gradient(&self, index: u32, at: &TexturePoint<'_>) -> Vec2 {
        let texture = &self.0[index as usize];
        match &texture.kind {
            TextureKind::Bitmap(bitmap) => texture.to_uv.matrix2.transpose() * bitmap.gradient(texture.uv(at)),
            _ => Vec2::ZERO,
        }
    }
}

/// An attribute's colour and opacity at a point; zero where there is none.
fn attribute(index: u32, at: &TexturePoint<'_>) -> Vec4 {
    at.mesh.map_or(Vec4::ZERO, |mesh| mesh.attribute(index))
}

/// Whether exactly one coordinate lies in the second half of its unit interval.
fn is_odd_square(uv: Vec2) -> bool {
    let cell = uv - uv.floor();
    (cell.x > 0.5) != (cell.y > 0.5)
}

#[cfg(test)]
mod tests;
