//! `snell render`.

use super::aov::Beside;
use super::args::{AovName, IntegratorName, RenderArgs, ReuseName};
use super::prepare::{self, Prepared};
use super::progress::{Display, quantity};
use super::stats::{Names, Stats};
use super::{EXIT_INTERRUPTED, interrupt, replay};
use crate::description::IntegratorKind;
use crate::error::{Error, Result};
use crate::image::{ComponentFormat, Format, Layers, Metadata, OutputFile, PixelFormat, Reserved, WriteOptions};
use crate::integrator::{Integrator, PathReuse, Undecided};
use crate::render::{Progress, RenderSettings, Rendered, render_with, total_samples};
use crate::sampler::Sampler;
use rayon::ThreadPool;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

/// Number of path segments of direct light.
const DIRECT_DEPTH: u32 = 2;

/// Renders and writes; `command` is what the arguments come from, as a shell takes it.
pub(super) fn run(args: &RenderArgs, command: &str) -> Result<ExitCode> {
    let say = |text: std::fmt::Arguments<'_>| {
        if !args.quiet {
            // Nobody may be reading.
            let _ = writeln!(std::io::stderr(), "{text}");
        }
    };
    let Outputs { pictures, stats } = reserve(args)?;
    let progress = Arc::new(Progress::default());
    let temporaries = pictures.iter().map(OutputFile::temporary_path).chain(stats.iter().map(Reserved::temporary_path));
    interrupt::handle(&progress, temporaries.map(Path::to_owned).collect());
    let pool = prepare::pool(args.scene.threads)?;
    let prepared = prepare::prepare(&args.scene, args.aov.contains(&AovName::Uv), args.spp, &pool)?;
    for warning in &prepared.warnings {
        say(format_args!("warning: {warning}"));
    }
    let (settings, integrator) = settings(args, &prepared, &pool)?;
    if let Some(id) = args.replay {
        return replay::run(&prepared.scene, &settings, id).map(|()| ExitCode::SUCCESS);
    }
    tell(args, &prepared, &settings, integrator, &say);
    let format = pixel_format(args, &prepared);
    let mut beside = Beside::new(&args.aov, &prepared.description.integrator.aovs, format, &prepared.scene)?;
    beside.tell(integrator != IntegratorName::Direct, settings.samples);
    prepare::check_film(&prepared.scene, beside.bytes(&prepared.scene))?;
    if beside.has_channels() && !pictures.iter().any(|p| p.format() == Format::Exr) {
        say(format_args!(
            "warning: the channels beside the picture are not written: only a file named .exr can hold them"
        ));
    }
    let display = Display::start(&progress, total_samples(&prepared.scene, &settings), args.quiet);
    let rendered = render_with(&prepared.scene, &settings, &beside.aovs, &pool, &progress);
    drop(display);
    let names = Names {
        integrator: integrator.text(),
        sampler: args.sampler.text(),
        path_reuse: settings.integrator.reuse != PathReuse::Off,
        light_samples: settings.integrator.light_samples,
        threads: pool.current_num_threads(),
    };
    report(command, &prepared, &rendered, &say);
    // What cannot be written keeps nothing else from being written.
    let mut failures = Vec::new();
    let mut clamped = 0;
    if rendered.samples > 0 {
        let options = write_options(args, command, &prepared, &rendered, &settings, &names);
        let (picture, alpha) = (rendered.film.develop(), beside.alpha(&rendered.film));
        let planes = beside.planes(&rendered.film, &picture);
        let layers = Layers { picture: &picture, format, alpha: alpha.as_deref(), planes: &planes };
        clamped = write(layers, &options, pictures, &say, &mut failures);
    }
    if let Some(file) = stats {
        failures.extend(write_stats(file, &Stats::new(&prepared, &rendered, &names, clamped)).err());
    }
    if let Some(last) = failures.pop() {
        for error in failures {
            let _ = writeln!(std::io::stderr(), "error: {error}");
        }
        return Err(last);
    }
    Ok(if rendered.complete { ExitCode::SUCCESS } else { ExitCode::from(EXIT_INTERRUPTED) })
}

