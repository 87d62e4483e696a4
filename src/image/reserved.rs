//! An output file that exists whole or not at all: written without its name, which it gets when it is safely on disk.
//!
//! Until then it has no name at all where the system can do that (Linux, on most of its file systems), so that not even a
//! process that is killed leaves anything behind; elsewhere a temporary one beside its place.

use crate::error::{Error, Result};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// A place for a file, reserved before there is anything to write so that it is known to be writable. Nothing is left
/// behind if it is dropped unwritten.
pub struct Reserved {
    path: PathBuf,
    /// What the file is to hold, for messages: "the picture".
    what: &'static str,
    /// Where the path leads if it is a symbolic link.
    place: PathBuf,
    unnamed: Unnamed,
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
        let unnamed = Unnamed::beside(&place).map_err(|e| fail(&e))?;
        Ok(Self { path: path.to_owned(), what, place, unnamed })
    }

    /// The name that the file will have.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The name that it has until it is written, if it has one.
    pub fn temporary_path(&self) -> Option<&Path> {
        self.unnamed.temporary_path()
    }

    /// Lets `write` fill the file and gives it its name, when all of it is on disk; what had that name before is replaced
    /// at once.
    pub fn write<T, E: std::fmt::Display>(
        mut self,
        write: impl FnOnce(&mut File) -> std::result::Result<T, E>,
    ) -> Result<T> {
        let what = self.what;
        let fail = |e: &dyn std::fmt::Display| Error::file(&self.path, format!("cannot write {what}: {e}"));
        let file = self.unnamed.file();
        let written = write(file).map_err(|e| fail(&e))?;
        if let Ok(existing) = self.place.metadata() {
            // Who may read it does not change; where the owner cannot be kept, a mode that cannot be set is no failure.
            let _ = file.set_permissions(existing.permissions());
        }
        file.sync_all().map_err(|e| fail(&e))?;
        self.unnamed.name(&self.place).map_err(|e| {
            let message = format!("cannot give {what} its name: {e}");
            Error::file(&self.path, message)
        })?;
        // The name is on disk only with its folder. Where folders cannot be synchronised, it will be there soon.
        let _ = File::open(folder(&self.place)).and_then(|folder| folder.sync_all());
        Ok(written)
    }
}

/// The folder of a file.
fn folder(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A new file that does not have its name yet.
enum Unnamed {
    /// It has none.
    #[cfg(target_os = "linux")]
    Nameless { file: File, folder: PathBuf },
    /// It has another.
    Temporary(NamedTempFile),
}

impl Unnamed {
    /// A new file in the folder of `path`.
    fn beside(path: &Path) -> io::Result<Self> {
        #[cfg(target_os = "linux")]
        if let Some(file) = nameless::create(folder(path)) {
            return Ok(Self::Nameless { file, folder: folder(path).to_owned() });
        }
        temporary_names().tempfile_in(folder(path)).map(Self::Temporary)
    }

    fn file(&mut self) -> &mut File {
        match self {
            #[cfg(target_os = "linux")]
            Self::Nameless { file, .. } => file,
            Self::Temporary(file) => file.as_file_mut(),
        }
    }

    fn temporary_path(&self) -> Option<&Path> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Nameless { .. } => None,
            Self::Temporary(file) => Some(file.path()),
        }
    }

    /// Gives the file its name. The file is whole: where something is in the way of its name, it is kept under another, which
    /// the error tells.
    fn name(self, place: &Path) -> std::result::Result<(), String> {
        let file = match self {
            // No name can be replaced by one that is made, only by one that is changed.
            #[cfg(target_os = "linux")]
            Self::Nameless { file, folder } => nameless::name(&file, &folder).map_err(|e| e.to_string())?,
            Self::Temporary(file) => file.into_temp_path(),
        };
        file.persist(place).map_err(|e| {
            let kept = e.path.keep().map(|kept| format!("; it is kept as {}", kept.display()));
            format!("{}{}", e.error, kept.unwrap_or_default())
        })
    }
}

/// How files are called that do not have their name yet.
fn temporary_names() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    // Short, whatever the name: file systems limit its length.
    builder.prefix(".snell-").suffix(".tmp");
    // As any new file: what the user's mask allows, not the private mode of temporary files.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder
}

/// Files without a name, which Linux has.
#[cfg(target_os = "linux")]
mod nameless {
    use rustix::fs::{AtFlags, CWD, Mode, OFlags, linkat, openat};
    use std::fs::File;
    use std::io;
    use std::os::fd::AsRawFd;
    use std::path::{Path, PathBuf};

    /// A new file in `folder`, if its file system has such files and they can be given a name later.
    pub(super) fn create(folder: &Path) -> Option<File> {
        // As any new file: what the user's mask allows.
        let mode = Mode::from_raw_mode(0o666);
        let file = File::from(openat(CWD, folder, OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC, mode).ok()?);
        open_as(&file).exists().then_some(file)
    }

    /// What the system calls a file that this process has open.
    fn open_as(file: &File) -> PathBuf {
        PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd()))
    }

    /// Gives the file a temporary name in `folder`, in which it was created.
    pub(super) fn name(file: &File, folder: &Path) -> io::Result<tempfile::TempPath> {
        let link = |path: &Path| Ok(linkat(CWD, open_as(file), CWD, path, AtFlags::SYMLINK_FOLLOW)?);
        super::temporary_names().make_in(folder, link).map(tempfile::NamedTempFile::into_temp_path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn a_file_appears_whole_and_replaces_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let names = || std::fs::read_dir(folder.path()).unwrap().count();
        for text in ["first", "second"] {
            let reserved = Reserved::new(&path, "the text").unwrap();
            let before = std::fs::read_to_string(&path).unwrap_or_default();
            reserved
                .write(|file| {
                    file.write_all(text.as_bytes())?;
                    assert_eq!(std::fs::read_to_string(&path).unwrap_or_default(), before);
                    io::Result::Ok(())
                })
                .unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
            assert_eq!(names(), 1);
        }
        drop(Reserved::new(&path, "the text").unwrap());
        assert_eq!(names(), 1);
    }

    /// Also where the system has files without a name.
    #[test]
    fn a_temporary_name_serves_as_well() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let mut unnamed = Unnamed::Temporary(temporary_names().tempfile_in(folder.path()).unwrap());
        unnamed.file().write_all(b"text").unwrap();
        assert!(unnamed.temporary_path().unwrap().exists());
        unnamed.name(&path).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "text");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
