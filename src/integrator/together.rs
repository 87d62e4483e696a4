//! Light samples for many paths at once, where the only light is a quad or a map of the sky.
//!
//! Sampling these is the most that such a scene's paths work out, and the same for all of them. So of the hits that are looked at
//! together it is first found where they are, then light is sampled for all, in vectors, and then each has its turn. That changes no
//! bit: what is sampled for a path does not depend on who else is there.

use super::variant::Variant;
use crate::accel::Hit;
use crate::light::{AreaLight, EnvironmentLight, FoundOnQuad, FoundSky, Light, LightSample, Quad, Receivers};
use crate::math::ray::Ray;
use crate::scene::{AHEAD, Ahead, Scene};
use crate::shape::surface::ShapePoint;
use glam::{Vec2, Vec3};

/// The only light of a scene.
#[derive(Clone, Copy)]
pub(super) enum Only<'a> {
    /// A parallelogram.
    Quad(&'a AreaLight, &'a Quad),
    /// A map of the sky.
    Sky(&'a EnvironmentLight),
}

impl<'a> Only<'a> {
    /// The only one of these, if it is one of those. Which of them it can be is a matter of the variant: a sample that could come from
    /// either would have to be put into memory, and read too soon after.
    #[inline(always)]
    pub(super) fn of<V: Variant>(lights: &'a [Light]) -> Option<Self> {
        match lights {
            [Light::Area(light)] if !V::ANY_LIGHTS => light.quad().map(|quad| Self::Quad(light, quad)),
            [Light::Environment(light)] if V::ANY_LIGHTS => Some(Self::Sky(light)),
            _ => None,
        }
    }
}

/// Room for the hits that are looked at together.
pub(super) struct Together {
    /// Where they are, if that was found out.
    points: [Option<ShapePoint>; AHEAD],
    /// The normals on whose side they are taken to scatter, and their numbers.
    normals: [Vec3; AHEAD],
    numbers: [Vec2; AHEAD],
    receivers: Receivers<AHEAD>,
    on_quad: FoundOnQuad<AHEAD>,
    in_sky: FoundSky<AHEAD>,
}

impl Default for Together {
    fn default() -> Self {
        Self {
            points: [None; AHEAD],
            normals: [Vec3::ZERO; AHEAD],
            numbers: [Vec2::ZERO; AHEAD],
            receivers: Receivers::default(),
            on_quad: FoundOnQuad::default(),
            in_sky: FoundSky::NONE,
        }
    }
}

impl Together {
    /// Samples `light` for what the rays `ray(0)`, `ray(1)`, … meet, by the numbers `u(0)`, `u(1)`, …; `ahead` is what was looked at
    /// ahead there, if anything. `combined`: see [`Light::sample`].
    #[inline(always)]
    pub(super) fn sample<'r, V: Variant>(
        &mut self,
        (scene, light, combined): (&Scene, Only<'_>, bool),
        (hits, ahead): (&[Hit], Option<&Ahead>),
        ray: impl Fn(usize) -> &'r Ray,
        u: impl Fn(usize) -> Vec2,
    ) {
        self.receivers.count = hits.len();
        for (i, hit) in hits.iter().enumerate() {
            self.points[i] = None;
            if !hit.is_some() {
                continue;
            }
            let met = ahead.and_then(|ahead| ahead.met(i)).map(|met| met.point());
            let Some((point, n)) = scene.receiver(ray(i), *hit, met) else { continue };
            self.points[i] = Some(point);
            self.normals[i] = n;
            match V::ANY_LIGHTS {
                false => self.receivers.put(i, point.point.p, n, u(i)),
                true => self.numbers[i] = u(i),
            }
        }
        match light {
            Only::Quad(_, quad) => self.on_quad = quad.sample(&self.receivers),
            Only::Sky(sky) => {
                let receiver = |i: usize| self.points[i].map(|_| (self.normals[i], self.numbers[i]));
                sky.sample_all(hits.len(), receiver, combined, &mut self.in_sky);
            }
        }
    }

    /// Where the hit of this number is, if that was found out.
    #[inline(always)]
    pub(super) fn point(&self, index: usize) -> Option<&ShapePoint> {
        self.points[index].as_ref()
    }

    /// What was sampled for it, if it scatters on the side of this normal as it was taken to do.
    #[inline(always)]
    pub(super) fn light<V: Variant>(&self, light: Only<'_>, index: usize, n: Vec3) -> Option<Option<LightSample>> {
        let known = self.points[index].is_some() && self.normals[index] == n;
        if V::ANY_LIGHTS {
            return known.then(|| self.in_sky.sample(index));
        }
        let Only::Quad(light, quad) = light else { return None };
        known.then(|| light.found(quad, &self.on_quad, index))
    }
}
