//! The point where a ray meets a primitive that an accelerator found: computed here once, whoever found it.

use super::offset::{self, SurfacePoint};
use super::triangle::{self, Corner};
use super::{Plane, Shape, TriangleMesh, sphere::Sphere};
use crate::facts::{Feature, has};
use crate::math::ray::{Line, Ray};
use glam::{DVec2, DVec3, Vec3};
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
    /// Area of the front side, in the compiled scene's length²; 0 of a placed shape, which cannot emit.
    pub fn area(&self) -> f64 {
        match self {
            Self::Mesh(mesh) => mesh.areas().sum(),
            Self::Sphere(sphere) => 4.0 * PI * f64::from(sphere.radius) * f64::from(sphere.radius),
            Self::Disk(disk) => disk.area(),
            Self::Cylinder(cylinder) => cylinder.area(),
            Self::Placed(_) => 0.0,
        }
    }

    /// Where `ray` meets the primitive.
    #[inline(always)]
    pub fn meet(&self, ray: &Ray, primitive: u32) -> ShapePoint {
        match self {
            Self::Mesh(mesh) => mesh.meet(ray, primitive),
            other => other.meet_other(ray, primitive),
        }
    }

    #[inline(never)]
    fn meet_other(&self, ray: &Ray, primitive: u32) -> ShapePoint {
        has(Feature::Instances, matches!(self, Self::Placed(_)));
        match self {
            Self::Placed(placed) => placed.meet(ray, primitive),
            quadric => quadric.meet_quadric(ray),
        }
    }

    pub(super) fn meet_quadric(&self, ray: &impl Line) -> ShapePoint {
        match self {
            Self::Mesh(_) | Self::Placed(_) => unreachable!("this is no quadric"),
            Self::Sphere(sphere) => {
                let t = sphere.resolve(ray);
                sphere.point(ray.origin() + t * ray.direction() - sphere.centre.as_dvec3())
            }
            Self::Disk(disk) => disk.meet(ray),
            Self::Cylinder(cylinder) => cylinder.meet(ray),
        }
    }

    /// A bound on the curvature of a quadric at a point of it.
    pub(super) fn curvature(&self, p: DVec3) -> f64 {
        match self {
            Self::Sphere(sphere) => sphere.curvature(),
            Self::Cylinder(cylinder) => cylinder.curvature(cylinder.project(p).normalize()),
            Self::Mesh(_) | Self::Disk(_) | Self::Placed(_) => 0.0,
        }
    }

    /// A point of the tangent plane of a primitive near `p`.
    pub(super) fn beside(&self, primitive: u32, p: DVec3) -> ShapePoint {
        match self {
            Self::Mesh(mesh) => mesh.point(primitive, [1.0, 0.0, 0.0]),
            Self::Sphere(sphere) => sphere.point(p - sphere.centre.as_dvec3()),
            Self::Disk(disk) => disk.point(DVec2::ZERO),
            Self::Cylinder(cylinder) => cylinder.point(cylinder.project(p), 0.0),
            Self::Placed(placed) => placed.beside(primitive, p),
        }
    }
}

impl TriangleMesh {
    /// Where `ray` meets triangle `face`.
    #[inline(always)]
    pub(crate) fn meet(&self, ray: &Ray, face: u32) -> ShapePoint {
        self.meet_at(ray, face).0
    }

    /// The same, and the barycentric coordinates.
    #[inline(always)]
    pub(crate) fn meet_at(&self, ray: &Ray, face: u32) -> (ShapePoint, [f64; 3]) {
        let triangle = self.corner(face);
        let b = triangle::barycentrics(ray, &triangle);
        let b = b.unwrap_or_else(|| {
            let [v0, v1, v2] = self.triangle(face);
            triangle::resolve(ray, v0, v1, v2).b
        });
        (self.at(face, &triangle, b), b)
    }

    /// Some bits of the memory that a triangle's indices and plane are in.
    #[inline]
    pub(crate) fn touch_face(&self, face: u32) -> u32 {
        self.faces[face as usize][0] ^ self.planes.get(face as usize).map_or(0, |plane| plane.slack.to_bits())
    }

    /// Some bits of the memory that its vertices and their normals are in.
    #[inline]
    pub(crate) fn touch_vertices(&self, face: u32) -> u32 {
        let mut bits = 0;
        for i in self.faces[face as usize] {
            bits ^= self.positions[i as usize].x.to_bits();
            bits ^= self.normals.get(i as usize).map_or(0, |n| n.x.to_bits());
        }
        bits
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
    pub(super) fn corner(&self, face: u32) -> Corner {
        let [a, b, c] = self.faces[face as usize];
        let v0 = self.positions[a as usize].as_dvec3();
        Corner { v0, e1: self.positions[b as usize].as_dvec3() - v0, e2: self.positions[c as usize].as_dvec3() - v0 }
    }

    /// The interpolated vertex normal; `None` where the mesh is flat or the normals cancel.
    #[inline(always)]
    pub(super) fn shading_normal(&self, face: u32, b: [f64; 3]) -> Option<Vec3> {
        if !has(Feature::Normals, !self.normals.is_empty()) { None } else { self.interpolated_normal(face, b) }
    }

    #[inline(never)]
    fn interpolated_normal(&self, face: u32, b: [f64; 3]) -> Option<Vec3> {
        let [i0, i1, i2] = self.faces[face as usize];
        let [n0, n1, n2] = [self.normals[i0 as usize], self.normals[i1 as usize], self.normals[i2 as usize]];
        (n0 * b[0] as f32 + n1 * b[1] as f32 + n2 * b[2] as f32).try_normalize()
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
    /// Its curvature.
    #[inline]
    pub(super) fn curvature(&self) -> f64 {
        1.0 / f64::from(self.radius)
    }

    /// The point of the sphere in direction `from_centre`, not zero, of any length.
    #[inline]
    pub fn point(&self, from_centre: DVec3) -> ShapePoint {
        let n = from_centre.normalize();
        let p = self.centre.as_dvec3() + n * f64::from(self.radius);
        let n = if self.flip { -n.as_vec3() } else { n.as_vec3() };
        let slack = offset::sagitta(p, self.curvature());
        ShapePoint { point: SurfacePoint { p, n, slack }, shading_normal: n }
    }
}
