//! Pictures from files, as linear sRGB in floating point.

use super::decode::{self, Decoded};
use super::{Picture, Raster};
use crate::error::Result;
use crate::files::Memory;
use image::ImageFormat;
use std::path::Path;

/// A picture from a file.
#[derive(Clone, Debug)]
pub struct PictureFile {
    /// Its pixels in linear sRGB; those of a file with luminance only are grey.
    pub picture: Picture,
    /// Column and row of its first pixel in the whole picture, of which it may be a part.
    pub offset: (i32, i32),
}

/// Reads a picture: OpenEXR, Radiance HDR, PNG, JPEG, BMP or TGA. Alpha is left out.
///
/// Fails where the file cannot be read, is none of these, or has no known channels.
pub fn read(path: &Path) -> Result<PictureFile> {
    decode::read(path).map(PictureFile::from)
}

/// The same for the bytes of a file; `named` is the format that its name says, which counts only for files that do not say
/// theirs (TGA). Also fails where it takes more than `memory` has.
pub fn decode(bytes: &[u8], named: Option<ImageFormat>, memory: &Memory) -> std::result::Result<PictureFile, String> {
    decode::decode(bytes, named, false, memory).map(PictureFile::from)
}

impl From<Decoded> for PictureFile {
    fn from(Decoded { raster, offset }: Decoded) -> Self {
        Self { picture: Picture::from(&raster), offset }
    }
}

impl From<&Raster> for Picture {
    fn from(raster: &Raster) -> Self {
        let (width, height) = (raster.width(), raster.height());
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| raster.colour(x, y))).collect();
        Self { width, height, pixels }
    }
}
