//! Light samples for many paths at once, where the only light is a quad.
//!
//! Sampling a quad is the most that such a scene's paths work out, and the same for all of them. So of the hits that are looked at
//! together it is first found where they are, then light is sampled for all, in vectors, and then each has its turn. That changes no
//! bit: what is sampled for a path does not depend on who else is there ([`crate::light::Quad`]).

use crate::accel::Hit;
use crate::light::{AreaLight, Found, LightSample, Quad, Receivers};
use crate::math::ray::Ray;
use crate::scene::{AHEAD, Ahead, Scene};
use crate::shape::surface::ShapePoint;
use glam::{Vec2, Vec3};

/// Room for the hits that are looked at together.
#[derive(Default)]
pub(super) struct Together {
    /// Where they are, if that was found out.
    points: [Option<ShapePoint>; AHEAD],
    /// The normals on whose side they are taken to scatter.
    normals: [Vec3; AHEAD],
    receivers: Receivers<AHEAD>,
    found: Found<AHEAD>,
}

impl Together {
    /// Samples `quad` for what the rays `ray(0)`, `ray(1)`, … meet, by the numbers `u(0)`, `u(1)`, …; `ahead` is what was looked at
    /// ahead there, if anything.
    #[inline(always)]
    pub(super) fn sample<'r>(
        &mut self,
        scene: &Scene,
        quad: &Quad,
        (hits, ahead): (&[Hit], Option<&Ahead>),
        ray: impl Fn(usize) -> &'r Ray,
        u: impl Fn(usize) -> Vec2,
    ) {
        for (i, hit) in hits.iter().enumerate() {
            self.points[i] = None;
            if !hit.is_some() {
                continue;
            }
            let ray = ray(i);
            let met = ahead.and_then(|ahead| ahead.met(i)).map(|met| met.point());
            let Some((point, n)) = scene.receiver(ray, *hit, met) else { continue };
            self.points[i] = Some(point);
            self.normals[i] = n;
            self.receivers.put(i, point.point.p, n, u(i));
        }
        self.found = quad.sample(&self.receivers);
    }

    /// Where the hit of this number is, if that was found out.
    #[inline(always)]
    pub(super) fn point(&self, index: usize) -> Option<&ShapePoint> {
        self.points[index].as_ref()
    }

    /// What was sampled for it, if it scatters on the side of this normal as it was taken to do.
    #[inline(always)]
    pub(super) fn light(&self, light: &AreaLight, quad: &Quad, index: usize, n: Vec3) -> Option<Option<LightSample>> {
        let known = self.points[index].is_some() && self.normals[index] == n;
        known.then(|| light.found(quad, &self.found, index))
    }
}
