//! Rays per second of one thread for the recorded rays of paths through scene files, for both accelerators, in turn, as
//! ratios: `cargo bench --bench rays -- FILE...`, or some own scenes. `ten-million` and `instances` instead of a file are large
//! scenes that are generated ([`generated`]); what is placed is our own tree's in Embree's case, too.
//!
//! Camera rays are asked one by one. Answers are checked: they may differ for ties and where Embree loses a ray.
#![allow(missing_docs, unreachable_pub, clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark")]

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "recorded/generated.rs"]
mod generated;
mod recorded;

use common::{accelerators, compiled, file_settings, project};
use recorded::timed::{Measured, Rays, classes};
#[cfg(feature = "embree")]
use snell::accel::EmbreeMode;
use snell::accel::{Accelerator, Quality};
use snell::integrator::{Estimator, PathReuse};
use snell::loader::LoadOptions;

/// Paths that are recorded, at least.
const PATHS: u32 = 60_000;

/// Times that each accelerator answers all rays, in turn; the best counts.
const ROUNDS: usize = 7;

/// The fraction of answers that may differ between the accelerators.
const ALLOWED_DIFFERENCES: f64 = 1e-4;

/// How carefully to build; what all is compared with comes first.
const QUALITIES: [Quality; 3] = [Quality::Medium, Quality::Low, Quality::High];

/// What of Embree is compared beside its robust mode, of which no answers are expected that are right.
#[cfg(feature = "embree")]
const EMBREE_QUICK: [(EmbreeMode, Quality); 3] =
    [(EmbreeMode::Quick, Quality::Medium), (EmbreeMode::Quick, Quality::High), (EmbreeMode::Compact, Quality::Medium)];

fn measure(file: &str, rounds: usize) {
    let folder = tempfile::tempdir().unwrap();
    let (path, defines) = if generated::NAMES.contains(&file) {
        generated::write(file, folder.path()).unwrap()
    } else {
        (project(file), Vec::new())
    };
    let description = snell::loader::load(&path, &LoadOptions { defines, ..Default::default() }).unwrap();
    let scene = compiled(&description, Accelerator::Native);
    let size = scene.film.crop;
    let mut settings = file_settings(&description, Estimator::Path, PATHS.div_ceil(size.width * size.height));
    settings.integrator.reuse = PathReuse::Off;
    let rays = Rays::record(&scene, &settings);
    let qualities = accelerators().into_iter().rev().flat_map(|which| QUALITIES.map(|quality| (which, quality)));
    let mut all: Vec<_> = qualities.map(|(which, quality)| Measured::accel(which, quality, &scene.shapes)).collect();
    let exact = all.len();
    #[cfg(feature = "embree")]
    all.extend(EMBREE_QUICK.map(|(mode, quality)| Measured::embree(mode, quality, &scene.shapes)));
    for _ in 0..rounds {
        all.iter_mut().for_each(|measured| measured.round(&rays));
    }
    let counts = rays.counts();
    println!("{file}: {}", classes(counts));
    let all_rays = counts.iter().sum::<usize>() as f64;
    for (number, measured) in all.iter().enumerate() {
        let differ = measured.differing(&all[0]);
        println!("{}; {differ} answers differ", measured.row(counts, &all[0]));
        assert!(number >= exact || differ as f64 <= ALLOWED_DIFFERENCES * all_rays, "too many");
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
