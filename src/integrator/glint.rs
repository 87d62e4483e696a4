//! Glints: the sky in a mirror that few samples of a bsdf go to, looked for at once.
//!
//! A coat or a pane of glass reflects a small part F of the light, so its mirror is sampled seldom: with a probability p of about F.
//! If the sky L in that direction is bright, F·L/p now and then is noise of the variance (F·L)²·(1 − p)/p, in the picture of a window on a
//! coat and in what coats reflect on to the floor. But the direction is known: one ray tells whether the sky is there, and F·L counts
//! each time (splitting: Arvo and Kirk 1990, *Particle Transport and Image Synthesis*). Paths that are sampled to go there find what is in the
//! way as ever; the map of the sky no longer counts for them.
//!
//! Only `path` does so, on surfaces that are one bsdf (not a blend, nor what has a normal of its own), and not from inside of glass.
//! Only the sky's map is looked for: other lights would have to be found first, by a ray that tells more than whether something is in
//! the way, and what shines alike from everywhere is little noise.

use super::direct::{Candidate, Shadows};
use super::path_state::PathState;
use super::record::Record;
use super::technique::Technique;
use super::variant::Variant;
use super::wave::Walker;
use crate::accel::Hit;
use crate::facts::{Feature, has};
use crate::light::Light;
use crate::material::Scatter;
use crate::scene::Surface;
use crate::spectrum::Rgb;
use glam::Vec3;

/// The luminance that a glint must add that is looked for, over the mean luminance of the map: fainter ones are not worth their ray.
/// Measured for the material ball (docs/experiments.md): down to 0.1 less noise, below only more rays.
const FAINTEST: f32 = 0.1;

impl Walker<'_> {
    /// Whether some are looked for.
    #[inline(always)]
    pub(super) fn has_glints<T: Technique>(&self) -> bool {
        let is_map = |&index: &u32| matches!(self.scene.lights[index as usize], Light::Environment(_));
        T::COMBINES
            && T::Variant::ANY_LIGHTS
            && has(Feature::Environment, self.scene.infinite_lights.iter().any(is_map))
    }

    /// Has it looked whether the sky is in the mirror that the surface is, if it is one among others and the sky is bright there; whether
    /// that is so.
    #[inline(never)]
    pub(super) fn look_for_glint<T: Technique>(
        &self,
        from: (&PathState, Hit, u32),
        surface: &Surface<'_>,
        glints: &mut Shadows,
        record: &mut impl Record,
    ) -> bool {
        let Scatter::One(bsdf) = surface.bsdf else { return false };
        let wo = surface.frame.to_local(surface.wo);
        let Some(reflectance) = bsdf.mirror(wo) else { return false };
        let wi = surface.frame.to_world(Vec3::new(-wo.x, -wo.y, wo.z));
        let (mut sky, mut mean) = (Rgb::BLACK, 0.0);
        for &index in &self.scene.infinite_lights {
            if let Light::Environment(light) = &self.scene.lights[index as usize] {
                sky += light.seen(&wi, Vec3::ZERO, T::COMBINES).0;
                mean += light.mean_luminance();
            }
        }
        let path = from.0;
        let radiance = path.throughput * reflectance * sky;
        if !((path.carried * radiance).luminance() > FAINTEST * mean) {
            return false;
        }
        let glint = Candidate { wi, end: None, on: Hit::NONE, radiance, weight: 1.0, scattered: None };
        self.look_for::<T>(from, surface, &glint, glints, record);
        true
    }
}
