//! `snell render`.

use super::args::{IntegratorName, RenderArgs};
use super::prepare::{self, Prepared};
use super::progress::{Display, quantity};
use super::stats::{Names, Stats};
use super::{EXIT_INTERRUPTED, interrupt, replay};
use crate::description::IntegratorKind;
use crate::error::{Error, Result};
use crate::image::{Metadata, OutputFile, WriteOptions};
use crate::integrator::Integrator;
use crate::render::{Progress, RenderSettings, Rendered, render, total_samples};
use crate::sampler::Sampler;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

/// Number of path segments of direct light.
const DIRECT_DEPTH: u32 = 2;

/// Renders and writes.
pub(super) fn run(args: &RenderArgs) -> Result<ExitCode> {
    let say = |text: std::fmt::Arguments<'_>| {
        if !args.quiet {
            // Nobody may be reading.
            let _ = writeln!(std::io::stderr(), "{text}");
        }
    };
    let outputs = reserve(args)?;
    let progress = Arc::new(Progress::default());
    interrupt::handle(&progress, outputs.iter().map(|o| o.temporary_path().to_owned()).collect());
    let pool = prepare::pool(args.scene.threads)?;
    let prepared = prepare::prepare(&args.scene, &pool)?;
    for warning in &prepared.warnings {
        say(format_args!("warning: {warning}"));
    }
    let (settings, integrator) = settings(args, &prepared);
    if let Some(id) = args.replay {
        return replay::run(&prepared.scene, &settings, id).map(|()| ExitCode::SUCCESS);
    }
    if args.verbose {
        let (load, build) = (prepared.load.as_secs_f64(), prepared.build.as_secs_f64());
        say(format_args!("loaded in {load:.3} s, {} built in {build:.3} s", prepared.scene.accel.name()));
    }
    let display = Display::start(&progress, total_samples(&prepared.scene, &settings), args.quiet);
    let rendered = render(&prepared.scene, &settings, &pool, &progress);
    drop(display);
    let names =
        Names { integrator: integrator.text(), sampler: args.sampler.text(), threads: pool.current_num_threads() };
    report(args, &rendered, &say);
    if rendered.samples > 0 {
        write(args, &prepared, &rendered, &settings, &names, outputs, &say)?;
    }
    if let Some(path) = &args.stats {
        write_stats(path, &Stats::new(&prepared, &rendered, &names))?;
    }
    Ok(if rendered.complete { ExitCode::SUCCESS } else { ExitCode::from(EXIT_INTERRUPTED) })
}

/// Makes sure, before anything is rendered, that every output can be written.
fn reserve(args: &RenderArgs) -> Result<Vec<OutputFile>> {
    if let Some(folder) = args.stats.as_deref().and_then(Path::parent)
        && !folder.as_os_str().is_empty()
        && !folder.is_dir()
    {
        return Err(Error::file(folder, "cannot write the statistics: this folder does not exist"));
    }
    if args.replay.is_some() {
        return Ok(Vec::new());
    }
    let named_after_scene =
        || vec![PathBuf::from(args.scene.scene.with_extension("exr").file_name().unwrap_or_default())];
    let paths = if args.output.is_empty() { named_after_scene() } else { args.output.clone() };
    let mut all: Vec<&Path> = paths.iter().map(PathBuf::as_path).chain(args.stats.as_deref()).collect();
    all.sort_unstable();
    if let Some(twice) = all.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Error::Usage(format!("{} is to be written twice", twice[0].display())));
    }
    paths.iter().map(|p| OutputFile::reserve(p)).collect()
}

/// What the file says, with what the arguments change in it.
fn settings(args: &RenderArgs, prepared: &Prepared) -> (RenderSettings, IntegratorName) {
    let file = &prepared.description.integrator;
    let sampler = prepared.description.cameras[args.scene.camera].sampler;
    let name = args.integrator.unwrap_or(match file.kind {
        IntegratorKind::Path => IntegratorName::Path,
        IntegratorKind::Direct => IntegratorName::Direct,
    });
    let file_depth = file.max_depth.unwrap_or(u32::MAX);
    let max_depth = match args.max_depth {
        Some(depth) => u32::try_from(depth).unwrap_or(u32::MAX),
        None if name == IntegratorName::Direct => file_depth.min(DIRECT_DEPTH),
        None => file_depth,
    };
    let settings = RenderSettings {
        samples: args.spp.unwrap_or(sampler.sample_count),
        sampler: Sampler { kind: args.sampler.kind(), seed: args.seed.unwrap_or(u64::from(sampler.seed)) },
        integrator: Integrator {
            estimator: name.estimator(),
            max_depth,
            rr_depth: args.rr_depth.unwrap_or(file.rr_depth),
            hide_emitters: file.hide_emitters,
        },
    };
    (settings, name)
}

fn report(args: &RenderArgs, rendered: &Rendered, say: &dyn Fn(std::fmt::Arguments<'_>)) {
    let seconds = rendered.time.as_secs_f64();
    let rate = |n: u64| quantity(n as f64 / seconds.max(f64::MIN_POSITIVE));
    let what = if rendered.complete { "rendered" } else { "interrupted after" };
    let (samples, rays) = (rate(rendered.samples), rate(rendered.rays.total()));
    say(format_args!("{what} {seconds:.2} s, {samples}samples/s, {rays}rays/s"));
    if rendered.dropped.count > 0 {
        say(format_args!(
            "warning: {} samples were not finite and were left out; to see them:",
            rendered.dropped.count
        ));
        for s in &rendered.dropped.examples {
            say(format_args!("  snell render {} --replay {},{},{}", args.scene.scene.display(), s.x, s.y, s.index));
        }
    }
}

fn write(
    args: &RenderArgs,
    prepared: &Prepared,
    rendered: &Rendered,
    settings: &RenderSettings,
    names: &Names<'_>,
    outputs: Vec<OutputFile>,
    say: &dyn Fn(std::fmt::Arguments<'_>),
) -> Result<()> {
    let film = prepared.scene.film;
    let pixels = f64::from(film.crop.width) * f64::from(film.crop.height);
    let command: Vec<String> = std::env::args().collect();
    let metadata = Metadata {
        numbers: vec![
            ("snell.samples", rendered.samples as f64 / pixels),
            ("snell.seconds", rendered.time.as_secs_f64()),
            ("snell.seed", settings.sampler.seed as f64),
            ("snell.nonFiniteSamples", rendered.dropped.count as f64),
        ],
        texts: vec![
            ("snell.version", env!("CARGO_PKG_VERSION").into()),
            ("snell.command", command.join(" ")),
            ("snell.integrator", names.integrator.into()),
            ("snell.sampler", names.sampler.into()),
            ("snell.accelerator", prepared.scene.accel.name()),
            ("snell.bias", "none".into()),
            ("snell.complete", if rendered.complete { "yes" } else { "no" }.into()),
        ],
    };
    let picture = rendered.film.develop();
    let options = WriteOptions {
        full_size: film.size,
        crop: film.crop,
        component_format: film.component_format,
        exposure: args.exposure,
        metadata,
    };
    for output in outputs {
        let path = output.path().to_owned();
        let clamped = output.write(&picture, &options)?;
        if clamped > 0 {
            say(format_args!("warning: {}: {clamped} values were too large for half floats", path.display()));
        }
        say(format_args!("wrote {}", path.display()));
    }
    Ok(())
}

fn write_stats(path: &Path, stats: &Stats<'_>) -> Result<()> {
    let mut text = serde_json::to_string_pretty(stats).map_err(|e| Error::file(path, e))?;
    text.push('\n');
    crate::image::write_whole(path, text.as_bytes())
}
