//! Drives a render: hands tiles of samples to threads, counts progress, stops when asked to.
//!
//! Work is cut into units, a tile times a chunk of samples, and handed out in order: all tiles of the first chunk, then
//! of the second, so that a render that is stopped early shows the whole picture. Which thread takes which unit cannot
//! change a bit of it, for the film's sums are exact.

use crate::film::exact::Scale;
use crate::film::{Dropped, Film};
use crate::integrator::aov::Aovs;
use crate::integrator::{Integrator, RayCounts};
use crate::sampler::Sampler;
use crate::scene::Scene;
use rayon::ThreadPool;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Samples a pixel in one unit of work: enough to fill waves, few enough that a stop is never far.
const CHUNK: u32 = 16;

/// What to render.
#[derive(Clone, Copy, Debug)]
pub struct RenderSettings {
    /// Samples per pixel.
    pub samples: u32,
    /// Where uniform numbers come from.
    pub sampler: Sampler,
    /// How to estimate.
    pub integrator: Integrator,
}

/// What is known of a render while it runs; shared with whoever shows it or stops it.
#[derive(Debug, Default)]
pub struct Progress {
    samples: AtomicU64,
    rays: AtomicU64,
    started: AtomicBool,
    cancelled: AtomicBool,
}

impl Progress {
    /// Samples taken so far.
    pub fn samples(&self) -> u64 {
        self.samples.load(Ordering::Relaxed)
    }

    /// Rays traced so far.
    pub fn rays(&self) -> u64 {
        self.rays.load(Ordering::Relaxed)
    }

    /// Whether the render has begun, so that there is something to stop.
    pub fn is_started(&self) -> bool {
        self.started.load(Ordering::Relaxed)
    }

    /// Asks the render to stop soon.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether it was asked to stop.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// A finished render, or as much of it as was done.
pub struct Rendered {
    /// The sums.
    pub film: Film,
    /// Samples taken, over all pixels.
    pub samples: u64,
    /// Rays traced.
    pub rays: RayCounts,
    /// Samples left out because they were not finite or did not fit the film.
    pub dropped: Dropped,
    /// Wall time.
    pub time: Duration,
    /// Whether every sample was taken.
    pub complete: bool,
}

/// Work that is done.
#[derive(Clone, Copy, Default)]
struct Done {
    samples: u64,
    rays: RayCounts,
}

impl std::ops::AddAssign for Done {
    fn add_assign(&mut self, o: Self) {
        self.samples += o.samples;
        self.rays += o.rays;
    }
}

/// Number of samples that a render takes, over all pixels and the border around them, if there is one.
pub fn total_samples(scene: &Scene, settings: &RenderSettings) -> u64 {
    let film = &scene.film;
    film.filter.sampled_area(film.crop, film.sample_border).pixels() * u64::from(settings.samples)
}

/// Renders on the threads of `pool`.
pub fn render(scene: &Scene, settings: &RenderSettings, pool: &ThreadPool, progress: &Progress) -> Rendered {
    render_with(scene, settings, &Aovs::default(), pool, progress)
}

/// Renders on the threads of `pool`, with everything that is to be known beside radiance.
pub fn render_with(
    scene: &Scene,
    settings: &RenderSettings,
    aovs: &Aovs,
    pool: &ThreadPool,
    progress: &Progress,
) -> Rendered {
    let start = Instant::now();
    progress.started.store(true, Ordering::Relaxed);
    let f = &scene.film;
    let film = Film::new(f.crop, f.filter, f.sample_border, Scale::for_radiance(scene.brightest()));
    let film = if aovs.is_empty() { film } else { film.with_extras(aovs.extras(scene)) };
    let job = Job { scene, settings, aovs, film: &film, progress };
    let tiles = film.tile_count() as u64;
    let units = tiles * u64::from(settings.samples.div_ceil(CHUNK));
    let next = AtomicU64::new(0);
    let counts = pool.broadcast(|_| {
        let mut done = Done::default();
        while !progress.is_cancelled() {
            let unit = next.fetch_add(1, Ordering::Relaxed);
            if unit >= units {
                break;
            }
            done += render_unit(&job, unit);
        }
        done
    });
    let mut done = Done::default();
    counts.into_iter().for_each(|c| done += c);
    let Done { samples, rays } = done;
    let dropped = film.dropped();
    let complete = samples == total_samples(scene, settings);
    Rendered { film, samples, rays, dropped, time: start.elapsed(), complete }
}

/// What the threads share.
struct Job<'a> {
    scene: &'a Scene,
    settings: &'a RenderSettings,
    aovs: &'a Aovs,
    film: &'a Film,
    progress: &'a Progress,
}

fn render_unit(job: &Job<'_>, unit: u64) -> Done {
    let &Job { scene, settings, aovs, film, progress } = job;
    let tiles = film.tile_count() as u64;
    let first = (unit / tiles) as u32 * CHUNK;
    let last = first.saturating_add(CHUNK).min(settings.samples);
    let mut tile = film.start_tile((unit % tiles) as usize);
    let (integrator, sampler) = (&settings.integrator, &settings.sampler);
    let rays = if aovs.is_empty() {
        integrator.sample_tile(scene, sampler, first..last, &mut tile)
    } else {
        integrator.sample_tile_with(scene, sampler, aovs, first..last, &mut tile)
    };
    film.add(&tile);
    let samples = tile.bounds().pixels() * u64::from(last - first);
    progress.samples.fetch_add(samples, Ordering::Relaxed);
    progress.rays.fetch_add(rays.total(), Ordering::Relaxed);
    Done { samples, rays }
}
