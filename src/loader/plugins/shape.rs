//! Shapes.

use super::emitter::{emission, is_textured};
use super::find;
use crate::description::{Geometry, Mesh, Shape};
use crate::error::{Error, Result};
use crate::loader::build::Builder;
use crate::loader::document::{Category, ObjectId};
use crate::loader::params::Params;
use crate::loader::{cube, normals, obj, ply, serialized};
use glam::{DAffine3, DMat3, DVec3};
use std::path::{Path, PathBuf};
use std::sync::Arc;

type ShapeFn = fn(&mut Builder<'_>, &Params<'_>) -> Result<Made>;

/// The supported shape plugins, beside `shapegroup` and `instance` ([`super::group`]).
const SHAPES: &[(&str, ShapeFn)] = &[
    ("cube", cube),
    ("cylinder", cylinder),
    ("disk", disk),
    ("obj", obj_mesh),
    ("ply", ply_mesh),
    ("rectangle", rectangle),
    ("serialized", serialized_mesh),
    ("sphere", sphere),
];

/// Largest relative difference between the scales of the axes at which a sphere is still a sphere.
const SPHERE_TOLERANCE: f64 = 1e-3;

/// The part of a shape that its plugin makes.
struct Made {
    geometry: Geometry,
    to_world: DAffine3,
    flip: bool,
    /// The mesh file, if there is one.
    file: Option<String>,
}

/// A format of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Format {
    Obj,
    Ply,
    /// With the number of the mesh in the file.
    Serialized(u32),
}

/// What meshes must agree in to be read once.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct MeshKey {
    path: PathBuf,
    format: Format,
    face_normals: bool,
    uvs: bool,
    attributes: bool,
    flip_uvs: bool,
    /// Bits of the linear part of the transformation where the computed normals depend on it.
    linear: Option<[u64; 9]>,
}

/// A shape of the scene.
pub(crate) fn shape(b: &mut Builder<'_>, id: ObjectId) -> Result<Shape> {
    let p = Params::new(b.document, id);
    let make = find(b.document, id, SHAPES)?;
    let emission = match p.child(Category::Emitter)? {
        Some((emitter, at)) => Some(emission(b, emitter, at)?),
        None => None,
    };
    let bsdf = match p.child(Category::Bsdf)? {
        Some((bsdf, _)) => b.bsdf(bsdf)?,
        None => b.default_bsdf(&p, emission.is_some()),
    };
    let flip_normals = p.boolean("flip_normals", false)?;
    // Every shape of Mitsuba has these; they do nothing for those that are not meshes.
    p.accept(&["face_normals", "silhouette_sampling_weight"]);
    let made = make(b, &p)?;
    let file_name = made.file.as_deref().and_then(|f| Path::new(f).file_name()).map(|f| f.to_string_lossy().into());
    let name = match &p.object.id {
        id if !id.is_empty() => id.clone(),
        _ => file_name.unwrap_or_else(|| p.object.plugin.clone()),
    };
    let flip_normals = flip_normals != made.flip;
    let shape =
        Shape { at: p.span(), name, geometry: made.geometry, to_world: made.to_world, flip_normals, bsdf, emission };
    p.finish(b)?;
    Ok(shape)
}

pub(super) fn to_world(p: &Params<'_>) -> Result<DAffine3> {
    let m = p.transform("to_world")?.unwrap_or(DAffine3::IDENTITY);
    let determinant = m.matrix3.determinant();
    if determinant == 0.0 || !determinant.is_finite() || !m.inverse().is_finite() {
        return Err(p.error("to_world", "the transformation of a shape must be invertible"));
    }
    Ok(m)
}

/// The normal of a mirrored rectangle is what the inverse transpose makes of +z.
fn rectangle(_: &mut Builder<'_>, p: &Params<'_>) -> Result<Made> {
    p.accept(&["flip_tex_coords"]);
    Ok(Made { geometry: Geometry::Rectangle, to_world: to_world(p)?, flip: false, file: None })
}

