//! A primitive of a mesh, as triangles.

use super::accessors::Purpose;
use super::deform::{self, Pose};
use super::model::Model;
use super::tangents;
use crate::description::{Attribute, Mesh};
use crate::error::Result;
use glam::{DVec2, DVec3, DVec4};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

/// The name of the attribute that vertex colours are.
pub(super) const COLOR: &str = "color";

/// What a material asks of a mesh.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Wanted {
    /// The sets of texture coordinates, in the order that they have in the mesh.
    pub(super) sets: Vec<u32>,
    /// Vertex colours.
    pub(super) colors: bool,
    /// Tangents, by the set of this place in `sets`.
    pub(super) tangents: Option<usize>,
}

/// The accessor of an attribute.
pub(super) fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<usize> {
    primitive.attributes.get(&Checked::Valid(semantic)).map(|accessor| accessor.value())
}

/// Reads a primitive; `None` where it is nothing that has a surface. `mirrored`: its place turns it inside out.
pub(super) fn read(
    model: &Model,
    primitive: &Primitive,
    place: &str,
    wanted: &Wanted,
    pose: &Pose,
    mirrored: bool,
) -> Result<Option<Mesh>> {
    if !has_surface(model, primitive, place)? {
        return Ok(None);
    }
    let Some(positions) = attribute(primitive, Semantic::Positions) else {
        model.warn(place, "it has no POSITION: it is left out");
        return Ok(None);
    };
    let positions = vectors(model, positions, &format!("{place}.attributes.POSITION"))?;
    let faces = faces(model, primitive, place, positions.len())?;
    if faces.is_empty() {
        model.warn(place, "it has no triangles: it is left out");
        return Ok(None);
    }
    let mut mesh = Mesh { positions, faces, ..Mesh::default() };
    let vertices = mesh.positions.len();
    let same_count = |name: &str, accessor: usize| -> Result<String> {
        let place = format!("{place}.attributes.{name}");
        let count = model.count(accessor, &place)?;
        if count == vertices {
            return Ok(place);
        }
        Err(model.error(&place, format!("it is of {count} vertices, but POSITION of {vertices}")))
    };
    if let Some(accessor) = attribute(primitive, Semantic::Normals) {
        mesh.normals = vectors(model, accessor, &same_count("NORMAL", accessor)?)?;
    }
    // Without normals tangents do not count either (specification, section 3.7.2.1).
    let given = attribute(primitive, Semantic::Tangents).filter(|_| !mesh.normals.is_empty());
    if let (Some(accessor), Some(_)) = (given, wanted.tangents) {
        let given: Vec<[f64; 4]> = model.numbers(accessor, &same_count("TANGENT", accessor)?, Purpose::Measures)?;
        let side = |w: f64| if w < 0.0 { -1.0 } else { 1.0 };
        mesh.tangents = given.into_iter().map(|[x, y, z, w]| DVec4::new(x, y, z, side(w))).collect();
    }
    for (slot, &set) in wanted.sets.iter().enumerate() {
        let uvs = match attribute(primitive, Semantic::TexCoords(set)) {
            Some(accessor) => {
                let place = same_count(&format!("TEXCOORD_{set}"), accessor)?;
                let uvs: Vec<[f64; 2]> = model.numbers(accessor, &place, Purpose::Measures)?;
                uvs.into_iter().map(DVec2::from_array).collect()
            }
            // Asked for by the user alone, and not for tangents: then they are those of a mesh without any.
            None if model.wants_uvs && wanted.sets.len() == 1 && wanted.tangents.is_none() => continue,
            None => {
                model.warn(place, format!("its material asks for TEXCOORD_{set}, which it lacks; it is taken as 0"));
                vec![DVec2::ZERO; vertices]
            }
        };
        if slot == 0 { mesh.uvs = uvs } else { mesh.more_uvs.push(uvs) }
    }
    if let Some(accessor) = attribute(primitive, Semantic::Colors(0)).filter(|_| wanted.colors) {
        mesh.attributes.push(colors(model, accessor, &same_count("COLOR_0", accessor)?)?);
    }
    deform::bend(model, primitive, place, pose, &mut mesh)?;
    if mirrored {
        mesh.faces.iter_mut().for_each(|face| face.swap(1, 2));
    }
    mesh = compact(mesh);
    if let (Some(set), true) = (wanted.tangents, mesh.tangents.is_empty()) {
        mesh = tangents::generate(mesh, set);
    }
    Ok(Some(mesh))
}

