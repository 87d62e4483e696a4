//! A mesh that is the whole scene: it is put on a floor, lit, and looked at.
//!
//! The picture: seen as [`super::framing`] has it, lit by a warm lamp from the upper left and a dim bluish sky, on a grey
//! floor under its lowest point. A mesh without normals is smooth but for its creases ([`super::creases`]). +y is up, and the front is +z. Lengths
//! are multiples of the mesh's size, so the picture is the same whatever the unit. The materials of an OBJ are those of
//! its MTL files ([`super::mtl`]); where one emits, it lights the scene alone, without floor, lamp and sky.

use super::LoadOptions;
use super::framing::{self, View};
use super::mtl::{self, GREY, Material};
use super::{creases, normals, obj, ply};
use crate::description::{
    Bsdf, BsdfId, BsdfKind, Emission, Geometry, Integrator, Inventory, Light, LightKind, Mesh, SceneDescription, Shape,
};
use crate::error::{Error, Result, Span};
use crate::files::Files;
use crate::spectrum::Rgb;
use glam::{DAffine3, DMat3, DVec3};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// The lamp's distance and radius in radii of the mesh, and its radiance; where it is [`framing`] says.
const LAMP: (f64, f64, Rgb) = (7.0, 1.6, Rgb::new(16.0, 14.7, 12.6));
/// Radiance of the sky.
const SKY: Rgb = Rgb::new(0.34, 0.37, 0.42);
/// Half the length of the floor's edges, in radii of the mesh.
const FLOOR: f64 = 25.0;
/// Reflectance of the floor: darker than a mesh of no colour, so that a flat one can be seen on it.
const FLOOR_GREY: f32 = 0.3;
/// How far the floor is below the mesh, in radii of the mesh: so little that it is not seen, but a flat mesh does not
/// coincide with it.
const GAP: f64 = 1.0 / 2048.0;

/// Whether a path names a mesh rather than a scene.
pub(crate) fn is_mesh(path: &Path) -> bool {
    extension(path).is_some_and(|e| e == "obj" || e == "ply")
}

fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

/// Reads a mesh and makes a scene of it.
pub(crate) fn read(path: &Path, options: &LoadOptions) -> Result<SceneDescription> {
    if let Some((name, _)) = options.defines.first() {
        return Err(Error::Usage(format!("-D {name}: a mesh has no parameters, only an XML scene has")));
    }
    let at = Span::whole(path);
    let mut scene = SceneDescription {
        integrator: Integrator::default(),
        cameras: Vec::new(),
        bsdfs: Vec::new(),
        textures: Vec::new(),
        shapes: Vec::new(),
        wants_uvs: options.uvs,
        groups: Vec::new(),
        instances: Vec::new(),
        lights: Vec::new(),
        inventory: Inventory::default(),
        warnings: Vec::new(),
    };
    let files = &options.files;
    let is_ply = extension(path).is_some_and(|e| e == "ply");
    let (mut mesh, materials) =
        if is_ply { (ply::read(files, path, ply::Wanted::default())?, None) } else { read_obj(files, path)? };
    if mesh.normals.len() != mesh.positions.len() {
        creases::split(&mut mesh.positions, &mut mesh.faces);
        mesh.normals = normals::compute(&mesh.positions, &mesh.faces, DMat3::IDENTITY);
    }
    let used = mesh.faces.iter().flatten().map(|&i| mesh.positions[i as usize]);
    let view = View::of(used).ok_or_else(|| Error::scene(&at, "the mesh has no size: all its points are the same"))?;
    match materials {
        Some(materials) => add_pieces(&mut scene, files, &at, &mesh, &materials),
        None => {
            let bsdf = add_two_sided(&mut scene, &at, "", BsdfKind::Diffuse { reflectance: Rgb::splat(GREY) });
            scene.shapes.push(shape(&at, "mesh", Geometry::Mesh(Arc::new(mesh)), bsdf, None));
        }
    }
    if options.sky.is_none() && scene.shapes.iter().all(|s| s.emission.is_none()) {
        light(&view, &mut scene, &at);
    }
    scene.cameras.push(view.camera(&at));
    Ok(scene)
}

/// An OBJ, if it names materials with what it says of them.
fn read_obj(files: &Files, path: &Path) -> Result<(Mesh, Option<(obj::Materials, std::path::PathBuf)>)> {
    let (mesh, materials) = obj::read_with_materials(files, path, false)?;
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let names_some = !materials.libraries.is_empty() || !materials.uses.is_empty();
    Ok((mesh, names_some.then_some((materials, folder))))
}

