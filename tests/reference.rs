//! Whole pictures against converged references of another renderer, with the variance of both.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, reason = "test code")]

mod common;

use common::*;
use snell::accel::Accelerator;
use snell::description::{BsdfKind, SceneDescription};
use snell::integrator::Estimator;
use std::path::Path;
use std::process::Command;

/// Ours: 32 seeds × 16 samples.
const SEEDS: u64 = 32;
const SAMPLES: u32 = 16;

/// Bounds of |z| for the picture, its tiles and its pixels; see [`pictures_agree_with_the_references`].
const BOUNDS: Worst = Worst { whole: 6.1, tile: 7.5, pixel: 6.2 };

/// Our estimate of the picture of a scene, changed a little or not at all, and the reference. One accelerator, for the pictures of all are the same
/// (`tests/determinism.rs`): Embree where this build has it.
fn estimates(row: &Reference, change: impl Fn(&mut SceneDescription)) -> (Estimate, Estimate) {
    let scratch = tempfile::tempdir().unwrap();
    let reference = read_reference(row.name);
    let mut description = load_scene(row.name, RES, scratch.path());
    change(&mut description);
    let settings = file_settings(&description, Estimator::Path, SAMPLES);
    let ratio = f64::from(row.samples) / (SEEDS as f64 * f64::from(SAMPLES));
    let estimate = Estimate::of(&compiled(&description, Accelerator::Auto), &settings, SEEDS);
    (estimate.no_surer_than(&reference, ratio), reference)
}

/// Hypothesis: the expectations of the picture's mean, of its tiles (8×8 pixels) and of its pixels' channels are the
/// reference's. z is the difference over the root of the sum of both variances.
///
/// Ours are those among the seeds. For the mean and the tiles z then follows Student's t with at least 31 degrees of
/// freedom: |t₃₁| > 6.1 has probability 9·10⁻⁷, |t₃₁| > 7.5 has 2·10⁻⁸, in one of 64 tiles 1.2·10⁻⁶. For pixels, whose
/// few samples may all have missed something bright, the variance is at least what the reference's predicts for as many
/// independent samples, so that z is normal but for skewness: |z| > 6.2 has probability 5.6·10⁻¹⁰, in one of 12,288
/// channels 6.9·10⁻⁶ (Šidák: 1 − (1 − p)ⁿ). Together 9·10⁻⁶ a picture, 10⁻⁴ for all scenes. The seeds are fixed.
///
/// Power: the same pictures, 1 % too bright, must fail.
#[test]
fn pictures_agree_with_the_references() {
    for row in &REFERENCES {
        let (estimate, reference) = estimates(row, |_| ());
        let worst = estimate.worst_z_against(&reference);
        let brighter = estimate.scaled(1.01).worst_z_against(&reference);
        println!("{}: {worst:.2?}; 1 % brighter: {brighter:.2?}", row.name);
        assert!(worst.within(&BOUNDS), "{} differs, in standard errors: {worst:?}", row.name);
        assert!(!brighter.within(&BOUNDS), "{}: 1 % more light goes unnoticed: {brighter:?}", row.name);
    }
}

/// Hypothesis: the expectation of the mean of the picture with heavy tails is the reference's. z of 32 seeds is nearly Student's: the
/// mean is that of 2 million samples, most of whose light is direct. |t₃₁| > 6.1 has probability 9·10⁻⁷. The seeds are fixed.
#[test]
fn the_picture_with_heavy_tails_has_the_mean_of_its_reference() {
    let (estimate, reference) = estimates(&HEAVY_TAILED, |_| ());
    let worst = estimate.worst_z_against(&reference);
    println!("{}: {worst:.2?}", HEAVY_TAILED.name);
    assert!(worst.whole < BOUNDS.whole, "{worst:?}");
}

/// Power against what a mistake changes in one place: paths one vertex shorter, and glass of a different index.
#[test]
fn slightly_different_scenes_are_told_from_the_reference() {
    let differ = |name: &str, change: &dyn Fn(&mut SceneDescription)| {
        let row = REFERENCES.iter().find(|row| row.name == name).unwrap();
        let (estimate, reference) = estimates(row, change);
        let worst = estimate.worst_z_against(&reference);
        println!("{name}, changed: {worst:.2?}");
        assert!(!worst.within(&BOUNDS), "{name}: a change goes unnoticed: {worst:?}");
    };
    differ("cornell-box", &|scene| *scene.integrator.max_depth.as_mut().unwrap() -= 1);
    differ("cornell-box-materials", &|scene| {
        for bsdf in &mut scene.bsdfs {
            if let BsdfKind::Dielectric { int_ior, .. } = &mut bsdf.kind {
                *int_ior *= 1.05;
            }
        }
    });
}

/// The white furnace: radiance 1 in every pixel, within noise, and within 10⁻⁴ in the mean. 128×128 × 1024 samples have a
/// standard error of about 2·10⁻⁵ (taken from 8 seeds of 128 samples each).
#[test]
fn the_furnace_is_white() {
    let description = load("scenes/furnace/scene.xml", &[]);
    let scene = compiled(&description, Accelerator::Auto);
    let means = (0..8).map(|seed| {
        let mut s = file_settings(&description, Estimator::Path, 128);
        s.sampler.seed = seed;
        mean(&picture(&scene, &s))
    });
    let m = means.sum::<f64>() / 8.0;
    println!("mean {m}");
    assert!((m - 1.0).abs() < 1e-4, "mean {m}");
}

