//! Pictures as output files: which format a name asks for, and what goes into the file.

use super::exr_file::{self, ExrOptions, Metadata};
use super::reserved::Reserved;
use super::{ComponentFormat, Crop, Layers, png_file};
use crate::error::{Error, Result};
use std::path::Path;

/// A file format, told by the name's ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR: linear radiance, alpha, anything beside it, metadata.
    Exr,
    /// PNG: 8 bits a channel, sRGB-encoded after exposure, with alpha.
    Png,
}

impl Format {
    /// The format that the ending of `path` names.
    pub fn of(path: &Path) -> Result<Self> {
        match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            _ => Err(Error::file(path, "cannot tell the format from the name: expected a name ending in .exr or .png")),
        }
    }
}

/// How a picture becomes a file.
#[derive(Clone, Debug)]
pub struct WriteOptions {
    /// Size of the whole film, of which the picture is the part `crop`.
    pub full_size: (u32, u32),
    /// Which part.
    pub crop: Crop,
    /// Type of an EXR's values.
    pub component_format: ComponentFormat,
    /// Stops of exposure for 8-bit formats: values are multiplied by 2 to this power.
    pub exposure: f32,
    /// What an EXR says of itself.
    pub metadata: Metadata,
}

/// A place for a picture.
pub struct OutputFile {
    format: Format,
    file: Reserved,
}

impl OutputFile {
    /// Reserves `path`, whose format is known.
    pub fn reserve(path: &Path) -> Result<Self> {
        let format = Format::of(path)?;
        Ok(Self { format, file: Reserved::new(path, "the picture")? })
    }

    /// Reserves `path`, whatever its name, for an EXR that is called `what` in messages.
    pub fn exr(path: &Path, what: &'static str) -> Result<Self> {
        Ok(Self { format: Format::Exr, file: Reserved::new(path, what)? })
    }

    /// The name that the picture will have.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// The name that it has until it is written, if it has one.
    pub fn temporary_path(&self) -> Option<&Path> {
        self.file.temporary_path()
    }

    /// Its format.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Writes the picture, with as much of what is beside it as the format can hold, and gives it its name. Returns how
    /// many values did not fit the file's type and were clamped.
    pub fn write(self, layers: Layers<'_>, options: &WriteOptions) -> Result<u64> {
        match self.format {
            Format::Exr => self.file.write(|file| exr_file::write(file, &ExrOptions::new(layers, options))),
            Format::Png => self.file.write(|file| png_file::write(file, &layers, options.exposure).map(|()| 0)),
        }
    }
}
