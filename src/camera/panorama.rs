//! The camera that sees in all directions: an equirectangular picture of the whole sphere.
//!
//! Mitsuba has no such camera. Ours is the inverse of its environment maps: across the picture the azimuth goes once
//! round, down it the angle from +y grows from 0 to π, and the middle is the viewing direction. So a panorama, given to an
//! environment map with the camera's `to_world`, shows the scene again where it was seen from.

use crate::math::ray::Ray;
use crate::sampling::warp::sin_cos;
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::f64::consts::{PI, TAU};

/// What a panorama is made from, in the compiled scene's space.
#[derive(Clone, Copy, Debug)]
pub struct Sphere {
    /// Where the camera stands.
    pub origin: DVec3,
    /// Unit vectors: to the left of what the middle of the picture shows,
    pub left: DVec3,
    /// up, where its upper edge is,
    pub up: DVec3,
    /// and to what its middle shows.
    pub forward: DVec3,
    /// Size of the whole film in pixels.
    pub film: DVec2,
    /// Nearest and farthest visible distance.
    pub clip: (f64, f64),
}

/// A camera that sees in all directions.
#[derive(Clone, Copy, Debug)]
pub struct Panorama {
    origin: Vec3,
    left: Vec3,
    up: Vec3,
    forward: Vec3,
    /// Radians per pixel.
    step: Vec2,
    clip: (f32, f32),
}

impl Panorama {
    /// The camera, rounded to f32.
    pub fn new(c: &Sphere) -> Self {
        Self {
            origin: c.origin.as_vec3(),
            left: c.left.as_vec3(),
            up: c.up.as_vec3(),
            forward: c.forward.as_vec3(),
            step: (DVec2::new(TAU, PI) / c.film).as_vec2(),
            clip: (c.clip.0 as f32, c.clip.1 as f32),
        }
    }

    /// The ray through a point of the film, in pixels from its upper left corner; its direction has unit length.
    #[inline]
    pub fn ray(&self, film: Vec2) -> Ray {
        let (sin_phi, cos_phi) = sin_cos(film.x * self.step.x);
        let (sin_theta, cos_theta) = sin_cos(film.y * self.step.y);
        let around = self.left * sin_phi - self.forward * cos_phi;
        let d = (around * sin_theta + self.up * cos_theta).normalize();
        Ray { o: self.origin, tmin: self.clip.0, d, tmax: self.clip.1 }
    }
}
