//! Light sampled through glass: shadow rays go on where they meet what lets light through in one direction, as it does.
//!
//! A lamp behind a pane, or behind what is half transparent, is found by paths that the bsdf happens to send through, and seldom: no
//! shadow ray of a vertex x reaches it. So a direction w that was sampled for the light l is followed where something is in its way: through
//! interfaces by refraction, with the part T of the light that they let pass. If what it then meets is l, it counts,
//! with the radiance of that point. Bent directions need no correction: w is what was sampled, and its density at x is known.
//!
//! # Weights
//!
//! Two ways find light of l in the direction w of x, by interfaces that are all passed: x samples l with the density p_l(w), and the path
//! goes on by the bsdf with the density p(w), passing each interface by chance. Each weighs against the other as where nothing is in between
//! ([`Technique::sampled_weight`], [`Technique::found_weight`]), with densities of the *same* w at x. So what goes on keeps w
//! ([`Segment::Through`]), and p_l(w) is that of the point of l where the *straight* line would meet it; if there is none, the light can only be
//! found by chance, and counts as ever. That number is unique only where a line meets the front of a light once: of skies,
//! rectangles, spheres from outside and disks ([`Walker::can_be_sought`]). Of other lights nothing is sought.
//!
//! It is sought behind panes only ([`crate::scene::Appearance::is_pane`]): what passes straight on, or nearly so, and plane pieces of glass. What is seen
//! through a ball of glass lies elsewhere, so that following it is next to always in vain.
//!
//! Reflection, and what passes by a wider lobe, is no part of it, and neither are lights without size: as in Mitsuba's `path`, they shine through nothing.
//! Where something absorbs, or paths are regularized, everything is as without. So is it at second vertices whose light is kept
//! apart by direction ([`super::reuse`]): what is found at the next vertex and what is found beyond are shared differently there.

use super::direct::{Shadows, Sought};
use super::path_state::{PathState, Segment};
use super::technique::Technique;
use super::variant::Variant;
use super::wave::{RayCounts, Walker};
use crate::accel::{Hit, Start};
use crate::facts::{Feature, has};
use crate::light::{AreaLight, Light, Receiver};
use crate::material::Layer;
use crate::math::ray::Ray;
use crate::sampling::pdf::SolidAnglePdf;
use crate::scene::Surface;
use crate::shape::Shape;
use crate::spectrum::Rgb;
use glam::{DVec3, Vec3};
use std::time::Instant;

/// A direction that is followed.
struct Followed {
    /// Which of the shadow rays.
    index: usize,
    /// What is left of the light.
    left: Rgb,
    /// Vertices of the path up to what `ray` will meet.
    depth: u32,
}

