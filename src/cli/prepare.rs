//! From the arguments to a compiled scene.

use super::args::{AovName, IntegratorName, RenderArgs, SceneArgs};
use crate::accel::Choice;
use crate::description::{Film, Integrator, IntegratorKind, SceneDescription};
use crate::error::{Error, Result};
use crate::error_estimate::{Parts, PixelEstimate};
use crate::files::{Files, Memory};
use crate::film::Film as Sums;
use crate::image::{Area, Crop};
use crate::integrator::BLOCK_SIZE;
use crate::loader::{self, LoadOptions, Sky};
use crate::scene::Scene;
use crate::scene::compile::{Beyond, CompileOptions, compile, fold};
use crate::scene::predict::{Prediction, predict};
use rayon::ThreadPool;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// A scene that is ready to render, and how long that took.
pub(super) struct Prepared {
    pub(super) description: SceneDescription,
    /// All files that were read.
    pub(super) files: Vec<PathBuf>,
    pub(super) scene: Scene,
    /// What each of the scene's lights is called.
    pub(super) light_names: Vec<String>,
    pub(super) warnings: Vec<String>,
    /// What was simpler than the file says.
    pub(super) folded: Vec<String>,
    /// Reading and compiling, without the accelerator.
    pub(super) load: Duration,
    /// Which accelerator, and why.
    pub(super) accel_choice: Choice,
    /// Building the accelerator.
    pub(super) build: Duration,
    /// What all that was expected to take.
    pub(super) memory: Prediction,
    limit: Memory,
}

/// How a film keeps its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FilmKind {
    /// In two halves.
    Halves,
    /// The same, and copies of it go to files.
    Kept,
    /// In blocks with numbers of their own.
    Blocks,
    /// The same, and copies of them go to files.
    KeptBlocks,
}

impl Prepared {
    /// An error if the sums of the film, with so many bytes a pixel beside radiance, are more than there is memory for, or more than the
    /// user lets snell have beside all else.
    pub(super) fn check_film(&self, beside: u64, kind: FilmKind) -> Result<()> {
        let pixels = Area::from(self.scene.film.crop).pixels();
        let film = match kind {
            FilmKind::Halves => Sums::bytes(pixels, Parts::Halves.count() as u64) + pixels * beside,
            FilmKind::Kept => {
                /// What is kept of a film is a copy, its planes, and these again in the type of the file.
                const KEPT_COPIES: u64 = 3;
                (1 + KEPT_COPIES) * (Sums::bytes(pixels, Parts::Halves.count() as u64) + pixels * beside)
            }
            FilmKind::Blocks | FilmKind::KeptBlocks => {
                /// What is kept of blocks is planes, and these again in the type of the file, and the film put together once more.
                const KEPT_COPIES: u64 = 2;
                let copies = if kind == FilmKind::KeptBlocks { KEPT_COPIES } else { 0 };
                let parts = Parts::Replicates.count() as u64;
                // Every block has a border of its own; beside the blocks there are estimates and, at the end, the film.
                let edge = u64::from(BLOCK_SIZE);
                let with_border = edge + 2 * u64::from(self.scene.film.filter.border());
                let blocks = (Sums::bytes(pixels, parts) + parts * pixels * beside) * with_border.pow(2) / edge.pow(2);
                let film = Sums::bytes(pixels, 1) + pixels * beside;
                (1 + copies) * blocks + pixels * size_of::<PixelEstimate>() as u64 + (1 + copies) * film
            }
        };
        check_limit(&Prediction { film, ..self.memory }, &self.limit)?;
        check_memory(film)
    }
}

/// The threads to work with.
pub(super) fn pool(threads: u32) -> Result<ThreadPool> {
    rayon::ThreadPoolBuilder::new().num_threads(threads as usize).thread_name(|i| format!("snell-{i}")).build().map_err(
        |e| {
            let count = if threads == 0 { "a thread for every core".into() } else { format!("{threads} threads") };
            Error::Usage(format!("cannot start {count}: {e}"))
        },
    )
}

/// What a scene is prepared for.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Purpose {
    /// Texture coordinates of all shapes are wanted.
    pub(super) uvs: bool,
    /// Quantities beside radiance are wanted, whatever the file says.
    pub(super) aovs: bool,
    /// The depth of paths is limited, whatever the file says.
    pub(super) limits_depth: bool,
    /// Samples a pixel, if it is not as many as the file says.
    pub(super) samples: Option<u32>,
}

