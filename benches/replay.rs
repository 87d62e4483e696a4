//! The share of a render's time that its bare ray queries take when they are replayed alone: what is left of the time if all
//! else were free. For the scene files that are given (`cargo bench --bench replay -- FILE...`), or some own ones.
//!
//! The rays of some paths are recorded, in the batches in which the renderer asks them, with what it knows of their starts;
//! of what shadow rays end on it knows more than is recorded. Then the same paths are walked and the same batches asked, in
//! turn, by one thread. Every answer is checked against the recorded one.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "a benchmark")]

#[path = "../tests/common/mod.rs"]
mod common;
mod recorded;

use common::{compiled, file_settings, project, rendered};
use cpu_time::ProcessTime;
use recorded::{Batch, Kind, record};
use snell::accel::{Accel, Accelerator, Hit, Start};
use snell::integrator::{Estimator, PathReuse};
use snell::loader::LoadOptions;
use snell::scene::Scene;

/// Paths that are walked, at least: some hundred waves.
const PATHS: u32 = 100_000;

/// Times that both are measured, in turn.
const ROUNDS: usize = 5;

/// CPU seconds that the batches take, for each kind of ray; and how many answers differ from the recorded ones.
fn replay(accel: &Accel, batches: &[Batch]) -> ([f64; 3], usize) {
    let (mut seconds, mut different) = ([0.0; 3], 0);
    let (mut hits, mut occluded) = (Vec::new(), Vec::new());
    for batch in batches {
        hits.clear();
        hits.resize(batch.rays.len(), Hit::NONE);
        occluded.clear();
        occluded.resize(batch.rays.len(), false);
        let ends: Vec<[Hit; 2]> = batch.from.iter().map(|&from| [from, Hit::NONE]).collect();
        let start = ProcessTime::now();
        match batch.kind {
            Kind::Camera => accel.closest_hits_from(&batch.rays, Start::Camera, &mut hits),
            Kind::Bounce => accel.closest_hits_from(&batch.rays, Start::Primitives(&batch.from), &mut hits),
            Kind::Shadow => accel.occluded_between(&batch.rays, &ends, &mut occluded),
        }
        seconds[batch.kind as usize] += start.elapsed().as_secs_f64();
        different += match batch.kind {
            Kind::Shadow => {
                batch.hits.iter().zip(&occluded).filter(|(hit, occluded)| hit.is_some() != **occluded).count()
            }
            _ => batch.hits.iter().zip(&hits).filter(|(a, b)| a != b).count(),
        };
    }
    (seconds, different)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn measure(name: &str, scene: &Scene, settings: &snell::render::RenderSettings, rounds: usize) {
    let batches = record(scene, settings);
    let (mut whole, mut parts) = (Vec::new(), Vec::new());
    for _ in 0..rounds {
        let start = ProcessTime::now();
        rendered(scene, settings, 1);
        let seconds = start.elapsed().as_secs_f64();
        let (bare, different) = replay(&scene.accel, &batches);
        assert_eq!(different, 0, "{name}: answers differ");
        whole.push(seconds);
        parts.push(bare.map(|part| part / seconds));
    }
    let [camera, bounce, shadow] = [0, 1, 2].map(|kind| 100.0 * median(parts.iter().map(|p| p[kind]).collect()));
    let all = 100.0 * median(parts.iter().map(|p| p.iter().sum()).collect());
    let rays: usize = batches.iter().map(|batch| batch.rays.len()).sum();
    println!(
        "{name}, {}: {rays} rays, {:.2} CPU s; bare queries {all:.0} % (camera {camera:.0}, bounce {bounce:.0}, shadow {shadow:.0})",
        scene.accel.name(),
        median(whole),
    );
}

fn main() {
    // `cargo test --benches` asks for one quick round.
    let quick = !std::env::args().any(|argument| argument == "--bench");
    let mut files: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    if files.is_empty() {
        files = ["cornell-box", "glass", "plates"].map(|name| format!("scenes/{name}/scene.xml")).into();
    }
    for file in &files {
        let description = snell::loader::load(&project(file), &LoadOptions::default()).unwrap();
        let scene = compiled(&description, Accelerator::Auto);
        let size = scene.film.crop;
        let samples = if quick { 1 } else { PATHS.div_ceil(size.width * size.height) };
        let mut settings = file_settings(&description, Estimator::Path, samples);
        settings.integrator.reuse = PathReuse::Off;
        measure(file, &scene, &settings, if quick { 1 } else { ROUNDS });
    }
}
