//! Rays per second of one thread for the recorded rays of paths through scene files, for both accelerators, in turn, as
//! ratios: `cargo bench --bench rays -- FILE...`, or some own scenes.
//!
//! Camera rays are asked one by one. Answers are checked: they may differ for ties and where Embree loses a ray.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark")]

#[path = "../tests/common/mod.rs"]
mod common;
mod recorded;

use common::{accelerators, compiled, file_settings, project};
use cpu_time::ProcessTime;
use recorded::{Batch, Kind, record};
use snell::accel::{Accel, Accelerator, Hit, Quality, Start};
use snell::integrator::{Estimator, PathReuse};
use snell::loader::LoadOptions;
use snell::math::ray::Ray;
use snell::scene::Scene;

/// Paths that are recorded, at least.
const PATHS: u32 = 60_000;

/// Times that each accelerator answers all rays, in turn; the best counts.
const ROUNDS: usize = 7;

/// The fraction of answers that may differ between the accelerators.
const ALLOWED_DIFFERENCES: f64 = 1e-4;

/// How carefully to build; what all is compared with comes first.
const QUALITIES: [Quality; 3] = [Quality::Medium, Quality::Low, Quality::High];

/// What is timed by itself.
const CLASSES: [&str; 4] = ["camera", "first bounce", "later bounces", "shadow"];

fn class(batch: &Batch) -> usize {
    match batch.kind {
        Kind::Camera => 0,
        Kind::Bounce if batch.vertex == 2 => 1,
        Kind::Bounce => 2,
        Kind::Shadow => 3,
    }
}

/// Recorded rays, and what shadow rays start and end on.
struct Rays {
    batches: Vec<Batch>,
    ends: Vec<Vec<[Hit; 2]>>,
}

impl Rays {
    fn record(scene: &Scene, settings: &snell::render::RenderSettings) -> Self {
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
    fn counts(&self) -> [usize; 4] {
        let mut counts = [0; 4];
        self.batches.iter().for_each(|batch| counts[class(batch)] += batch.rays.len());
        counts
    }

    /// CPU seconds for each class, and the answers; of a shadow ray some hit or none.
    fn trace(&self, accel: &Accel) -> ([f64; 4], Vec<Vec<Hit>>) {
        let mut seconds = [0.0; 4];
        let mut all = Vec::new();
        for (batch, ends) in self.batches.iter().zip(&self.ends) {
            let mut hits = vec![Hit::NONE; batch.rays.len()];
            let mut occluded = vec![false; batch.rays.len()];
            let start = ProcessTime::now();
            match batch.kind {
                Kind::Camera => accel.closest_hits_from(&batch.rays, Start::Anywhere, &mut hits),
                Kind::Bounce => accel.closest_hits_from(&batch.rays, Start::Primitives(&batch.from), &mut hits),
                Kind::Shadow => accel.occluded_between(&batch.rays, ends, &mut occluded),
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

/// An accelerator, what it took to build, and the least seconds for each class.
struct Measured {
    accel: Accel,
    quality: Quality,
    build: f64,
    best: [f64; 4],
    answers: Vec<Vec<Hit>>,
}

impl Measured {
    fn build(which: Accelerator, quality: Quality, scene: &Scene) -> Self {
        let start = ProcessTime::now();
        let accel = Accel::build(which, &scene.shapes, 1, quality).unwrap();
        Self { accel, quality, build: start.elapsed().as_secs_f64(), best: [f64::INFINITY; 4], answers: Vec::new() }
    }

    fn round(&mut self, rays: &Rays) {
        let (seconds, answers) = rays.trace(&self.accel);
        self.best.iter_mut().zip(seconds).for_each(|(best, seconds)| *best = best.min(seconds));
        self.answers = answers;
    }

    /// Mrays/s, and how many times as fast as `other`.
    fn print(&self, counts: [usize; 4], other: &Self) {
        let megabytes = self.accel.memory_bytes() as f64 / 1e6;
        let name = format!("{}, {:?}", self.accel.name(), self.quality);
        print!("  {name:33} built in {:.2} s ({:.2}), {megabytes:5.1} MB;", self.build, self.build / other.build);
        for ((count, best), other) in counts.iter().zip(self.best).zip(other.best) {
            print!(" {:.2} ({:.2})", *count as f64 / best / 1e6, other / best);
        }
        println!();
    }
}

fn measure(file: &str, rounds: usize) {
    let description = snell::loader::load(&project(file), &LoadOptions::default()).unwrap();
    let scene = compiled(&description, Accelerator::Native);
    let size = scene.film.crop;
    let mut settings = file_settings(&description, Estimator::Path, PATHS.div_ceil(size.width * size.height));
    settings.integrator.reuse = PathReuse::Off;
    let rays = Rays::record(&scene, &settings);
    let qualities = accelerators().into_iter().rev().flat_map(|which| QUALITIES.map(|quality| (which, quality)));
    let mut all: Vec<Measured> = qualities.map(|(which, quality)| Measured::build(which, quality, &scene)).collect();
    for _ in 0..rounds {
        all.iter_mut().for_each(|measured| measured.round(&rays));
    }
    let counts = rays.counts();
    println!("{file}: {}", CLASSES.iter().zip(counts).map(|(k, n)| format!("{n} {k}")).collect::<Vec<_>>().join(", "));
    for measured in &all {
        measured.print(counts, &all[0]);
        let pairs = measured.answers.iter().flatten().zip(all[0].answers.iter().flatten());
        let differ = pairs.filter(|(a, b)| a != b).count();
        assert!(differ as f64 <= ALLOWED_DIFFERENCES * counts.iter().sum::<usize>() as f64, "{differ} answers differ");
    }
}

fn main() {
    // `cargo test --benches` asks for one quick round.
    let quick = !std::env::args().any(|argument| argument == "--bench");
    let mut files: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    if files.is_empty() {
        files = ["cornell-box", "glass", "plates"].map(|name| format!("scenes/{name}/scene.xml")).into();
    }
    files.iter().for_each(|file| measure(file, if quick { 1 } else { ROUNDS }));
}
