//! The point where a ray meets a primitive that an accelerator found: computed here once, whoever found it.

use super::offset::SurfacePoint;
use super::triangle::{self, Corner};
use super::{Plane, Shape, TriangleMesh, sphere::Sphere};
use crate::math::ray::Ray;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// A point of a shape with its normals.
#[derive(Clone, Copy, Debug)]
pub struct ShapePoint {
    /// The point and its geometric normal.
    pub point: SurfacePoint,
    /// Unit shading normal.
    pub shading_normal: Vec3,
}

impl Shape {
    /// Area of the front side, in the compiled scene's length².
    pub fn area(&self) -> f64 {
        match self {
            Self::Mesh(mesh) => mesh.areas().sum(),
            Self::Sphere(sphere) => 4.0 * PI * f64::from(sphere.radius) * f64::from(sphere.radius),
            Self::Disk(disk) => disk.area(),
            Self::Cylinder(cylinder) => cylinder.area(),
        }
    }

    /// Where `ray` meets the primitive.
    #[inline(always)]
    pub fn meet(&self, ray: &Ray, primitive: u32) -> ShapePoint {
        match self {
            Self::Mesh(mesh) => mesh.meet(ray, primitive),
            quadric => quadric.meet_quadric(ray),
        }
    }

    #[inline(never)]
    fn meet_quadric(&self, ray: &Ray) -> ShapePoint {
        match self {
            Self::Mesh(_) => unreachable!("a mesh is no quadric"),
            Self::Sphere(sphere) => {
                let t = sphere.resolve(ray);
                sphere.point(ray.o.as_dvec3() + t * ray.d.as_dvec3() - sphere.centre.as_dvec3())
            }
            Self::Disk(disk) => disk.meet(ray),
            Self::Cylinder(cylinder) => cylinder.meet(ray),
        }
    }
}

impl TriangleMesh {
    /// Where `ray` meets triangle `face`.
    #[inline(always)]
    pub(crate) fn meet(&self, ray: &Ray, face: u32) -> ShapePoint {
        let triangle = self.corner(face);
        self.at(face, &triangle, self.barycentrics_on(ray, face, &triangle))
    }

    /// Barycentric coordinates of the point where `ray` meets triangle `face`.
    pub(crate) fn barycentrics(&self, ray: &Ray, face: u32) -> [f64; 3] {
        self.barycentrics_on(ray, face, &self.corner(face))
    }

    #[inline(always)]
    fn barycentrics_on(&self, ray: &Ray, face: u32, triangle: &Corner) -> [f64; 3] {
        triangle::barycentrics(ray, triangle).unwrap_or_else(|| {
            let [v0, v1, v2] = self.triangle(face);
            triangle::resolve(ray, v0, v1, v2).b
        })
    }

    /// The point of triangle `face` with these barycentric coordinates.
    #[inline(always)]
    pub fn point(&self, face: u32, b: [f64; 3]) -> ShapePoint {
        self.at(face, &self.corner(face), b)
    }

    #[inline(always)]
    fn at(&self, face: u32, triangle: &Corner, b: [f64; 3]) -> ShapePoint {
        let Plane { n, slack } = self.plane(face);
        let point = SurfacePoint { p: triangle.v0 + triangle.e1 * b[1] + triangle.e2 * b[2], n, slack };
        ShapePoint { point, shading_normal: self.shading_normal(face, b).unwrap_or(n) }
    }

    /// A triangle in f64.
    #[inline(always)]
    fn corner(&self, face: u32) -> Corner {
        let [a, b, c] = self.faces[face as usize];
        let v0 = self.positions[a as usize].as_dvec3();
        Corner { v0, e1: self.positions[b as usize].as_dvec3() - v0, e2: self.positions[c as usize].as_dvec3() - v0 }
    }

    /// The interpolated vertex normal; `None` where the mesh is flat or the normals cancel.
    #[inline(always)]
    fn shading_normal(&self, face: u32, b: [f64; 3]) -> Option<Vec3> {
        if self.normals.is_empty() { None } else { self.interpolated_normal(face, b) }
    }

    #[inline(never)]
    fn interpolated_normal(&self, face: u32, b: [f64; 3]) -> Option<Vec3> {
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
