//! The text files of a scene and places in them.
//!
//! A [`Loc`] is two numbers, so that everything read from a file can carry one; line and column are counted only when
//! an error or the description needs them.

use crate::error::{Error, Span};
use std::path::Path;
use std::sync::Arc;

/// Largest scene file in bytes. Reason: offsets are 32 bits wide, and a hand-written or exported scene is a thousandth of
/// this; what is larger is not a scene.
pub(crate) const MAX_TEXT_BYTES: u64 = 256 << 20;

/// Largest mesh or spectrum file in bytes. Reason: a mesh is read whole; this is beyond 2³² vertex indices of an ascii
/// file and protects against reading a device.
pub(crate) const MAX_DATA_BYTES: u64 = 64 << 30;

/// A byte of one of the [`Sources`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Loc {
    file: u32,
    offset: u32,
}

impl Loc {
    /// The byte `offset` of the file that [`Sources::add`] numbered `file`.
    pub(crate) fn new(file: usize, offset: usize) -> Self {
        // Both are bounded: the number of files and the size of a file have limits.
        Self { file: file as u32, offset: offset as u32 }
    }

    /// The number of the file.
    pub(crate) fn file(self) -> usize {
        self.file as usize
    }
}

#[derive(Debug)]
struct Source {
    path: Arc<Path>,
    text: Arc<str>,
    line_starts: Vec<usize>,
}

/// Every text file of a scene.
#[derive(Debug, Default)]
pub(crate) struct Sources {
    files: Vec<Source>,
}

impl Sources {
    /// Keeps a file and numbers it.
    pub(crate) fn add(&mut self, path: &Path, text: Arc<str>) -> usize {
        let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(i, _)| i + 1)).collect();
        self.files.push(Source { path: path.into(), text, line_starts: starts });
        self.files.len() - 1
    }

    /// How many files there are.
    pub(crate) fn len(&self) -> usize {
        self.files.len()
    }

    /// The path of a file as it was opened.
    pub(crate) fn path(&self, file: usize) -> &Path {
        &self.files[file].path
    }

    /// Line and column of a place.
    pub(crate) fn span(&self, at: Loc) -> Span {
        let source = &self.files[at.file()];
        let offset = at.offset as usize;
        let line = source.line_starts.partition_point(|&start| start <= offset).max(1);
        let start = source.line_starts[line - 1];
        let column = source.text.get(start..offset).map_or(offset - start, |s| s.chars().count());
        Span::text(source.path.clone(), line as u32, column as u32 + 1)
    }

    /// The input is wrong at this place.
    pub(crate) fn error(&self, at: Loc, message: impl Into<String>) -> Error {
        Error::scene(&self.span(at), message)
    }

    /// The input is right, but not supported; `hint` is empty or begins with punctuation.
    pub(crate) fn unsupported(&self, at: Loc, what: impl Into<String>, hint: impl Into<String>) -> Error {
        Error::Unsupported { at: self.span(at), what: what.into(), hint: hint.into() }
    }
}
