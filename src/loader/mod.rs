//! Reads scene files: Mitsuba 3 XML with OBJ, PLY and serialized meshes, or glTF 2.0 in, [`SceneDescription`] out.
//!
//! ```text
//! text ─xml─▶ Document (objects, typed parameters, places) ─build + plugins─▶ SceneDescription
//!                                                             └─obj, ply, serialized─▶ Mesh
//! glTF ─gltf─▶ SceneDescription
//! mesh file ─bare_mesh─▶ SceneDescription
//! ```
//!
//! The grammar, the names, defaults and units are those of Mitsuba 3.9. It is strict: what is not understood is an error
//! that names its place and what was expected, unless [`LoadOptions::lenient`] makes it a warning. A new plugin is one
//! more function in [`plugins`] and one more line in the table beside it.

mod bare_mesh;
mod build;
mod conductors;
mod creases;
mod cube;
mod dielectrics;
mod document;
mod framing;
mod gltf;
mod inventory;
mod mtl;
mod normals;
mod obj;
mod params;
mod pictures;
mod plugins;
mod ply;
mod serialized;
mod sky;
mod source;
mod substitute;
mod suggest;
mod transform;
mod values;
mod xml;

pub use sky::Sky;

use crate::description::SceneDescription;
use crate::error::Result;
use crate::files::Files;
use std::path::Path;

/// How to read a scene file.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Values for the `$name` parameters of the file, before its `<default>`s; each must be used.
    pub defines: Vec<(String, String)>,
    /// Whether unknown parameters and attributes, and unsupported values that have a near supported one, are warnings.
    pub lenient: bool,
    /// Whether the texture coordinates of every shape are wanted, not only of those with textures.
    pub uvs: bool,
    /// An environment in place of the scene's own; a mesh that is the whole scene then has no lamp and no floor.
    pub sky: Option<Sky>,
    /// Where files may be; it notes those that are read.
    pub files: Files,
}

/// Reads a Mitsuba 3 XML scene and the meshes it uses, or glTF 2.0 (by its name, .gltf or .glb), or a mesh (.obj or .ply),
/// to which a camera and light are added.
pub fn load(path: &Path, options: &LoadOptions) -> Result<SceneDescription> {
    let mut scene = if gltf::is_gltf(path) {
        gltf::read(path, options)?
    } else if bare_mesh::is_mesh(path) {
        bare_mesh::read(path, options)?
    } else {
        build::build(&xml::read(path, options)?, options)?
    };
    if let Some(sky) = &options.sky {
        sky.replace_in(&mut scene, &options.files)?;
    }
    Ok(scene)
}
