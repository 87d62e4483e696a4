//! Spheres.

use glam::Vec3;

/// A sphere.
#[derive(Clone, Copy, Debug)]
pub struct Sphere {
    /// Centre.
    pub centre: Vec3,
    /// Radius, positive.
    pub radius: f32,
    /// Whether the front is the inside.
    pub flip: bool,
}
