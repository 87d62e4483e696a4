//! An output file that exists whole or not at all: written beside its place under a temporary name, then renamed.

use super::exr_file::{self, ExrOptions, Metadata};
use super::{ComponentFormat, Crop};
use super::{Picture, png_file};
use crate::error::{Error, Result};
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// A file format, told by the name's ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR: linear radiance, metadata.
    Exr,
    /// PNG: 8 bits a channel, sRGB-encoded after exposure.
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

/// Writes `bytes` to `path`, whole or not at all.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let fail = |e: std::io::Error| Error::file(path, format!("cannot write: {e}"));
    let mut temporary = temporary_beside(path).map_err(fail)?;
    temporary.write_all(bytes).map_err(fail)?;
    temporary.as_file_mut().sync_all().map_err(fail)?;
    temporary.persist(path).map_err(|e| fail(e.error))?;
    Ok(())
}

/// A new file in the folder of `path`, to be renamed to it.
fn temporary_beside(path: &Path) -> std::io::Result<NamedTempFile> {
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    let prefix = format!(".{}.", path.file_name().unwrap_or_default().to_string_lossy());
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(".tmp");
    // As any new file: what the user's mask allows, not the private mode of temporary files.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// A place for a picture, reserved before the render so that it is known to be writable. Nothing is left behind if it
/// is dropped unwritten.
pub struct OutputFile {
    path: PathBuf,
    format: Format,
    temporary: NamedTempFile,
}

impl OutputFile {
    /// Reserves `path`: its format is known, its folder exists and can be written to, and it is no folder itself.
    pub fn reserve(path: &Path) -> Result<Self> {
        let format = Format::of(path)?;
        if path.is_dir() {
            return Err(Error::file(path, "cannot write the picture: this is a folder"));
        }
        if let Some(folder) = path.parent()
            && !folder.as_os_str().is_empty()
            && !folder.is_dir()
        {
            let message = format!("cannot write the picture: the folder {} does not exist", folder.display());
            return Err(Error::file(path, message));
        }
        let temporary =
            temporary_beside(path).map_err(|e| Error::file(path, format!("cannot write the picture: {e}")))?;
        Ok(Self { path: path.to_owned(), format, temporary })
    }

    /// The name that the picture will have.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The name that it has until it is written.
    pub fn temporary_path(&self) -> &Path {
        self.temporary.path()
    }

    /// Writes the picture and gives it its name. Returns how many values did not fit the file's type and were clamped.
    pub fn write(mut self, picture: &Picture, options: &WriteOptions) -> Result<u64> {
        let fail = |e: &dyn std::fmt::Display| Error::file(&self.path, format!("cannot write the picture: {e}"));
        let clamped = match self.format {
            Format::Exr => {
                let exr = ExrOptions::new(picture, options);
                exr_file::write(self.temporary.as_file_mut(), &exr).map_err(|e| fail(&e))?
            }
            Format::Png => {
                png_file::write(self.temporary.as_file_mut(), picture, options.exposure).map_err(|e| fail(&e))?;
                0
            }
        };
        self.temporary.as_file_mut().sync_all().map_err(|e| fail(&e))?;
        let Self { path, temporary, .. } = self;
        temporary
            .persist(&path)
            .map_err(|e| Error::file(&path, format!("cannot give the picture its name: {}", e.error)))?;
        Ok(clamped)
    }
}
