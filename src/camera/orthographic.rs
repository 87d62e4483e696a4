//! The camera that sees along parallel rays: a plane that looks at what is before it.
//!
//! Every ray has an origin of its own, which is rounded to f32, the more coarsely the farther the plane is from the scene.
//! So where the plane lies before all of the scene, it is moved up to it, in f64: between the two there is nothing.

use crate::math::ray::Ray;
use glam::{DVec2, DVec3, Vec2, Vec3};

/// What an orthographic camera is made from, in the compiled scene's space.
#[derive(Clone, Copy, Debug)]
pub struct Slab {
    /// The middle of the film.
    pub origin: DVec3,
    /// From there to the left edge of the picture.
    pub left: DVec3,
    /// From there along the picture, upwards, as far as `left` is across it: to the upper edge where the film is a square.
    pub up: DVec3,
    /// Unit vector along the rays.
    pub forward: DVec3,
    /// Size of the whole film in pixels.
    pub film: DVec2,
    /// Nearest and farthest visible distance from the film.
    pub clip: (f64, f64),
}

/// A plane across the viewing direction at this distance before the scene's middle lies before all of the scene, whose
/// coordinates are at most 1: its corners are √3 away.
const BEFORE_THE_SCENE: f64 = 2.0;

/// An orthographic camera: a film point (x, y) sees from `corner + x·right + y·down` along `forward`.
#[derive(Clone, Copy, Debug)]
pub struct Orthographic {
    corner: Vec3,
    right: Vec3,
    down: Vec3,
    forward: Vec3,
    tmin: f32,
    tmax: f32,
}

impl Orthographic {
    /// The camera, rounded to f32.
    pub fn new(c: &Slab) -> Self {
        let up = c.up * (c.film.y / c.film.x);
        let depth = |x: f64, y: f64| (c.origin + c.left * x + up * y).dot(c.forward);
        let deepest = [depth(-1.0, -1.0), depth(-1.0, 1.0), depth(1.0, -1.0), depth(1.0, 1.0)];
        let deepest = deepest.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let skipped = (-BEFORE_THE_SCENE - deepest).max(0.0);
        Self {
            corner: (c.origin + c.forward * skipped + c.left + up).as_vec3(),
            right: (c.left * (-2.0 / c.film.x)).as_vec3(),
            down: (up * (-2.0 / c.film.y)).as_vec3(),
            forward: c.forward.as_vec3(),
            tmin: (c.clip.0 - skipped).max(0.0) as f32,
            tmax: (c.clip.1 - skipped).max(0.0) as f32,
        }
    }

    /// The ray through a point of the film, in pixels from its upper left corner; its direction has unit length, its
    /// interval ends at the clip planes.
    #[inline]
    pub fn ray(&self, film: Vec2) -> Ray {
        let o = self.corner + film.x * self.right + film.y * self.down;
        Ray { o, tmin: self.tmin, d: self.forward, tmax: self.tmax }
    }
}
