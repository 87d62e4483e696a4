//! Figures about a finished render, for people and for `--stats`.

use super::prepare::Prepared;
use crate::render::Rendered;
use crate::scene::Features;
use serde::Serialize;

/// What `--stats` writes.
#[derive(Debug, Serialize)]
pub(super) struct Stats<'a> {
    version: &'static str,
    accelerator: String,
    integrator: &'a str,
    sampler: &'a str,
    threads: usize,
    load_seconds: f64,
    build_seconds: f64,
    render_seconds: f64,
    complete: bool,
    samples: u64,
    rays: Rays,
    rays_per_second: f64,
    samples_per_second: f64,
    /// Part of the threads' time that ray queries took.
    ray_query_share: f64,
    non_finite_samples: u64,
    non_finite_examples: Vec<[u32; 3]>,
    accelerator_bytes: u64,
    peak_memory_bytes: Option<u64>,
    features: Features,
    #[serde(skip_serializing_if = "Option::is_none")]
    accelerator_comparison: Option<String>,
}

#[derive(Debug, Serialize)]
struct Rays {
    camera: u64,
    bounce: u64,
    shadow: u64,
}

/// What the render was asked for, by name.
pub(super) struct Names<'a> {
    pub(super) integrator: &'a str,
    pub(super) sampler: &'a str,
    pub(super) threads: usize,
}

impl<'a> Stats<'a> {
    pub(super) fn new(prepared: &Prepared, rendered: &Rendered, names: &Names<'a>) -> Self {
        let seconds = rendered.time.as_secs_f64().max(f64::MIN_POSITIVE);
        let (accel, rays) = (&prepared.scene.accel, rendered.rays);
        Self {
            version: env!("CARGO_PKG_VERSION"),
            accelerator: accel.name(),
            integrator: names.integrator,
            sampler: names.sampler,
            threads: names.threads,
            load_seconds: prepared.load.as_secs_f64(),
            build_seconds: prepared.build.as_secs_f64(),
            render_seconds: rendered.time.as_secs_f64(),
            complete: rendered.complete,
            samples: rendered.samples,
            rays: Rays { camera: rays.camera, bounce: rays.bounce, shadow: rays.shadow },
            ray_query_share: rays.time.as_secs_f64() / (seconds * names.threads as f64),
            rays_per_second: rays.total() as f64 / seconds,
            samples_per_second: rendered.samples as f64 / seconds,
            non_finite_samples: rendered.dropped.count,
            non_finite_examples: rendered.dropped.examples.iter().map(|s| [s.x, s.y, s.index]).collect(),
            accelerator_bytes: accel.memory_bytes(),
            peak_memory_bytes: peak_memory_bytes(),
            features: prepared.scene.features,
            accelerator_comparison: accel.comparison().map(|c| format!("{c:?}")),
        }
    }
}

/// The most memory that this process ever held, where the system tells (Linux).
fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}
