//! Drives a render: hands tiles of samples to threads, counts progress, stops when asked to.
//!
//! Work is cut into units, a tile times a chunk of samples, and handed out in order: all tiles of the first chunk, then
//! of the second, so that a render that is stopped early shows the whole picture. Which thread takes which unit cannot
//! change a bit of it, for the film's sums are exact.
//!
//! A render that is to reach a certain error, or to take its samples where there is most of it, is [`adaptive`].

pub mod adaptive;
mod ledger;
mod schedule;

pub use ledger::Standing;

use crate::error_estimate::{Estimates, Parts};
use crate::film::exact::Scale;
use crate::film::{Dropped, Film};
use crate::image::Plane;
use crate::integrator::aov::Aovs;
use crate::integrator::{Integrator, RayCounts, Work};
use crate::sampler::Sampler;
use crate::scene::Scene;
use ledger::Ledger;
use rayon::ThreadPool;
use schedule::Schedule;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{PoisonError, RwLock};
use std::time::{Duration, Instant};

/// What to render.
#[derive(Clone, Copy, Debug)]
pub struct RenderSettings {
    /// Samples per pixel.
    pub samples: u32,
    /// Where uniform numbers come from.
    pub sampler: Sampler,
    /// How to estimate.
    pub integrator: Integrator,
    /// The radiance above which a sample is scaled down to it, which makes the picture biased.
    pub clamp: Option<f32>,
}

/// What is known of a render while it runs; shared with whoever shows it or stops it.
#[derive(Debug, Default)]
pub struct Progress {
    samples: AtomicU64,
    rays: AtomicU64,
    earlier_samples: AtomicU64,
    earlier_rays: AtomicU64,
    /// Bits of an f64: the estimated relative error so far; 0 before there is one.
    error: AtomicU64,
    started: AtomicBool,
    cancelled: AtomicBool,
}

impl Progress {
    /// Samples taken so far, in all runs of the render.
    pub fn samples(&self) -> u64 {
        self.samples.load(Ordering::Relaxed)
    }

    /// Samples and rays of this run.
    pub fn of_this_run(&self) -> [u64; 2] {
        let pairs = [(&self.samples, &self.earlier_samples), (&self.rays, &self.earlier_rays)];
        pairs.map(|(all, earlier)| all.load(Ordering::Relaxed) - earlier.load(Ordering::Relaxed))
    }

    /// The relative error so far, as it is estimated, if it has been.
    pub fn error(&self) -> Option<f64> {
        let error = f64::from_bits(self.error.load(Ordering::Relaxed));
        (error > 0.0).then_some(error)
    }

    fn set_error(&self, error: f64) {
        self.error.store(error.to_bits(), Ordering::Relaxed);
    }

    fn count(&self, done: &Done) {
        self.samples.fetch_add(done.samples, Ordering::Relaxed);
        self.rays.fetch_add(done.rays.total(), Ordering::Relaxed);
    }

    /// Counts what earlier runs did.
    fn resume(&self, done: &Done) {
        self.earlier_samples.store(done.samples, Ordering::Relaxed);
        self.samples.store(done.samples, Ordering::Relaxed);
        self.earlier_rays.store(done.rays.total(), Ordering::Relaxed);
        self.rays.store(done.rays.total(), Ordering::Relaxed);
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
    /// Why it ended.
    pub ended: Ended,
    /// Whether samples went where the error is; else every pixel has the same number, but for what was left undone.
    pub is_adaptive: bool,
    /// What its samples say of its error; nothing where there are too few.
    pub estimates: Option<Estimates>,
}

impl Rendered {
    /// Whether it ended by itself.
    pub fn is_complete(&self) -> bool {
        self.ended != Ended::Stopped
    }
}

/// Why a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// All samples were taken.
    Samples,
    /// The time was up.
    Time,
    /// The error was small enough.
    Error,
    /// It was asked to stop.
    Stopped,
}

/// Work that is done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Done {
    /// Samples taken, over all pixels.
    pub samples: u64,
    /// Rays traced.
    pub rays: RayCounts,
}

impl std::ops::AddAssign for Done {
    fn add_assign(&mut self, o: Self) {
        self.samples += o.samples;
        self.rays += o.rays;
    }
}

