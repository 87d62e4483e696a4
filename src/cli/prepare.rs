//! From the arguments to a compiled scene.

use super::args::SceneArgs;
use crate::description::{Film, SceneDescription};
use crate::error::{Error, Result};
use crate::image::Crop;
use crate::loader::{self, LoadOptions};
use crate::scene::Scene;
use crate::scene::compile::{CompileOptions, compile};
use rayon::ThreadPool;
use std::time::{Duration, Instant};

/// A scene that is ready to render, and how long that took.
pub(super) struct Prepared {
    pub(super) description: SceneDescription,
    pub(super) scene: Scene,
    pub(super) warnings: Vec<String>,
    /// Reading and compiling, without the accelerator.
    pub(super) load: Duration,
    /// Building the accelerator.
    pub(super) build: Duration,
}

/// The threads to work with.
pub(super) fn pool(threads: u32) -> Result<ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads as usize)
        .thread_name(|i| format!("snell-{i}"))
        .build()
        .map_err(|e| Error::Usage(format!("cannot start {threads} threads: {e}")))
}

/// Reads and compiles the scene.
pub(super) fn prepare(args: &SceneArgs, pool: &ThreadPool) -> Result<Prepared> {
    let start = Instant::now();
    let options = LoadOptions { defines: args.define.clone(), lenient: args.lenient };
    let mut description = loader::load(&args.scene, &options)?;
    adjust_film(&mut description, args)?;
    let options =
        CompileOptions { accelerator: args.accel.into(), threads: pool.current_num_threads(), camera: args.camera };
    let compiled = pool.install(|| compile(&description, &options))?;
    let mut warnings = description.warnings.clone();
    warnings.extend(compiled.warnings);
    let build = compiled.accel_build;
    Ok(Prepared { description, scene: compiled.scene, warnings, load: start.elapsed() - build, build })
}

/// Puts the size and crop of the arguments into the film of the camera that is used.
fn adjust_film(description: &mut SceneDescription, args: &SceneArgs) -> Result<()> {
    let Some(camera) = description.cameras.get_mut(args.camera) else { return Ok(()) };
    let film = &mut camera.film;
    if let Some((width, height)) = args.size {
        for side in [width, height] {
            Film::check_side(side).map_err(|m| Error::Usage(format!("--size: {m}")))?;
        }
        (film.width, film.height) = (width, height);
        film.crop = Crop { x: 0, y: 0, width, height };
    }
    if let Some(crop) = args.crop {
        let fits = |start: u32, length: u32, whole: u32| start.checked_add(length).is_some_and(|end| end <= whole);
        if !fits(crop.x, crop.width, film.width) || !fits(crop.y, crop.height, film.height) {
            let message = format!("--crop reaches outside the picture, which is {}x{}", film.width, film.height);
            return Err(Error::Usage(message));
        }
        film.crop = crop;
    }
    Film::check_pixels(film.crop).map_err(|m| Error::Usage(format!("--size: {m}")))
}
