//! Opens every input file: with a limit to its size, inside of one folder if that is asked for, and noting what was read.
//!
//! **What confinement holds.** A file is read only if its path, with all `..` and symbolic links resolved, lies inside of
//! the folder, compared name by name. On Linux the same is asked of the opened file itself (`/proc/self/fd`), so that
//! nothing outside is read even where somebody exchanges folders and links meanwhile; elsewhere there is no such second
//! look. What is told of a file outside is the same whether or not it is there. Hard links and mounts inside of the folder are
//! inside.
//!
//! Whoever reads a file also finds here how much memory that may take ([`Memory`]).

mod memory;

pub use memory::Memory;

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, Metadata};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Where input files may be, and those that were read. Clones share both.
#[derive(Clone, Debug, Default)]
pub struct Files {
    place: Arc<Place>,
    /// With links resolved.
    read: Arc<Mutex<BTreeSet<PathBuf>>>,
    memory: Memory,
}

/// Where files may be.
#[derive(Debug, Default)]
enum Place {
    #[default]
    Anywhere,
    Inside(Folder),
    /// Nowhere on any disk: path and content of each.
    Held(BTreeMap<PathBuf, Vec<u8>>),
}

/// The folder outside of which nothing is read.
#[derive(Debug)]
struct Folder {
    /// As the user named it.
    name: PathBuf,
    /// With links resolved.
    path: PathBuf,
}

impl Files {
    /// Only those inside of a folder.
    ///
    /// Fails, with the reason, where it is no folder.
    pub fn inside(folder: &Path) -> Result<Self, String> {
        let path = folder.canonicalize().map_err(|e| e.to_string())?;
        if !path.is_dir() {
            return Err("is not a folder".into());
        }
        let place = Place::Inside(Folder { name: folder.to_owned(), path });
        Ok(Self { place: Arc::new(place), ..Self::default() })
    }

    /// These alone, and nothing of any disk: for who has a scene in memory, as fuzzers do.
    pub fn held(files: impl IntoIterator<Item = (PathBuf, Vec<u8>)>) -> Self {
        Self { place: Arc::new(Place::Held(files.into_iter().collect())), ..Self::default() }
    }

    /// The same, with a limit to the memory that what is read may take.
    #[must_use]
    pub fn within(self, memory: Memory) -> Self {
        Self { memory, ..self }
    }

    /// What is left of the memory that what is read may take.
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// The bytes of a regular file of at most `limit` bytes, or the reason why not.
    pub fn read(&self, path: &Path, limit: u64) -> Result<Vec<u8>, String> {
        let resolved = self.resolve(path)?;
        if let Place::Held(files) = &*self.place {
            let bytes = files.get(&resolved).ok_or_else(|| self.refused())?;
            self.note(resolved);
            return Ok(bytes.clone());
        }
        // Before it is opened, for opening a pipe waits for its other end; and after, for it may be another by then.
        check_regular(std::fs::metadata(&resolved))?;
        let file = File::open(&resolved).map_err(|e| e.to_string())?;
        let about = check_regular(file.metadata())?;
        self.check_opened(&file)?;
        if about.len() > limit {
            return Err(format!("is larger than {limit} bytes"));
        }
        self.memory.check(about.len()).map_err(|m| format!("the file {m}"))?;
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(about.len() as usize).map_err(|e| e.to_string())?;
        // The file may grow while it is read; the limit holds all the same.
        file.take(limit).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
        self.note(resolved);
        Ok(bytes)
    }

    fn note(&self, path: PathBuf) {
        self.read.lock().unwrap_or_else(PoisonError::into_inner).insert(path);
    }

    /// Whether there is such a file or folder, and it may be read.
    pub fn has(&self, path: &Path) -> bool {
        match (&*self.place, self.resolve(path)) {
            (Place::Held(files), Ok(path)) => files.contains_key(&path),
            (_, resolved) => resolved.is_ok_and(|path| path.exists()),
        }
    }