fn vectors(model: &Model, accessor: usize, place: &str) -> Result<Vec<DVec3>> {
    Ok(model.numbers(accessor, place, Purpose::Measures)?.into_iter().map(DVec3::from_array).collect())
}

/// Vertex colours, which the specification limits to [0, 1].
fn colors(model: &Model, accessor: usize, place: &str) -> Result<Attribute> {
    let clamped = |v: f64| v.clamp(0.0, 1.0) as f32;
    let width = model.width(accessor, place)?;
    let values = if width == 4 {
        model.numbers::<4>(accessor, place, Purpose::Measures)?.into_flattened()
    } else {
        model.numbers::<3>(accessor, place, Purpose::Measures)?.into_flattened()
    };
    Ok(Attribute { name: COLOR.into(), of_faces: false, width, values: values.into_iter().map(clamped).collect() })
}

/// Whether it is made of triangles.
fn has_surface(model: &Model, primitive: &Primitive, place: &str) -> Result<bool> {
    match primitive.mode {
        Checked::Invalid => Err(model.error(place, "its mode is not one from 0 to 6")),
        Checked::Valid(Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) => Ok(true),
        Checked::Valid(_) => {
            model.warn(place, "points and lines have no surface: it is left out");
            Ok(false)
        }
    }
}

/// The triangles of a primitive, with checked indices.
fn faces(model: &Model, primitive: &Primitive, place: &str, vertices: usize) -> Result<Vec<[u32; 3]>> {
    let corners = match primitive.indices {
        Some(accessor) => {
            let place = format!("{place}.indices");
            let indices: Vec<[f64; 1]> = model.numbers(accessor.value(), &place, Purpose::Indices)?;
            if let Some([index]) = indices.iter().find(|[index]| *index >= vertices as f64) {
                return Err(model.error(&place, format!("there is no vertex {index}; it has {vertices}")));
            }
            indices.into_iter().map(|[index]| index as u32).collect()
        }
        None => (0..vertices as u32).collect::<Vec<_>>(),
    };
    let Checked::Valid(mode) = primitive.mode else { return Ok(Vec::new()) };
    if mode == Mode::Triangles && !corners.len().is_multiple_of(3) {
        return Err(model.error(place, format!("{} corners are no whole number of triangles", corners.len())));
    }
    Ok(triangles(mode, &corners))
}

/// Triangles as section 3.7.2.1 of the specification makes them.
fn triangles(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    let windows = corners.windows(3);
    let flat = |f: &[u32; 3]| f[0] == f[1] || f[1] == f[2] || f[2] == f[0];
    match mode {
        Mode::TriangleStrip => windows
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .filter(|f| !flat(f))
            .collect(),
        Mode::TriangleFan => windows.map(|w| [w[1], w[2], corners[0]]).filter(|f| !flat(f)).collect(),
        _ => corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}

/// Without the vertices that no face uses: primitives often share a list of them.
fn compact(mut mesh: Mesh) -> Mesh {
    const UNUSED: u32 = u32::MAX;
    let mut numbers = vec![UNUSED; mesh.positions.len()];
    mesh.faces.iter().flatten().for_each(|&index| numbers[index as usize] = 0);
    let used: Vec<u32> = (0..numbers.len() as u32).filter(|&index| numbers[index as usize] != UNUSED).collect();
    if used.len() == numbers.len() {
        return mesh;
    }
    (0u32..).zip(&used).for_each(|(new, &old)| numbers[old as usize] = new);
    mesh.faces.iter_mut().flatten().for_each(|index| *index = numbers[*index as usize]);
    tangents::pick(mesh, &used)
}
