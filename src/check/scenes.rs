//! Scenes with closed-form answers, rendered and compared; and the bits of pictures.

use super::rooms::Case;
use crate::accel::Accelerator;
use crate::description::SceneDescription;
use crate::error::Result;
use crate::film::Dropped;
use crate::image::Picture;
use crate::integrator::{Estimator, Integrator, PathReuse};
use crate::render::{Progress, RenderSettings, render};
use crate::sampler::{Sampler, SamplerKind, mix64};
use crate::scene::Scene;
use crate::scene::compile::{CompileOptions, compile};
use rayon::ThreadPool;

/// Seeds of a z-test.
const SEEDS: u64 = 16;

/// Standard errors that a mean may be off by: Student's t with 15 degrees of freedom exceeds it in 2.4·10⁻⁵ of cases.
pub const MOST: f64 = 6.0;

/// What rounding may do to a mean, relatively: pictures without noise are off by some roundings of f32, those of directions
/// magnified by a grazing cosine.
const ROUNDING: f64 = 16.0 * f32::EPSILON as f64;

/// What a scene showed.
#[derive(Clone, Debug)]
pub struct Reading {
    /// Mean of all pixels, samples and seeds.
    pub mean: f64,
    /// Its standard error, at least what rounding does.
    pub error: f64,
    /// What was expected.
    pub expected: f64,
    /// Samples that were not numbers, or negative.
    pub dropped: Dropped,
}

impl Reading {
    /// How many standard errors off.
    pub fn z(&self) -> f64 {
        (self.mean - self.expected) / self.error
    }

    /// Whether it is as expected.
    pub fn is_right(&self) -> bool {
        self.z().abs() < MOST && self.dropped.is_empty()
    }
}

/// What to render by default: an estimator without limits.
pub fn settings(estimator: Estimator, samples: u32, max_depth: u32) -> RenderSettings {
    RenderSettings {
        samples,
        sampler: Sampler { kind: SamplerKind::Sobol, seed: 1 },
        clamp: None,
        integrator: Integrator {
            estimator,
            max_depth,
            rr_depth: 5,
            hide_emitters: false,
            hide_environment: false,
            light_samples: 1,
            reuse: PathReuse::Off,
        },
    }
}

/// A description, compiled for an accelerator.
pub fn compiled(scene: &SceneDescription, accelerator: Accelerator) -> Result<Scene> {
    let options = CompileOptions { accelerator, quality: None, threads: 2, camera: 0, samples: None };
    Ok(compile(scene, &options)?.scene)
}

/// The picture, and what was left out of it.
pub fn picture(scene: &Scene, settings: &RenderSettings, pool: &ThreadPool) -> (Picture, Dropped) {
    let rendered = render(scene, settings, pool, &Progress::default());
    (rendered.film.develop(), rendered.dropped)
}

/// Mean over pixels and channels.
pub fn mean(picture: &Picture) -> f64 {
    let sum: f64 = picture.pixels().iter().flat_map(|p| p.to_array()).map(f64::from).sum();
    sum / (3 * picture.pixels().len()) as f64
}

/// Renders a case with several seeds.
pub fn read(
    case: &Case,
    estimator: Estimator,
    accelerator: Accelerator,
    samples: u32,
    pool: &ThreadPool,
) -> Result<Reading> {
    let scene = compiled(&case.scene, accelerator)?;
    // What is one pixel takes as many samples as others have in all pixels.
    let pixels = u64::from(scene.film.size.0) * u64::from(scene.film.size.1);
    let samples = (u64::from(samples) * ROOM_PIXELS / pixels.max(1)).max(1) as u32;
    let mut settings = settings(estimator, samples, case.max_depth);
    let mut dropped = Dropped::default();
    let mut means = Vec::new();
    for seed in 0..SEEDS {
        settings.sampler.seed = seed;
        let (picture, lost) = picture(&scene, &settings, pool);
        means.push(mean(&picture));
        dropped.add(&lost);
    }
    let n = SEEDS as f64;
    let m = means.iter().sum::<f64>() / n;
    let error = (means.iter().map(|x| (x - m) * (x - m)).sum::<f64>() / (n - 1.0) / n).sqrt();
    Ok(Reading { mean: m, error: error.max(ROUNDING * case.expected), expected: case.expected, dropped })
}

/// Pixels of the pictures of rooms.
const ROOM_PIXELS: u64 = 24 * 24;

/// A number that tells all bits of a picture.
pub fn fingerprint(picture: &Picture) -> u64 {
    let bits = picture.pixels().iter().flat_map(|p| p.to_array()).map(f32::to_bits);
    bits.fold(0, |hash, bits| mix64(hash ^ u64::from(bits)))
}
