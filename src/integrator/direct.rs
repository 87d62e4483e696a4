//! Light sampled on purpose: one sample at a vertex, or several at the first, of which a few are looked for.
//!
//! # Candidates
//!
//! Most pixels get most of their light directly, and there the choice of a light, the point on it and the lobe that reflects it
//! make more noise than what is in the way. So the first vertex may take M light samples, which cost no ray; of their
//! contributions C₁ … C_M, the shadow aside, S are picked in proportion to their luminances, and each that is visible stands for
//! the S-th part of all (resampled importance sampling: Talbot, Cline and Egbert 2005, *Importance Resampling for Global
//! Illumination*). The expected value is that of looking for all of them. They are picked at equal distances along the sum of
//! luminances (systematic resampling: Carpenter, Clifford and Fearnhead 1999, *Improved Particle Filter for Nonlinear
//! Problems*), by one uniform number, so that what is picked twice takes one ray.
//!
//! Against the bsdf's own samples they weigh as M samples of the same density (Veach 1997, section 9.2.2), those that run into a
//! light at the second vertex as one against M.

use super::path_state::PathState;
use super::record::{Event, Record};
use super::technique::Technique;
use super::variant::Variant;
use super::wave::{RayCounts, Walker, with_avx2};
use crate::accel::Hit;
use crate::bsdf::{Gloss, Seen};
use crate::facts::{Feature, has};
use crate::light::{End, FoundSky, Light, LightSample, Lobe, Receiver};
use crate::material::{Layer, Scatter};
use crate::math::float::{max, min};
use crate::math::frame::Frame;
use crate::math::ray::Ray;
use crate::sampler::{Batch, LightUniforms, SamplerKind};
use crate::scene::Surface;
use crate::spectrum::Rgb;
use glam::Vec3;
use std::time::Instant;

/// Most light samples of a first vertex. Reason: with more, what is in the way is all that is left to be noise.
pub const MOST_CANDIDATES: u32 = 16;

/// Candidates for each ray. Between 1 and 4 the material ball and the plates of lights differ by 10 % in error against time; 2 is
/// best or near it for both.
const CANDIDATES_PER_RAY: u32 = 2;

/// The light samples of a first vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidates {
    /// How many, a power of two; 1 where there is nothing to pick.
    pub(super) count: u32,
    /// What their numbers come from.
    pub(super) kind: SamplerKind,
}

impl Candidates {
    /// `count` of them, if the sampler has so many numbers.
    pub(super) fn new(count: u32, kind: SamplerKind) -> Self {
        match kind.split(count) {
            Some(kind) => Self { count, kind },
            None => Self { count: 1, kind },
        }
    }

    /// How many are looked for.
    fn rays(self) -> u32 {
        (self.count / CANDIDATES_PER_RAY).max(1)
    }
}

/// A light sample that may count.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// Unit vector towards the light.
    pub(super) wi: Vec3,
    /// Where that ends on it.
    pub(super) end: Option<End>,
    /// What that is a point of.
    pub(super) on: Hit,
    /// What it adds then: weighted radiance, throughput included.
    pub(super) radiance: Rgb,
    /// Multiple-importance weight.
    pub(super) weight: f32,
    /// What is sought if something hides it, if anything.
    pub(super) scattered: Option<(u32, Rgb)>,
}

/// What is sought through glass where something hides a light sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sought {
    /// Index of the light.
    pub(super) light: u32,
    /// What the sample adds for each unit of radiance that arrives.
    pub(super) scattered: Rgb,
    /// Number of the vertex.
    pub(super) depth: u32,
}

/// Light samples of a wave that wait to know whether they are visible.
#[derive(Default)]
pub(super) struct Shadows {
    pub(super) rays: Vec<Ray>,
    pub(super) ends: Vec<[Hit; 2]>,
    pub(super) pending: Vec<Pending>,
    pub(super) occluded: Vec<bool>,
    /// As many as rays where some are sought; else none.
    pub(super) sought: Vec<Option<Sought>>,
    /// Room for those of one vertex.
    candidates: Vec<Candidate>,
}