/// How far a render is: enough to go on from there, in this process or another, as if it had never been stopped.
pub struct State {
    /// The sums of what is done.
    pub film: Film,
    /// Which work that is.
    pub reached: Reached,
    /// How much it is.
    pub done: Done,
    /// The wall time that it took.
    pub time: Duration,
}

/// Which work of a render is done.
pub enum Reached {
    /// Of one whose pixels all get the same number of samples: units.
    Units(Standing),
    /// Of one whose samples go where the error is: passes.
    Passes(adaptive::Passes),
}

impl State {
    /// All sums, as planes of whole numbers for a file.
    pub fn to_planes(&self) -> Vec<Plane> {
        match &self.reached {
            Reached::Units(_) => self.film.to_planes(),
            Reached::Passes(passes) => passes.to_planes(&self.film),
        }
    }
}

/// Number of samples that a render of so many samples a pixel takes, over all pixels and the border around them, if there is
/// one.
pub fn total_samples(scene: &Scene, samples: u32) -> u64 {
    let film = &scene.film;
    film.filter.sampled_area(film.crop, film.sample_border).pixels() * u64::from(samples)
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
    let session = Session::new(scene, settings, aovs, 0..settings.samples, progress);
    session.run(pool);
    session.finish()
}

/// An empty film for the scene, with all that is to be known beside radiance.
fn empty_film(scene: &Scene, clamp: Option<f32>, aovs: &Aovs) -> Film {
    let f = &scene.film;
    let film = Film::new(f.crop, f.filter, f.sample_border, Scale::for_radiance(scene.brightest()));
    let film = match clamp {
        Some(most) => film.clamped(most),
        None => film,
    };
    if aovs.is_empty() { film } else { film.with_extras(aovs.extras(scene)) }
}

/// A render of some of the samples of every pixel, of which a [`State`] can be had at any time.
pub struct Session<'a> {
    scene: &'a Scene,
    settings: &'a RenderSettings,
    aovs: &'a Aovs,
    /// Which samples of each pixel to take, and in which order.
    schedule: Schedule,
    /// How long it may take.
    limit: Option<Duration>,
    /// Whether it could have gone on for longer.
    out_of_time: AtomicBool,
    film: Film,
    ledger: Ledger,
    /// Held for reading while a unit is entered into film and ledger, so that whoever holds it for writing sees the same
    /// units in both.
    entering: RwLock<()>,
    progress: &'a Progress,
    start: Instant,
    /// Wall time of what was done in earlier runs.
    before: Duration,
}

impl<'a> Session<'a> {
    /// A render of the samples `samples` of every pixel, not begun; they are the same numbers of the same sequence as in a
    /// render of all `settings.samples`.
    pub fn new(
        scene: &'a Scene,
        settings: &'a RenderSettings,
        aovs: &'a Aovs,
        samples: Range<u32>,
        progress: &'a Progress,
    ) -> Self {
        Self::scheduled(scene, settings, aovs, (Schedule::counted(samples, settings.samples), None), progress)
    }

    /// A render of as many samples of every pixel as there is time for, at least one, and at most `settings.samples`. The picture is that
    /// of a render of just so many.
    pub fn timed(
        scene: &'a Scene,
        settings: &'a RenderSettings,
        aovs: &'a Aovs,
        time: Duration,
        progress: &'a Progress,
    ) -> Self {
        Self::scheduled(scene, settings, aovs, (Schedule::Open { most: settings.samples }, Some(time)), progress)
    }

    fn scheduled(
        scene: &'a Scene,
        settings: &'a RenderSettings,
        aovs: &'a Aovs,
        (schedule, limit): (Schedule, Option<Duration>),
        progress: &'a Progress,
    ) -> Self {
        let film = empty_film(scene, settings.clamp, aovs).with_parts(Parts::Halves.count());
        let ledger = Ledger::new(units(&film, &schedule));
        let (entering, start, before) = (RwLock::new(()), Instant::now(), Duration::ZERO);
        let out_of_time = AtomicBool::new(false);
        Self { scene, settings, aovs, schedule, limit, out_of_time, film, ledger, entering, progress, start, before }
    }

