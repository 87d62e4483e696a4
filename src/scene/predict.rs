//! How much memory compiling a description will take, told before it is done.
//!
//! The figures of what is stored follow from its types; what building takes beside that was measured (docs/hostile-input.md
//! compares). They are meant to be rather too large than too small.

use crate::accel::{Accel, Accelerator, Choice};
use crate::description::{Geometry, LightKind, Mesh, SceneDescription, Shape, TextureKind};
use crate::scene::compile::{CompileOptions, rays};
use crate::shape::placed::Placed;
use glam::{Vec2, Vec3, Vec4};
use std::collections::HashSet;
use std::sync::Arc;

/// The program, its threads and its tables.
const PROGRAM: u64 = 24 << 20;

/// A shape beside its mesh: description, material, name, place in the accelerator's tables.
const PER_SHAPE: u64 = 1 << 10;

/// A shape of an instance, likewise.
const PER_PLACED: u64 = size_of::<Placed>() as u64 + 512;

/// A triangle that emits: its place in tables of areas and powers.
const PER_EMITTING_TRIANGLE: u64 = 64;

/// A pixel of an environment map beside the description's: nodes, cells and the tables that are made of them.
const PER_SKY_PIXEL: u64 = 96;

/// Tables for directions of surfaces under an environment map.
const PER_SKY: u64 = 4 << 20;

/// What a scene will take, in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Prediction {
    /// The program itself.
    pub program: u64,
    /// The description: meshes in double precision, and what stands around them.
    pub description: u64,
    /// Pictures, of textures and of skies.
    pub pictures: u64,
    /// Compiled shapes and lights.
    pub compiled: u64,
    /// The accelerator while it is built.
    pub accelerator: u64,
    /// The sums of the pixels, and what is kept beside them.
    pub film: u64,
}

impl Prediction {
    /// All together.
    pub fn total(&self) -> u64 {
        let parts = [self.program, self.description, self.pictures, self.compiled, self.accelerator, self.film];
        parts.into_iter().fold(0, u64::saturating_add)
    }
}

/// What `description` will take, its film left out.
pub fn predict(description: &SceneDescription, options: &CompileOptions) -> Prediction {
    let groups: Vec<&Shape> = description.groups.iter().flat_map(|g| &g.shapes).collect();
    let own = triangles(description.shapes.iter());
    let in_groups = triangles(groups.iter().copied());
    let placed: u64 = description
        .instances
        .iter()
        .filter_map(|i| description.groups.get(i.group.0))
        .map(|group| group.shapes.len() as u64)
        .fold(0, u64::saturating_add);
    let choice = Choice::for_triangles(options.accelerator, options.quality, own as usize, rays(description, options));
    let shapes = (description.shapes.len() + groups.len()) as u64;
    let emitting = triangles(description.shapes.iter().chain(groups.iter().copied()).filter(|s| s.emission.is_some()));
    let stored: u64 = description.shapes.iter().chain(groups.iter().copied()).map(compiled_bytes).sum();
    let skies = sky_pixels(description);
    let sum = |parts: [u64; 5]| parts.into_iter().fold(0, u64::saturating_add);
    Prediction {
        program: PROGRAM,
        description: meshes(description).iter().map(|mesh| mesh.memory_bytes()).sum(),
        pictures: pictures(description) + skies.iter().map(|pixels| pixels * size_of::<Vec3>() as u64).sum::<u64>(),
        compiled: sum([
            stored,
            shapes * PER_SHAPE,
            placed.saturating_mul(PER_PLACED),
            emitting * PER_EMITTING_TRIANGLE,
            skies.iter().map(|pixels| pixels * PER_SKY_PIXEL + PER_SKY).sum(),
        ]),
        // Groups have trees of ours, with all care.
        accelerator: own * Accel::bytes_per_triangle(choice.accelerator, choice.quality)
            + in_groups * Accel::bytes_per_triangle(Accelerator::Native, choice.quality),
        film: 0,
    }
}

fn triangles<'a>(shapes: impl Iterator<Item = &'a Shape>) -> u64 {
    let of = |shape: &Shape| match &shape.geometry {
        Geometry::Mesh(mesh) => mesh.faces.len() as u64,
        Geometry::Rectangle => 2,
        // Primitives of another tree.
        _ => 1,
    };
    shapes.map(of).sum()
}

/// Every mesh, once.
fn meshes(description: &SceneDescription) -> Vec<&Mesh> {
    let (mut seen, mut found) = (HashSet::new(), Vec::new());
    for shape in description.shapes.iter().chain(description.groups.iter().flat_map(|g| &g.shapes)) {
        if let Geometry::Mesh(mesh) = &shape.geometry
            && seen.insert(Arc::as_ptr(mesh))
        {
            found.push(&**mesh);
        }
    }
    found
}

/// What a shape's mesh takes in the compiled scene, where each shape has its own.
fn compiled_bytes(shape: &Shape) -> u64 {
    let Geometry::Mesh(mesh) = &shape.geometry else { return 0 };
    let of = |count: usize, bytes: usize| (count * bytes) as u64;
    let attributes: u64 = mesh.attributes.iter().map(|a| of(a.values.len(), size_of::<f32>())).sum();
    // Positions, normals, and a plane for each face.
    of(mesh.positions.len() + mesh.normals.len(), size_of::<Vec3>())
        + of(mesh.faces.len(), size_of::<[u32; 3]>() + size_of::<Vec4>())
        + of(mesh.uvs.len() + mesh.more_uvs.iter().map(Vec::len).sum::<usize>(), size_of::<Vec2>())
        + of(mesh.tangents.len(), size_of::<Vec4>())
        + attributes
}

/// Bytes of the pictures of textures, each once.
fn pictures(description: &SceneDescription) -> u64 {
    let mut seen = HashSet::new();
    let of = |kind: &TextureKind| match kind {
        TextureKind::Bitmap { image, .. } if seen.insert(Arc::as_ptr(image)) => image.memory_bytes(),
        _ => 0,
    };
    description.textures.iter().map(|texture| &texture.kind).map(of).sum()
}

/// Pixels of each environment map.
fn sky_pixels(description: &SceneDescription) -> Vec<u64> {
    let of = |kind: &LightKind| match kind {
        LightKind::Environment { map, .. } => Some(map.pixels().len() as u64),
        _ => None,
    };
    description.lights.iter().filter_map(|light| of(&light.kind)).collect()
}
