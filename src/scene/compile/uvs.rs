//! The texture coordinates of shapes with textured materials.

use super::geometry::world_cylinder;
use crate::description::{self, Geometry};
use crate::scene::space::ToScene;
use crate::shape::Shape;
use crate::shape::placed::Group;
use crate::shape::uv::{Quadric, UvField};
use glam::{DAffine3, DMat3, DVec3, DVec4, Vec2, Vec4};
use std::collections::HashMap;
use std::sync::Arc;

/// Makes fields, those of the shapes of groups once.
#[derive(Default)]
pub(super) struct Fields {
    of_groups: HashMap<(*const Group, u32), Arc<UvField>>,
}

impl Fields {
    /// The texture coordinates of `shape`, which was compiled from `described` by `space`.
    pub(super) fn of(&mut self, described: &description::Shape, shape: &Shape, space: &ToScene) -> UvField {
        let Shape::Placed(placed) = shape else { return field(described, space) };
        let id = (Arc::as_ptr(&placed.group), placed.index);
        let inner = self.of_groups.entry(id).or_insert_with(|| Arc::new(field(described, space)));
        UvField::Placed(inner.clone(), placed.clone())
    }
}

/// A tangent of a file in the compiled scene: a unit vector, and the side on which the bitangent then is. A bitangent moves
/// with the surface, while n×t turns round where the map mirrors, or where the normal is flipped.
fn tangent(t: DVec4, described: &description::Shape) -> Vec4 {
    let map = described.to_world.matrix3;
    let turned = (map.determinant() < 0.0) != described.flip_normals;
    let along = (map * t.truncate()).normalize_or_zero();
    along.extend(if (t.w < 0.0) != turned { -1.0 } else { 1.0 }).as_vec4()
}

fn field(described: &description::Shape, to_scene: &ToScene) -> UvField {
    let world = &described.to_world;
    // The way from a quadric's own space, whose axes and origin these are in world space.
    let quadric = |kind, origin: DVec3, axes: DMat3| {
        let linear = axes * to_scene.unit;
        UvField::quadric(kind, DAffine3 { matrix3: linear, translation: to_scene.point(origin) })
    };
    match &described.geometry {
        Geometry::Mesh(mesh) => UvField::Mesh {
            uvs: mesh.uvs.iter().map(|uv| uv.as_vec2()).collect(),
            tangents: mesh.tangents.iter().map(|&t| tangent(t, described)).collect(),
        },
        Geometry::Rectangle => {
            UvField::Mesh { uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y], tangents: Vec::new() }
        }
        Geometry::Disk => quadric(Quadric::Disk, world.translation, world.matrix3),
        &Geometry::Sphere { centre, radius, frame } => {
            quadric(Quadric::Sphere, world.transform_point3(centre), world.matrix3 * frame * radius)
        }
        Geometry::Cylinder { .. } => {
            let (base, [u, v, h]) = world_cylinder(described);
            quadric(Quadric::Cylinder, base, DMat3::from_cols(u, v, h))
        }
    }
}