/// Without light sampling and roulette the furnace has no noise: every path ends in the sky, with exactly the throughput
/// that its lossless surfaces left it. Paths longer than the limit are those caught in glass by total reflection.
#[test]
fn the_furnace_without_noise_is_white_in_every_pixel() {
    let description = load("scenes/furnace/scene.xml", &[]);
    for accelerator in accelerators() {
        let mut s = file_settings(&description, Estimator::Bsdf, 32);
        s.integrator.rr_depth = u32::MAX;
        s.integrator.max_depth = 1000;
        let picture = picture(&compiled(&description, accelerator), &s);
        for (i, p) in picture.pixels().iter().enumerate() {
            for v in p.to_array() {
                // Each refraction multiplies and divides by η², with two roundings; paths have some dozen.
                assert!((v - 1.0).abs() < 2e-6, "{accelerator:?}: pixel {i} is {v}");
            }
        }
    }
}

/// Samples per pixel of the picture that OpenImageIO compares.
const COMPARED_SAMPLES: u32 = 256;

/// Thresholds for `oiiotool --diff`, which knows no variances: they follow from them.
struct Thresholds {
    /// Differences beyond this are counted: three times the root of the pixels' mean variance.
    fail: f64,
    /// Per cent of pixels that may be counted: as many as the normal law lets expect at these variances, and six standard
    /// deviations of that number (probability 10⁻⁹; 6 more, for where next to none are expected).
    fail_percent: f64,
    /// Differences beyond this are never right: 6.2 times the largest deviation (probability 6.9·10⁻⁶ a picture).
    hard_fail: f64,
}

impl Thresholds {
    /// For differences of these variances: the channels of one pixel after another.
    fn of(variances: &[f64]) -> Self {
        let fail = 3.0 * (variances.iter().sum::<f64>() / variances.len() as f64).sqrt();
        let beyond = |v: &f64| if *v > 0.0 { libm::erfc(fail / (2.0 * v).sqrt()) } else { 0.0 };
        let pixels = variances.chunks(3);
        let expected: f64 = pixels.clone().map(|channels| channels.iter().map(beyond).sum::<f64>().min(1.0)).sum();
        let allowed = expected + 6.0 * expected.sqrt() + 6.0;
        let largest = variances.iter().copied().fold(0.0, f64::max);
        Self { fail, fail_percent: 100.0 * allowed / pixels.len() as f64, hard_fail: BOUNDS.pixel * largest.sqrt() }
    }

    /// Whether oiiotool finds two files alike, the first made `factor` times as bright; and what it says.
    fn accept(&self, ours: &Path, factor: f64, reference: &Path) -> (bool, String) {
        let output = Command::new("oiiotool")
            .args(["--fail", &self.fail.to_string(), "--failpercent", &self.fail_percent.to_string()])
            .args(["--hardfail", &self.hard_fail.to_string()])
            .arg(ours)
            .args(["--mulc", &factor.to_string()])
            .arg(reference)
            .arg("--diff")
            .output()
            .unwrap();
        (output.status.success(), String::from_utf8_lossy(&output.stdout).into_owned())
    }
}

/// The files that the command writes, against those of the references, by OpenImageIO. Hypothesis: the expectation of every
/// pixel is the reference's; independent samples, so that the reference's variance predicts ours. One seed; the
/// false-alarm rates stand at [`Thresholds`]. Power: 30 % more light is too much.
#[test]
fn openimageio_finds_pictures_and_references_alike() {
    if Command::new("oiiotool").arg("--help").output().is_err() {
        println!("skipped: oiiotool is not installed");
        return;
    }
    for row in &REFERENCES {
        let scratch = tempfile::tempdir().unwrap();
        let reference = project(&format!("tests/data/reference/{}.exr", row.name));
        let ratio = f64::from(row.samples) / f64::from(COMPARED_SAMPLES);
        let pixels = read_reference(row.name).pixels;
        let variances: Vec<f64> = pixels.iter().map(|v| v.variance * (1.0 + ratio)).collect();
        let thresholds = Thresholds::of(&variances);
        let ours = scratch.path().join("ours.exr");
        let mut command = Command::new(env!("CARGO_BIN_EXE_snell"));
        command.arg("render").arg(project(&format!("scenes/{}/scene.xml", row.name))).arg("-o").arg(&ours);
        command.args(["--spp", &COMPARED_SAMPLES.to_string(), "--seed", "77", "--sampler", "independent", "-q"]);
        for (name, value) in scene_parameters(row.name, RES, scratch.path()) {
            command.arg(format!("-D{name}={value}"));
        }
        assert!(command.status().unwrap().success(), "{}: the render failed", row.name);
        let (alike, said) = thresholds.accept(&ours, 1.0, &reference);
        assert!(alike, "{}: {said}", row.name);
        let (alike, said) = thresholds.accept(&ours, 1.3, &reference);
        assert!(!alike, "{}: 30 % more light goes unnoticed: {said}", row.name);
    }
}