/// The materials of the libraries, by name. A library that is not there is a warning: the mesh can be shown without it.
fn libraries(
    scene: &mut SceneDescription,
    files: &Files,
    at: &Span,
    names: &[String],
    folder: &Path,
) -> HashMap<String, Material> {
    let mut found = HashMap::new();
    for name in names {
        match mtl::read(files, &folder.join(name)) {
            Ok(materials) => found.extend(materials.into_iter().map(|m| (m.name.clone(), m))),
            Err(e) => scene.warnings.push(format!("{at}: a material library is left out: {e}")),
        }
    }
    if found.values().any(|m| m.has_texture) {
        scene.warnings.push(format!("{at}: the textures of its materials are left out"));
    }
    found
}

/// One shape for each material that the mesh uses.
fn add_pieces(
    scene: &mut SceneDescription,
    files: &Files,
    at: &Span,
    mesh: &Mesh,
    (materials, folder): &(obj::Materials, std::path::PathBuf),
) {
    let known = libraries(scene, files, at, &materials.libraries, folder);
    // Faces of each material, in the order of first use; those before the first have the empty name.
    let mut pieces: Vec<(&str, Vec<[u32; 3]>)> = Vec::new();
    let starts = std::iter::once((0, "")).chain(materials.uses.iter().map(|(first, name)| (*first, name.as_str())));
    let ends = materials.uses.iter().map(|(first, _)| *first).chain([mesh.faces.len()]);
    for ((start, name), end) in starts.zip(ends).filter(|((start, _), end)| end > start) {
        let faces = &mesh.faces[start..end];
        match pieces.iter_mut().find(|piece| piece.0 == name) {
            Some(piece) => piece.1.extend_from_slice(faces),
            None => pieces.push((name, faces.to_vec())),
        }
    }
    for (name, faces) in pieces {
        let material = known.get(name);
        if material.is_none() && !name.is_empty() && !known.is_empty() {
            scene.warnings.push(format!("{at}: no library has the material '{name}'; it is grey"));
        }
        let kind = material.map_or(BsdfKind::Diffuse { reflectance: Rgb::splat(GREY) }, |m| m.kind.clone());
        let bsdf = add_two_sided(scene, at, name, kind);
        let emission = material.and_then(|m| m.emission);
        let name = if name.is_empty() { "mesh" } else { name };
        scene.shapes.push(shape(at, name, Geometry::Mesh(Arc::new(part(mesh, faces))), bsdf, emission));
    }
}

/// Some faces of a mesh, with the vertices that they use.
fn part(mesh: &Mesh, mut faces: Vec<[u32; 3]>) -> Mesh {
    let mut new_index = vec![u32::MAX; mesh.positions.len()];
    let mut part = Mesh::default();
    for index in faces.iter_mut().flatten() {
        let old = *index as usize;
        if new_index[old] == u32::MAX {
            new_index[old] = part.positions.len() as u32;
            part.positions.push(mesh.positions[old]);
            part.normals.push(mesh.normals[old]);
        }
        *index = new_index[old];
    }
    part.faces = faces;
    part
}

/// Adds a bsdf that shows from both sides, as glass does anyway.
fn add_two_sided(scene: &mut SceneDescription, at: &Span, name: &str, kind: BsdfKind) -> BsdfId {
    let mut add = |kind: BsdfKind| {
        scene.bsdfs.push(Bsdf { at: at.clone(), name: name.into(), kind, varying: Vec::new() });
        BsdfId(scene.bsdfs.len() - 1)
    };
    let transmits = matches!(kind, BsdfKind::Dielectric { .. });
    let front = add(kind);
    if transmits { front } else { add(BsdfKind::TwoSided { front, back: front }) }
}

fn shape(at: &Span, name: &str, geometry: Geometry, bsdf: BsdfId, emission: Option<Rgb>) -> Shape {
    Shape {
        at: at.clone(),
        name: name.into(),
        geometry,
        to_world: DAffine3::IDENTITY,
        flip_normals: false,
        bsdf,
        emission: emission.map(Emission::uniform),
    }
}

/// Adds the floor, the lamp and the sky.
fn light(view: &View, scene: &mut SceneDescription, at: &Span) {
    let grey = add_two_sided(scene, at, "floor", BsdfKind::Diffuse { reflectance: Rgb::splat(FLOOR_GREY) });
    let black = add_two_sided(scene, at, "lamp", BsdfKind::Diffuse { reflectance: Rgb::BLACK });
    let mut floor = shape(at, "floor", Geometry::Rectangle, grey, None);
    let lying = DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y) * (FLOOR * view.radius);
    floor.to_world = DAffine3::from_mat3_translation(lying, DVec3 { y: view.floor - GAP * view.radius, ..view.centre });
    let (distance, radius, radiance) = LAMP;
    let centre = view.centre + framing::LAMP.normalize() * (distance * view.radius);
    let lamp = Geometry::Sphere { centre, radius: radius * view.radius, frame: DMat3::IDENTITY };
    scene.shapes.extend([floor, shape(at, "lamp", lamp, black, Some(radiance))]);
    scene.lights.push(Light { at: at.clone(), kind: LightKind::Constant { radiance: SKY } });
}