/// Says what is to be known before a render.
fn tell(
    args: &RenderArgs,
    prepared: &Prepared,
    settings: &RenderSettings,
    integrator: IntegratorName,
    say: &dyn Fn(std::fmt::Arguments<'_>),
) {
    if prepared.scene.features.lights_without_size() > 0 && !settings.integrator.estimator.samples_lights() {
        let name = integrator.text();
        say(format_args!("warning: lights without size stay dark: '{name}' only counts light that a path runs into"));
    }
    if args.verbose {
        let (load, build) = (prepared.load.as_secs_f64(), prepared.build.as_secs_f64());
        let shares = match settings.integrator.reuse {
            PathReuse::Off => "keep",
            PathReuse::Eights => "share, eight together,",
            PathReuse::Blocks => "share",
        };
        say(format_args!("loaded in {load:.3} s, {} built in {build:.3} s", prepared.scene.accel.name()));
        let samples = settings.integrator.light_samples;
        let plural = if samples == 1 { "" } else { "s" };
        say(format_args!(
            "neighbouring pixels {shares} what their paths find; {samples} light sample{plural} at the first hit"
        ));
    }
}

/// Places for what is to be written.
struct Outputs {
    pictures: Vec<OutputFile>,
    stats: Option<Reserved>,
}

/// Makes sure, before anything is rendered, that every output can be written.
fn reserve(args: &RenderArgs) -> Result<Outputs> {
    if args.replay.is_some() {
        return Ok(Outputs { pictures: Vec::new(), stats: None });
    }
    if let Some(stats) = &args.stats
        && let (Ok(stats), Ok(scene)) = (stats.canonicalize(), args.scene.scene.canonicalize())
        && stats == scene
    {
        return Err(Error::file(&stats, "cannot write the statistics: this is the scene"));
    }
    let named_after_scene =
        || vec![PathBuf::from(args.scene.scene.with_extension("exr").file_name().unwrap_or_default())];
    let paths = if args.output.is_empty() { named_after_scene() } else { args.output.clone() };
    let mut all: Vec<&Path> = paths.iter().map(PathBuf::as_path).chain(args.stats.as_deref()).collect();
    all.sort_unstable();
    if let Some(twice) = all.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Error::Usage(format!("{} is to be written twice", twice[0].display())));
    }
    let is_exr = |path: &&PathBuf| Format::of(path).is_ok_and(|format| format == Format::Exr);
    if !args.aov.is_empty() && !paths.iter().any(|path| is_exr(&path)) {
        return Err(Error::Usage(
            "--aov needs an output whose name ends in .exr: no other can hold its channels".into(),
        ));
    }
    let pictures = paths.iter().map(|p| OutputFile::reserve(p)).collect::<Result<_>>()?;
    let stats = args.stats.as_deref().map(|p| Reserved::new(p, "the statistics")).transpose()?;
    Ok(Outputs { pictures, stats })
}

/// What the file says, with what the arguments change in it.
pub(super) fn settings(
    args: &RenderArgs,
    prepared: &Prepared,
    pool: &ThreadPool,
) -> Result<(RenderSettings, IntegratorName)> {
    let file = &prepared.description.integrator;
    let sampler = prepared.description.cameras[args.scene.camera].sampler;
    let name = args.integrator.unwrap_or(match file.kind {
        IntegratorKind::Path => IntegratorName::Path,
        IntegratorKind::Direct => IntegratorName::Direct,
    });
    let file_depth = file.max_depth.unwrap_or(u32::MAX);
    // Light that the file leaves out stays out, whoever estimates the rest.
    let is_direct = file.kind == IntegratorKind::Direct || name == IntegratorName::Direct;
    let max_depth = match args.max_depth {
        Some(depth) => u32::try_from(depth).unwrap_or(u32::MAX),
        None if is_direct => file_depth.min(DIRECT_DEPTH),
        None => file_depth,
    };
    let samples = args.spp.unwrap_or(sampler.sample_count);
    let kind = args.sampler.kind_for(samples)?;
    let integrator = Integrator {
        estimator: name.estimator(),
        max_depth,
        rr_depth: args.rr_depth.unwrap_or(file.rr_depth),
        hide_emitters: file.hide_emitters,
        hide_environment: !args.env_visible,
        light_samples: args.light_samples.0.unwrap_or(1),
        reuse: match args.reuse {
            ReuseName::Auto | ReuseName::Off => PathReuse::Off,
            ReuseName::Eights => PathReuse::Eights,
            ReuseName::On => PathReuse::Blocks,
        },
    };
    let undecided = Undecided { reuse: args.reuse == ReuseName::Auto, light_samples: args.light_samples.0.is_none() };
    let settings = RenderSettings {
        samples,
        sampler: Sampler { kind, seed: args.seed.unwrap_or(u64::from(sampler.seed)) },
        integrator: pool.install(|| integrator.with_what_pays(&prepared.scene, undecided)),
    };
    Ok((settings, name))
}

