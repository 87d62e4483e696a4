//! A scene file after parsing: objects with typed parameters, references resolved, nothing interpreted yet.

use super::source::{Loc, Sources};
use crate::error::Result;
use crate::files::Files;
use glam::{DAffine3, DVec3};
use std::cell::Cell;
use std::path::PathBuf;

/// What kind of object a tag makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Category {
    Scene,
    Bsdf,
    Shape,
    Emitter,
    Sensor,
    Film,
    Sampler,
    Rfilter,
    Integrator,
    Texture,
    Medium,
    Phase,
    Volume,
}

/// Tags of objects.
const CATEGORIES: &[(&str, Category)] = &[
    ("scene", Category::Scene),
    ("bsdf", Category::Bsdf),
    ("shape", Category::Shape),
    ("emitter", Category::Emitter),
    ("sensor", Category::Sensor),
    ("film", Category::Film),
    ("sampler", Category::Sampler),
    ("rfilter", Category::Rfilter),
    ("integrator", Category::Integrator),
    ("texture", Category::Texture),
    ("medium", Category::Medium),
    ("phase", Category::Phase),
    ("volume", Category::Volume),
];

impl Category {
    /// The category of a tag, if it is an object's.
    pub(crate) fn from_tag(tag: &str) -> Option<Self> {
        CATEGORIES.iter().find(|row| row.0 == tag).map(|row| row.1)
    }

    /// The tag.
    pub(crate) fn tag(self) -> &'static str {
        CATEGORIES.iter().find(|row| row.1 == self).map_or("object", |row| row.0)
    }

    /// Every tag of an object.
    pub(crate) fn tags() -> impl Iterator<Item = &'static str> {
        CATEGORIES.iter().map(|row| row.0)
    }
}

/// Index into [`Document::objects`].
pub(crate) type ObjectId = usize;

/// One object of the file.
#[derive(Debug)]
pub(crate) struct Object {
    pub(crate) category: Category,
    /// The `type` attribute.
    pub(crate) plugin: String,
    /// The `id` attribute, or empty.
    pub(crate) id: String,
    /// The element.
    pub(crate) at: Loc,
    /// The value of the `type` attribute.
    pub(crate) plugin_at: Loc,
    pub(crate) params: Vec<Param>,
}

/// One parameter or child of an object.
#[derive(Debug)]
pub(crate) struct Param {
    /// Empty for a child that was not named.
    pub(crate) name: String,
    /// The element.
    pub(crate) at: Loc,
    /// What a complaint about the value points at.
    pub(crate) value_at: Loc,
    pub(crate) value: Value,
    /// Whether a plugin asked for it.
    pub(crate) used: Cell<bool>,
}

/// The value of a parameter.
#[derive(Debug)]
pub(crate) enum Value {
    Float(f64),
    Integer(i64),
    Boolean(bool),
    Text(String),
    Vector(DVec3),
    Rgb([f64; 3]),
    Spectrum(Spectrum),
    Transform(DAffine3),
    Child(ObjectId),
    /// The id of another object; none is left once the whole file is read.
    Reference(String),
}

/// A `<spectrum>`.
#[derive(Debug)]
pub(crate) enum Spectrum {
    Uniform(f64),
    /// Wavelength in nanometres, ascending, and value; at least two.
    Table(Vec<(f64, f64)>),
    /// A file of such pairs, not read yet.
    File(String),
}

impl Value {
    /// The tag that makes it.
    pub(crate) fn tag(&self) -> &'static str {
        match self {
            Self::Float(_) => "float",
            Self::Integer(_) => "integer",
            Self::Boolean(_) => "boolean",
            Self::Text(_) => "string",
            Self::Vector(_) => "vector",
            Self::Rgb(_) => "rgb",
            Self::Spectrum(_) => "spectrum",
            Self::Transform(_) => "transform",
            Self::Child(_) => "object",
            Self::Reference(_) => "ref",
        }
    }
}

/// A parsed scene with everything it includes.
#[derive(Debug)]
pub(crate) struct Document {
    pub(crate) files: Files,
    pub(crate) sources: Sources,
    /// The scene is the first.
    pub(crate) objects: Vec<Object>,
    /// Where to look for files, in this order, before the folder of the file that names them.
    pub(crate) search: Vec<PathBuf>,
    pub(crate) warnings: Vec<String>,
}

impl Document {
    /// The file that `name`, written at `at`, means; where it was looked for if there is none.
    pub(crate) fn find_file(&self, name: &str, at: Loc) -> std::result::Result<PathBuf, String> {
        find_file(&self.files, &self.search, self.sources.path(at.file()), name)
    }

    /// An error if an object contains itself, which only references can do.
    pub(crate) fn check_cycles(&self) -> Result<()> {
        let mut state = vec![Visit::New; self.objects.len()];
        for start in 0..self.objects.len() {
            // Depth first without recursion: chains of references may be as long as the file.
            let mut stack = vec![(start, 0)];
            while let Some((object, next)) = stack.pop() {
                if next == 0 {
                    if state[object] == Visit::Done {
                        continue;
                    }
                    state[object] = Visit::Open;
                }
                let Some(param) = self.objects[object].params.get(next) else {
                    state[object] = Visit::Done;
                    continue;
                };
                stack.push((object, next + 1));
                let Value::Child(child) = param.value else { continue };
                if state[child] == Visit::Open {
                    let id = &self.objects[child].id;
                    return Err(self.sources.error(param.at, format!("'{id}' contains itself")));
                }
                if state[child] == Visit::New {
                    stack.push((child, 0));
                }
            }
        }
        Ok(())
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Visit {
    New,
    Open,
    Done,
}

/// Looks for a file in the `search` folders, beside the file that names it, and in the working directory.
pub(crate) fn find_file(
    files: &Files,
    search: &[PathBuf],
    naming: &std::path::Path,
    name: &str,
) -> std::result::Result<PathBuf, String> {
    let beside = naming.parent().unwrap_or(std::path::Path::new("")).to_path_buf();
    let mut folders: Vec<PathBuf> = search.to_vec();
    for folder in [beside, PathBuf::new()] {
        if !folders.contains(&folder) {
            folders.push(folder);
        }
    }
    let found = folders.iter().map(|folder| folder.join(name)).find(|path| files.has(path));
    found.ok_or_else(|| {
        let names: Vec<String> = folders
            .iter()
            .map(|f| format!("'{}'", if f.as_os_str().is_empty() { ".".into() } else { f.display().to_string() }))
            .collect();
        format!("there is no file '{name}'{} (looked in {})", files.confinement(), names.join(", "))
    })
}
