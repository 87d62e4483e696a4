//! Scenes at other sizes and places, thin and touching things, long runs, heavy tails: what `scripts/stress` runs and
//! `docs/numerics.md` tells of. It also shows how to use the library.
//!
//! `cargo run --release --example stress -- COMMAND [SCENE]`, with one of
//! * `bits SCENE`: every length × 2^k, k = −40…40: the same bits;
//! * `scale SCENE`: every length × 10^k, k = −12…12: the same picture within its noise;
//! * `offset SCENE`: moved by 10^k of its size, k = 0…7, with its vertices in f64, and rounded to f32 as many files have them;
//! * `thin`: thin, flush, coincident, nested and tiny things in rooms with closed-form answers;
//! * `long SCENE`: up to 10^6 samples per pixel: how the error falls;
//! * `tail SCENE`: how heavy the tail of single samples is.
//!
//! The last line that it prints begins with `RESULT`; the exit code is 1 if something is wrong.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "an example talks to its user")]

#[path = "../../tests/common/estimate.rs"]
#[allow(
    dead_code,
    missing_docs,
    unreachable_pub,
    clippy::allow_attributes_without_reason,
    clippy::unwrap_used,
    reason = "the tests use all of it"
)]
mod estimate;
#[path = "../../scenes/million/generate.rs"]
#[allow(dead_code, missing_docs, unreachable_pub, reason = "a program of its own, too")]
mod million;
mod moved;
mod samples;
mod thin;

use rayon::ThreadPool;
use snell::accel::Accelerator;
use snell::check::scenes;
use snell::description::{Crop, SceneDescription};
use snell::image::Picture;
use snell::integrator::Estimator;
use snell::render::RenderSettings;
use snell::scene::Scene;
use std::path::Path;
use std::process::ExitCode;
use std::sync::LazyLock;

/// What goes wrong here is told and ends the program.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// What was found, and whether it is as it should be.
struct Found {
    text: String,
    right: bool,
}

static POOL: LazyLock<ThreadPool> =
    LazyLock::new(|| rayon::ThreadPoolBuilder::new().build().unwrap_or_else(|e| panic!("no threads: {e}")));

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let found = match words[..] {
        ["bits", scene] => moved::bits(Path::new(scene)),
        ["scale", scene] => moved::scale(Path::new(scene)),
        ["offset", scene] => moved::offset(Path::new(scene)),
        ["thin"] => thin::run(),
        ["long", scene] => samples::long(Path::new(scene)),
        ["tail", scene] => samples::tail(Path::new(scene)),
        _ => Err("expected bits, scale, offset, long or tail and a scene, or thin".into()),
    };
    match found {
        Ok(Found { text, right }) => {
            println!("RESULT {}: {text}", if right { "right" } else { "WRONG" });
            ExitCode::from(u8::from(!right))
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// A scene with a square film of so many pixels a side.
fn load(path: &Path, pixels: u32) -> Result<SceneDescription> {
    let scratch = tempfile::tempdir()?;
    let mut options = snell::loader::LoadOptions::default();
    if path.ends_with("million/scene.xml") {
        let mesh = scratch.path().join("mesh.ply");
        million::write_mesh(&mesh, million::SIZE)?;
        options.defines.push(("mesh".into(), mesh.to_string_lossy().into_owned()));
    }
    let mut scene = snell::loader::load(path, &options)?;
    for camera in &mut scene.cameras {
        (camera.film.width, camera.film.height) = (pixels, pixels);
        camera.film.crop = Crop { x: 0, y: 0, width: pixels, height: pixels };
    }
    Ok(scene)
}

/// With the limits of its file.
fn settings(scene: &SceneDescription, samples: u32) -> RenderSettings {
    let mut settings = scenes::settings(Estimator::Path, samples, scene.integrator.max_depth.unwrap_or(u32::MAX));
    settings.integrator.rr_depth = scene.integrator.rr_depth;
    settings
}

fn compiled(scene: &SceneDescription, accelerator: Accelerator) -> Result<Scene> {
    Ok(POOL.install(|| scenes::compiled(scene, accelerator))?)
}

/// A picture, of which no sample may be anything but a number that is not negative.
fn picture(scene: &Scene, settings: &RenderSettings) -> Picture {
    let (picture, dropped) = scenes::picture(scene, settings, &POOL);
    if !dropped.is_empty() {
        println!("dropped: {dropped:?}");
    }
    picture
}

fn mean(picture: &Picture) -> f64 {
    scenes::mean(picture)
}

/// The accelerators that there are.
fn accelerators() -> Vec<Accelerator> {
    if cfg!(feature = "embree") { vec![Accelerator::Native, Accelerator::Embree] } else { vec![Accelerator::Native] }
}