/// What the file's pixels are to be: as the scene says, but with alpha where the sky is left out.
fn pixel_format(args: &RenderArgs, prepared: &Prepared) -> PixelFormat {
    let format = prepared.scene.film.pixel_format;
    if args.env_visible { format } else { format.with_alpha() }
}

fn report(command: &str, prepared: &Prepared, rendered: &Rendered, say: &dyn Fn(std::fmt::Arguments<'_>)) {
    let seconds = rendered.time.as_secs_f64();
    let rate = |n: u64| quantity(n as f64 / seconds.max(f64::MIN_POSITIVE));
    let what = if rendered.complete { "rendered" } else { "interrupted after" };
    let (samples, rays) = (rate(rendered.samples), rate(rendered.rays.total()));
    say(format_args!("{what} {seconds:.2} s, {samples}samples/s, {rays}rays/s"));
    if let Some(c) = prepared.scene.accel.comparison() {
        say(format_args!(
            "compared {} rays: {} ties, {} edges, misses {} (Embree) and {} (native), false hits {} and {}",
            c.rays, c.ties, c.edges, c.embree_misses, c.native_misses, c.embree_false, c.native_false
        ));
    }
    let dropped = &rendered.dropped;
    if !dropped.is_empty() {
        if dropped.negative > 0 {
            say(format_args!("warning: {} samples were negative and were counted as they are", dropped.negative));
        }
        let kinds = [
            (dropped.non_finite(), "not finite"),
            (dropped.oversized, "more than 2^31 times as bright as the brightest light"),
        ];
        for (count, what) in kinds.into_iter().filter(|(count, _)| *count > 0) {
            say(format_args!("warning: {count} samples were {what} and were left out"));
        }
        say(format_args!("to see them:"));
        for s in &dropped.examples {
            say(format_args!("  {command} --replay {},{},{}", s.x, s.y, s.index));
        }
    }
}

/// What the files are to say of the render.
fn write_options(
    args: &RenderArgs,
    command: &str,
    prepared: &Prepared,
    rendered: &Rendered,
    settings: &RenderSettings,
    names: &Names<'_>,
) -> WriteOptions {
    let film = prepared.scene.film;
    let pixels = film.filter.sampled_area(film.crop, film.sample_border).pixels() as f64;
    let metadata = Metadata {
        numbers: vec![
            ("snell.samples", rendered.samples as f64 / pixels),
            ("snell.seconds", rendered.time.as_secs_f64()),
            ("snell.nonFiniteSamples", rendered.dropped.non_finite() as f64),
            ("snell.oversizedSamples", rendered.dropped.oversized as f64),
        ],
        texts: vec![
            ("snell.version", env!("CARGO_PKG_VERSION").into()),
            ("snell.command", command.into()),
            ("snell.integrator", names.integrator.into()),
            ("snell.sampler", names.sampler.into()),
            // As text: not every seed is a number of f64.
            ("snell.seed", settings.sampler.seed.to_string()),
            ("snell.accelerator", prepared.scene.accel.name()),
            ("snell.bias", "none".into()),
            ("snell.complete", if rendered.complete { "yes" } else { "no" }.into()),
        ],
    };
    WriteOptions {
        full_size: film.size,
        crop: film.crop,
        component_format: film.component_format,
        exposure: args.exposure,
        metadata,
    }
}

/// Writes every picture that can be written, and adds to `failures` what is wrong with the others. Returns how many values
/// did not fit their files' type and were clamped.
fn write(
    layers: Layers<'_>,
    options: &WriteOptions,
    outputs: Vec<OutputFile>,
    say: &dyn Fn(std::fmt::Arguments<'_>),
    failures: &mut Vec<Error>,
) -> u64 {
    let mut all_clamped = 0;
    for output in outputs {
        let path = output.path().to_owned();
        match output.write(layers, options) {
            Ok(clamped) => {
                if clamped > 0 {
                    let largest = ComponentFormat::MAX_HALF;
                    let name = path.display();
                    say(format_args!(
                        "warning: {name}: {clamped} values were too large for half floats, and are {largest} now"
                    ));
                }
                all_clamped += clamped;
                say(format_args!("wrote {}", path.display()));
            }
            Err(error) => failures.push(error),
        }
    }
    all_clamped
}

fn write_stats(file: Reserved, stats: &Stats<'_>) -> Result<()> {
    file.write(|file| {
        let text = serde_json::to_string_pretty(stats)?;
        writeln!(file, "{text}")
    })
}
