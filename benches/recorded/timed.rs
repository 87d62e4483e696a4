//! Recorded rays by the class that they are timed in, and what answers them: timed in turn, the best of rounds counting.

use super::{Batch, Kind, record};
use cpu_time::ProcessTime;
#[cfg(feature = "embree")]
use snell::accel::EmbreeMode;
use snell::accel::{Accel, Accelerator, Hit, Quality, Start};
use snell::math::ray::Ray;
use snell::render::RenderSettings;
use snell::scene::Scene;
use snell::shape::Shape;

/// What is timed by itself.
pub const CLASSES: [&str; 4] = ["camera", "first bounce", "later bounces", "shadow"];

fn class(batch: &Batch) -> usize {
    match batch.kind {
        Kind::Camera => 0,
        Kind::Bounce if batch.vertex == 2 => 1,
        Kind::Bounce => 2,
        Kind::Shadow => 3,
    }
}

/// What answers batches of rays.
pub trait Tracer {
    /// What each ray meets first, if anything.
    fn closest(&self, batch: &Batch, hits: &mut [Hit]);

    /// Whether each ray meets anything between what it starts and ends on.
    fn occluded(&self, batch: &Batch, ends: &[[Hit; 2]], occluded: &mut [bool]);
}

/// Camera rays are asked one by one.
impl Tracer for Accel {
    fn closest(&self, batch: &Batch, hits: &mut [Hit]) {
        let start = if batch.kind == Kind::Camera { Start::Anywhere } else { Start::Primitives(&batch.from) };
        self.closest_hits_from(&batch.rays, start, hits);
    }

    fn occluded(&self, batch: &Batch, ends: &[[Hit; 2]], occluded: &mut [bool]) {
        self.occluded_between(&batch.rays, ends, occluded);
    }
}

/// Recorded rays, and what shadow rays start and end on.
pub struct Rays {
    batches: Vec<Batch>,
    ends: Vec<Vec<[Hit; 2]>>,
}

impl Rays {
    /// Those of all samples that `settings` ask for.
    pub fn record(scene: &Scene, settings: &RenderSettings) -> Self {
        let batches = record(scene, settings);
        let ends = batches.iter().map(|batch| Self::ends(scene, batch)).collect();
        Self { batches, ends }
    }

    /// The renderer knows which primitive a light sample lies on; here it is asked for.
    fn ends(scene: &Scene, batch: &Batch) -> Vec<[Hit; 2]> {
        const AROUND: f32 = 1e-4;
        let mut to = vec![Hit::NONE; batch.rays.len()];
        if batch.kind == Kind::Shadow {
            let around = |ray: &Ray| Ray { tmin: 1.0 - AROUND, tmax: 1.0 + AROUND, ..*ray };
            scene.accel.closest_hits(&batch.rays.iter().map(around).collect::<Vec<_>>(), &mut to);
        }
        batch.from.iter().zip(to).map(|(&from, to)| [from, to]).collect()
    }

    /// How many rays of each class there are.
    pub fn counts(&self) -> [usize; 4] {
        let mut counts = [0; 4];
        self.batches.iter().for_each(|batch| counts[class(batch)] += batch.rays.len());
        counts
    }

    /// CPU seconds for each class, and the answers; of a shadow ray some hit or none.
    fn trace(&self, tracer: &dyn Tracer) -> ([f64; 4], Vec<Vec<Hit>>) {
        let mut seconds = [0.0; 4];
        let mut all = Vec::new();
        for (batch, ends) in self.batches.iter().zip(&self.ends) {
            let mut hits = vec![Hit::NONE; batch.rays.len()];
            let mut occluded = vec![false; batch.rays.len()];
            let start = ProcessTime::now();
            match batch.kind {
                Kind::Camera | Kind::Bounce => tracer.closest(batch, &mut hits),
                Kind::Shadow => tracer.occluded(batch, ends, &mut occluded),
            }
            seconds[class(batch)] += start.elapsed().as_secs_f64();
            if batch.kind == Kind::Shadow {
                let some = |occluded| if occluded { Hit { shape: 0, primitive: 0 } } else { Hit::NONE };
                hits = occluded.into_iter().map(some).collect();
            }
            all.push(hits);
        }
        (seconds, all)
    }
}

/// A tracer, what it took to build, and the least seconds for each class.
pub struct Measured {
    name: String,
    tracer: Box<dyn Tracer>,
    megabytes: f64,
    build: f64,
    best: [f64; 4],
    answers: Vec<Vec<Hit>>,
}

impl Measured {
    /// Times how long `build` takes; `describe` says the tracer's name and bytes.
    pub fn build<T: Tracer + 'static>(build: impl FnOnce() -> T, describe: impl FnOnce(&T) -> (String, u64)) -> Self {
        let start = ProcessTime::now();
        let tracer = build();
        let build = start.elapsed().as_secs_f64();
        let (name, bytes) = describe(&tracer);
        let megabytes = bytes as f64 / 1e6;
        Self { name, tracer: Box::new(tracer), megabytes, build, best: [f64::INFINITY; 4], answers: Vec::new() }
    }

    /// One of snell's accelerators.
    pub fn accel(which: Accelerator, quality: Quality, shapes: &[Shape]) -> Self {
        Self::build(|| Accel::build(which, shapes, 1, quality).unwrap(), |accel| Self::describe(accel, quality))
    }

    /// Embree by an arithmetic that renders do not take.
    #[cfg(feature = "embree")]
    pub fn embree(mode: EmbreeMode, quality: Quality, shapes: &[Shape]) -> Self {
        let build = || Accel::build_embree(shapes, 1, quality, mode).unwrap();
        Self::build(build, |accel| Self::describe(accel, quality))
    }

    fn describe(accel: &Accel, quality: Quality) -> (String, u64) {
        (format!("{}, {quality:?}", accel.name()), accel.memory_bytes())
    }

    /// Answers all rays once more.
    pub fn round(&mut self, rays: &Rays) {
        let (seconds, answers) = rays.trace(&*self.tracer);
        self.best.iter_mut().zip(seconds).for_each(|(best, seconds)| *best = best.min(seconds));
        self.answers = answers;
    }

    /// Mrays/s, and how many times as fast as `other`.
    pub fn row(&self, counts: [usize; 4], other: &Self) -> String {
        let Self { name, megabytes, build, .. } = self;
        let mut row = format!("  {name:38} built in {build:.2} s ({:.2}), {megabytes:5.1} MB;", build / other.build);
        for ((count, best), other) in counts.iter().zip(self.best).zip(other.best) {
            row += &format!(" {:.2} ({:.2})", *count as f64 / best / 1e6, other / best);
        }
        row
    }

    /// How many answers are not those of `other`.
    pub fn differing(&self, other: &Self) -> usize {
        let pairs = self.answers.iter().flatten().zip(other.answers.iter().flatten());
        pairs.filter(|(a, b)| a != b).count()
    }
}

/// How many rays of which class there are, in words.
pub fn classes(counts: [usize; 4]) -> String {
    CLASSES.iter().zip(counts).map(|(class, count)| format!("{count} {class}")).collect::<Vec<_>>().join(", ")
}
