//! The point where a ray meets a primitive that an accelerator found: computed here once, whoever found it.

use super::offset::SurfacePoint;
use super::{Plane, Shape, TriangleMesh, sphere::Sphere, triangle};
use crate::math::ray::Ray;
use glam::{DVec3, Vec3};

/// A point of a shape with its normals.
#[derive(Clone, Copy, Debug)]
pub struct ShapePoint {
    /// The point and its geometric normal.
    pub point: SurfacePoint,
    /// Unit shading normal.
    pub shading_normal: Vec3,
}

impl Shape {
    /// Where `ray` meets the primitive.
    #[inline]
    pub fn meet(&self, ray: &Ray, primitive: u32) -> ShapePoint {
        match self {
            Self::Mesh(mesh) => {
                let v = mesh.triangle(primitive);
                mesh.point(primitive, triangle::barycentrics(ray, v))
            }
            Self::Sphere(sphere) => {
                let t = sphere.resolve(ray);
                sphere.point(ray.o.as_dvec3() + t * ray.d.as_dvec3() - sphere.centre.as_dvec3())
            }
        }
    }
}

impl TriangleMesh {
    /// The point of triangle `face` with these barycentric coordinates.
    #[inline]
    pub fn point(&self, face: u32, b: [f64; 3]) -> ShapePoint {
        let [v0, v1, v2] = self.triangle(face).map(|v| v.as_dvec3());
        let Plane { n, slack } = self.plane(face);
        let point = SurfacePoint { p: v0 + (v1 - v0) * b[1] + (v2 - v0) * b[2], n, slack };
        ShapePoint { point, shading_normal: self.shading_normal(face, b).unwrap_or(n) }
    }

    /// The interpolated vertex normal; `None` where the mesh is flat or the normals cancel.
    #[inline]
    fn shading_normal(&self, face: u32, b: [f64; 3]) -> Option<Vec3> {
        if self.normals.is_empty() {
            return None;
        }
        let [n0, n1, n2] = self.faces[face as usize].map(|i| self.normals[i as usize]);
        let [b0, b1, b2] = b.map(|b| b as f32);
        (n0 * b0 + n1 * b1 + n2 * b2).try_normalize()
    }

    /// Areas of the triangles, each in the compiled scene's length².
    pub fn areas(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.faces.len() as u32).map(|face| {
            let [a, b, c] = self.triangle(face).map(|v| v.as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        })
    }
}

impl Sphere {
    /// The point of the sphere in direction `from_centre`, not zero, of any length.
    #[inline]
    pub fn point(&self, from_centre: DVec3) -> ShapePoint {
        let n = from_centre.normalize();
        let p = self.centre.as_dvec3() + n * f64::from(self.radius);
        let n = if self.flip { -n.as_vec3() } else { n.as_vec3() };
        ShapePoint { point: SurfacePoint { p, n, slack: 0.0 }, shading_normal: n }
    }
}
