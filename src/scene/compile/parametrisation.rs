//! How texture coordinates lie on shapes.

use crate::description::{self, Geometry};
use crate::shape::uv::Parametrisation;
use glam::DVec3;

/// That of a shape. Which point of its equator a sphere counts from is not in the description: it is the one nearest to
/// the world's x axis (or its y axis, where the pole is along x).
pub(super) fn of(shape: &description::Shape) -> Parametrisation {
    match shape.geometry {
        Geometry::Rectangle => Parametrisation::Rectangle,
        Geometry::Sphere { axis, .. } => {
            let pole = (shape.to_world.matrix3 * axis).normalize_or(DVec3::Z);
            // Either is far enough from the pole.
            let near = if pole.x.abs() < pole.y.abs().max(pole.z.abs()) { DVec3::X } else { DVec3::Y };
            Parametrisation::Sphere { pole, zero: (near - pole * near.dot(pole)).normalize() }
        }
        Geometry::Mesh(_) | Geometry::Disk | Geometry::Cylinder { .. } => Parametrisation::Own,
    }
}