/// The cube [−1, 1]³. Its normals point outwards however it is transformed.
fn cube(_: &mut Builder<'_>, p: &Params<'_>) -> Result<Made> {
    let to_world = to_world(p)?;
    p.accept(&["flip_tex_coords"]);
    // Where faces come mirrored, their corners must be turned round for their normals to agree with the corners'.
    let mirrored = to_world.matrix3.determinant() < 0.0;
    Ok(Made { geometry: Geometry::Mesh(Arc::new(cube::mesh(mirrored))), to_world, flip: false, file: None })
}

fn disk(_: &mut Builder<'_>, p: &Params<'_>) -> Result<Made> {
    Ok(Made { geometry: Geometry::Disk, to_world: to_world(p)?, flip: false, file: None })
}

/// As in Mitsuba, the sign of the radius does not matter, and any invertible transformation may follow.
fn cylinder(_: &mut Builder<'_>, p: &Params<'_>) -> Result<Made> {
    let p0 = p.vector("p0")?.unwrap_or(DVec3::ZERO);
    let p1 = p.vector("p1")?.unwrap_or(DVec3::Z);
    let radius = p.float("radius")?.unwrap_or(1.0).abs();
    let to_world = to_world(p)?;
    if radius == 0.0 || !radius.is_finite() {
        return Err(p.error("radius", "the radius of a cylinder must be neither zero nor infinite"));
    }
    let length = (p1 - p0).length();
    if length == 0.0 || !length.is_finite() {
        return Err(p.error("p1", "the two ends of a cylinder must be different points"));
    }
    Ok(Made { geometry: Geometry::Cylinder { p0, p1, radius }, to_world, flip: false, file: None })
}

/// A sphere is brought to world space here: all that a transformation can do to it is to move, to scale, and, if it
/// mirrors, to turn it inside out.
fn sphere(_: &mut Builder<'_>, p: &Params<'_>) -> Result<Made> {
    let centre = p.vector("center")?.unwrap_or(DVec3::ZERO);
    let radius = p.float("radius")?.unwrap_or(1.0);
    let m = to_world(p)?;
    let linear = m.matrix3;
    let Some(scale) = uniform_scale(linear, SPHERE_TOLERANCE) else {
        return Err(p.error("to_world", "the transformation of a sphere must scale all axes alike and not shear"));
    };
    let radius = radius * scale * linear.determinant().signum();
    let centre = m.transform_point3(centre);
    if radius == 0.0 || !radius.is_finite() || !centre.is_finite() {
        return Err(p.error("radius", "the radius of a sphere must be neither zero nor infinite"));
    }
    let frame = linear * (1.0 / scale);
    let geometry = Geometry::Sphere { centre, radius: radius.abs(), frame };
    Ok(Made { geometry, to_world: DAffine3::IDENTITY, flip: radius < 0.0, file: None })
}

/// The factor by which a matrix scales every vector, if there is one.
fn uniform_scale(m: DMat3, tolerance: f64) -> Option<f64> {
    // The cube root of the volume, and what is left when it is divided out.
    let scale = libm::cbrt(m.determinant().abs());
    let rigid = m * (1.0 / scale);
    (rigid.transpose() * rigid).abs_diff_eq(DMat3::IDENTITY, tolerance).then_some(scale)
}

