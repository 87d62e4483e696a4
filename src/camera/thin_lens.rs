//! The camera with a thin lens: what lies in one plane is sharp, all else is spread by the aperture.
//!
//! All rays through one film point meet in one point of the plane of focus, which the pinhole camera in the middle of the
//! lens sees there (Cook, Porter and Carpenter 1984, *Distributed Ray Tracing*; pbrt-v4 section 5.2.3).

use super::perspective::{Perspective, Pinhole};
use crate::math::ray::Ray;
use crate::sampling::warp::square_to_disk;
use glam::{Vec2, Vec3};

/// The lens of a camera, in the compiled scene's space.
#[derive(Clone, Copy, Debug)]
pub struct Lens {
    /// Radius of its aperture; with 0 the camera is the pinhole.
    pub radius: f64,
    /// Distance of the plane of focus along the viewing axis, positive.
    pub focus: f64,
}

/// A camera with a thin lens.
#[derive(Clone, Copy, Debug)]
pub struct ThinLens {
    pinhole: Perspective,
    /// Half axes of the aperture.
    aperture: [Vec3; 2],
    /// The same over the distance of the plane of focus: what moves the pinhole's direction, whose part along the viewing
    /// axis is 1.
    shift: [Vec3; 2],
}

impl ThinLens {
    /// The camera, rounded to f32.
    pub fn new(pinhole: &Pinhole, lens: &Lens) -> Self {
        let axes = [pinhole.left, pinhole.up];
        Self {
            pinhole: Perspective::new(pinhole),
            aperture: axes.map(|axis| (axis * lens.radius).as_vec3()),
            shift: axes.map(|axis| (axis * (lens.radius / lens.focus)).as_vec3()),
        }
    }

    /// The ray through a point of the film, in pixels from its upper left corner, from a point of the lens, in the unit
    /// square; its direction has unit length, its interval ends at the clip planes.
    #[inline]
    pub fn ray(&self, film: Vec2, lens: Vec2) -> Ray {
        let p = square_to_disk(lens);
        let along = |axes: &[Vec3; 2]| axes[0] * p.x + axes[1] * p.y;
        self.pinhole.ray_from(along(&self.aperture), self.pinhole.direction(film) - along(&self.shift))
    }
}
