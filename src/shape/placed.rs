//! Shapes that share their geometry: a group of shapes in a space of its own, and placements of it in the scene.
//!
//! Every shape of every placement is a [`super::Shape`] of its own, a [`Placed`], with an index of its own: a hit names
//! it like any other, and its look is found like any other's. The geometry is stored once, in the group, whose space is
//! fitted to it as the scene's is to the scene ([`super`]).
//!
//! A ray is taken to the group's space, in f64, and met there by the tests in f64. Affine maps do not change distances
//! along a ray. The point is computed in the group's space, from the f32 vertices, and brought back once.
//!
//! # What the maps err by
//!
//! Let M·q + t be the map from the group to the scene, W·x + w the one back, both in f64, |·| the matrix or vector of
//! absolute values, 1 the vector of ones and u = 2⁻⁵³. In the scene no coordinate of a surface is above 1, so that a
//! segment between surfaces is at most 2 long along each axis; in the group none is above 1. Along each axis of the group
//!
//! - a point q of the group comes back from the scene at most |W·M − I|·1 + |W·t + w| beside itself, as the maps are not
//!   each other's inverse but for rounding; to compute this bound rounds, too, by at most γ₄·(|W|·(|M|·1 + |t|) + |w|),
//! - the point of a hit was rounded on its way to the scene: γ₄·|W|·(|M|·1 + |t|),
//! - the origin of the next ray is rounded on its way to the group: γ₄·(|W|·1 + |w|),
//! - and the ray's direction, by γ₃·|W|·2 where the ray has crossed the scene.
//!
//! All of this is less than D = |W·M − I|·1 + |W·t + w| + γ₁₂·(|W|·(|M|·1 + |t| + 2·1) + |w|), and |M|·D, seen in the
//! scene, is what a [`Placement`] keeps as its error: the displacement of a placed surface along each axis that offsets
//! ([`super::offset`]) have to reckon with, beside what the test in f64 errs by in the group. With numbers that f64 holds
//! exactly (a translation by a fraction of few digits) nothing of it happens, but the bound stays, at some 10⁻¹⁵.

use super::offset::{self, SurfacePoint};
use super::surface::ShapePoint;
use super::triangle::{self, ExactWatertightRay};
use super::{Shape, TriangleMesh};
use crate::math::bounds::Bounds;
use crate::math::float::{UNIT_ROUNDOFF, UNIT_ROUNDOFF_F64, round_down, round_up};
use crate::math::ray::{DRay, Ray};
use glam::{DAffine3, DMat3, DVec3, Vec3};
use std::sync::Arc;

/// Rounded operations behind D, with those of the computation of D itself: derived in the head.
const MAP_ROUNDINGS: f64 = 12.0;

/// Largest entry of the map from the scene to a group. Reason: rays of the group are rounded to f32 to walk its hierarchy;
/// this is far inside the range of f32. What is smaller than this beside the scene cannot be seen.
const MAX_MAGNIFICATION: f64 = (1u64 << 60) as f64;

/// Shapes that are placed together, in a space of their own where no coordinate of them is above 1.
#[derive(Debug)]
pub struct Group {
    /// The shapes. None is a [`Placed`].
    pub shapes: Vec<Shape>,
    /// A box around each of them.
    bounds: Vec<Bounds>,
}

impl Group {
    /// A group of `shapes`.
    pub fn new(shapes: Vec<Shape>) -> Self {
        let bounds = |shape: &Shape| {
            let primitives = 0..shape.primitive_count() as u32;
            primitives.fold(Bounds::EMPTY, |all, primitive| all.union(shape.primitive_bounds(primitive)))
        };
        let bounds = shapes.iter().map(bounds).collect();
        Self { shapes, bounds }
    }

    /// A box around all shapes.
    pub fn bounds(&self) -> Bounds {
        self.bounds.iter().copied().fold(Bounds::EMPTY, Bounds::union)
    }
}

/// Where in the scene a group is.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    to_scene: DAffine3,
    to_group: DAffine3,
    /// Displacement of surfaces along the scene's axes that the rounding of the maps amounts to, at most.
    error: Vec3,
    /// 1 in the head's |M|·1: the extents of the group's unit cube, from its middle, along the scene's axes.
    reach: DVec3,
    /// How much the map changes angles: the error of a normal of the group is at most this many times as large in the
    /// scene.
    skew: f32,
}

