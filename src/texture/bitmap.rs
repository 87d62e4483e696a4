//! Pictures as textures: lookups between and beyond their pixels.

use crate::image::Raster;
use crate::math::float::{max, min};
use crate::spectrum::Rgb;
use glam::Vec2;
use std::sync::Arc;

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

impl Wrap {
    /// The column (or row) of a picture of `size` columns that stands for column `i`.
    #[inline]
    fn column(self, i: i32, size: u32) -> u32 {
        let (i, n) = (i64::from(i), i64::from(size));
        let column = match self {
            Self::Repeat => i.rem_euclid(n),
            Self::Mirror => {
                let there_and_back = i.rem_euclid(2 * n);
                there_and_back.min(2 * n - 1 - there_and_back)
            }
            Self::Clamp => i.clamp(0, n - 1),
        };
        column as u32
    }

    /// That, and the one for column `i` + 1.
    #[inline]
    fn columns(self, i: i32, size: u32) -> [u32; 2] {
        let first = match self {
            // Most pictures, and most coordinates of the others, without a division.
            Self::Repeat if size.is_power_of_two() => i.cast_unsigned() & (size - 1),
            Self::Repeat if i.cast_unsigned() < size => i.cast_unsigned(),
            Self::Repeat => self.column(i, size),
            // A step beyond the last number would overflow.
            Self::Mirror | Self::Clamp => return [self.column(i, size), self.column(i.saturating_add(1), size)],
        };
        [first, if first + 1 == size { 0 } else { first + 1 }]
    }
}

/// A picture over the unit square, its first row at v = 0. The middle of a pixel is where it has its own colour.
#[derive(Clone, Debug)]
pub struct Bitmap {
    /// The picture.
    pub image: Arc<Raster>,
    /// Whether lookups interpolate between the middles of pixels.
    pub bilinear: bool,
    /// What there is outside the unit square, along u and along v.
    pub wrap: [Wrap; 2],
}

/// The four pixels around a point, and where it lies between them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Columns and rows of the pixels before and after it.
    pub(super) x: [u32; 2],
    pub(super) y: [u32; 2],
    /// Distance from the pixels before it, in pixels.
    between: Vec2,
}

impl Bitmap {
    /// The linear colour at `uv`; where the coordinates are no numbers, that of the first pixel.
    pub fn colour(&self, uv: Vec2) -> Rgb {
        if !self.bilinear {
            let [x, y] = self.nearest(uv);
            return self.image.colour(x, y);
        }
        let Cell { x, y, between } = self.cell(uv);
        mix(self.image.four(x, y), between)
    }

    /// What [`Self::colour`] reads of a picture in blocks, which is still to be decoded; `None` of another, or if it is one pixel.
    #[inline]
    pub(super) fn read(&self, cell: &Cell) -> Option<[[[u8; 4]; 2]; 2]> {
        if self.bilinear { self.image.four_coded(cell.x, cell.y) } else { None }
    }

    /// What [`Self::colour`] makes of that.
    #[inline]
    pub(super) fn colour_of(&self, pixels: [[[u8; 4]; 2]; 2], cell: &Cell) -> Rgb {
        mix(self.image.decode_four(pixels), cell.between)
    }

    /// Opacity at `uv`.
    pub fn alpha(&self, uv: Vec2) -> f32 {
        if !self.bilinear {
            let [x, y] = self.nearest(uv);
            return self.image.alpha(x, y);
        }
        let Cell { x, y, between } = self.cell(uv);
        let pixel = |i: usize, j: usize| self.image.alpha(x[i], y[j]);
        let rows = [0, 1].map(|j| pixel(0, j) + (pixel(1, j) - pixel(0, j)) * between.x);
        rows[0] + (rows[1] - rows[0]) * between.y
    }

    /// The gradient of the interpolated luminance at `uv`; zero where nothing interpolates.
    pub fn gradient(&self, uv: Vec2) -> Vec2 {
        if !self.bilinear {
            return Vec2::ZERO;
        }
        let Cell { x, y, between } = self.cell(uv);
        let [[f00, f10], [f01, f11]] = self.image.four(x, y).map(|row| row.map(Rgb::luminance));
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        Vec2::new(mix(f10 - f00, f11 - f01, between.y), mix(f01 - f00, f11 - f10, between.x)) * self.size()
    }

    #[inline]
    fn size(&self) -> Vec2 {
        Vec2::new(self.image.width() as f32, self.image.height() as f32)
    }

    /// Column and row of the pixel that `uv` is in.
    fn nearest(&self, uv: Vec2) -> [u32; 2] {
        let at = uv * self.size();
        let column = |at: f32, wrap: Wrap, size: u32| wrap.column(split(at).0, size);
        [column(at.x, self.wrap[0], self.image.width()), column(at.y, self.wrap[1], self.image.height())]
    }

    /// The pixels that an interpolating lookup at `uv` reads.
    #[inline]
    pub(super) fn cell(&self, uv: Vec2) -> Cell {
        let at = uv * self.size() - 0.5;
        let ((i, s), (j, t)) = (split(at.x), split(at.y));
        Cell {
            x: self.wrap[0].columns(i, self.image.width()),
            y: self.wrap[1].columns(j, self.image.height()),
            between: Vec2::new(s, t),
        }
    }
}

/// The integer below a number, and how far the number is above it, in [0, 1]. Beyond the integers the nearest of them; zeros
/// for what is no number.
#[inline]
fn split(at: f32) -> (i32, f32) {
    let towards_zero = at as i32;
    let below = if at < towards_zero as f32 { towards_zero.saturating_sub(1) } else { towards_zero };
    (below, min(max(at - below as f32, 0.0), 1.0))
}

/// Between the colours of four pixels.
#[inline]
fn mix([above, below]: [[Rgb; 2]; 2], between: Vec2) -> Rgb {
    let [above, below] = [across(above, between.x), across(below, between.x)];
    across([above, below], between.y)
}

/// Between two colours, `t` of the way.
#[inline]
fn across([a, b]: [Rgb; 2], t: f32) -> Rgb {
    Rgb(a.0 + (b.0 - a.0) * t)
}
