//! The pinhole camera.

use crate::math::ray::Ray;
use glam::{DVec2, DVec3, Vec2, Vec3};

/// What a pinhole camera is made from, in the compiled scene's space.
#[derive(Clone, Copy, Debug)]
pub struct Pinhole {
    /// Where it stands.
    pub origin: DVec3,
    /// Unit vectors to the left and the upper edge of the picture, and along the viewing axis.
    pub left: DVec3,
    /// See `left`.
    pub up: DVec3,
    /// See `left`.
    pub forward: DVec3,
    /// Size of the whole film in pixels.
    pub film: DVec2,
    /// Tangent of half the horizontal field of view; pixels are square.
    pub half_width: f64,
    /// Position of the principal point relative to the middle of the film, as a fraction of its width and height.
    pub principal_point: DVec2,
    /// Nearest and farthest visible distance along the viewing axis.
    pub clip: (f64, f64),
}

/// A pinhole camera.
///
/// A film point (x, y) in pixels, from the upper left corner of the whole film, sees along `corner + x·right + y·down`,
/// which is scaled so that its part along the viewing axis is 1.
#[derive(Clone, Copy, Debug)]
pub struct Perspective {
    origin: Vec3,
    corner: Vec3,
    right: Vec3,
    down: Vec3,
    near: f32,
    far: f32,
}

impl Perspective {
    /// The camera, rounded to f32.
    pub fn new(c: &Pinhole) -> Self {
        let half_height = c.half_width * c.film.y / c.film.x;
        let across = c.left * (c.half_width * (1.0 - 2.0 * c.principal_point.x));
        let along = c.up * (half_height * (1.0 - 2.0 * c.principal_point.y));
        Self {
            origin: c.origin.as_vec3(),
            corner: (c.forward + across + along).as_vec3(),
            right: (c.left * (-2.0 * c.half_width / c.film.x)).as_vec3(),
            down: (c.up * (-2.0 * half_height / c.film.y)).as_vec3(),
            near: c.clip.0 as f32,
            far: c.clip.1 as f32,
        }
    }

    /// Where a point of the film sees, in pixels from its upper left corner: scaled so that the part along the viewing
    /// axis is 1.
    #[inline]
    pub(super) fn direction(&self, film: Vec2) -> Vec3 {
        self.corner + film.x * self.right + film.y * self.down
    }

    /// The ray from beside the pinhole along a direction whose part along the viewing axis is 1.
    #[inline]
    pub(super) fn ray_from(&self, beside: Vec3, d: Vec3) -> Ray {
        let length = d.length();
        Ray { o: self.origin + beside, tmin: self.near * length, d: d / length, tmax: self.far * length }
    }

    /// The ray through a point of the film, in pixels from its upper left corner; its direction has unit length, its
    /// interval ends at the clip planes.
    #[inline]
    pub fn ray(&self, film: Vec2) -> Ray {
        self.ray_from(Vec3::ZERO, self.direction(film))
    }
}
