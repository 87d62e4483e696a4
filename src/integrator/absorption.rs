//! Light that travels inside of something is absorbed: of every channel the part exp(−σ·d) is left after the distance d (Beer
//! and Lambert's law).
//!
//! A path knows what it is inside of. At a surface with an inside, going on to its back means being inside of it and going on to
//! its front being outside of everything, whichever way the path came; at all other surfaces, such as those of things frozen
//! into glass, it stays where it is. Inside of two things at once is only the last that was entered. None of this is inlined, as
//! few scenes have it.

use super::path_state::{NOTHING_INSIDE, PathState};
use super::wave::Walker;
use crate::accel::Hit;
use crate::math::ray::Ray;
use crate::scene::Surface;
use crate::spectrum::Rgb;
use glam::Vec3;

impl Walker<'_> {
    /// What is absorbed on the way to the surface that the current segment met.
    #[cold]
    #[inline(never)]
    pub(super) fn absorb(&self, path: &mut PathState, surface: &Surface<'_>, hit: Hit) {
        if path.depth == 1 && surface.point.n.dot(surface.wo) < 0.0 {
            // The camera is inside of what it sees from there.
            path.inside = self.inside_towards(path, surface, hit, &surface.wo);
        }
        let distance = (surface.p().as_vec3() - path.ray.o).length();
        path.throughput *= self.left(path.inside, distance);
    }

    /// What is absorbed by what has no end.
    #[cold]
    #[inline(never)]
    pub(super) fn absorb_for_ever(&self, path: &mut PathState) {
        path.throughput *= self.left(path.inside, f32::INFINITY);
    }

    /// What is left of `radiance` from a light at the end of the shadow ray `ray` from a surface.
    #[cold]
    #[inline(never)]
    pub(super) fn absorb_shadow(
        &self,
        path: &PathState,
        surface: &Surface<'_>,
        hit: Hit,
        ray: &Ray,
        radiance: Rgb,
    ) -> Rgb {
        let inside = self.inside_towards(path, surface, hit, &ray.d);
        radiance * self.left(inside, ray.d.length() * ray.tmax)
    }

    /// What a path is inside of that leaves a surface in the direction `d`.
    #[cold]
    #[inline(never)]
    pub(super) fn inside_towards(&self, path: &PathState, surface: &Surface<'_>, hit: Hit, &d: &Vec3) -> u32 {
        let material = self.scene.appearances[hit.shape as usize].material;
        if self.scene.absorption[material as usize].is_none() {
            return path.inside;
        }
        if surface.point.n.dot(d) < 0.0 { material } else { NOTHING_INSIDE }
    }

    /// The part that is left after a distance.
    fn left(&self, inside: u32, distance: f32) -> Rgb {
        let absorption = self.scene.absorption.get(inside as usize).copied().flatten();
        // What does not absorb does not for ever: no 0·∞.
        let channel = |sigma: f32| if sigma > 0.0 { libm::expf(-sigma * distance) } else { 1.0 };
        absorption.map_or(Rgb::WHITE, |sigma| sigma.map(channel))
    }
}
