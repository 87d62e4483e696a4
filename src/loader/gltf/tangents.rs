//! Tangents where a file gives none: MikkTSpace (Mikkelsen 2008, *Simulation of Wrinkled Surfaces Revisited*), as the
//! specification asks for, which gives them to corners of faces rather than to vertices.

use crate::description::{Attribute, Mesh};
use bevy_mikktspace::{Geometry, Ops, TangentSpace, generate_tangents};
use glam::{DVec2, DVec3, DVec4};
use std::collections::HashMap;

/// A mesh as MikkTSpace asks for it.
struct Corners<'a> {
    mesh: &'a Mesh,
    uvs: &'a [DVec2],
    /// A power of two that brings coordinates near one, where squares neither vanish nor overflow.
    scale: f64,
    /// The answers, three a face.
    tangents: Vec<DVec4>,
}

/// The functions that it needs, the same on every machine.
struct Libm;

impl Ops for Libm {
    fn sqrt(x: f32) -> f32 {
        libm::sqrtf(x)
    }

    fn acos(x: f32) -> f32 {
        libm::acos(f64::from(x)) as f32
    }
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.faces[face][corner] as usize
    }
}

impl Geometry<Libm> for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.faces.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        (self.mesh.positions[self.vertex(face, corner)] * self.scale).as_vec3().to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        let normal = match self.mesh.normals.get(self.vertex(face, corner)) {
            Some(normal) => normal.normalize_or_zero(),
            None => flat_normal(self.mesh, face),
        };
        normal.as_vec3().to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.uvs[self.vertex(face, corner)].as_vec2().to_array()
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        // It takes v to run up, but in glTF it runs down: its bitangent is against the green channel's direction.
        let [x, y, z, w] = space.unwrap_or_default().tangent_encoded().map(f64::from);
        self.tangents[3 * face + corner] = DVec4::new(x, y, z, -w);
    }
}

fn flat_normal(mesh: &Mesh, face: usize) -> DVec3 {
    let [a, b, c] = mesh.faces[face].map(|i| mesh.positions[i as usize]);
    (b - a).cross(c - a).normalize_or_zero()
}

/// Gives tangents to a mesh by one of its sets of texture coordinates, and splits vertices whose faces differ in theirs.
pub(super) fn generate(mesh: Mesh, set: usize) -> Mesh {
    let uvs = if set == 0 { &mesh.uvs } else { &mesh.more_uvs[set - 1] };
    let reach = mesh.positions.iter().fold(0.0, |reach: f64, p| reach.max(p.abs().max_element()));
    let scale = libm::ldexp(1.0, if reach > 0.0 { -libm::frexp(reach).1 } else { 0 });
    let fits = |v: &DVec2| v.as_vec2().is_finite();
    if !uvs.iter().all(fits) || !scale.is_finite() {
        return mesh;
    }
    let tangents = vec![DVec4::ZERO; 3 * mesh.faces.len()];
    let mut corners = Corners { mesh: &mesh, uvs, scale, tangents };
    let Ok(()) = generate_tangents(&mut corners) else { return mesh };
    let tangents = corners.tangents;
    split(mesh, &tangents)
}

/// One vertex for each pair of a vertex and a tangent at one of its corners.
fn split(mut mesh: Mesh, tangents: &[DVec4]) -> Mesh {
    let mut numbers: HashMap<(u32, [u64; 4]), u32> = HashMap::new();
    let (mut origins, mut own) = (Vec::new(), Vec::new());
    for (index, &tangent) in mesh.faces.iter_mut().flatten().zip(tangents) {
        let key = (*index, tangent.to_array().map(f64::to_bits));
        *index = *numbers.entry(key).or_insert_with(|| {
            origins.push(key.0);
            own.push(tangent);
            (origins.len() - 1) as u32
        });
    }
    Mesh { tangents: own, ..pick(mesh, &origins) }
}

/// A mesh of the vertices with these numbers, in that order. Its faces are left as they are.
pub(super) fn pick(mesh: Mesh, origins: &[u32]) -> Mesh {
    fn picked<T: Copy>(all: &[T], origins: &[u32]) -> Vec<T> {
        if all.is_empty() { Vec::new() } else { origins.iter().map(|&i| all[i as usize]).collect() }
    }
    let attribute = |a: &Attribute| {
        let values = origins.iter().flat_map(|&i| &a.values[i as usize * a.width..][..a.width]).copied().collect();
        Attribute { name: a.name.clone(), values, ..*a }
    };
    Mesh {
        positions: picked(&mesh.positions, origins),
        normals: picked(&mesh.normals, origins),
        uvs: picked(&mesh.uvs, origins),
        more_uvs: mesh.more_uvs.iter().map(|set| picked(set, origins)).collect(),
        tangents: picked(&mesh.tangents, origins),
        attributes: mesh.attributes.iter().map(attribute).collect(),
        faces: mesh.faces,
    }
}
