//! The point where a ray meets a primitive that an accelerator found: computed here once, whoever found it.

use super::offset::SurfacePoint;
use super::{Shape, TriangleMesh, sphere::Sphere, triangle};
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
                let [v0, v1, v2] = mesh.triangle(primitive);
                mesh.point(primitive, triangle::resolve(ray, v0, v1, v2).b)
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
        let v = self.triangle(face);
        let d = v.map(|v| v.as_dvec3());
        let (e1, e2) = (d[1] - d[0], d[2] - d[0]);
        let sign = if self.flip { -1.0 } else { 1.0 };
        let n = (e1.cross(e2).normalize() * sign).as_vec3();
        let extent = v[0].max(v[1]).max(v[2]) - v[0].min(v[1]).min(v[2]);
        let point = SurfacePoint { p: d[0] + e1 * b[1] + e2 * b[2], n, extent };
        ShapePoint { point, shading_normal: self.shading_normal(face, b).unwrap_or(n) }
    }

    /// The interpolated vertex normal; `None` where the mesh is flat or the normals cancel.
    #[inline]
    fn shading_normal(&self, face: u32, b: [f64; 3]) -> Option<Vec3> {
        if self.normals.is_empty() {
            return None;
        }
        let [n0, n1, n2] = self.faces[face as usize].map(|i| self.normals[i as usize].as_dvec3());
        (n0 * b[0] + n1 * b[1] + n2 * b[2]).try_normalize().map(DVec3::as_vec3)
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
        ShapePoint { point: SurfacePoint { p, n, extent: Vec3::ZERO }, shading_normal: n }
    }
}
