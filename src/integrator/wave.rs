//! Walks paths in waves, vertex by vertex: every stage is a loop over the paths of a wave.
//!
//! ```text
//! camera rays ─▶ closest hits ─▶ light found ─▶ light sampled ─▶ bsdf, roulette ─▶ occlusion ─▶ finished paths leave
//!                    ▲                                                                 │
//!                    └─────────────────────────────────────────────────────────────────┘
//! ```
//!
//! Ray queries get a whole batch at a time, and a path's sums depend on nothing but the path: its uniform numbers are
//! functions of (pixel, sample, dimension), and its contributions are added in the order of its vertices.

use super::Integrator;
use super::path_state::{PathState, Segment};
use super::record::{Event, Record};
use super::technique::Technique;
use crate::accel::Hit;
use crate::film::SampleId;
use crate::light::Light;
use crate::math::float::min;
use crate::math::ray::Ray;
use crate::sampler::{BsdfUniforms, Sampler};
use crate::sampling::pdf::SolidAnglePdf;
use crate::scene::{Scene, Surface};
use crate::spectrum::Rgb;
use glam::{DVec3, Vec2};
use std::time::{Duration, Instant};

/// Paths of a wave: enough for whole batches of rays, few enough that their states (some 80 KiB) stay in a core's second
/// cache. Between 128 and 2048 the Cornell box takes the same time within 3 %.
const WAVE_SIZE: usize = 512;

/// Largest probability of surviving roulette: even light that loses nothing must not be followed for ever.
const MAX_SURVIVAL: f32 = 0.95;

/// Rays that were traced, and the time that took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// From the camera.
    pub camera: u64,
    /// From a surface, to find the next one.
    pub bounce: u64,
    /// From a surface to a light.
    pub shadow: u64,
    /// Time spent in ray queries, added up over threads.
    pub time: Duration,
}

impl RayCounts {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.camera + self.bounce + self.shadow
    }
}

impl std::ops::AddAssign for RayCounts {
    fn add_assign(&mut self, o: Self) {
        self.camera += o.camera;
        self.bounce += o.bounce;
        self.shadow += o.shadow;
        self.time += o.time;
    }
}

/// What all paths share.
#[derive(Clone, Copy)]
pub(super) struct Walker<'a> {
    pub(super) scene: &'a Scene,
    pub(super) sampler: &'a Sampler,
    pub(super) limits: &'a Integrator,
}

/// A light sample that waits to know whether it is visible.
struct Pending {
    path: u32,
    radiance: Rgb,
}

/// The paths of a wave, and the batches that ray queries work on.
#[derive(Default)]
struct Wave {
    paths: Vec<PathState>,
    rays: Vec<Ray>,
    hits: Vec<Hit>,
    shadow_rays: Vec<Ray>,
    pending: Vec<Pending>,
    occluded: Vec<bool>,
}

