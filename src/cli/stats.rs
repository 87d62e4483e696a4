//! Figures about a finished render, for people and for `--stats`.

use super::finish;
use super::prepare::Prepared;
use crate::accel::Hit;
use crate::accel::comparison::ComparisonCounts;
use crate::error_estimate::Estimates;
use crate::math::simd;
use crate::render::Rendered;
use crate::scene::Features;
use serde::Serialize;

/// Edge of the tiles whose errors are told, in pixels.
const ERROR_TILE: usize = 64;

/// What `--stats` writes.
#[derive(Debug, Serialize)]
pub(super) struct Stats<'a> {
    version: &'static str,
    accelerator: String,
    /// How carefully that was built.
    accelerator_quality: String,
    /// Vector instructions.
    simd: &'static str,
    integrator: &'a str,
    sampler: &'a str,
    /// Whether neighbouring pixels shared what their paths found.
    path_reuse: bool,
    /// Light samples at the first hit.
    light_samples: u32,
    threads: usize,
    load_seconds: f64,
    build_seconds: f64,
    render_seconds: f64,
    complete: bool,
    /// What ended it: samples, time, error, interrupted.
    ended_by: &'static str,
    /// Whether samples went where the error is.
    adaptive: bool,
    samples: u64,
    samples_per_pixel: f64,
    /// Estimated relative error of the picture, and the ends of its interval; nothing where there are too few samples.
    estimated_error: Option<f64>,
    estimated_error_low: Option<f64>,
    estimated_error_high: Option<f64>,
    /// The probability with which the error is in there.
    confidence: f64,
    /// Index of the tail of the pixels' squared errors; how many times as large the squared error would be if half of the samples said
    /// what the others should be; and whether it is so heavy that the estimate cannot be trusted.
    error_tail_index: Option<f64>,
    error_surprise: Option<f64>,
    error_is_heavy_tailed: bool,
    /// The same error by tiles: column and row of the first pixel, width, height, error.
    estimated_error_of_tiles: Vec<(i32, i32, u32, u32, f64)>,
    rays: Rays,
    rays_per_second: f64,
    samples_per_second: f64,
    /// Part of the threads' time that ray queries took.
    ray_query_share: f64,
    non_finite_samples: u64,
    negative_samples: u64,
    oversized_samples: u64,
    dropped_examples: Vec<[i64; 3]>,
    /// Pixel values, over all files, that were too large for half floats.
    clamped_values: u64,
    accelerator_bytes: u64,
    peak_memory_bytes: Option<u64>,
    features: Features,
    #[serde(skip_serializing_if = "Option::is_none")]
    accelerator_comparison: Option<Comparison>,
    /// Hits of Embree that exact arithmetic refuted.
    #[serde(skip_serializing_if = "Option::is_none")]
    embree_false_hits: Option<u64>,
}

#[derive(Debug, Serialize)]
struct Rays {
    camera: u64,
    bounce: u64,
    shadow: u64,
}

/// What comes of tracing every ray with both accelerators.
#[derive(Debug, Serialize)]
struct Comparison {
    rays: u64,
    ties: u64,
    edges: u64,
    embree_misses: u64,
    native_misses: u64,
    embree_false: u64,
    native_false: u64,
    examples: Vec<Disagreement>,
}

/// A ray about which the two differ, in the compiled scene's space.
#[derive(Debug, Serialize)]
struct Disagreement {
    origin: [f32; 3],
    direction: [f32; 3],
    interval: [f32; 2],
    /// Whether any hit was asked for, not the closest.
    any_hit: bool,
    /// Shape and primitive.
    embree: Option<[u32; 2]>,
    native: Option<[u32; 2]>,
    verdict: String,
}

