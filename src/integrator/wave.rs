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
use super::aov::Sink;
use super::direct::{Candidates, Shadows, receiving_normal};
use super::path_state::{NOTHING_INSIDE, PathState, Segment};
use super::record::{Event, Record};
use super::reuse::{Group, Reuse};
use super::technique::Technique;
use super::together::{Only, Together};
use super::variant::Variant;
use crate::accel::{Hit, Start};
use crate::camera::Camera;
use crate::facts::{Feature, has};
use crate::film::SampleId;
use crate::light::Lobe;
use crate::material::Layer;
use crate::math::float::{UNIT_ROUNDOFF, min};
use crate::math::ray::Ray;
use crate::sampler::{Batch, BsdfUniforms, Sampler};
use crate::scene::{AHEAD, Ahead, LookedAt, Scene, Surface};
use crate::spectrum::Rgb;
use fearless_simd::{Level, Simd};
use glam::{Vec2, Vec3};
use std::time::{Duration, Instant};

/// Paths of a wave: enough for whole batches of rays, few enough that their states (some 105 KiB) stay in a core's second
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
    /// Light samples of the first vertex.
    pub(super) candidates: Candidates,
    /// What the processor can do.
    pub(super) level: Level,
}

/// The paths of a wave, and the batches that ray queries work on.
#[derive(Default)]
pub(super) struct Wave {
    pub(super) paths: Vec<PathState>,
    /// Indices of the paths that go on, in order. All that follows has an element for each of them, or for some.
    active: Vec<u32>,
    rays: Vec<Ray>,
    from: Vec<Hit>,
    hits: Vec<Hit>,
    /// Light samples that wait to know whether they are visible.
    shadows: Shadows,
    /// Looks for the sky in mirrors, which wait for the same.
    glints: Shadows,
    /// What was looked at ahead, if the scene does.
    ahead: Ahead,
    /// Light that was sampled for many at once, if the scene lets that be.
    together: Box<Together>,
    /// Room for the layers of one surface.
    layers: Vec<Layer>,
    /// What neighbours share, if they do.
    reuse: Option<Reuse>,
    /// Uniform numbers of the vertex at hand, and of the film before there is one.
    bsdf_numbers: Batch,
    light_numbers: Batch,
}