impl Placement {
    /// The placement by an affine map from the group's space to the scene's; `None` where that flattens the group, or makes
    /// it so thin or so small that single precision ends.
    pub fn new(to_scene: DAffine3) -> Option<Self> {
        let to_group = to_scene.inverse();
        let largest = to_group.matrix3.to_cols_array().into_iter().fold(0.0, |m: f64, c| m.max(c.abs()));
        if !to_group.is_finite() || !(largest <= MAX_MAGNIFICATION) {
            return None;
        }
        let (m, t, w, v) = (to_scene.matrix3, to_scene.translation, to_group.matrix3, to_group.translation);
        let (abs_m, abs_w) = (absolute(m), absolute(w));
        let gamma = MAP_ROUNDINGS * UNIT_ROUNDOFF_F64 / (1.0 - MAP_ROUNDINGS * UNIT_ROUNDOFF_F64);
        let reach = abs_m * DVec3::ONE;
        let inverse = absolute(w * m - DMat3::IDENTITY) * DVec3::ONE + (w * t + v).abs();
        let displacement = inverse + (abs_w * (reach + t.abs() + 2.0) + v.abs()) * gamma;
        let error = (abs_m * displacement).to_array().map(|e| round_up(e).next_up()).into();
        Some(Self { to_scene, to_group, error, reach, skew: round_up(frobenius(&m) * frobenius(&w)) })
    }

    /// How far along the scene's axes what is in the group can be from its middle.
    pub(super) fn reach(&self) -> DVec3 {
        self.reach
    }

    /// The ray in the group's space; distances stay the same.
    #[inline]
    pub fn ray_to_group(&self, ray: &Ray) -> DRay {
        ray.transformed(&self.to_group)
    }

    /// The map from the scene to the group's space.
    pub fn to_group(&self) -> &DAffine3 {
        &self.to_group
    }

    /// A point of the group, in the scene.
    pub fn point_to_scene(&self, q: DVec3) -> DVec3 {
        self.to_scene.transform_point3(q)
    }

    /// A box in the scene around what is in a box of the group, whatever the rounding.
    pub fn bounds_to_scene(&self, b: Bounds) -> Bounds {
        let (min, max) = (b.min.as_dvec3(), b.max.as_dvec3());
        let centre = self.to_scene.transform_point3((min + max) * 0.5);
        let reach = absolute(self.to_scene.matrix3) * ((max - min) * 0.5) + self.error.as_dvec3();
        Bounds {
            min: (centre - reach).to_array().map(|x| round_down(x).next_down()).into(),
            max: (centre + reach).to_array().map(|x| round_up(x).next_up()).into(),
        }
    }

    /// Unit image of a normal: normals are covectors, and move with the inverse transpose. As in Mitsuba, a map that
    /// mirrors leaves outside what was outside.
    #[inline]
    fn normal(&self, n: DVec3) -> DVec3 {
        (self.to_group.matrix3.transpose() * n).normalize()
    }

    /// A direction of the group, in the scene; its length changes.
    #[inline]
    fn direction(&self, d: Vec3) -> Vec3 {
        (self.to_scene.matrix3 * d.as_dvec3()).normalize_or_zero().as_vec3()
    }
}

/// What it stretches a vector by, at most.
fn frobenius(m: &DMat3) -> f64 {
    m.to_cols_array().into_iter().map(|c| c * c).sum::<f64>().sqrt()
}

fn absolute(m: DMat3) -> DMat3 {
    DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}

/// A shape of a placed group.
#[derive(Clone, Debug)]
pub struct Placed {
    /// The group.
    pub group: Arc<Group>,
    /// Which of its shapes.
    pub index: u32,
    /// Where it is. Shapes that are placed together share this.
    pub placement: Arc<Placement>,
}

impl Placed {
    /// The shape, in the group's space.
    #[inline]
    pub fn shape(&self) -> &Shape {
        &self.group.shapes[self.index as usize]
    }

    /// A point of the scene, in the group's space.
    pub(super) fn point_to_group(&self, p: DVec3) -> DVec3 {
        self.placement.to_group.transform_point3(p)
    }

    /// A vector of the group's space, in the scene.
    pub(super) fn vector_to_scene(&self, v: Vec3) -> Vec3 {
        (self.placement.to_scene.matrix3 * v.as_dvec3()).as_vec3()
    }

    /// Whether the map to the scene mirrors.
    pub(super) fn mirrors(&self) -> bool {
        self.placement.to_scene.matrix3.determinant() < 0.0
    }

    /// A box around all of it, in the scene.
    pub fn bounds(&self) -> Bounds {
        self.placement.bounds_to_scene(self.group.bounds[self.index as usize])
    }

    /// A box around a primitive, in the scene.
    pub(super) fn primitive_bounds(&self, primitive: u32) -> Bounds {
        self.placement.bounds_to_scene(self.shape().primitive_bounds(primitive))
    }

    /// See [`Shape::intersect`].
    pub(super) fn intersect(&self, primitive: u32, ray: &Ray) -> Option<f32> {
        self.shape().intersect_in_group(primitive, &self.placement.ray_to_group(ray))
    }

