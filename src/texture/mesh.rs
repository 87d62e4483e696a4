//! What a mesh gives textures beside its first set of texture coordinates: further sets, and numbers of its own.

use glam::{Vec2, Vec4};

/// What one mesh gives.
#[derive(Clone, Debug, Default)]
pub struct MeshValues {
    /// Texture coordinates of set 1 and further ones, each one a vertex, or none if no texture lies there.
    pub uvs: Vec<Vec<Vec2>>,
    /// The scene's attributes, as far as the mesh has them; a [`super::TextureKind::Attribute`] knows which it asks.
    pub attributes: Vec<Option<Attribute>>,
}

/// Numbers of each vertex or face: a grey, or a linear colour, or that and an opacity.
#[derive(Clone, Debug)]
pub struct Attribute {
    /// Whether there is one value a face; otherwise one a vertex.
    pub of_faces: bool,
    /// How many numbers a value has: 1, 3 or 4.
    pub width: usize,
    /// The values, one after the other.
    pub values: Vec<f32>,
}

/// A point of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct MeshPoint<'a> {
    /// What the mesh gives.
    pub values: &'a MeshValues,
    /// The face that it is on.
    pub face: u32,
    /// The vertices of that.
    pub corners: [u32; 3],
    /// Barycentric coordinates: how much each of them counts.
    pub weights: [f32; 3],
}

impl Attribute {
    /// A value as a colour and its opacity.
    fn value(&self, index: u32) -> Vec4 {
        let from = index as usize * self.width;
        match self.values[from..from + self.width] {
            [grey] => Vec4::new(grey, grey, grey, 1.0),
            [r, g, b] => Vec4::new(r, g, b, 1.0),
            [r, g, b, a] => Vec4::new(r, g, b, a),
            _ => Vec4::ZERO,
        }
    }
}

impl MeshPoint<'_> {
    /// Texture coordinates of a set beside the first; zero where the mesh has no such set.
    pub(super) fn uv(&self, set: u32) -> Vec2 {
        let Some(uvs) = self.values.uvs.get(set as usize - 1).filter(|uvs| !uvs.is_empty()) else { return Vec2::ZERO };
        let [a, b, c] = self.corners.map(|i| uvs[i as usize]);
        a + (b - a) * self.weights[1] + (c - a) * self.weights[2]
    }

    /// An attribute's colour and opacity: of the face, or interpolated between vertices; zero where the mesh has none.
    pub(super) fn attribute(&self, index: u32) -> Vec4 {
        let Some(Some(attribute)) = self.values.attributes.get(index as usize) else { return Vec4::ZERO };
        if attribute.of_faces {
            return attribute.value(self.face);
        }
        // Relative to a corner, so that what is the same at all corners is the same between them.
        let [a, b, c] = self.corners.map(|i| attribute.value(i));
        a + (b - a) * self.weights[1] + (c - a) * self.weights[2]
    }
}