impl Walker<'_> {
    /// Walks the paths of `ids` to their ends and hands each to `sink`.
    pub(super) fn run<T: Technique, S: Sink>(
        &self,
        ids: impl Iterator<Item = SampleId>,
        record: &mut impl Record,
        counts: &mut RayCounts,
        sink: &mut S,
    ) {
        // Not even the segment from the camera: black, as in Mitsuba.
        let black = self.limits.max_depth == 0;
        if black && !S::LOOKS {
            return ids.for_each(|id| sink.finished(0, &self.start(id)));
        }
        let mut ids = ids.peekable();
        let mut wave = Wave { reuse: self.limits.shares(self.scene).then(Reuse::default), ..Wave::default() };
        loop {
            wave.paths.clear();
            wave.paths.extend(ids.by_ref().take(WAVE_SIZE).map(|id| self.start(id)));
            let Some(last) = wave.paths.last().map(|path| path.id) else { return };
            if wave.reuse.is_some() {
                // Those who share are in one wave.
                let group = |id| Group::of(id, self.limits.reuse);
                let rest = std::iter::from_fn(|| ids.next_if(|&id| group(id) == group(last)));
                wave.paths.extend(rest.map(|id| self.start(id)));
            }
            wave.active.extend(0..wave.paths.len() as u32);
            self.aim(&mut wave);
            counts.camera += wave.paths.len() as u64;
            self.trace(&mut wave, true, counts);
            if self.limits.hide_emitters {
                self.skip_emitters(&mut wave, counts);
            }
            sink.first_hits(&wave.rays, &wave.paths, &wave.hits);
            if let Some(reuse) = &mut wave.reuse {
                reuse.start(&wave.paths, &wave.hits);
            }
            if black {
                wave.active.clear();
            }
            for vertex in 0.. {
                if wave.active.is_empty() {
                    break;
                }
                if vertex > 0 {
                    counts.bounce += wave.active.len() as u64;
                    self.trace(&mut wave, false, counts);
                }
                self.draw::<T>(&mut wave, vertex);
                self.advance_all::<T>(&mut wave, vertex, record);
                if let Some(reuse) = &mut wave.reuse {
                    reuse.sampled(vertex, &mut wave.paths, wave.shadows.directions());
                }
                self.resolve(&mut wave, record, counts);
                if let Some(reuse) = &mut wave.reuse {
                    reuse.passed(vertex, &mut wave.paths);
                }
                wave.active.retain(|&i| wave.paths[i as usize].alive);
            }
            if let Some(reuse) = &mut wave.reuse {
                self.share(reuse, &mut wave.paths, &mut wave.layers, counts);
            }
            for (index, path) in wave.paths.iter().enumerate() {
                record.at(|| path.id);
                if wave.reuse.is_some() {
                    record.event(Event::Shared);
                }
                record.event(Event::Finished { radiance: path.radiance });
                sink.finished(index, path);
            }
        }
    }

    /// Counts what nothing hides of the light that was looked for at a vertex.
    fn resolve(&self, wave: &mut Wave, record: &mut impl Record, counts: &mut RayCounts) {
        self.resolve_shadows((&mut wave.shadows, false), &mut wave.paths, record, counts);
        if !wave.glints.is_empty() {
            self.resolve_shadows((&mut wave.glints, true), &mut wave.paths, record, counts);
        }
    }

    /// A path that is going to leave the camera.
    fn start(&self, id: SampleId) -> PathState {
        PathState {
            ray: Ray::new(Vec3::ZERO, Vec3::Z),
            from: Hit::NONE,
            segment: Segment::Delta,
            throughput: Rgb::WHITE,
            carried: Rgb::WHITE,
            radiance: Rgb::BLACK,
            eta_squared: 1.0,
            inside: NOTHING_INSIDE,
            depth: 0,
            id,
            stream: self.sampler.stream(id.x.cast_unsigned(), id.y.cast_unsigned(), id.index),
            met: false,
            scattered: false,
            seeks: false,
            alive: true,
        }
    }

    /// Sends every path off from its point of the film.
    fn aim(&self, wave: &mut Wave) {
        let camera = &self.scene.camera;
        has(Feature::Lens, camera.has_lens());
        wave.bsdf_numbers.fill_film(camera.has_lens(), wave.paths.iter().map(|p| p.stream));
        match camera {
            Camera::Perspective(camera) => wave.aim(|film, _| camera.ray(film)),
            Camera::ThinLens(camera) => wave.aim(|film, lens| camera.ray(film, lens)),
            Camera::Orthographic(camera) => wave.aim(|film, _| camera.ray(film)),
            Camera::Panorama(camera) => wave.aim(|film, _| camera.ray(film)),
        }
    }

    /// Draws the uniform numbers that vertex `vertex` (counted from 0) may need, of all paths.
    fn draw<T: Technique>(&self, wave: &mut Wave, vertex: u32) {
        if vertex + 1 >= self.limits.max_depth {
            return;
        }
        let streams = wave.active.iter().map(|&i| wave.paths[i as usize].stream);
        wave.bsdf_numbers.fill_bsdf(vertex, streams.clone());
        if T::SAMPLES_LIGHTS && !self.scene.lights.is_empty() {
            let choice = T::Variant::ANY_LIGHTS && has(Feature::LightChoice, self.scene.lights.len() > 1);
            if vertex == 0 && has(Feature::Candidates, self.candidates.count > 1) {
                let Wave { paths, active, light_numbers, .. } = wave;
                let stream = |i: usize| paths[active[i] as usize].stream;
                let parts = (self.candidates.kind, self.candidates.count);
                light_numbers.fill_light_parts(vertex, choice, parts, stream, active.len());
            } else {
                wave.light_numbers.fill_light(vertex, choice, streams);
            }
        }
    }

    /// Finds what the current segment of every path meets.
    fn trace(&self, wave: &mut Wave, from_camera: bool, counts: &mut RayCounts) {
        let paths = wave.active.iter().map(|&i| &wave.paths[i as usize]);
        wave.rays.clear();
        wave.rays.extend(paths.clone().map(|p| p.ray));
        wave.from.clear();
        wave.from.extend(paths.map(|p| p.from));
        wave.hits.resize(wave.active.len(), Hit::NONE);
        let start = if from_camera { Start::Camera } else { Start::Primitives(&wave.from) };
        let now = Instant::now();
        self.scene.accel.closest_hits_from(&wave.rays, start, &mut wave.hits);
        counts.time += now.elapsed();
    }

    /// Lets camera rays pass through surfaces that emit.
    #[cold]
    fn skip_emitters(&self, wave: &mut Wave, counts: &mut RayCounts) {
        for (path, hit) in wave.paths.iter_mut().zip(&mut wave.hits) {
            while hit.is_some() && self.scene.appearances[hit.shape as usize].is_emitter {
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

    /// One vertex of every path.
    fn advance_all<T: Technique>(&self, wave: &mut Wave, vertex: u32, record: &mut impl Record) {
        let looks_ahead = T::Variant::ANY_MATERIALS && self.scene.looks_ahead();
        let only = self.only_light::<T>(vertex);
        with_avx2(
            self.level,
            #[inline(always)]
            || {
                let count = wave.active.len();
                for start in (0..count).step_by(AHEAD) {
                    let some = start..count.min(start + AHEAD);
                    if looks_ahead {
                        let Wave { paths, active, hits, ahead, .. } = &mut *wave;
                        let ray = |i: usize| &paths[active[start + i] as usize].ray;
                        self.scene.look_ahead(&hits[some.clone()], ray, ahead);
                    }
                    if let Some(light) = only {
                        let Wave { paths, active, hits, ahead, together, light_numbers, .. } = &mut *wave;
                        let ray = |i: usize| &paths[active[start + i] as usize].ray;
                        let u = |i: usize| light_numbers.light(start + i).point();
                        let hits = (&hits[some.clone()], looks_ahead.then_some(&*ahead));
                        together.sample::<T::Variant>((self.scene, light, T::COMBINES), hits, ray, u);
                    }
                    for index in some {
                        self.advance::<T>(wave, index, only, record);
                    }
                }
            },
        );
    }

    /// The only light, if it can be sampled for many at once and all paths sample it once at vertex `vertex` (counted from 0).
    #[inline(always)]
    fn only_light<T: Technique>(&self, vertex: u32) -> Option<Only<'_>> {
        let once = vertex > 0 || self.candidates.count == 1;
        let samples = T::SAMPLES_LIGHTS && once && vertex + 1 < self.limits.max_depth;
        if samples { Only::of::<T::Variant>(&self.scene.lights) } else { None }
    }

    /// One vertex of one path: light found, light sampled, bsdf sampled, roulette. Light was sampled already if there is but one,
    /// `only`.
    #[inline(always)]
    fn advance<T: Technique>(&self, wave: &mut Wave, index: usize, only: Option<Only<'_>>, record: &mut impl Record) {
        let id = wave.active[index];
        let (hit, path) = (wave.hits[index], &mut wave.paths[id as usize]);
        path.depth += 1;
        record.at(|| path.id);
        record.event(Event::Traced { vertex: path.depth, ray: path.ray, hit });
        if !hit.is_some() {
            if self.absorbs::<T>() {
                self.absorb_for_ever(path);
            }
            self.find_sky::<T>(path, record);
            return end(path, "nothing is met", record);
        }
        let met = Feature::Aovs.is_built() && std::mem::replace(&mut path.met, true);
        let last = path.depth >= self.limits.max_depth;
        if last && self.scene.appearances[hit.shape as usize].light.is_none() {
            return end(path, "the depth limit", record);
        }
        let looked_at = || wave.ahead.met(index % AHEAD);
        let point = if only.is_some() { wave.together.point(index % AHEAD) } else { None };
        let surface = match (T::Variant::ANY_MATERIALS, self.scene.regularizes()) {
            (false, _) => self.scene.plain_surface((&path.ray, hit, point)),
            (true, false) => self.scene.surface_looked_at((&path.ray, hit, point), looked_at, &mut wave.layers),
            (true, true) => self.regularized(path, hit, looked_at(), &mut wave.layers),
        };
        if self.absorbs::<T>() {
            self.absorb(path, &surface, hit);
        }
        // Light that the path ran into, weighted against sampling it.
        self.find_light::<T>(path, &surface, hit, record);
        if last {
            return end(path, "the depth limit", record);
        }
        let (mut has_joined, mut is_apart) = (false, false);
        if has(Feature::Sharing, wave.reuse.is_some())
            && path.depth == 2
            && let Some(reuse) = &mut wave.reuse
        {
            (has_joined, is_apart) = reuse.join(id as usize, path, &surface, hit);
        }
        let bsdf_numbers = wave.bsdf_numbers.bsdf(index);
        path.seeks = self.seeks::<T>() && !is_apart;
        // What others use as well sees each of them from another side.
        let lobe = if has_joined { Lobe::NONE } else { self.lobe::<T>(&surface) };
        // Light sampled on purpose.
        if T::SAMPLES_LIGHTS && surface.bsdf.lobes().smooth && !self.scene.lights.is_empty() {
            let from = (&*path, hit, id);
            if path.depth == 1 && has(Feature::Candidates, self.candidates.count > 1) {
                let numbers = (&wave.light_numbers, index, bsdf_numbers.roulette());
                self.sample_candidates::<T>(from, (&surface, &lobe), numbers, &mut wave.shadows, record);
            } else {
                let n = receiving_normal::<T>(&surface);
                let known = only.and_then(|light| wave.together.light::<T::Variant>(light, index % AHEAD, n));
                let numbers = || wave.light_numbers.light(index);
                self.sample_light::<T>(from, (&surface, n, &lobe), (known, numbers), &mut wave.shadows, record);
            }
        }
        // What such a lobe of a vertex that others use finds is a matter of its own: it does without.
        let mirrored = surface.bsdf.lobes().delta
            && self.has_glints::<T>()
            && !has_joined
            && self.look_for_glint::<T>((&*path, hit, id), &surface, &mut wave.glints, record);
        self.go_on::<T>(path, (&surface, lobe), (hit, met), (bsdf_numbers, mirrored), record);
    }

    /// Whether something absorbs light inside of it.
    #[inline(always)]
    pub(super) fn absorbs<T: Technique>(&self) -> bool {
        T::Variant::ANY_MATERIALS && self.scene.absorbs()
    }

    /// What a path meets where paths are regularized: something rougher once it has been scattered by what is no mirror. Not
    /// inlined, as few renders are so.
    #[inline(never)]
    fn regularized<'s>(
        &'s self,
        path: &mut PathState,
        hit: Hit,
        met: Option<LookedAt<'_>>,
        layers: &'s mut Vec<Layer>,
    ) -> Surface<'s> {
        path.scattered |= matches!(path.segment, Segment::Smooth { .. });
        match path.scattered {
            false => self.scene.surface_looked_at((&path.ray, hit, None), || met, layers),
            true => self.scene.rougher_surface(&path.ray, hit, met, layers),
        }
    }

    /// Sends a path on from a surface by its bsdf, or ends it. It had `met` something before; `mirrored`: the sky in its mirror has
    /// been looked for.
    #[inline(always)]
    fn go_on<T: Technique>(
        &self,
        path: &mut PathState,
        (surface, lobe): (&Surface<'_>, Lobe),
        (hit, met): (Hit, bool),
        (uniforms, mirrored): (BsdfUniforms, bool),
        record: &mut impl Record,
    ) {
        let wo = surface.frame.to_local(surface.wo);
        let Some(sample) = T::sample_bsdf(&surface.bsdf, wo, uniforms) else {
            return end(path, "the bsdf sample carries no energy", record);
        };
        path.throughput *= sample.weight;
        if T::Variant::ANY_MATERIALS && Feature::Transmission.is_built() {
            path.eta_squared *= sample.eta * sample.eta;
        }
        path.segment = match sample.pdf {
            Some(pdf) if Feature::Mis.is_built() => {
                Segment::Smooth { pdf, from: surface.p(), n: receiving_normal::<T>(surface), lobe, seeks: path.seeks }
            }
            pdf => {
                if Feature::Aovs.is_built() && pdf.is_none() && sample.wi == -wo {
                    // Straight through: as if there were nothing, as far as alpha goes.
                    path.met = met;
                }
                match wo.z * sample.wi.z > 0.0 {
                    true if mirrored => Segment::Mirror,
                    false if self.seeks::<T>() && self.through(surface, hit).is_some() => self.passed(path),
                    _ => Segment::Delta,
                }
            }
        };
        path.ray = surface.spawn(surface.frame.to_world(sample.wi));
        path.from = hit;
        if self.absorbs::<T>() {
            path.inside = self.inside_towards(path, surface, hit, &{ path.ray.d });
        }
        self.roulette::<T>(path, &uniforms, record);
    }

    /// Ends a path at random, the more likely the less it carries, and makes up for it in those that survive.
    #[inline(always)]
    fn roulette<T: Technique>(&self, path: &mut PathState, u: &BsdfUniforms, record: &mut impl Record) {
        let before = path.throughput;
        if before.is_black() {
            return end(path, "nothing is carried on", record);
        }
        if !before.is_finite() {
            // Without this a sample that finds no light after all would pass for black.
            path.radiance = before;
            return end(path, "the throughput is not finite", record);
        }
        let delta = !matches!(path.segment, Segment::Smooth { .. });
        if path.depth < self.limits.rr_depth {
            return record.event(Event::Scattered { throughput: before, survival: 1.0, delta });
        }
        // η² undoes the compression of radiance in dense media, which is no loss of energy (Veach 1997, section 5.2).
        let whole = if Feature::Sharing.is_built() { before * path.carried } else { before };
        let eta_squared = if T::Variant::ANY_MATERIALS { path.eta_squared } else { 1.0 };
        let survival = attainable(min(whole.max_component() * eta_squared, MAX_SURVIVAL));
        record.event(Event::Scattered { throughput: before * path.carried, survival, delta });
        if !(u.roulette() < survival) {
            return end(path, "roulette", record);
        }
        path.throughput = before / survival;
    }
}

