//! Texture coordinates of a point, as Mitsuba has them.

use super::Shape;
use crate::math::ray::Ray;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// What the texture coordinates of a shape are that its geometry alone does not tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Parametrisation {
    /// Those of its geometry. A triangle: the barycentric coordinates of its second and third vertex. A disk: distance from
    /// the middle and angle; the side of a cylinder: angle and height.
    Own,
    /// Two triangles that make a rectangle, from one corner to the opposite one.
    Rectangle,
    /// A sphere with this pole: longitude, from `zero`, and polar angle.
    Sphere {
        /// Unit vector to the pole.
        pole: DVec3,
        /// Unit vector to the point of the equator where u is zero.
        zero: DVec3,
    },
}

impl Shape {
    /// Texture coordinates where `ray` meets a primitive; angles are fractions of a turn (polar ones of half a turn).
    pub fn uv(&self, parametrisation: Parametrisation, ray: &Ray, primitive: u32) -> DVec2 {
        match (self, parametrisation) {
            (Self::Mesh(mesh), Parametrisation::Rectangle) => {
                let [_, b1, b2] = mesh.barycentrics(ray, primitive);
                // The corners of the two triangles are (0, 0), (1, 0), (1, 1) and (0, 0), (1, 1), (0, 1).
                if primitive == 0 { DVec2::new(b1 + b2, b2) } else { DVec2::new(b1, b1 + b2) }
            }
            (Self::Mesh(mesh), _) => {
                let [_, b1, b2] = mesh.barycentrics(ray, primitive);
                DVec2::new(b1, b2)
            }
            (Self::Disk(disk), _) => {
                let at = disk.coordinates_of(ray);
                DVec2::new(at.length(), turn(at.y, at.x))
            }
            (Self::Cylinder(cylinder), _) => {
                let at = cylinder.coordinates_of(ray);
                DVec2::new(turn(at.y, at.x), at.z)
            }
            (Self::Sphere(sphere), parametrisation) => {
                let (pole, zero) = match parametrisation {
                    Parametrisation::Sphere { pole, zero } => (pole, zero),
                    _ => (DVec3::Z, DVec3::X),
                };
                let p = sphere.meet(ray).point.p - sphere.centre.as_dvec3();
                let (x, y, z) = (p.dot(zero), p.dot(pole.cross(zero)), p.dot(pole));
                DVec2::new(turn(y, x), libm::atan2(libm::hypot(x, y), z) / PI)
            }
        }
    }
}

/// The angle of (x, y) as a fraction of a turn, in [0, 1].
fn turn(y: f64, x: f64) -> f64 {
    let angle = libm::atan2(y, x) / TAU;
    if angle < 0.0 { angle + 1.0 } else { angle }
}