impl Comparison {
    fn new(c: &ComparisonCounts) -> Self {
        let hit = |hit: Hit| hit.is_some().then_some([hit.shape, hit.primitive]);
        let examples = c.examples.iter().map(|d| Disagreement {
            origin: d.ray.o.to_array(),
            direction: d.ray.d.to_array(),
            interval: [d.ray.tmin, d.ray.tmax],
            any_hit: d.any,
            embree: hit(d.embree),
            native: hit(d.native),
            verdict: format!("{:?}", d.verdict),
        });
        Self {
            rays: c.rays,
            ties: c.ties,
            edges: c.edges,
            embree_misses: c.embree_misses,
            native_misses: c.native_misses,
            embree_false: c.embree_false,
            native_false: c.native_false,
            examples: examples.collect(),
        }
    }
}

/// What the render was asked for, by name.
pub(super) struct Names<'a> {
    pub(super) integrator: &'a str,
    pub(super) sampler: &'a str,
    pub(super) path_reuse: bool,
    pub(super) light_samples: u32,
    pub(super) threads: usize,
    /// Pixels in which samples are taken.
    pub(super) pixels: u64,
    pub(super) confidence: f64,
}

impl<'a> Stats<'a> {
    pub(super) fn new(prepared: &Prepared, rendered: &Rendered, names: &Names<'a>, clamped_values: u64) -> Self {
        let seconds = rendered.time.as_secs_f64().max(f64::MIN_POSITIVE);
        let (accel, rays) = (&prepared.scene.accel, rendered.rays);
        let error = rendered.estimates.as_ref().map(|estimates| estimates.whole(names.confidence));
        Self {
            version: env!("CARGO_PKG_VERSION"),
            accelerator: accel.name(),
            accelerator_quality: format!("{:?}", prepared.accel_choice.quality).to_lowercase(),
            simd: simd::name(simd::level()),
            integrator: names.integrator,
            sampler: names.sampler,
            path_reuse: names.path_reuse,
            light_samples: names.light_samples,
            threads: names.threads,
            load_seconds: prepared.load.as_secs_f64(),
            build_seconds: prepared.build.as_secs_f64(),
            render_seconds: rendered.time.as_secs_f64(),
            complete: rendered.is_complete(),
            ended_by: finish::ended_text(rendered.ended),
            adaptive: rendered.is_adaptive,
            samples: rendered.samples,
            samples_per_pixel: rendered.samples as f64 / names.pixels as f64,
            estimated_error: error.map(|e| e.error),
            estimated_error_low: error.map(|e| e.interval.low),
            estimated_error_high: error.map(|e| e.interval.high),
            confidence: names.confidence,
            error_tail_index: error.map(|e| e.tail).filter(|tail| tail.is_finite()),
            error_surprise: error.map(|e| e.surprise),
            error_is_heavy_tailed: error.is_some_and(|e| e.is_heavy_tailed()),
            estimated_error_of_tiles: rendered.estimates.as_ref().map(errors_of_tiles).unwrap_or_default(),
            rays: Rays { camera: rays.camera, bounce: rays.bounce, shadow: rays.shadow },
            ray_query_share: rays.time.as_secs_f64() / (seconds * names.threads as f64),
            rays_per_second: rays.total() as f64 / seconds,
            samples_per_second: rendered.samples as f64 / seconds,
            non_finite_samples: rendered.dropped.non_finite(),
            negative_samples: rendered.dropped.negative,
            oversized_samples: rendered.dropped.oversized,
            dropped_examples: rendered
                .dropped
                .examples
                .iter()
                .map(|s| [s.x.into(), s.y.into(), s.index.into()])
                .collect(),
            clamped_values,
            accelerator_bytes: accel.memory_bytes(),
            peak_memory_bytes: peak_memory_bytes(),
            features: prepared.scene.features,
            accelerator_comparison: accel.comparison().map(|c| Comparison::new(&c)),
            embree_false_hits: accel.embree_false_hits(),
        }
    }
}

/// The error of each of the squares that a picture is cut into.
fn errors_of_tiles(estimates: &Estimates) -> Vec<(i32, i32, u32, u32, f64)> {
    let darkness = estimates.darkness();
    estimates
        .tiles(ERROR_TILE)
        .map(|tile| (tile.x, tile.y, tile.width, tile.height, estimates.of_area(tile, darkness)))
        .collect()
}

/// The most memory that this process ever held, where the system tells (Linux).
fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}