/// `probability`, in (0, 1), rounded up to one that comparing with a uniform number attains exactly: these are multiples
/// of 2⁻²⁴ ([`crate::sampler`]), so that P(u < k·2⁻²⁴) = k·2⁻²⁴, while in between the next multiple would be what happens
/// and a smaller number what the survivors are divided by.
#[inline]
fn attainable(probability: f32) -> f32 {
    // Both products only change the exponent.
    (probability / UNIT_ROUNDOFF).ceil() * UNIT_ROUNDOFF
}

/// Marks a path as finished; it leaves the wave once its light sample is decided.
#[inline]
fn end(path: &mut PathState, reason: &'static str, record: &mut impl Record) {
    path.alive = false;
    record.event(Event::Ended { reason });
}

impl Wave {
    /// Gives every path its camera ray, a function of its points of the film and of the lens.
    #[inline(always)]
    fn aim(&mut self, ray: impl Fn(Vec2, Vec2) -> Ray) {
        for (i, path) in self.paths.iter_mut().enumerate() {
            let film = Vec2::new(path.id.x as f32, path.id.y as f32) + self.bsdf_numbers.film(i);
            path.ray = ray(film, self.bsdf_numbers.lens(i));
        }
    }
}

/// Runs `f`, compiled for AVX2 where the processor has it: the same operations in the same order, so the same bits, but
/// fewer instructions. Only what is inlined into `f` gains.
#[inline(always)]
pub(super) fn with_avx2(level: Level, f: impl FnOnce()) {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx2) = level.as_avx2() {
        return avx2.vectorize(f);
    }
    f();
}
