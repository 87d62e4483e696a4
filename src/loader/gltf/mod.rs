//! Reads glTF 2.0 (Khronos Group 2021, *glTF 2.0 Specification*): `.gltf` with its buffers and pictures, or `.glb`.
//!
//! ```text
//! file ─container─▶ objects, as the crate `gltf` has them ─model─▶ a file with places and warnings
//!     buffers, accessors: numbers          nodes: where things are
//!     primitives, deform, tangents ─▶ Mesh       materials, layers, textures, pictures ─▶ Bsdf, Texture
//!     placing: shapes, groups, instances   lights, cameras
//! ```
//!
//! The crate only knows the form of the objects. No index, count or offset of a file is trusted: each is checked before
//! anything is read or allocated by it, and what is wrong is told with its place in the JSON.
//!
//! A file without a camera is looked at as [`super::framing`] has it. One without lights is lit by that module's
//! surroundings: it has none if nothing in it is a light of `KHR_lights_punctual`, and nothing emits more than white. (What
//! emits less is meant to be seen, not to light a room: in rasterisers it lights nothing.)

mod accessors;
mod buffers;
mod cameras;
mod container;
mod deform;
mod extensions;
mod layers;
mod lights;
mod materials;
mod model;
mod nodes;
mod pictures;
mod placing;
mod primitives;
mod tangents;
mod textures;

use super::LoadOptions;
use super::framing::{self, View};
use crate::description::{Integrator, Inventory, Light, SceneDescription};
use crate::error::{Error, Result};
use materials::Materials;
use model::Model;
use nodes::Nodes;
use std::path::Path;

/// Whether a path names a glTF file.
pub(crate) fn is_gltf(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str());
    extension.is_some_and(|e| e.eq_ignore_ascii_case("gltf") || e.eq_ignore_ascii_case("glb"))
}

/// Reads a glTF file.
pub(crate) fn read(path: &Path, options: &LoadOptions) -> Result<SceneDescription> {
    if let Some((name, _)) = options.defines.first() {
        return Err(Error::Usage(format!("-D {name}: a glTF file has no parameters, only an XML scene has")));
    }
    let model = Model::new(path, container::read(&options.files, path)?, options);
    extensions::check_version(&model)?;
    extensions::check(&model)?;
    if !model.root.animations.is_empty() {
        model.warn("animations", "they are left out: everything is where its node says");
    }
    let nodes = Nodes::new(&model)?;
    let mut materials = Materials::new(&model);
    let placed = placing::read(&model, &nodes, &mut materials)?;
    let mut cameras = cameras::read(&model, &nodes)?;
    let mut lights = lights::read(&model, &nodes)?;
    if lights.is_empty() && !materials.has_lamp && options.sky.is_none() {
        lights.push(Light { at: model.at.clone(), kind: framing::surroundings() });
    }
    if cameras.is_empty() {
        let points = placed.points();
        let view = View::of(points.iter().copied())
            .ok_or_else(|| Error::scene(&model.at, "there is nothing in it to look at, and it has no camera"))?;
        cameras.push(view.camera(&model.at));
    }
    Ok(SceneDescription {
        integrator: Integrator::default(),
        cameras,
        bsdfs: materials.bsdfs,
        textures: materials.textures.finish()?,
        shapes: placed.shapes,
        groups: placed.groups,
        instances: placed.instances,
        wants_uvs: options.uvs,
        lights,
        warnings: model.take_warnings(),
        inventory: Inventory::default(),
    })
}
