//! The tangents of shapes with anisotropic bsdfs.

use crate::description::{self, Geometry};
use crate::math::frame::Frame;
use crate::shape::placed::Group;
use crate::shape::tangent::TangentField;
use crate::shape::{Shape, TriangleMesh};
use glam::{DVec2, DVec3, Vec3};
use std::collections::HashMap;
use std::sync::Arc;

/// Makes fields, those of the shapes of groups once.
#[derive(Default)]
pub(super) struct Fields {
    of_groups: HashMap<(*const Group, u32), Arc<TangentField>>,
}

impl Fields {
    /// The directions of ∂p/∂u on `shape`, which was compiled from `described`.
    pub(super) fn of(&mut self, described: &description::Shape, shape: &Shape) -> TangentField {
        let Shape::Placed(placed) = shape else { return field(described, shape) };
        let id = (Arc::as_ptr(&placed.group), placed.index);
        let inner = self.of_groups.entry(id).or_insert_with(|| Arc::new(field(described, placed.shape())));
        TangentField::Placed(inner.clone(), placed.clone())
    }
}

fn field(described: &description::Shape, shape: &Shape) -> TangentField {
    let world = |v: DVec3| (described.to_world.matrix3 * v).normalize_or_zero().as_vec3();
    match (&described.geometry, shape) {
        (Geometry::Rectangle, _) => TangentField::Constant(world(DVec3::X)),
        (&Geometry::Sphere { frame, .. }, _) => TangentField::Around(world(frame.z_axis)),
        (Geometry::Disk, Shape::Disk(disk)) => TangentField::Affine(disk.radii()),
        (Geometry::Cylinder { .. }, Shape::Cylinder(cylinder)) => TangentField::Affine(cylinder.circles()),
        (Geometry::Mesh(file), Shape::Mesh(mesh)) => {
            let faces = 0..mesh.faces.len() as u32;
            TangentField::Faces(faces.map(|face| face_tangent(mesh, &file.uvs, face)).collect())
        }
        // Nothing is compiled to anything else; zero is any direction.
        (Geometry::Mesh(_) | Geometry::Disk | Geometry::Cylinder { .. }, _) => TangentField::Constant(Vec3::ZERO),
    }
}

/// Vector along ∂p/∂u of a triangle. As in Mitsuba, u is the barycentric coordinate of the second vertex where the mesh has
/// no texture coordinates, and the tangent is an arbitrary one where position is no function of those that it has.
fn face_tangent(mesh: &TriangleMesh, uvs: &[DVec2], face: u32) -> Vec3 {
    let [a, b, c] = mesh.triangle(face).map(|v| v.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    if uvs.is_empty() {
        return e1.normalize_or_zero().as_vec3();
    }
    let [ua, ub, uc] = mesh.faces[face as usize].map(|i| uvs[i as usize]);
    let (d1, d2) = (ub - ua, uc - ua);
    if d1.perp_dot(d2) == 0.0 {
        return Frame::from_normal(e1.cross(e2).normalize_or(DVec3::Z).as_vec3()).s;
    }
    // Cramer's rule for the two equations ∂p/∂u·du + ∂p/∂v·dv = dp of the edges; the sign does not matter.
    (e1 * d2.y - e2 * d1.y).normalize_or_zero().as_vec3()
}