fn obj_mesh(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Made> {
    let flip_uvs = p.boolean("flip_tex_coords", true)?;
    mesh(b, p, Format::Obj, flip_uvs)
}

fn ply_mesh(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Made> {
    let flip_uvs = p.boolean("flip_tex_coords", false)?;
    mesh(b, p, Format::Ply, flip_uvs)
}

/// Mitsuba takes the texture coordinates of these files as they are.
fn serialized_mesh(b: &mut Builder<'_>, p: &Params<'_>) -> Result<Made> {
    let index = p.unsigned("shape_index", 0, 0)?;
    mesh(b, p, Format::Serialized(index), false)
}

fn mesh(b: &mut Builder<'_>, p: &Params<'_>, format: Format, flip_uvs: bool) -> Result<Made> {
    let file = p.required_text("filename")?;
    let face_normals = p.boolean("face_normals", false)?;
    let uvs = match p.child(Category::Bsdf)? {
        Some((bsdf, _)) => b.bsdf(bsdf).map(|id| b.needs_uvs(id))?,
        None => b.wants_uvs(),
    } || p.child(Category::Emitter)?.is_some_and(|(emitter, _)| is_textured(b, emitter));
    let attributes = b.wants_attributes();
    let to_world = to_world(p)?;
    let path = b.document.find_file(file, p.at("filename")).map_err(|m| p.error("filename", m))?;
    let canonical = b.document.files.identity(&path);
    let linear = normals::frame(to_world.matrix3);
    // A mesh that needs no normals of its own computing is the same in every frame, but that shows only once it is read.
    let key = |linear: DMat3| MeshKey {
        path: canonical.clone(),
        format,
        face_normals,
        uvs,
        attributes,
        flip_uvs,
        linear: (linear != DMat3::IDENTITY && !face_normals).then(|| linear.to_cols_array().map(f64::to_bits)),
    };
    let own = b.meshes.get(&key(linear)).or_else(|| b.meshes.get(&key(DMat3::IDENTITY)).filter(|m| m.has_own_normals));
    let loaded = match own {
        Some(loaded) => loaded.clone(),
        None => {
            let loaded = read(b, p, &key(linear), linear)?;
            let frame = if loaded.has_own_normals { DMat3::IDENTITY } else { linear };
            b.meshes.insert(key(frame), loaded.clone());
            loaded
        }
    };
    let name = match format {
        Format::Serialized(index) => format!("{file}@{index}"),
        Format::Obj | Format::Ply => file.into(),
    };
    Ok(Made { geometry: Geometry::Mesh(loaded.mesh), to_world, flip: false, file: Some(name) })
}

/// A mesh and whether its normals (or their absence) came from the file.
#[derive(Clone, Debug)]
pub(crate) struct LoadedMesh {
    mesh: Arc<Mesh>,
    has_own_normals: bool,
}

fn read(b: &mut Builder<'_>, p: &Params<'_>, key: &MeshKey, linear: DMat3) -> Result<LoadedMesh> {
    let (path, face_normals) = (&key.path, key.face_normals);
    let files = &b.document.files;
    let mesh = match key.format {
        Format::Obj => obj::read(files, path, key.uvs),
        Format::Ply => ply::read(files, path, ply::Wanted { uvs: key.uvs, attributes: key.attributes }),
        Format::Serialized(index) => serialized::read(files, path, index, key.uvs),
    };
    let mut mesh = mesh.map_err(|e| match e {
        Error::File { message, .. } => p.error("filename", format!("cannot read '{}': {message}", path.display())),
        other => other,
    })?;
    if mesh.normals.len() != mesh.positions.len() && !mesh.normals.is_empty() {
        b.warn(p.at("filename"), "some vertices of the mesh have no normal; all normals are computed");
        mesh.normals.clear();
    }
    if mesh.uvs.len() != mesh.positions.len() {
        mesh.uvs.clear();
    }
    if key.flip_uvs {
        mesh.uvs.iter_mut().for_each(|uv| uv.y = 1.0 - uv.y);
    }
    files
        .memory()
        .keep(mesh.memory_bytes())
        .map_err(|m| p.error("filename", format!("'{}': {}", path.display(), m)))?;
    let mut has_own_normals = true;
    if face_normals {
        mesh.normals = Vec::new();
    } else if mesh.normals.is_empty() {
        mesh.normals = normals::compute(&mesh.positions, &mesh.faces, linear);
        has_own_normals = false;
    }
    Ok(LoadedMesh { mesh: Arc::new(mesh), has_own_normals })
}
