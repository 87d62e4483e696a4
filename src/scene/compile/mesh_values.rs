//! What meshes give textures beside their first set of texture coordinates: only what a texture asks for.

use super::textures::attribute_names;
use crate::description::{self, Geometry, Mesh, SceneDescription, TextureKind};
use crate::error::{Error, Result};
use crate::shape::{Shape, TriangleMesh};
use crate::texture::{Attribute, MeshValues};
use std::collections::HashMap;
use std::sync::Arc;

/// Makes them; shapes that share a mesh share its values, if they ask for the same.
pub(super) struct Makers<'a> {
    description: &'a SceneDescription,
    /// The scene's attributes.
    names: Vec<&'a str>,
    made: HashMap<(*const Mesh, Vec<usize>), Arc<MeshValues>>,
}

impl<'a> Makers<'a> {
    pub(super) fn new(description: &'a SceneDescription) -> Self {
        Self { description, names: attribute_names(description), made: HashMap::new() }
    }

    /// What the textures of `described` ask of its mesh; `None` if nothing. `shape` is what was compiled from it.
    pub(super) fn of(&mut self, described: &description::Shape, shape: &Shape) -> Result<Option<Arc<MeshValues>>> {
        let mut asked: Vec<usize> = self.description.textures_of(described).into_iter().map(|id| id.0).collect();
        asked.retain(|&id| {
            let texture = &self.description.textures[id];
            texture.uv_set > 0 || matches!(texture.kind, TextureKind::Attribute { .. })
        });
        if asked.is_empty() {
            return Ok(None);
        }
        let (Geometry::Mesh(file), Some(mesh)) = (&described.geometry, compiled_mesh(shape)) else {
            let message = format!("'{}' is no mesh, but a texture asks for what only a mesh has", described.name);
            return Err(Error::scene(&described.at, message));
        };
        let key = (Arc::as_ptr(file), asked);
        if let Some(made) = self.made.get(&key) {
            return Ok(Some(made.clone()));
        }
        let made = Arc::new(self.values(described, file, mesh, &key.1)?);
        self.made.insert(key, made.clone());
        Ok(Some(made))
    }

    fn values(
        &self,
        described: &description::Shape,
        file: &Mesh,
        mesh: &TriangleMesh,
        asked: &[usize],
    ) -> Result<MeshValues> {
        let fail = |message: String| Err(Error::scene(&described.at, message));
        let mut values = MeshValues::default();
        for &id in asked {
            let texture = &self.description.textures[id];
            let set = texture.uv_set as usize;
            if set > 0 {
                values.uvs.resize(values.uvs.len().max(set), Vec::new());
                let Some(uvs) = file.more_uvs.get(set - 1).filter(|uvs| uvs.len() == file.positions.len()) else {
                    return fail(format!("'{}' has no texture coordinates of set {set}", described.name));
                };
                values.uvs[set - 1] = uvs.iter().map(|uv| uv.as_vec2()).collect();
            }
            if let TextureKind::Attribute { name, .. } = &texture.kind {
                let Some(attribute) = file.attributes.iter().find(|a| a.name == *name) else {
                    let has: Vec<String> = file.attributes.iter().map(|a| format!("'{}'", a.name)).collect();
                    let has = if has.is_empty() { "none".into() } else { has.join(", ") };
                    return fail(format!(
                        "'{}' has no attribute '{name}' that a texture asks for ({has})",
                        described.name
                    ));
                };
                values.attributes.resize(self.names.len(), None);
                let place = self.names.iter().position(|n| n == name).unwrap_or_default();
                values.attributes[place] = Some(compiled(attribute, file, mesh));
            }
        }
        Ok(values)
    }
}

fn compiled_mesh(shape: &Shape) -> Option<&TriangleMesh> {
    match shape {
        Shape::Mesh(mesh) => Some(mesh),
        Shape::Placed(placed) => compiled_mesh(placed.shape()),
        _ => None,
    }
}

/// The attribute, of the faces that were kept.
fn compiled(attribute: &description::Attribute, file: &Mesh, mesh: &TriangleMesh) -> Attribute {
    let description::Attribute { of_faces, width, .. } = *attribute;
    let values = match of_faces && mesh.faces.len() < file.faces.len() {
        false => attribute.values.clone(),
        true => {
            let mut kept = mesh.faces.iter().peekable();
            let rows = file.faces.iter().zip(attribute.values.chunks_exact(width));
            // In order; of equal faces either all were dropped or none.
            rows.filter(|(face, _)| kept.next_if_eq(face).is_some()).flat_map(|(_, row)| row.iter().copied()).collect()
        }
    };
    Attribute { of_faces, width, values }
}
