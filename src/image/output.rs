//! An output file that exists whole or not at all: written beside its place under a temporary name, then renamed.

use super::exr_file::{self, ExrOptions, Metadata};
use super::{ComponentFormat, Crop, Layers, png_file};
use crate::error::{Error, Result};
use std::fs::File;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

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

/// A place for a file, reserved before there is anything to write so that it is known to be writable. Nothing is left
/// behind if it is dropped unwritten.
pub struct Reserved {
    path: PathBuf,
    /// What the file is to hold, for messages: "the picture".
    what: &'static str,
    /// Where the path leads if it is a symbolic link.
    place: PathBuf,
    temporary: NamedTempFile,
}

impl Reserved {
    /// Reserves `path`: its folder exists and can be written to, and it is nothing but a regular file itself, if it
    /// exists.
    pub fn new(path: &Path, what: &'static str) -> Result<Self> {
        let fail = |why: &dyn std::fmt::Display| Error::file(path, format!("cannot write {what}: {why}"));
        if path.is_dir() {
            return Err(fail(&"this is a folder"));
        }
        if path.exists() && !path.is_file() {
            return Err(fail(&"this is not a regular file"));
        }
        let folder = folder(path);
        if !folder.is_dir() {
            return Err(fail(&format_args!("the folder {} does not exist", folder.display())));
        }
        // A link stays a link, and what it leads to is written.
        let place = if path.is_symlink() { path.canonicalize().map_err(|e| fail(&e))? } else { path.to_owned() };
        let temporary = temporary_beside(&place).map_err(|e| fail(&e))?;
        Ok(Self { path: path.to_owned(), what, place, temporary })
    }

    /// The name that the file will have.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The name that it has until it is written.
    pub fn temporary_path(&self) -> &Path {
        self.temporary.path()
    }

    /// Lets `write` fill the file and gives it its name.
    pub fn write<T, E: std::fmt::Display>(
        mut self,
        write: impl FnOnce(&mut File) -> std::result::Result<T, E>,
    ) -> Result<T> {
        let what = self.what;
        let fail = |e: &dyn std::fmt::Display| Error::file(&self.path, format!("cannot write {what}: {e}"));
        let file = self.temporary.as_file_mut();
        let written = write(file).map_err(|e| fail(&e))?;
        if let Ok(existing) = self.place.metadata() {
            // Who may read it does not change; where the owner cannot be kept, a mode that cannot be set is no failure.
            let _ = file.set_permissions(existing.permissions());
        }
        file.sync_all().map_err(|e| fail(&e))?;
        self.temporary.persist(&self.place).map_err(|e| {
            // The file is whole: what is in the way of its name is no reason to lose it.
            let kept = e.file.keep().map(|(_, kept)| format!("; it is kept as {}", kept.display()));
            let message = format!("cannot give {what} its name: {}{}", e.error, kept.unwrap_or_default());
            Error::file(&self.path, message)
        })?;
        Ok(written)
    }
}

/// The folder of a file.
fn folder(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A new file in the folder of `path`, to be renamed to it.
fn temporary_beside(path: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    // Short, whatever the name: file systems limit its length.
    builder.prefix(".snell-").suffix(".tmp");
    // As any new file: what the user's mask allows, not the private mode of temporary files.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder(path))
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

    /// The name that the picture will have.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// The name that it has until it is written.
    pub fn temporary_path(&self) -> &Path {
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
