//! Whether the estimated error is right, whether a target is reached as it was promised, and whether samples where the error is
//! pay and leave the picture what it is: what `scripts/calibrate` runs and `docs/error.md` tells of.
//!
//! `cargo run --release --example calibrate -- COMMAND SCENE SIZE NUMBER SEEDS FOLDER`, with one of
//! * `interval`: renders of NUMBER samples per pixel: how often the 95 % interval has the true error, and how far the estimate is off;
//! * `target`: renders to a relative error of NUMBER: how often that is true, and how many samples more than needed it took;
//! * `gain`: NUMBER samples per pixel, where the error is against the same for all: error and CPU time of both;
//! * `bias`: the mean of many renders of two sequences and NUMBER samples per pixel against that of as many with even numbers, and
//!   the reference;
//! * `choice`: the same with one sequence where that promises more.
//!
//! SIZE is the edge of the picture in pixels. References are kept in FOLDER, as `NAME-SIZE.reference`. The last line printed begins
//! with `RESULT`.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "an example talks to its user")]

mod reference;

use rayon::ThreadPool;
use reference::{Means, Reference};
use snell::accel::Accelerator;
use snell::bench::timed;
use snell::check::scenes;
use snell::description::{Crop, SceneDescription};
use snell::integrator::aov::Aovs;
use snell::integrator::{Estimator, Undecided};
use snell::render::adaptive::{Limits, render_adaptively};
use snell::render::{Ended, Progress, RenderSettings, Rendered, render};
use snell::scene::Scene;
use std::cell::Cell;
use std::path::Path;
use std::process::ExitCode;

/// What goes wrong here is told and ends the program.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Seeds for which estimates from halves are looked at, too.
const HALVES: u64 = 20;

/// The confidence of all intervals.
const CONFIDENCE: f64 = 0.95;

