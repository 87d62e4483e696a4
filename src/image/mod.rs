//! Finished pictures: arrays of pixels, and the files they are written to.

mod exr_file;
mod output;
mod png_file;

pub use exr_file::Metadata;
pub use output::{Format, OutputFile, WriteOptions, write_whole};

use crate::spectrum::Rgb;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

/// Type of a stored pixel value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComponentFormat {
    /// 16-bit floating point.
    Half,
    /// 32-bit floating point.
    Float,
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

    /// Sets the pixel in column `x` of row `y`.
    pub fn set(&mut self, x: u32, y: u32, value: Rgb) {
        self.pixels[y as usize * self.width as usize + x as usize] = value;
    }
}
