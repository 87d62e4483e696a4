//! The texture coordinates of shapes with textured materials.

use super::geometry::world_cylinder;
use crate::description::{self, Geometry};
use crate::scene::space::ToScene;
use crate::shape::uv::{Quadric, UvField};
use glam::{DAffine3, DMat3, DVec3, Vec2};

/// The texture coordinates of the shape that was compiled from `described`.
pub(super) fn field(described: &description::Shape, to_scene: &ToScene) -> UvField {
    let world = &described.to_world;
    // The way from a quadric's own space, whose axes and origin these are in world space.
    let quadric = |kind, origin: DVec3, axes: DMat3| {
        let linear = axes * to_scene.unit;
        UvField::quadric(kind, DAffine3 { matrix3: linear, translation: to_scene.point(origin) })
    };
    match &described.geometry {
        Geometry::Mesh(mesh) if mesh.uvs.is_empty() => UvField::Barycentric,
        Geometry::Mesh(mesh) => UvField::Vertices(mesh.uvs.iter().map(|uv| uv.as_vec2()).collect()),
        Geometry::Rectangle => UvField::Vertices(vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]),
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
