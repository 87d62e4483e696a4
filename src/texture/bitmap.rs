//! Pictures as textures: lookups between and beyond their pixels.

use crate::image::Raster;
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
    fn column(self, i: i64, size: u32) -> u32 {
        let n = i64::from(size);
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
struct Cell {
    /// Columns and rows of the pixels before and after it.
    x: [u32; 2],
    y: [u32; 2],
    /// Distance from the pixels before it, in pixels.
    between: Vec2,
}

impl Bitmap {
    /// The linear colour at `uv`; where the coordinates are no numbers, that of the first pixel.
    pub fn colour(&self, uv: Vec2) -> Rgb {
        if !self.bilinear {
            let at = (uv * self.size()).floor();
            return self.image.colour(self.column(at.x as i64), self.row(at.y as i64));
        }
        let Cell { x, y, between } = self.cell(uv);
        let pixel = |i: usize, j: usize| self.image.colour(x[i], y[j]).0;
        let rows = [0, 1].map(|j| pixel(0, j).lerp(pixel(1, j), between.x));
        Rgb(rows[0].lerp(rows[1], between.y))
    }

    /// Opacity at `uv`.
    pub fn alpha(&self, uv: Vec2) -> f32 {
        if !self.bilinear {
            let at = (uv * self.size()).floor();
            return self.image.alpha(self.column(at.x as i64), self.row(at.y as i64));
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
        let pixel = |i: usize, j: usize| self.image.colour(x[i], y[j]).luminance();
        let [f00, f10, f01, f11] = [pixel(0, 0), pixel(1, 0), pixel(0, 1), pixel(1, 1)];
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        Vec2::new(mix(f10 - f00, f11 - f01, between.y), mix(f01 - f00, f11 - f10, between.x)) * self.size()
    }

    fn size(&self) -> Vec2 {
        Vec2::new(self.image.width() as f32, self.image.height() as f32)
    }

    fn column(&self, i: i64) -> u32 {
        self.wrap[0].column(i, self.image.width())
    }

    fn row(&self, i: i64) -> u32 {
        self.wrap[1].column(i, self.image.height())
    }

    fn cell(&self, uv: Vec2) -> Cell {
        let at = uv * self.size() - 0.5;
        let before = at.floor();
        let (i, j) = (before.x as i64, before.y as i64);
        Cell {
            // Saturated conversions: a step beyond them would overflow.
            x: [self.column(i), self.column(i.saturating_add(1))],
            y: [self.row(j), self.row(j.saturating_add(1))],
            between: at - before,
        }
    }
}
