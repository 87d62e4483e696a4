//! A glTF file while it is read: its objects, its bytes, and how its faults are told.

use super::container::Container;
use crate::error::{Error, Result, Span};
use crate::files::Files;
use crate::loader::LoadOptions;
use gltf::json::Root;
use std::cell::{OnceCell, RefCell};
use std::path::{Path, PathBuf};

/// A glTF file.
pub(super) struct Model {
    /// The file.
    pub(super) at: Span,
    /// Its objects. No index and no number in them has been checked.
    pub(super) root: Root,
    /// Where it may read.
    pub(super) files: Files,
    /// The folder that its URIs start from.
    pub(super) folder: PathBuf,
    /// The buffer of a binary file.
    pub(super) blob: Option<Vec<u8>>,
    /// The bytes of other buffers, read when they are first asked for.
    pub(super) buffers: Vec<OnceCell<Vec<u8>>>,
    lenient: bool,
    /// Whether the first set of texture coordinates is wanted of every mesh.
    pub(super) wants_uvs: bool,
    warnings: RefCell<Vec<String>>,
}

impl Model {
    pub(super) fn new(path: &Path, Container { root, blob }: Container, options: &LoadOptions) -> Self {
        Self {
            at: Span::whole(path),
            files: options.files.clone(),
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
            buffers: root.buffers.iter().map(|_| OnceCell::new()).collect(),
            root,
            blob,
            lenient: options.lenient,
            wants_uvs: options.uvs,
            warnings: RefCell::default(),
        }
    }

    /// The file is wrong at this place of its JSON.
    pub(super) fn error(&self, place: &str, message: impl std::fmt::Display) -> Error {
        Error::scene(&self.at, format!("{place}: {message}"))
    }

    /// The file is right, but not supported; `hint` is empty or begins with punctuation.
    pub(super) fn unsupported(&self, what: String, hint: String) -> Error {
        Error::Unsupported { at: self.at.clone(), what, hint }
    }

    /// Tells what was left out or taken to be something else.
    pub(super) fn warn(&self, place: &str, message: impl std::fmt::Display) {
        let warning = format!("{}: {place}: {message}", self.at);
        let mut warnings = self.warnings.borrow_mut();
        if !warnings.contains(&warning) {
            warnings.push(warning);
        }
    }

    /// All that was told.
    pub(super) fn take_warnings(&self) -> Vec<String> {
        self.warnings.take()
    }

    /// An error, unless the user is lenient: then a warning that ends in what is done instead.
    pub(super) fn complain(&self, place: &str, message: &str, instead: &str) -> Result<()> {
        if !self.lenient {
            return Err(self.error(place, message));
        }
        self.warn(place, format!("{message}; {instead}"));
        Ok(())
    }

    /// An element of one of the file's lists, which is called `list`; `place` refers to it.
    pub(super) fn get<'a, T>(&self, all: &'a [T], index: usize, list: &str, place: &str) -> Result<&'a T> {
        let count = all.len();
        all.get(index).ok_or_else(|| self.error(place, format!("there is no {list}[{index}]; the file has {count}")))
    }

    /// Whether what is not supported is left out.
    pub(super) fn is_lenient(&self) -> bool {
        self.lenient
    }

    /// A number that must be between `low` and `high`.
    pub(super) fn number(&self, place: &str, value: f64, low: f64, high: f64) -> Result<f64> {
        if value >= low && value <= high {
            return Ok(value);
        }
        let expected = if high == f64::MAX { format!("at least {low}") } else { format!("from {low} to {high}") };
        self.complain(place, &format!("expected a number {expected}, not {value}"), "it is taken as the nearest one")?;
        Ok(if value.is_nan() { low } else { value.clamp(low, high) })
    }
}
