//! Where the tangents of a surface point: along ∂p/∂u of its texture coordinates. Only anisotropic bsdfs ask.
//!
//! Conventions are Mitsuba's. Neither length nor sign matters: a microfacet distribution is symmetric in both.

use super::offset::SurfacePoint;
use super::placed::Placed;
use glam::{DAffine3, Vec3};
use std::sync::Arc;

/// The directions of ∂p/∂u on one shape, in the compiled scene's space.
#[derive(Clone, Debug)]
pub enum TangentField {
    /// The same all over the shape: a rectangle.
    Constant(Vec3),
    /// One for each face of a mesh.
    Faces(Vec<Vec3>),
    /// Around an axis: the circles of latitude of a sphere.
    Around(Vec3),
    /// An affine function of the point: away from the centre of a disk, or around a cylinder.
    Affine(DAffine3),
    /// That of a shape of a group, where the group is placed.
    Placed(Arc<Self>, Placed),
}

impl TangentField {
    /// A vector along ∂p/∂u at a point of `primitive`: neither unit nor orthogonal to the shading normal, and zero at the
    /// poles of a sphere and in the middle of a disk.
    #[inline]
    pub fn at(&self, primitive: u32, point: &SurfacePoint) -> Vec3 {
        match self {
            Self::Constant(s) => *s,
            Self::Faces(faces) => faces[primitive as usize],
            Self::Around(axis) => axis.cross(point.n),
            Self::Affine(map) => map.transform_point3(point.p).normalize_or_zero().as_vec3(),
            Self::Placed(field, placed) => placed.tangent(point, |point| field.at(primitive, point)),
        }
    }
}
