//! What can go wrong before a render, and where in the input: the one error type of the library.
//!
//! The render loop itself cannot fail. Everything here is found while reading, compiling or preparing to write, and is
//! meant to be printed as one line that names the file, the place and what was expected.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A place in an input file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Span {
    /// The file as the user named it (or as it was resolved from the scene file).
    pub file: Arc<Path>,
    /// Where in the file.
    pub position: Position,
}

/// A position inside a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Position {
    /// The file as a whole.
    Whole,
    /// 1-based line and column of a text file.
    Text {
        /// 1-based line.
        line: u32,
        /// 1-based column, in characters.
        column: u32,
    },
    /// 1-based line of a text file whose columns say nothing.
    Line(u32),
    /// Offset from the start of a binary file.
    Byte(u64),
}

impl Span {
    /// The file as a whole.
    pub fn whole(file: impl Into<Arc<Path>>) -> Self {
        Self { file: file.into(), position: Position::Whole }
    }

    /// A line and column, both 1-based.
    pub fn text(file: impl Into<Arc<Path>>, line: u32, column: u32) -> Self {
        Self { file: file.into(), position: Position::Text { line, column } }
    }
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        match self.position {
            Position::Whole => Ok(()),
            Position::Text { line, column } => write!(f, ":{line}:{column}"),
            Position::Line(line) => write!(f, ":{line}"),
            Position::Byte(offset) => write!(f, ": byte {offset}"),
        }
    }
}

/// Everything that can stop a render before it starts, in the four kinds a caller can act on.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The input is wrong at this place.
    #[error("{at}: {message}")]
    Scene {
        /// Where.
        at: Span,
        /// What is wrong, and what was expected.
        message: String,
    },
    /// The input is right, but names something that snell does not do yet.
    #[error("{at}: {what} is not supported yet{hint}")]
    Unsupported {
        /// Where.
        at: Span,
        /// The thing, for example `bsdf plugin 'plastic'`.
        what: String,
        /// Empty, or a continuation that begins with punctuation, for example `; supported: diffuse, …`.
        hint: String,
    },
    /// A file could not be read or written.
    #[error("{}: {message}", path.display())]
    File {
        /// Which file.
        path: PathBuf,
        /// Why.
        message: String,
    },
    /// The ray accelerator could not be set up.
    #[error("{0}")]
    Accelerator(String),
    /// The request makes no sense (a crop outside the film, for example).
    #[error("{0}")]
    Usage(String),
}

impl Error {
    /// An [`Error::Scene`].
    pub fn scene(at: &Span, message: impl Into<String>) -> Self {
        Self::Scene { at: at.clone(), message: message.into() }
    }

    /// An [`Error::File`] from an I/O error.
    pub fn file(path: impl Into<PathBuf>, message: impl fmt::Display) -> Self {
        Self::File { path: path.into(), message: message.to_string() }
    }
}

/// Result with [`Error`].
pub type Result<T> = std::result::Result<T, Error>;