    /// See [`Shape::resolve_distance`].
    pub(crate) fn resolve_distance(&self, primitive: u32, ray: &Ray) -> f64 {
        let ray = self.placement.ray_to_group(ray);
        match self.shape() {
            Shape::Mesh(mesh) => {
                let [v0, v1, v2] = mesh.triangle(primitive);
                triangle::resolve(&ray, v0, v1, v2).t
            }
            Shape::Sphere(sphere) => sphere.resolve(&ray),
            Shape::Disk(disk) => disk.resolve(&ray),
            Shape::Cylinder(cylinder) => cylinder.resolve(&ray),
            Shape::Placed(_) => unreachable!("groups are not nested"),
        }
    }

    /// Where `ray` meets the primitive, in the scene.
    pub(super) fn meet(&self, ray: &Ray, primitive: u32) -> ShapePoint {
        let ray = self.placement.ray_to_group(ray);
        match self.shape() {
            Shape::Mesh(mesh) => {
                let [v0, v1, v2] = mesh.triangle(primitive);
                let b = triangle::barycentrics(&ray, &mesh.corner(primitive));
                self.mesh_point(mesh, primitive, b.unwrap_or_else(|| triangle::resolve(&ray, v0, v1, v2).b))
            }
            quadric => self.quadric_point(quadric.meet_quadric(&ray)),
        }
    }

    /// A point of the tangent plane of a primitive near the point `p` of the scene; of a mesh any point of the triangle.
    pub(super) fn beside(&self, primitive: u32, p: DVec3) -> ShapePoint {
        match self.shape() {
            Shape::Mesh(mesh) => self.mesh_point(mesh, primitive, [1.0, 0.0, 0.0]),
            quadric => self.quadric_point(quadric.beside(0, self.placement.to_group.transform_point3(p))),
        }
    }

    /// The point of a triangle with these barycentric coordinates. Its normal is computed in f64, so that the map does not
    /// magnify the rounding of one in f32.
    fn mesh_point(&self, mesh: &TriangleMesh, face: u32, b: [f64; 3]) -> ShapePoint {
        let corner = mesh.corner(face);
        let map = &self.placement;
        let n = map.normal(corner.e1.cross(corner.e2)).as_vec3();
        let n = if mesh.flip { -n } else { n };
        let p = map.to_scene.transform_point3(corner.v0 + corner.e1 * b[1] + corner.e2 * b[2]);
        let [v0, v1, v2] = mesh.triangle(face);
        let extent = (v0.max(v1).max(v2) - v0.min(v1).min(v2)).element_sum();
        let slack = n.abs().dot(map.error + offset::exact_slack(extent) * map.reach.as_vec3());
        let shading = mesh.shading_normal(face, b).map(|s| map.normal(s.as_dvec3()).as_vec3());
        ShapePoint { point: SurfacePoint { p, n, slack }, shading_normal: shading.unwrap_or(n) }
    }

    /// A point of a quadric of the group, in the scene.
    fn quadric_point(&self, at: ShapePoint) -> ShapePoint {
        let map = &self.placement;
        let p = map.to_scene.transform_point3(at.point.p);
        let [n, shading_normal] = [at.point.n, at.shading_normal].map(|n| map.normal(n.as_dvec3()).as_vec3());
        // The normal was rounded in the group: an offset along it reckons with coordinates that are 0 by a little, and
        // rounding the point along the others moves it by this.
        let tilt = UNIT_ROUNDOFF * map.skew * (2.0 * UNIT_ROUNDOFF) * p.abs().element_sum() as f32;
        // The scene's rounding along the surface, magnified on its way to the group, and what comes of it on the way back.
        let inverse = frobenius(&map.to_group.matrix3);
        let bend = frobenius(&map.to_scene.matrix3) * inverse * inverse * self.shape().curvature(at.point.p);
        let slack = n.abs().dot(map.error) + tilt + offset::sagitta(p, bend);
        ShapePoint { point: SurfacePoint { p, n, slack }, shading_normal }
    }

    /// The direction in the scene of a tangent of the group, found by `at` for a point of the group.
    pub(super) fn tangent(&self, at: &SurfacePoint, tangent: impl Fn(&SurfacePoint) -> Vec3) -> Vec3 {
        let map = &self.placement;
        let n = (map.to_scene.matrix3.transpose() * at.n.as_dvec3()).normalize_or_zero().as_vec3();
        let local = SurfacePoint { p: map.to_group.transform_point3(at.p), n, slack: 0.0 };
        map.direction(tangent(&local))
    }
}

impl Shape {
    /// [`Self::intersect`] of a shape of a group, in the group's space.
    pub fn intersect_in_group(&self, primitive: u32, ray: &DRay) -> Option<f32> {
        match self {
            Self::Mesh(mesh) => ExactWatertightRay::new(ray).intersect(mesh.triangle(primitive)).map(|t| t as f32),
            Self::Sphere(sphere) => sphere.intersect(ray),
            Self::Disk(disk) => disk.intersect(ray),
            Self::Cylinder(cylinder) => cylinder.intersect(ray),
            Self::Placed(_) => unreachable!("groups are not nested"),
        }
    }
}