    /// Goes on from where a render of the same samples of the same scene with the same settings stood, which the caller must know.
    ///
    /// `None` where its film or the units of work that are done are not those of such a render.
    pub fn resume(self, state: State) -> Option<Self> {
        let State { film, reached: Reached::Units(standing), done, time } = state else { return None };
        let ledger = Ledger::resumed(units(&self.film, &self.schedule), &standing, done)?;
        self.film.add_film(&film)?;
        self.progress.resume(&done);
        Some(Self { ledger, before: time, ..self })
    }

    /// Takes the samples that are left on the threads of `pool`, until the progress is cancelled.
    pub fn run(&self, pool: &ThreadPool) {
        self.progress.started.store(true, Ordering::Relaxed);
        pool.broadcast(|_| {
            while !self.progress.is_cancelled()
                && let Some(unit) = self.ledger.take(|unit| self.has_time_for(unit))
            {
                self.render_unit(unit);
            }
        });
    }

    /// Whether a new unit may begin: one of a chunk that has begun always, the first of a chunk where all of it may be done in time.
    fn has_time_for(&self, unit: u64) -> bool {
        let (tiles, elapsed) = (self.film.tile_count() as u64, self.time());
        let (chunk, before) = (unit / tiles, self.schedule.before(unit / tiles));
        let Some(limit) = self.limit.filter(|_| unit.is_multiple_of(tiles) && before > 0) else { return true };
        let samples = self.schedule.chunk(chunk).0.len() as f64;
        let has = elapsed.as_secs_f64() * (1.0 + samples / f64::from(before)) <= limit.as_secs_f64();
        if !has {
            self.out_of_time.store(true, Ordering::Relaxed);
        }
        has
    }

    /// Estimates the error of what is there so far, and tells whoever looks at the progress.
    pub fn look(&self) {
        if let Some(estimates) = self.estimates() {
            self.progress.set_error(estimates.error());
        }
    }

    /// What the two halves say of each other, once both have samples.
    fn estimates(&self) -> Option<Estimates> {
        self.film.has_parts().then(|| Estimates::from_halves(&self.film))
    }

    /// How far it is, also while it runs; threads wait only as long as it takes to copy the sums.
    pub fn state(&self) -> State {
        let _nothing_enters = self.entering.write().unwrap_or_else(PoisonError::into_inner);
        State {
            film: self.film.copied(),
            reached: Reached::Units(self.ledger.standing()),
            done: self.ledger.done(),
            time: self.time(),
        }
    }

    /// Wall time so far, with that of earlier runs.
    fn time(&self) -> Duration {
        self.before + self.start.elapsed()
    }

    /// What came of it.
    pub fn finish(self) -> Rendered {
        let (time, estimates) = (self.time(), self.estimates());
        let (Done { samples, rays }, dropped) = (self.ledger.done(), self.film.dropped());
        let ended = match (self.ledger.is_complete(), self.out_of_time.into_inner()) {
            (true, _) => Ended::Samples,
            (false, true) if !self.progress.is_cancelled() => Ended::Time,
            _ => Ended::Stopped,
        };
        Rendered { film: self.film, samples, rays, dropped, time, ended, is_adaptive: false, estimates }
    }

    fn render_unit(&self, unit: u64) {
        let &Self { scene, settings, aovs, ref film, progress, .. } = self;
        let tiles = film.tile_count() as u64;
        let (samples, half) = self.schedule.chunk(unit / tiles);
        let mut tile = film.start_tile((unit % tiles) as usize);
        let done = take_samples(scene, settings, aovs, &mut [Work::new(samples, &mut tile)]);
        let _entering = self.entering.read().unwrap_or_else(PoisonError::into_inner);
        film.add(&tile, half);
        self.ledger.finish(unit, done);
        progress.count(&done);
    }
}

/// Takes some samples.
fn take_samples(scene: &Scene, settings: &RenderSettings, aovs: &Aovs, work: &mut [Work<'_>]) -> Done {
    let RenderSettings { integrator, sampler, .. } = settings;
    let samples = work.iter().map(Work::count).sum();
    Done { samples, rays: integrator.sample_tiles(scene, sampler, aovs, work) }
}

/// Number of units of work.
fn units(film: &Film, schedule: &Schedule) -> u64 {
    film.tile_count() as u64 * schedule.chunks()
}