impl Walker<'_> {
    /// Whether light is sought through glass.
    #[inline(always)]
    pub(super) fn seeks<T: Technique>(&self) -> bool {
        T::SAMPLES_LIGHTS
            && T::Variant::ANY_MATERIALS
            && has(Feature::Transmission, !self.scene.panes.is_empty())
            && !self.scene.regularizes()
            && !self.scene.absorbs()
    }

    /// Whether a line meets the front of a light at most once, wherever it starts.
    fn can_be_sought(&self, light: &Light) -> bool {
        match light {
            Light::Constant(_) | Light::Environment(_) => true,
            Light::Area(light) => match &self.scene.shapes[light.shape as usize] {
                Shape::Mesh(_) => light.quad().is_some(),
                Shape::Sphere(sphere) => !sphere.flip,
                Shape::Disk(_) => true,
                Shape::Cylinder(_) | Shape::Placed(_) => false,
            },
            _ => false,
        }
    }

    /// Follows the light samples that something hides through what lets them pass, and takes note of those that arrive.
    #[inline(never)]
    pub(super) fn seek(&self, shadows: &mut Shadows, counts: &mut RayCounts) {
        let Shadows { rays: shadow_rays, ends, pending, occluded, sought, .. } = shadows;
        let mut layers: Vec<Layer> = Vec::new();
        let (mut followed, mut rays, mut from) = (Vec::new(), Vec::new(), Vec::new());
        for (index, sought) in sought.iter().enumerate() {
            let ray = &shadow_rays[index];
            if occluded[index]
                && let Some(sought) = sought
                && sought.depth + 1 < self.limits.max_depth
                && self.can_be_sought(&self.scene.lights[sought.light as usize])
                && self.scene.panes.may_be_met(ray)
            {
                followed.push(Followed { index, left: Rgb::WHITE, depth: sought.depth + 1 });
                rays.push(Ray::new(ray.o, ray.d.normalize()));
                from.push(ends[index][0]);
            }
        }
        let mut hits = Vec::new();
        while !followed.is_empty() {
            hits.clear();
            hits.resize(rays.len(), Hit::NONE);
            counts.shadow += rays.len() as u64;
            let now = Instant::now();
            self.scene.accel.closest_hits_from(&rays, Start::Primitives(&from), &mut hits);
            counts.time += now.elapsed();
            let mut kept = 0;
            for i in 0..followed.len() {
                let Followed { index, left, depth } = followed[i];
                let (ray, hit, Some(sought)) = (rays[i], hits[i], &sought[index]) else { continue };
                if let Some(radiance) = self.arrives(&ray, hit, sought) {
                    // Had nothing been in the way, it would have been visible.
                    if depth > sought.depth + 1 {
                        pending[index].radiance = sought.scattered * left * radiance;
                        occluded[index] = false;
                    }
                } else if self.is_pane(hit) && depth < self.limits.max_depth {
                    // Asked before: what is opaque need not be worked out.
                    let surface = self.scene.surface(&ray, hit, &mut layers);
                    let Some((wi, part)) = self.through(&surface, hit) else { continue };
                    followed[kept] = Followed { index, left: left * part, depth: depth + 1 };
                    (rays[kept], from[kept]) = (surface.spawn(surface.frame.to_world(wi)), hit);
                    kept += 1;
                }
            }
            followed.truncate(kept);
            rays.truncate(kept);
            from.truncate(kept);
        }
    }

    /// The radiance that arrives from the light that is sought, if the ray meets that.
    fn arrives(&self, ray: &Ray, hit: Hit, sought: &Sought) -> Option<Rgb> {
        let radiance = match &self.scene.lights[sought.light as usize] {
            Light::Constant(light) if !hit.is_some() => light.radiance,
            Light::Environment(light) if !hit.is_some() => light.seen(&{ ray.d }, Vec3::ZERO, true).0,
            Light::Area(light) if hit.is_some() && hit.shape == light.shape => {
                let point = self.scene.shapes[hit.shape as usize].meet(ray, hit.primitive).point;
                light.emitted(point.n, -ray.d)
            }
            _ => return None,
        };
        (!radiance.is_black()).then_some(radiance)
    }

    /// Where light comes from through a surface that it may be sought behind, and which part of it passes.
    #[inline(never)]
    pub(super) fn through(&self, surface: &Surface<'_>, hit: Hit) -> Option<(Vec3, Rgb)> {
        if self.is_pane(hit) { surface.bsdf.through(surface.frame.to_local(surface.wo)) } else { None }
    }

    /// Whether light may be sought behind what was hit, if anything was.
    fn is_pane(&self, hit: Hit) -> bool {
        hit.is_some() && self.scene.appearances[hit.shape as usize].is_pane
    }

    /// What becomes of a segment whose end is passed by a delta lobe; `sampled_at_first`: it came from the first vertex.
    #[inline(never)]
    pub(super) fn passed(&self, path: &PathState) -> Segment {
        match path.segment {
            Segment::Smooth { pdf, from, n, lobe, seeks: true } => {
                Segment::Through { pdf, from, n, lobe, d: path.ray.d, first: path.depth == 2 }
            }
            through @ Segment::Through { .. } => through,
            _ => Segment::Delta,
        }
    }

    /// The weight of light of this index that a path found which came through glass, if it was sampled so.
    #[inline(never)]
    pub(super) fn weight_through<T: Technique>(&self, segment: &Segment, index: usize) -> f32 {
        let Segment::Through { pdf, from, n, lobe, d, first } = *segment else { return 1.0 };
        let light = &self.scene.lights[index];
        if !self.can_be_sought(light) {
            return 1.0;
        }
        let density = match light {
            Light::Constant(light) => light.pdf(d, n, T::COMBINES),
            Light::Environment(light) => light.seen(&d, n, T::COMBINES).1,
            Light::Area(light) => self.straight_pdf(light, from, n, d),
            _ => SolidAnglePdf(0.0),
        };
        let pmf = match T::Variant::ANY_LIGHTS {
            true => self.scene.light_sampler.pmf(index, || Receiver { p: from.as_vec3(), n, lobe }),
            false => 1.0,
        };
        let samples = if Feature::Candidates.is_built() && first { self.candidates.count as f32 } else { 1.0 };
        let sampled = density * (pmf * samples);
        // What is never sampled counts as ever.
        if sampled.0 > 0.0 && density.0.is_finite() { T::found_weight(pdf, sampled) } else { 1.0 }
    }

    /// Density with which a light is sampled in the direction `d` from a point, as if nothing were in the way.
    fn straight_pdf(&self, light: &AreaLight, from: DVec3, n: Vec3, d: Vec3) -> SolidAnglePdf {
        let (shape, ray) = (&self.scene.shapes[light.shape as usize], Ray::new(from.as_vec3(), d));
        let met = (0..shape.primitive_count() as u32).find(|&primitive| shape.intersect(primitive, &ray).is_some());
        let point = met.map(|primitive| shape.meet(&ray, primitive).point).filter(|point| point.n.dot(d) < 0.0);
        point.map_or(SolidAnglePdf(0.0), |point| light.pdf(shape, from, n, &point))
    }
}
