//! Finished pictures: arrays of pixels, and the files they are written to.

mod blocks;
pub mod compare;
mod decode;
mod exr_file;
mod filter;
mod guarded;
mod input;
mod layers;
mod output;
mod png_file;
mod raster;
mod reserved;
pub mod sums_file;

pub use decode::MAX_PICTURE_BYTES;
pub use exr_file::Metadata;
pub use filter::Filter;
pub use input::{PictureFile, decode as decode_picture, read as read_picture};
pub use layers::{Layers, PixelFormat, Plane, PlaneValues};
pub use output::{Format, OutputFile, WriteOptions};
pub use png_file::to_png;
pub use raster::Raster;
pub use reserved::Reserved;

use crate::spectrum::Rgb;
use serde::{Deserialize, Serialize};

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crop {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
}

/// A rectangle of pixels that may reach beyond the picture, to the left of and above it, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    /// First column.
    pub x: i32,
    /// First row.
    pub y: i32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl From<Crop> for Area {
    fn from(c: Crop) -> Self {
        // The sides of films are limited far below this when the scene is read.
        let signed = |v: u32| i32::try_from(v).unwrap_or(i32::MAX);
        Self { x: signed(c.x), y: signed(c.y), width: c.width, height: c.height }
    }
}

impl Area {
    /// Number of pixels.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// With `border` more pixels on every side.
    #[must_use]
    pub fn grown(self, border: u32) -> Self {
        let (b, both) = (border.cast_signed(), 2 * border);
        Self { x: self.x - b, y: self.y - b, width: self.width + both, height: self.height + both }
    }

    /// What two areas share; of no size where that is nothing.
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        let overlap = |a: i32, a_size: u32, b: i32, b_size: u32| {
            let start = a.max(b);
            let end = (a + a_size.cast_signed()).min(b + b_size.cast_signed());
            (start, (end - start).max(0).cast_unsigned())
        };
        let (x, width) = overlap(self.x, self.width, other.x, other.width);
        let (y, height) = overlap(self.y, self.height, other.y, other.height);
        Self { x, y, width, height }
    }

    /// Whether a pixel is inside.
    pub fn contains(&self, x: i32, y: i32) -> bool {
        let one = Self { x, y, width: 1, height: 1 };
        self.intersection(one) == one
    }

    /// Position of a pixel that it holds, row by row.
    #[inline]
    pub fn index(&self, x: i32, y: i32) -> usize {
        ((y - self.y) * self.width.cast_signed() + x - self.x) as usize
    }
}

/// Type of a stored pixel value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ComponentFormat {
    /// 16-bit floating point.
    Half,
    /// 32-bit floating point.
    Float,
}

impl ComponentFormat {
    /// The largest 16-bit float; what is larger is clamped to it.
    pub const MAX_HALF: f32 = 65504.0;
}

/// A picture in linear sRGB, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    width: u32,
    height: u32,
    pixels: Vec<Rgb>,
}

impl Picture {
    /// A black picture.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, pixels: vec![Rgb::BLACK; width as usize * height as usize] }
    }

    /// Pixels across.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Pixels down.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The pixels, row by row from the top.
    pub fn pixels(&self) -> &[Rgb] {
        &self.pixels
    }

    /// The pixel in column `x` of row `y`.
    pub fn get(&self, x: u32, y: u32) -> Rgb {
        self.pixels[y as usize * self.width as usize + x as usize]
    }

    /// Puts `f` of each pixel in its place.
    pub fn apply(&mut self, f: impl Fn(Rgb) -> Rgb) {
        self.pixels.iter_mut().for_each(|p| *p = f(*p));
    }

    /// With columns and rows like the last ones added where there are fewer than these.
    #[must_use]
    pub fn padded(self, width: u32, height: u32) -> Self {
        if self.width >= width && self.height >= height {
            return self;
        }
        let (width, height) = (self.width.max(width), self.height.max(height));
        let mut larger = Self::new(width, height);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            larger.set(x, y, self.get(x.min(self.width - 1), y.min(self.height - 1)));
        }
        larger
    }

    /// Sets the pixel in column `x` of row `y`.
    pub fn set(&mut self, x: u32, y: u32, value: Rgb) {
        self.pixels[y as usize * self.width as usize + x as usize] = value;
    }
}