/// Reads, folds and compiles the scene.
pub(super) fn prepare(args: &SceneArgs, purpose: Purpose, pool: &ThreadPool) -> Result<Prepared> {
    let start = Instant::now();
    let sky = args.env.clone().map(|file| Sky { file, degrees: f64::from(args.env_rotate.unwrap_or(0.0)) });
    let files = match &args.confine {
        None => Files::default(),
        Some(folder) => {
            Files::inside(folder).map_err(|m| Error::Usage(format!("--confine: '{}': {m}", folder.display())))?
        }
    };
    let limit = args.memory_limit.as_ref().and_then(Memory::limit).map_or_else(Memory::default, Memory::limited);
    let files = files.within(limit.clone());
    let options = LoadOptions { defines: args.define.clone(), lenient: args.lenient, uvs: purpose.uvs, sky, files };
    let mut description = pool.install(|| loader::load(&args.scene, &options))?;
    let files = options.files.read_so_far();
    adjust_film(&mut description, args)?;
    let beyond = purpose.beyond(&description.integrator);
    let (description, folded) = fold(description, beyond)?;
    let threads = pool.current_num_threads();
    let options = CompileOptions {
        accelerator: args.accel.into(),
        quality: args.accel_quality.into(),
        threads,
        camera: args.camera,
        samples: purpose.samples,
    };
    let film = Sums::bytes(film_pixels(&description, args.camera), Parts::Halves.count() as u64);
    let memory = Prediction { film, ..predict(&description, &options) };
    check_limit(&memory, &limit)?;
    let compiled = pool.install(|| compile(&description, &options))?;
    let mut warnings = description.warnings.clone();
    warnings.extend(compiled.warnings);
    let (accel_choice, build) = (compiled.accel_choice, compiled.accel_build);
    let (scene, light_names) = (compiled.scene, compiled.light_names);
    let load = start.elapsed() - build;
    Ok(Prepared { description, files, scene, light_names, warnings, folded, load, accel_choice, build, memory, limit })
}

impl Purpose {
    /// To render as the arguments say, with so many samples a pixel if it is not as many as the file says.
    pub(super) fn of(args: &RenderArgs, samples: Option<u32>) -> Self {
        Self {
            uvs: args.aov.contains(&AovName::Uv),
            aovs: !args.aov.is_empty(),
            limits_depth: args.max_depth.is_some() || args.integrator == Some(IntegratorName::Direct),
            samples,
        }
    }

    /// What decides, beside the scene, which of its surfaces can be told from nothing.
    fn beyond(self, file: &Integrator) -> Beyond {
        let limits_depth = self.limits_depth || file.max_depth.is_some() || file.kind == IntegratorKind::Direct;
        Beyond { any_depth: !limits_depth, aovs: self.aovs || self.uvs || !file.aovs.is_empty() }
    }
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
    // Whatever the file says was checked when it was read.
    let given = if args.crop.is_some() { "--crop" } else { "--size" };
    Film::check_pixels(film.crop).map_err(|m| Error::Usage(format!("{given}: {m}")))?;
    check_memory(Sums::bytes(Area::from(film.crop).pixels(), Parts::Halves.count() as u64))
}

/// Pixels to render with a camera, if there is one.
fn film_pixels(description: &SceneDescription, camera: usize) -> u64 {
    description.cameras.get(camera).map_or(0, |camera| Area::from(camera.film.crop).pixels())
}

/// An error, with the figures, if more memory is expected to be needed than the user lets snell have.
fn check_limit(memory: &Prediction, limit: &Memory) -> Result<()> {
    match limit.limit() {
        Some(limit) if memory.total() > limit => Err(Error::Usage(format!(
            "--memory-limit: the scene would take about {}, more than {}",
            describe(memory),
            mib(limit)
        ))),
        _ => Ok(()),
    }
}

/// The figures, in all and by kind.
pub(super) fn describe(memory: &Prediction) -> String {
    let &Prediction { program, description, pictures, compiled, accelerator, film } = memory;
    let parts = [
        ("program", program),
        ("description", description),
        ("pictures", pictures),
        ("shapes and lights", compiled),
        ("accelerator", accelerator),
        ("film", film),
    ];
    let parts: Vec<String> = parts.into_iter().map(|(name, bytes)| format!("{name} {}", mib(bytes))).collect();
    format!("{}: {}", mib(memory.total()), parts.join(", "))
}

/// For people.
pub(super) fn mib(bytes: u64) -> String {
    format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20))
}

/// An error if the system says already now that it will not give so many bytes for the film, rather than in the middle of
/// the render.
fn check_memory(bytes: u64) -> Result<()> {
    let refused = || Error::Usage(format!("there is no memory for so many pixels: their sums take {bytes} bytes"));
    let bytes = usize::try_from(bytes).map_err(|_| refused())?;
    // Untouched memory costs nothing.
    Vec::<u8>::new().try_reserve_exact(bytes).map_err(|_| refused())
}