impl Walker<'_> {
    /// Walks the paths of `ids` to their ends and hands each sample's radiance to `sink`.
    pub(super) fn run<T: Technique>(
        &self,
        mut ids: impl Iterator<Item = SampleId>,
        record: &mut impl Record,
        counts: &mut RayCounts,
        sink: &mut impl FnMut(SampleId, Rgb),
    ) {
        let mut wave = Wave::default();
        loop {
            wave.paths.extend(ids.by_ref().take(WAVE_SIZE).map(|id| self.start(id)));
            if wave.paths.is_empty() {
                return;
            }
            counts.camera += wave.paths.len() as u64;
            self.trace(&mut wave, counts);
            if self.limits.hide_emitters {
                self.skip_emitters(&mut wave, counts);
            }
            loop {
                for i in 0..wave.paths.len() {
                    self.advance::<T>(&mut wave, i, record);
                }
                self.resolve_shadows(&mut wave, record, counts);
                retire(&mut wave.paths, sink);
                if wave.paths.is_empty() {
                    break;
                }
                counts.bounce += wave.paths.len() as u64;
                self.trace(&mut wave, counts);
            }
        }
    }

    /// A path that leaves the camera.
    fn start(&self, id: SampleId) -> PathState {
        let stream = self.sampler.stream(id.x, id.y, id.index);
        let film = Vec2::new(id.x as f32, id.y as f32) + stream.film();
        PathState {
            ray: self.scene.camera.ray(film),
            segment: Segment::Delta,
            throughput: Rgb::WHITE,
            radiance: Rgb::BLACK,
            eta_squared: 1.0,
            depth: 0,
            id,
            stream,
            alive: true,
        }
    }

    /// Finds what the current segment of every path meets.
    fn trace(&self, wave: &mut Wave, counts: &mut RayCounts) {
        wave.rays.clear();
        wave.rays.extend(wave.paths.iter().map(|p| p.ray));
        wave.hits.resize(wave.paths.len(), Hit::NONE);
        let start = Instant::now();
        self.scene.accel.closest_hits(&wave.rays, &mut wave.hits);
        counts.time += start.elapsed();
    }

    /// Lets camera rays pass through surfaces that emit.
    #[cold]
    fn skip_emitters(&self, wave: &mut Wave, counts: &mut RayCounts) {
        for (path, hit) in wave.paths.iter_mut().zip(&mut wave.hits) {
            while hit.is_some() && self.scene.appearances[hit.shape as usize].light.is_some() {
                let ray = path.ray;
                let point = self.scene.shapes[hit.shape as usize].meet(&ray, hit.primitive).point;
                let origin = point.origin_towards(ray.d);
                // What is left of the interval; the direction of a camera ray has unit length.
                let gone = (point.p.as_vec3() - ray.o).length();
                path.ray = Ray { o: origin, tmin: 0.0, d: ray.d, tmax: ray.tmax - gone };
                counts.camera += 1;
                self.scene.accel.closest_hits(&[path.ray], std::slice::from_mut(hit));
            }
        }
    }

    /// One vertex of one path: light found, light sampled, bsdf sampled, roulette.
    #[inline]
    fn advance<T: Technique>(&self, wave: &mut Wave, index: usize, record: &mut impl Record) {
        let (hit, path) = (wave.hits[index], &mut wave.paths[index]);
        path.depth += 1;
        record.event(Event::Traced { vertex: path.depth, ray: path.ray, hit });
        if !hit.is_some() {
            self.find_sky::<T>(path, record);
            return end(path, "nothing is met", record);
        }
        let surface = self.scene.surface(&path.ray, hit);
        // Light that the path ran into, weighted against sampling it.
        self.find_light::<T>(path, &surface, record);
        if path.depth >= self.limits.max_depth {
            return end(path, "the depth limit", record);
        }
        let wo = surface.frame.to_local(surface.wo);
        // Light sampled on purpose.
        if T::SAMPLES_LIGHTS
            && surface.bsdf.lobes().smooth
            && let Some((ray, radiance)) = self.sample_light::<T>(path, &surface, wo, record)
        {
            wave.shadow_rays.push(ray);
            wave.pending.push(Pending { path: index as u32, radiance });
        }
        // Go on by the bsdf, or end.
        let uniforms = path.stream.bsdf(path.depth - 1);
        let Some(sample) = T::sample_bsdf(surface.bsdf, wo, uniforms) else {
            return end(path, "the bsdf sample carries no energy", record);
        };
        path.throughput *= sample.weight;
        path.eta_squared *= sample.eta * sample.eta;
        path.segment = match sample.pdf {
            Some(pdf) => Segment::Smooth { pdf, from: surface.p() },
            None => Segment::Delta,
        };
        path.ray = surface.spawn(surface.frame.to_world(sample.wi));
        self.roulette(path, &uniforms, record);
    }

    /// Ends a path at random, the more likely the less it carries, and makes up for it in those that survive.
    #[inline]
    fn roulette(&self, path: &mut PathState, u: &BsdfUniforms, record: &mut impl Record) {
        let before = path.throughput;
        if before.is_black() {
            return end(path, "nothing is carried on", record);
        }
        if path.depth < self.limits.rr_depth {
            return record.event(Event::Scattered { throughput: before, survival: 1.0 });
        }
        // η² undoes the compression of radiance in dense media, which is no loss of energy (Veach 1997, section 5.2).
        let survival = min(before.max_component() * path.eta_squared, MAX_SURVIVAL);
        record.event(Event::Scattered { throughput: before, survival });
        // A throughput that is not a number ends here too, and has been counted by the film if it found light.
        if !(u.roulette() < survival) {
            return end(path, "roulette", record);
        }
        path.throughput = before / survival;
    }

    /// Light from infinitely far away, where the segment met nothing.
    #[inline]
    fn find_sky<T: Technique>(&self, path: &mut PathState, record: &mut impl Record) {
        if path.depth == 1 && self.limits.hide_emitters {
            return;
        }
        for &index in &self.scene.infinite_lights {
            if let Light::Constant(light) = &self.scene.lights[index as usize] {
                self.found::<T>(path, light.radiance, |_| light.pdf(), record);
            }
        }
    }

    /// Light of the surface that the segment met.
    #[inline]
    fn find_light<T: Technique>(&self, path: &mut PathState, surface: &Surface<'_>, record: &mut impl Record) {
        let Some(index) = surface.light else { return };
        if let Light::Area(light) = &self.scene.lights[index as usize] {
            let radiance = light.emitted(surface.point.n, surface.wo);
            if !radiance.is_black() {
                let shape = &self.scene.shapes[light.shape as usize];
                self.found::<T>(path, radiance, |from| light.pdf(shape, from, &surface.point), record);
            }
        }
    }

    /// Counts light at the end of the segment, which the light itself samples with the density `pdf(from)`.
    #[inline]
    fn found<T: Technique>(
        &self,
        path: &mut PathState,
        radiance: Rgb,
        pdf: impl Fn(DVec3) -> SolidAnglePdf,
        record: &mut impl Record,
    ) {
        let weight = match path.segment {
            Segment::Delta => 1.0,
            Segment::Smooth { pdf: bsdf, from } => {
                let light =
                    if T::SAMPLES_LIGHTS { pdf(from) * self.scene.light_sampler.pmf() } else { SolidAnglePdf(0.0) };
                T::found_weight(bsdf, light)
            }
        };
        let found = path.throughput * radiance * weight;
        record.event(Event::Found { radiance: found, weight });
        path.radiance += found;
    }

    /// A light sample that may count, with the ray that must be free for it.
    #[inline]
    fn sample_light<T: Technique>(
        &self,
        path: &PathState,
        surface: &Surface<'_>,
        wo: glam::Vec3,
        record: &mut impl Record,
    ) -> Option<(Ray, Rgb)> {
        let u = path.stream.light(path.depth - 1);
        let (index, pmf) = self.scene.light_sampler.sample(|| u.choice())?;
        let sample = self.scene.lights[index].sample(&self.scene.shapes, surface.p(), u.point())?;
        let wi = surface.frame.to_local(sample.wi);
        let f = surface.bsdf.eval(wo, wi);
        if f.is_black() {
            return None;
        }
        let pdf = sample.pdf * pmf;
        let weight = T::sampled_weight(pdf, surface.bsdf.pdf(wo, wi));
        let radiance = path.throughput * f * sample.radiance * (weight / pdf.0);
        record.event(Event::Sampled { radiance, weight });
        Some((surface.shadow_ray(&sample), radiance))
    }

    /// Counts the light samples that nothing hides.
    fn resolve_shadows(&self, wave: &mut Wave, record: &mut impl Record, counts: &mut RayCounts) {
        wave.occluded.resize(wave.shadow_rays.len(), false);
        counts.shadow += wave.shadow_rays.len() as u64;
        let start = Instant::now();
        self.scene.accel.occluded(&wave.shadow_rays, &mut wave.occluded);
        counts.time += start.elapsed();
        for (pending, &occluded) in wave.pending.iter().zip(&wave.occluded) {
            record.event(Event::Shadow { occluded });
            if !occluded {
                wave.paths[pending.path as usize].radiance += pending.radiance;
            }
        }
        wave.shadow_rays.clear();
        wave.pending.clear();
    }
}

/// Marks a path as finished; it leaves the wave once its light sample is decided.
#[inline]
fn end(path: &mut PathState, reason: &'static str, record: &mut impl Record) {
    path.alive = false;
    record.event(Event::Ended { reason, radiance: path.radiance });
}

/// Takes finished paths out of the wave.
fn retire(paths: &mut Vec<PathState>, sink: &mut impl FnMut(SampleId, Rgb)) {
    paths.retain(|path| {
        if !path.alive {
            sink(path.id, path.radiance);
        }
        path.alive
    });
}