/// A scene with its reference.
struct Stage {
    scene: Scene,
    settings: RenderSettings,
    reference: Reference,
    pool: ThreadPool,
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let result = match words[..] {
        [command, scene, size, number, seeds, folder] => run(command, (scene, size), (number, seeds), folder),
        _ => Err("expected interval, target, gain, bias or choice, and SCENE SIZE NUMBER SEEDS FOLDER".into()),
    };
    match result {
        Ok(text) => {
            println!("RESULT {text}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(command: &str, (scene, size): (&str, &str), (number, seeds): (&str, &str), folder: &str) -> Result<String> {
    let (number, seeds): (f64, u64) = (number.parse()?, seeds.parse()?);
    let stage = Stage::new(Path::new(scene), size.parse()?, Path::new(folder))?;
    Ok(match command {
        "interval" => interval(&stage, number as u32, seeds),
        "target" => target(&stage, number, seeds),
        "gain" => gain(&stage, number as u32, seeds),
        "bias" => bias(&stage, (number as u32, &counted_towards_target(number as u32)), seeds),
        "choice" => bias(&stage, (number as u32, &counted(number as u32)), seeds),
        other => return Err(format!("no '{other}' here").into()),
    })
}

/// A scene with a square film of so many pixels a side.
fn load(path: &Path, pixels: u32) -> Result<SceneDescription> {
    let mut scene = snell::loader::load(path, &snell::loader::LoadOptions::default())?;
    for camera in &mut scene.cameras {
        (camera.film.width, camera.film.height) = (pixels, pixels);
        camera.film.crop = Crop { x: 0, y: 0, width: pixels, height: pixels };
    }
    Ok(scene)
}

impl Stage {
    fn new(path: &Path, size: u32, folder: &Path) -> Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new().build()?;
        let description = load(path, size)?;
        let scene = pool.install(|| scenes::compiled(&description, Accelerator::Auto))?;
        let depth = description.integrator.max_depth.unwrap_or(u32::MAX);
        let mut settings = scenes::settings(Estimator::Path, 1, depth);
        settings.integrator.rr_depth = description.integrator.rr_depth;
        // As the command does by default.
        let undecided = Undecided { reuse: true, light_samples: true };
        settings.integrator = pool.install(|| settings.integrator.with_what_pays(&scene, undecided));
        let name = format!("{}-{size}.reference", name_of(path));
        let reference = Reference::load_or_render(&folder.join(name), (&scene, &settings, &pool))?;
        Ok(Self { scene, settings, reference, pool })
    }

    /// The settings with another seed, which no reference has.
    fn seeded(&self, samples: u32, seed: u64) -> RenderSettings {
        let mut settings = RenderSettings { samples, ..self.settings };
        settings.sampler.seed = seed + 1;
        settings
    }

    fn adaptive(&self, limits: &Limits, seed: u64) -> Rendered {
        let (settings, progress) = (self.seeded(1, seed), Progress::default());
        render_adaptively(&self.scene, &settings, &Aovs::default(), limits, (&self.pool, &progress))
    }

    fn uniform(&self, samples: u32, seed: u64) -> Rendered {
        render(&self.scene, &self.seeded(samples, seed), &self.pool, &Progress::default())
    }

    fn samples_per_pixel(&self, rendered: &Rendered) -> f64 {
        rendered.samples as f64 / f64::from(self.reference.size() * self.reference.size())
    }
}

/// The folder of a scene, or the file's name where that says more.
fn name_of(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folder = path.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy().into_owned();
    if stem == "scene" { folder } else { stem }
}

fn counted(samples: u32) -> Limits {
    Limits { samples: Some(samples), time: None, error: None, confidence: CONFIDENCE }
}

/// The same for a target that is never reached: always of two sequences.
fn counted_towards_target(samples: u32) -> Limits {
    Limits { error: Some(0.0), ..counted(samples) }
}

fn interval(stage: &Stage, samples: u32, seeds: u64) -> String {
    let (mut ratios, mut covered, mut halves, mut trues, mut tails) =
        (Vec::new(), 0u64, Vec::new(), Vec::new(), Vec::new());
    let (mut widths, mut warned) = (Vec::new(), 0u64);
    let mut covered_by_halves = 0u64;
    for seed in 0..seeds {
        let rendered = stage.adaptive(&counted_towards_target(samples), seed);
        let truth = stage.reference.error_of(&rendered.film.develop());
        if let Some(known) = rendered.estimates.map(|e| e.whole(CONFIDENCE)) {
            ratios.push(known.error / truth);
            covered += u64::from((known.interval.low..=known.interval.high).contains(&truth));
            tails.push(known.tail);
            warned += u64::from(known.is_heavy_tailed());
            widths.push(known.interval.high / known.error);
            trues.push(truth);
        }
        if seed >= HALVES {
            continue;
        }
        // The estimate of a render with the same number of samples everywhere, from halves.
        let rendered = stage.uniform(samples, seed);
        let truth = stage.reference.error_of(&rendered.film.develop());
        if let Some(known) = rendered.estimates.map(|e| e.whole(CONFIDENCE)) {
            halves.push(known.error / truth);
            covered_by_halves += u64::from((known.interval.low..=known.interval.high).contains(&truth));
        }
    }
    let own = stage.reference.own_error();
    let part = |n: u64| 100.0 * n as f64 / seeds as f64;
    let by_halves = 100.0 * covered_by_halves as f64 / seeds.min(HALVES) as f64;
    format!(
        "true {:.3} %, estimate/true {:.3} ({:.3} to {:.3}), covered {:.0} %, the interval a factor of {:.2} wide; from halves {:.3}, covered {:.0} %; tail {:.2}, warned of in \
         {:.0} %; relMSE over the reference's {:.0}",
        100.0 * median(&mut trues),
        median(&mut ratios),
        quantile(&mut ratios, 0.05),
        quantile(&mut ratios, 0.95),
        part(covered),
        median(&mut widths),
        median(&mut halves),
        by_halves,
        median(&mut tails),
        part(warned),
        (median(&mut trues) / own).powi(2),
    )
}

fn target(stage: &Stage, error: f64, seeds: u64) -> String {
    let limits = Limits { samples: None, time: None, error: Some(error), confidence: CONFIDENCE };
    let (mut reached, mut samples, mut trues, mut halves) = (0u64, Vec::new(), Vec::new(), Vec::new());
    for seed in 0..seeds {
        let rendered = stage.adaptive(&limits, seed);
        let truth = stage.reference.error_of(&rendered.film.develop());
        reached += u64::from(truth <= error && rendered.ended == Ended::Error);
        trues.push(truth);
        let taken = stage.samples_per_pixel(&rendered);
        samples.push(taken);
        // With half of the samples, to know how fast the error falls there.
        let half = stage.adaptive(&counted_towards_target((taken / 2.0) as u32), seed);
        halves.push(stage.reference.error_of(&half.film.develop()) / truth);
    }
    let slope = 2.0 * median(&mut halves).log2();
    let spent = (error / median(&mut trues)).powf(2.0 / slope);
    format!(
        "target {:.2} %: true {:.3} % (95 % below {:.3} %), reached in {:.0} %, {spent:.2} times the samples needed (of {:.0} per pixel; relMSE falls as N^-{slope:.2}); \
         the reference's error {:.3} %",
        100.0 * error,
        100.0 * median(&mut trues),
        100.0 * quantile(&mut trues, 0.95),
        100.0 * reached as f64 / seeds as f64,
        median(&mut samples),
        100.0 * stage.reference.own_error(),
    )
}

fn gain(stage: &Stage, samples: u32, seeds: u64) -> String {
    let (mut sums, mut adaptive_ones) = ([[0.0; 2]; 2], 0);
    for seed in 0..seeds {
        for (which, sum) in sums.iter_mut().enumerate() {
            let (rendered, took) = timed(|| match which {
                0 => stage.uniform(samples, seed),
                _ => stage.adaptive(&counted(samples), seed),
            });
            adaptive_ones += u64::from(rendered.is_adaptive);
            let error = stage.reference.error_of(&rendered.film.develop());
            sum[0] += error * error;
            sum[1] += took.cpu / rendered.samples as f64;
        }
    }
    let [[uniform, time], [adaptive, adaptive_time]] = sums;
    let n = seeds as f64;
    format!(
        "relMSE {:.3e} uniform, {:.3e} adaptive: {:.2} times less; CPU time of a sample {:.3} times; error per second {:.2} times better; \
         where the error is in {adaptive_ones} of {seeds}; the reference's {:.1e}",
        uniform / n,
        adaptive / n,
        uniform / adaptive,
        adaptive_time / time,
        uniform * time / (adaptive * adaptive_time),
        stage.reference.own_error().powi(2)
    )
}

fn bias(stage: &Stage, (samples, limits): (u32, &Limits), seeds: u64) -> String {
    let means = |render: &dyn Fn(u64) -> Rendered| {
        let pictures = (0..seeds).map(|seed| stage.reference.tile_means(render(seed).film.develop().pixels()));
        Means::of(pictures)
    };
    let adaptive_ones = Cell::new(0);
    let uneven = means(&|seed| {
        let rendered = stage.adaptive(limits, seed);
        adaptive_ones.set(adaptive_ones.get() + u64::from(rendered.is_adaptive));
        rendered
    });
    let even = means(&|seed| stage.uniform(samples, seed + seeds));
    format!(
        "uneven numbers (in {} of {seeds}) against even ones: {}; against the reference: {}",
        adaptive_ones.get(),
        uneven.against(&even),
        uneven.against(&stage.reference.means())
    )
}

fn quantile(values: &mut [f64], part: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = (values.len() as f64 * part) as usize;
    values.get(at.min(values.len().saturating_sub(1))).copied().unwrap_or(f64::NAN)
}

fn median(values: &mut [f64]) -> f64 {
    quantile(values, 0.5)
}