    /// How long a file is that may be read; it is not opened.
    pub fn bytes(&self, path: &Path) -> Option<u64> {
        let path = self.resolve(path).ok()?;
        match &*self.place {
            Place::Held(files) => files.get(&path).map(|bytes| bytes.len() as u64),
            Place::Anywhere | Place::Inside(_) => check_regular(std::fs::metadata(path)).ok().map(|about| about.len()),
        }
    }

    /// One path for all names of a file; the name itself where there is none or it must not be known.
    pub fn identity(&self, path: &Path) -> PathBuf {
        match (&*self.place, self.resolve(path)) {
            (Place::Anywhere | Place::Inside(_), Ok(path)) => path,
            _ => path.to_owned(),
        }
    }

    /// What to say after "there is no file 'name'" of where it must be: nothing, or which folder holds all that is read.
    pub fn confinement(&self) -> String {
        match &*self.place {
            Place::Inside(folder) => format!(" inside of '{}' (--confine)", folder.name.display()),
            Place::Anywhere | Place::Held(_) => String::new(),
        }
    }

    /// All that was read, each once, with links resolved, sorted.
    pub fn read_so_far(&self) -> Vec<PathBuf> {
        self.read.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }

    /// With links resolved, if that is inside.
    fn resolve(&self, path: &Path) -> Result<PathBuf, String> {
        match &*self.place {
            Place::Held(_) => Ok(path.to_owned()),
            // What cannot be resolved is named when it is opened.
            Place::Anywhere => Ok(path.canonicalize().unwrap_or_else(|_| path.to_owned())),
            Place::Inside(folder) => {
                path.canonicalize().ok().filter(|p| p.starts_with(&folder.path)).ok_or_else(|| self.refused())
            }
        }
    }

    fn refused(&self) -> String {
        format!("there is no such file{}", self.confinement())
    }

    /// An error unless the file that was opened is inside.
    #[cfg(target_os = "linux")]
    fn check_opened(&self, file: &File) -> Result<(), String> {
        use std::os::fd::AsRawFd;
        let Place::Inside(folder) = &*self.place else { return Ok(()) };
        let path = std::fs::read_link(format!("/proc/self/fd/{}", file.as_raw_fd()))
            .map_err(|e| format!("cannot tell whether it is inside of '{}': {e}", folder.name.display()))?;
        if path.starts_with(&folder.path) { Ok(()) } else { Err(self.refused()) }
    }

    #[cfg(not(target_os = "linux"))]
    #[allow(clippy::unused_self, clippy::unnecessary_wraps, reason = "as where it can be done")]
    fn check_opened(&self, _: &File) -> Result<(), String> {
        Ok(())
    }
}

