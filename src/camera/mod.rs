//! Cameras: from a point of the film, and one of the lens, to a ray.
//!
//! Camera space is Mitsuba's: the camera looks along +z, +y is up, and +x points to the *left* of the picture. Film points
//! are in pixels from the upper left corner of the whole film, lens points uniform in the unit square.

mod orthographic;
mod panorama;
mod perspective;
mod thin_lens;

pub use orthographic::{Orthographic, Slab};
pub use panorama::{Panorama, Sphere};
pub use perspective::{Perspective, Pinhole};
pub use thin_lens::{Lens, ThinLens};

use crate::math::ray::Ray;
use glam::Vec2;

/// A camera of the compiled scene.
#[derive(Clone, Copy, Debug)]
pub enum Camera {
    /// A pinhole.
    Perspective(Perspective),
    /// A lens that is in focus at one distance.
    ThinLens(ThinLens),
    /// All rays are parallel.
    Orthographic(Orthographic),
    /// All directions.
    Panorama(Panorama),
}

impl Camera {
    /// Whether rays depend on the point of the lens.
    pub fn has_lens(&self) -> bool {
        matches!(self, Self::ThinLens(_))
    }

    /// The ray through a point of the film from a point of the lens. Its direction has unit length, its interval ends at
    /// the clip planes. For many rays, decide which camera it is once.
    pub fn ray(&self, film: Vec2, lens: Vec2) -> Ray {
        match self {
            Self::Perspective(camera) => camera.ray(film),
            Self::ThinLens(camera) => camera.ray(film, lens),
            Self::Orthographic(camera) => camera.ray(film),
            Self::Panorama(camera) => camera.ray(film),
        }
    }
}