pub(super) struct Pending {
    /// Index of the path in its wave.
    path: u32,
    pub(super) radiance: Rgb,
}

impl Shadows {
    /// Whether none waits.
    pub(super) fn is_empty(&self) -> bool {
        self.pending.is_empty()
    }

    /// The paths of a wave whose light samples wait, in order, and the directions of those, of any length.
    pub(super) fn directions(&self) -> impl Iterator<Item = (u32, Vec3)> {
        self.pending.iter().zip(&self.rays).map(|(pending, ray)| (pending.path, ray.d))
    }
}

impl Walker<'_> {
    /// Samples one light for the path `id` of a wave, which is on `hit`, a surface that scatters on the side of `n`. If the sample of the
    /// only light is known nothing else is asked.
    #[inline(always)]
    pub(super) fn sample_light<T: Technique>(
        &self,
        (path, hit, id): (&PathState, Hit, u32),
        (surface, n, lobe): (&Surface<'_>, Vec3, &Lobe),
        (known, u): (Option<Option<LightSample>>, impl FnOnce() -> LightUniforms),
        shadows: &mut Shadows,
        record: &mut impl Record,
    ) {
        if let Some(known) = known {
            if let Some(sample) = known
                && let Some(candidate) = self.weigh::<T>(path, (surface, None), &sample, (0, 1.0))
            {
                self.look_for::<T>((path, hit, id), surface, &candidate, shadows, record);
            }
            return;
        }
        let u = u();
        let receiver = || Receiver { p: surface.p().as_vec3(), n, lobe: *lobe };
        let chosen = match T::Variant::ANY_LIGHTS {
            true => self.scene.light_sampler.sample(receiver, || u.choice()),
            // There is one: nobody asks else.
            false => Some((0, 1.0)),
        };
        if let Some(chosen) = chosen
            && let Some(candidate) = self.candidate::<T>(path, (surface, n, None), chosen, 1.0, u)
        {
            self.look_for::<T>((path, hit, id), surface, &candidate, shadows, record);
        }
    }

    /// The same with several samples, by the numbers of path `index` among those that go on; `pick` is a uniform number that
    /// nothing else uses.
    #[inline(never)]
    pub(super) fn sample_candidates<T: Technique>(
        &self,
        from: (&PathState, Hit, u32),
        (surface, lobe): (&Surface<'_>, &Lobe),
        (numbers, index, pick): (&Batch, usize, f32),
        shadows: &mut Shadows,
        record: &mut impl Record,
    ) {
        let count = self.candidates.count as usize;
        let mut candidates = std::mem::take(&mut shadows.candidates);
        candidates.clear();
        with_avx2(
            self.level,
            #[inline(always)]
            || {
                let n = receiving_normal::<T>(surface);
                let seen = surface.bsdf.look_from(surface.frame.to_local(surface.wo));
                let lights = self.scene.light_sampler.at(|| Receiver { p: surface.p().as_vec3(), n, lobe: *lobe });
                let uniforms = (index * count..(index + 1) * count).map(|i| numbers.light(i));
                if Feature::Environment.is_built()
                    && let [Light::Environment(light)] = &self.scene.lights[..]
                {
                    let receiver = |i| Some((n, numbers.light(index * count + i).point()));
                    let mut found = FoundSky::<{ MOST_CANDIDATES as usize }>::NONE;
                    light.sample_all(count, receiver, T::COMBINES, &mut found);
                    for sample in (0..count).filter_map(|i| found.sample(i)) {
                        candidates.extend(self.weigh::<T>(from.0, (surface, Some(&seen)), &sample, (0, count as f32)));
                    }
                    return;
                }
                for u in uniforms {
                    if let Some(chosen) = lights.sample(|| u.choice()) {
                        let surface = (surface, n, Some(&seen));
                        candidates.extend(self.candidate::<T>(from.0, surface, chosen, count as f32, u));
                    }
                }
            },
        );
        let sum: f32 = candidates.iter().map(|c| c.radiance.luminance()).sum();
        let step = sum / self.candidates.rays() as f32;
        if !(step >= f32::MIN_POSITIVE && sum < f32::INFINITY) {
            // Nothing to pick by: what there is lies below or beyond all numbers.
            candidates.iter().for_each(|c| self.look_for::<T>(from, surface, c, shadows, record));
        } else {
            let (mut next, mut passed) = (pick * step, 0.0);
            for candidate in &candidates {
                let luminance = candidate.radiance.luminance();
                passed += luminance;
                let mut times = 0.0;
                while next < passed {
                    (next, times) = (next + step, times + 1.0);
                }
                if times > 0.0 {
                    let times = times * step / luminance;
                    let scattered = candidate.scattered.map(|(light, scattered)| (light, scattered * times));
                    let picked = Candidate { radiance: candidate.radiance * times, scattered, ..*candidate };
                    self.look_for::<T>(from, surface, &picked, shadows, record);
                }
            }
        }
        shadows.candidates = candidates;
    }

    /// A sample of the light that was chosen, one of `samples`; its index and the probability of choosing it. `n` is what
    /// [`receiving_normal`] says, and `seen` what the bsdf knows of the viewer, if it was asked.
    #[inline(always)]
    fn candidate<T: Technique>(
        &self,
        path: &PathState,
        (surface, n, seen): (&Surface<'_>, Vec3, Option<&Seen>),
        (index, pmf): (usize, f32),
        samples: f32,
        u: LightUniforms,
    ) -> Option<Candidate> {
        let sample = self.scene.lights[index].sample(&self.scene.shapes, surface.p(), n, u.point(), T::COMBINES)?;
        self.weigh::<T>(path, (surface, seen), &sample, (index, pmf * samples))
    }

    /// A sample of the light of this index with what it adds if nothing hides it; `pmf` is the number of samples times the probability
    /// of choosing the light.
    #[inline(always)]
    fn weigh<T: Technique>(
        &self,
        path: &PathState,
        (surface, seen): (&Surface<'_>, Option<&Seen>),
        sample: &LightSample,
        (index, pmf): (usize, f32),
    ) -> Option<Candidate> {
        let (wo, wi) = (surface.frame.to_local(surface.wo), surface.frame.to_local(sample.wi));
        let (f, bsdf_pdf) = match seen {
            Some(seen) => surface.bsdf.eval_pdf_seen(seen, wo, wi),
            None => surface.bsdf.eval_pdf(wo, wi),
        };
        if f.is_black() {
            return None;
        }
        has(Feature::Mis, sample.pdf.is_some());
        let (weight, pdf) = match sample.pdf {
            Some(pdf) => (T::sampled_weight(pdf * pmf, bsdf_pdf), (pdf * pmf).0),
            // No bsdf finds a light without size.
            None => (1.0, pmf),
        };
        let radiance = path.throughput * f * sample.radiance * (weight / pdf);
        let scattered = (self.seeks::<T>() && path.seeks && sample.pdf.is_some())
            .then(|| (index as u32, path.throughput * f * (weight / pdf)));
        Some(Candidate { wi: sample.wi, end: sample.end, on: sample.on, radiance, weight, scattered })
    }

    /// Has it looked whether a light sample is visible.
    #[inline(always)]
    pub(super) fn look_for<T: Technique>(
        &self,
        (path, hit, id): (&PathState, Hit, u32),
        surface: &Surface<'_>,
        sample: &Candidate,
        shadows: &mut Shadows,
        record: &mut impl Record,
    ) {
        let Candidate { wi, end, on, radiance, weight, scattered } = sample;
        let (on, radiance, weight) = (*on, *radiance, *weight);
        let ray = surface.shadow_ray(*wi, end.as_ref());
        record.event(Event::Sampled { radiance: path.carried * radiance, weight });
        let absorbs = self.absorbs::<T>();
        let radiance = if absorbs { self.absorb_shadow(path, surface, hit, &ray, radiance) } else { radiance };
        shadows.rays.push(ray);
        shadows.ends.push([hit, on]);
        shadows.pending.push(Pending { path: id, radiance });
        if self.seeks::<T>() {
            let sought = |(light, scattered)| Sought { light, scattered, depth: path.depth };
            shadows.sought.push(scattered.map(sought));
        }
    }

    /// Counts the light samples that nothing hides; `delta`: of delta lobes.
    pub(super) fn resolve_shadows(
        &self,
        (shadows, delta): (&mut Shadows, bool),
        paths: &mut [PathState],
        record: &mut impl Record,
        counts: &mut RayCounts,
    ) {
        let Shadows { rays, ends, occluded, .. } = shadows;
        occluded.resize(rays.len(), false);
        counts.shadow += rays.len() as u64;
        let start = Instant::now();
        self.scene.accel.occluded_between(rays, ends, occluded);
        counts.time += start.elapsed();
        if has(Feature::Transmission, !shadows.sought.is_empty()) {
            self.seek(shadows, counts);
        }
        let Shadows { rays, ends, pending, occluded, sought, .. } = shadows;
        for ((pending, &occluded), &ray) in pending.iter().zip(&*occluded).zip(&*rays) {
            let path = &mut paths[pending.path as usize];
            record.at(|| path.id);
            record.event(Event::Shadow { ray, radiance: path.carried * pending.radiance, delta, occluded });
            if !occluded {
                path.radiance += pending.radiance;
            }
        }
        rays.clear();
        ends.clear();
        pending.clear();
        sought.clear();
    }
}

/// Greatest part of what is scattered that the choice of a light takes to be in a lobe. Reason: what is beside the lobe is only guessed
/// to be so little.
const MOST_IN_LOBE: f32 = 0.9;

/// Least square of a lobe's angle for the choice of a light. Reason: what is narrower is a mirror, in which paths find lights with size by
/// themselves, and those without are next to never.
const LEAST_SPREAD: f32 = 1e-6;

impl Walker<'_> {
    /// The lobe by which a light is chosen at a surface.
    #[inline(always)]
    pub(super) fn lobe<T: Technique>(&self, surface: &Surface<'_>) -> Lobe {
        if !(T::Variant::ANY_LIGHTS && T::SAMPLES_LIGHTS && self.scene.light_sampler.has_choice()) {
            return Lobe::NONE;
        }
        if receiving_normal::<T>(surface) == Vec3::ZERO {
            return Lobe::NONE;
        }
        let wo = surface.frame.to_local(surface.wo);
        let Some(Gloss { alpha_squared, share }) = surface.bsdf.gloss(wo) else { return Lobe::NONE };
        let axis = surface.frame.to_world(Vec3::new(-wo.x, -wo.y, wo.z));
        Lobe { axis, spread: max(4.0 * alpha_squared, LEAST_SPREAD), share: min(share, MOST_IN_LOBE) }
    }
}

/// The normal on whose side a surface scatters; zero where that is both sides.
#[inline(always)]
pub(super) fn receiving_normal<T: Technique>(surface: &Surface<'_>) -> Vec3 {
    if !T::Variant::ANY_MATERIALS {
        return surface.frame.n;
    }
    has(Feature::Textures, matches!(surface.bsdf, Scatter::Layers(_)));
    match &surface.bsdf {
        Scatter::One(bsdf) if has(Feature::Transmission, bsdf.lobes().transmits) => Vec3::ZERO,
        Scatter::One(_) => surface.frame.n,
        Scatter::Layers(layers) => layers_normal(layers, &{ surface.frame }),
    }
}

/// The normal on whose side all layers of a surface scatter, in world space; zero where there is none.
#[inline(never)]
fn layers_normal(layers: &[Layer], frame: &Frame) -> Vec3 {
    let mut common = None;
    for layer in layers {
        let n = layer.perturbation.map_or(frame.n, |p| frame.to_world(p.frame.n));
        if layer.bsdf.lobes().transmits || common.is_some_and(|other| other != n) {
            return Vec3::ZERO;
        }
        common = Some(n);
    }
    common.unwrap_or(Vec3::ZERO)
}