fn check_regular(about: std::io::Result<Metadata>) -> Result<Metadata, String> {
    match about {
        Ok(about) if about.is_file() => Ok(about),
        Ok(_) => Err("is not a regular file".to_owned()),
        Err(e) => Err(e.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: u64 = 100;

    /// A folder `in` with a file, one beside it that is called almost alike, and `in/folder`.
    fn tree() -> (tempfile::TempDir, PathBuf) {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().canonicalize().unwrap();
        for folder in ["in", "in/folder", "in-not"] {
            std::fs::create_dir(path.join(folder)).unwrap();
            std::fs::write(path.join(folder).join("file"), folder).unwrap();
        }
        (root, path)
    }

    #[test]
    fn only_what_is_inside_is_read_and_absence_outside_is_not_told() {
        let (_root, path) = tree();
        let inside = path.join("in");
        let files = Files::inside(&inside).unwrap();
        for name in ["file", "folder/file", "folder/../file", "../in/file", "../in-not/../in/file"] {
            assert!(files.read(&inside.join(name), LIMIT).is_ok() && files.has(&inside.join(name)), "{name}");
        }
        let refused = format!("there is no such file inside of '{}' (--confine)", inside.display());
        for name in ["../in-not/file", "../none", "folder/../../in-not/file", "none", "/etc/passwd", "/none", ".."] {
            assert_eq!(files.read(&inside.join(name), LIMIT), Err(refused.clone()), "{name}");
            assert!(!files.has(&inside.join(name)), "{name}");
            assert_eq!(files.identity(&inside.join(name)), inside.join(name), "{name}");
        }
        assert_eq!(files.read(&inside, LIMIT), Err("is not a regular file".into()));
        assert_eq!(files.read_so_far(), [inside.join("file"), inside.join("folder/file")]);
        assert_eq!(files.clone().read_so_far().len(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn links_count_by_what_they_point_at() {
        use std::os::unix::fs::symlink;
        let (_root, path) = tree();
        let inside = path.join("in");
        symlink("../in-not/file", inside.join("out-file")).unwrap();
        symlink(path.join("in-not"), inside.join("out-folder")).unwrap();
        symlink("folder/file", inside.join("in-file")).unwrap();
        symlink(&inside, path.join("in-not/way-in")).unwrap();
        symlink("loop", inside.join("loop")).unwrap();
        let files = Files::inside(&path.join("in-not/way-in")).unwrap();
        for name in ["out-file", "out-folder/file", "loop"] {
            assert!(files.read(&inside.join(name), LIMIT).is_err() && !files.has(&inside.join(name)), "{name}");
        }
        assert_eq!(files.read(&inside.join("in-file"), LIMIT).unwrap(), b"in/folder");
        assert_eq!(files.read(&path.join("in-not/way-in/file"), LIMIT).unwrap(), b"in");
        assert_eq!(files.read_so_far(), [inside.join("file"), inside.join("folder/file")]);
        let opened = |path: &Path| files.check_opened(&File::open(path).unwrap());
        assert_eq!(opened(&inside.join("file")), Ok(()));
        if cfg!(target_os = "linux") {
            assert!(opened(&inside.join("out-file")).unwrap_err().contains("no such file inside of"));
        }
    }

    /// Somebody exchanges a folder for a link to another, over and over, while it is read: never is the other read.
    #[cfg(target_os = "linux")]
    #[test]
    fn exchanging_folders_while_they_are_read_shows_nothing_outside() {
        let (_root, path) = tree();
        let inside = path.join("in");
        std::os::unix::fs::symlink(path.join("in-not"), inside.join("link")).unwrap();
        let files = Files::inside(&inside).unwrap();
        let (name, link, spare) = (inside.join("folder"), inside.join("link"), inside.join("spare"));
        std::thread::scope(|scope| {
            let exchange = scope.spawn(|| {
                for _ in 0..2000 {
                    std::fs::rename(&name, &spare).unwrap();
                    std::fs::rename(&link, &name).unwrap();
                    std::fs::rename(&name, &link).unwrap();
                    std::fs::rename(&spare, &name).unwrap();
                }
            });
            while !exchange.is_finished() {
                if let Ok(bytes) = files.read(&name.join("file"), LIMIT) {
                    assert_eq!(bytes, b"in/folder");
                }
            }
        });
    }

    #[test]
    fn without_a_folder_all_is_read_up_to_its_limit() {
        let (_root, path) = tree();
        let files = Files::default();
        assert_eq!(files.read(&path.join("in/../in-not/file"), LIMIT).unwrap(), b"in-not");
        assert_eq!(files.read(&path.join("in/file"), 1), Err("is larger than 1 bytes".into()));
        assert!(files.read(&path.join("none"), LIMIT).unwrap_err().contains("No such file"));
        assert_eq!(files.read_so_far(), [path.join("in-not/file")]);
        let small = Files::default().within(Memory::limited(1));
        let refused = "the file takes 0.0 MiB, which beside 0.0 MiB in use is more than the 0.0 MiB of --memory-limit";
        assert_eq!(small.read(&path.join("in/file"), LIMIT), Err(refused.into()));
        assert_eq!(Files::inside(&path.join("in/file")).unwrap_err(), "is not a folder");
        assert!(Files::inside(&path.join("none")).is_err());
    }

    #[test]
    fn held_files_hide_all_others() {
        let files = Files::held([(PathBuf::from("a"), b"1".to_vec())]);
        assert_eq!(files.read(Path::new("a"), LIMIT).unwrap(), b"1");
        assert!(files.has(Path::new("a")) && !files.has(Path::new("/")));
        assert_eq!(files.read(Path::new("/etc/passwd"), LIMIT).unwrap_err(), "there is no such file");
        assert_eq!(files.read_so_far(), [Path::new("a")]);
    }
}
