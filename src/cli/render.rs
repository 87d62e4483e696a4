//! `snell render`.

use super::aov::Beside;
use super::args::{IntegratorName, RenderArgs, ReuseName, Shard};
use super::finish::{self, Finish, Outcome};
use super::keeper::Keeper;
use super::prepare::{self, FilmKind, Prepared, Purpose};
use super::progress::{Aim, Display, quantity};
use super::record::Kept;
use super::stats::{Names, Stats};
use super::{goal, identity, interrupt, replay};
use crate::description::IntegratorKind;
use crate::error::{Error, Result};
use crate::image::{Format, OutputFile, PixelFormat, Reserved};
use crate::integrator::{Integrator, PathReuse, Undecided};
use crate::render::adaptive::{AdaptiveSession, Keeping};
use crate::render::{Progress, RenderSettings, Rendered, Session, State, total_samples};
use crate::sampler::{MOST_OF_RUN, Sampler};
use rayon::ThreadPool;
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

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
    goal::check(args)?;
    let Outputs { pictures, stats } = reserve(args)?;
    let progress = Arc::new(Progress::default());
    let temporaries = pictures.iter().map(OutputFile::temporary_path).chain(stats.iter().map(Reserved::temporary_path));
    interrupt::handle(&progress, temporaries.flatten().map(Path::to_owned).collect());
    let pool = prepare::pool(args.scene.threads)?;
    let mut prepared = prepare::prepare(&args.scene, Purpose::of(args, args.spp), &pool)?;
    if args.bias.regularize {
        pool.install(|| prepared.scene.regularize());
    }
    for warning in &prepared.warnings {
        say(format_args!("warning: {warning}"));
    }
    let (settings, integrator) = settings(args, &prepared, &pool)?;
    if let Some(id) = args.replay {
        return replay::run(&prepared.scene, &settings, id, args.goal.is_adaptive()).map(|()| ExitCode::SUCCESS);
    }
    tell(args, &prepared, &settings, integrator, &say);
    let format = pixel_format(args, &prepared);
    let beside = beside(args, &prepared, &settings, (format, integrator), &pictures, &say)?;
    let finish = finish(args, command, &prepared, &settings, integrator, format, &beside);
    let job = Job { args, prepared, settings, integrator, beside, finish };
    let kept = job.kept(&pool)?;
    let keeper = kept.as_ref().and_then(|kept| Keeper::new(&args.keep, kept));
    let (rendered, state) = job.render(keeper.as_ref(), &progress, &pool, &say)?;
    report(command, &job.prepared, &rendered, &say);
    let error = goal::error_of(args, &rendered);
    let pixels = total_samples(&job.prepared.scene, 1);
    goal::tell(args, &rendered, error, rendered.samples as f64 / pixels as f64, &say);
    // What cannot be written keeps nothing else from being written.
    let mut failures = Vec::new();
    if let (Some(keeper), Some(state)) = (&keeper, &state) {
        failures.extend(keeper.save(state, rendered.is_complete()).err());
    }
    let mut clamped = 0;
    if rendered.samples > 0 {
        let outcome = Outcome::of(&rendered, pixels, error);
        let of_shard = kept.as_ref().zip(state.as_ref()).filter(|_| args.keep.shard.is_some());
        let sealed = of_shard.map(|(kept, state)| kept.sealed(state, rendered.is_complete()));
        let sums = (&rendered.film, rendered.estimates.as_ref());
        clamped = job.finish.develop(sums, &outcome, args.exposure, sealed, |layers, options| {
            finish::write(layers, options, pictures, &say, &mut failures)
        });
    }
    if let Some(file) = stats {
        failures.extend(write_stats(file, &Stats::new(&job.prepared, &rendered, &job.names(&pool), clamped)).err());
    }
    finish::last_of(failures)?;
    Ok(goal::exit_code(args, &rendered))
}

/// What goes beside the picture; an error where there is no memory for it and the picture.
fn beside(
    args: &RenderArgs,
    prepared: &Prepared,
    settings: &RenderSettings,
    (format, integrator): (PixelFormat, IntegratorName),
    pictures: &[OutputFile],
    say: &dyn Fn(std::fmt::Arguments<'_>),
) -> Result<Beside> {
    let mut beside = Beside::new(&args.aov, &prepared.description.integrator.aovs, format, &prepared.scene)?;
    beside.tell(integrator != IntegratorName::Direct);
    beside.look_at_first(args.beside.aov_spp, settings.samples);
    prepared.check_film(beside.bytes(&prepared.scene), film_kind(args))?;
    if beside.has_channels() && !pictures.iter().any(|p| p.format() == Format::Exr) {
        say(format_args!(
            "warning: the channels beside the picture are not written: only a file named .exr can hold them"
        ));
    }
    Ok(beside)
}

/// A render that is ready to begin.
struct Job<'a> {
    args: &'a RenderArgs,
    prepared: Prepared,
    settings: RenderSettings,
    integrator: IntegratorName,
    beside: Beside,
    finish: Finish,
}

impl Job<'_> {
    /// Which of each pixel's samples are to be taken.
    fn samples(&self) -> Result<Range<u32>> {
        part_of(self.args.keep.shard, self.settings.samples)
    }

    /// What is to be known of the render to keep it, if it is kept.
    fn kept(&self, pool: &ThreadPool) -> Result<Option<Kept>> {
        let Self { args, prepared, settings, finish, .. } = self;
        let samples = self.samples()?;
        if !args.keep.keeps_sums() {
            return Ok(None);
        }
        Ok(Some(Kept {
            identity: identity::identity(args, prepared, settings, finish, pool)?,
            samples,
            all_samples: settings.samples,
            sampled_pixels: total_samples(&prepared.scene, 1),
            target: goal::target(args),
            finish: finish.clone(),
        }))
    }

    /// Renders, and keeps what is done meanwhile; with the last state, if it is kept.
    fn render(
        &self,
        keeper: Option<&Keeper<'_>>,
        progress: &Arc<Progress>,
        pool: &ThreadPool,
        say: &(dyn Fn(std::fmt::Arguments<'_>) + Sync),
    ) -> Result<(Rendered, Option<State>)> {
        let Self { args, settings, beside: Beside { aovs, .. }, .. } = self;
        let (scene, samples) = (&self.prepared.scene, self.samples()?);
        let has_number = samples.end < MOST_OF_RUN;
        let total = has_number.then(|| total_samples(scene, samples.len() as u32));
        let aim = Aim { samples: total, time: args.goal.time, error: args.goal.target_error };
        if let Some(limits) = goal::limits(args, settings.samples) {
            let mut session = AdaptiveSession::new(scene, settings, aovs, &limits, progress);
            if let Some(keeper) = keeper {
                session = keeper.resume_adaptive(session, &say)?;
            }
            let display = Display::start(progress, aim, args.quiet);
            let mut pace = keeper.map(|keeper| keeper.pace(say));
            session.run(pool, pace.as_mut().map(|pace| pace as &mut dyn Keeping));
            drop(display);
            let state = keeper.map(|_| session.state());
            return Ok((session.finish(), state));
        }
        let session = match args.goal.time {
            Some(time) => Session::timed(scene, settings, aovs, time, progress),
            None => Session::new(scene, settings, aovs, samples, progress),
        };
        let session = match keeper {
            Some(keeper) => keeper.resume(session, &say)?,
            None => session,
        };
        let display = Display::start(progress, aim, args.quiet);
        take_samples(&session, keeper, pool, !args.quiet, say);
        drop(display);
        let state = self.args.keep.keeps_sums().then(|| session.state());
        Ok((session.finish(), state))
    }

    fn names(&self, pool: &ThreadPool) -> Names<'static> {
        Names {
            integrator: self.integrator.text(),
            sampler: self.args.sampler.text(),
            path_reuse: self.settings.integrator.reuse != PathReuse::Off,
            light_samples: self.settings.integrator.light_samples,
            threads: pool.current_num_threads(),
            pixels: total_samples(&self.prepared.scene, 1),
            confidence: self.args.goal.confidence,
        }
    }
}

/// What the film has to keep.
fn film_kind(args: &RenderArgs) -> FilmKind {
    match (args.goal.is_adaptive(), args.keep.keeps_sums()) {
        (true, true) => FilmKind::KeptBlocks,
        (true, false) => FilmKind::Blocks,
        (false, true) => FilmKind::Kept,
        (false, false) => FilmKind::Halves,
    }
}

/// Which samples of each pixel a shard takes.
fn part_of(shard: Option<Shard>, samples: u32) -> Result<Range<u32>> {
    let Some(Shard { number, count }) = shard else { return Ok(0..samples) };
    if count > samples {
        return Err(Error::Usage(format!("--shard: {samples} samples a pixel cannot be cut into {count} parts")));
    }
    let until = |parts: u32| (u64::from(samples) * u64::from(parts) / u64::from(count)) as u32;
    Ok(until(number - 1)..until(number))
}

/// Renders, and meanwhile keeps what is done, and looks at its error if that is `shown`.
fn take_samples(
    session: &Session<'_>,
    keeper: Option<&Keeper<'_>>,
    pool: &ThreadPool,
    shown: bool,
    say: &(dyn Fn(std::fmt::Arguments<'_>) + Sync),
) {
    std::thread::scope(|threads| {
        let mut stops: Vec<Sender<()>> = Vec::new();
        let mut stopped = || {
            let (stop, stopped) = channel();
            stops.push(stop);
            stopped
        };
        if let Some(keeper) = keeper {
            let stopped = stopped();
            threads.spawn(move || keeper.keep_saving(session, &stopped, say));
        }
        if shown {
            let stopped = stopped();
            threads.spawn(move || keep_looking(session, &stopped));
        }
        session.run(pool);
        drop(stops);
    });
}

/// Estimates the error again and again until `stopped`.
fn keep_looking(session: &Session<'_>, stopped: &Receiver<()>) {
    /// A look takes less than a hundredth of the time.
    const LEISURE: u32 = 100;
    const LEAST: Duration = Duration::from_millis(500);
    let mut wait = LEAST;
    while stopped.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
        let start = Instant::now();
        session.look();
        wait = LEAST.max(start.elapsed().saturating_mul(LEISURE));
    }
}

/// What is to be made of the film.
fn finish(
    args: &RenderArgs,
    command: &str,
    prepared: &Prepared,
    settings: &RenderSettings,
    integrator: IntegratorName,
    format: PixelFormat,
    beside: &Beside,
) -> Finish {
    let film = prepared.scene.film;
    let about = [
        ("snell.version", env!("CARGO_PKG_VERSION").into()),
        ("snell.command", command.into()),
        ("snell.integrator", integrator.text().into()),
        ("snell.sampler", args.sampler.text().into()),
        // As text: not every seed is a number of f64.
        ("snell.seed", settings.sampler.seed.to_string()),
        ("snell.accelerator", prepared.scene.accel.name()),
        ("snell.bias", args.bias.text()),
    ];
    Finish {
        full_size: film.size,
        crop: film.crop,
        pixel_format: format,
        component_format: film.component_format,
        channels: beside.channels.clone(),
        about: about.map(|(name, text)| (name.to_owned(), text)).into(),
    }
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
    let is_exr = |path: &&PathBuf| Format::of(path).is_ok_and(|format| format == Format::Exr);
    if !args.aov.is_empty() && !paths.iter().any(|path| is_exr(&path)) {
        return Err(Error::Usage(
            "--aov needs an output whose name ends in .exr: no other can hold its channels".into(),
        ));
    }
    if args.keep.shard.is_some()
        && let Some(other) = paths.iter().find(|path| !is_exr(path))
    {
        return Err(Error::file(other, "a shard needs an output whose name ends in .exr: no other can hold its sums"));
    }
    let others: Vec<&Path> = args.stats.as_deref().into_iter().collect();
    let pictures = reserve_pictures(&paths, &others)?;
    let all: Vec<&Path> =
        paths.iter().map(PathBuf::as_path).chain(others).chain([args.scene.scene.as_path()]).collect();
    Keeper::check(&args.keep, &all)?;
    let stats = args.stats.as_deref().map(|p| Reserved::new(p, "the statistics")).transpose()?;
    Ok(Outputs { pictures, stats })
}

/// Reserves the pictures; none of them twice or in the place of `others`.
pub(super) fn reserve_pictures(paths: &[PathBuf], others: &[&Path]) -> Result<Vec<OutputFile>> {
    let mut all: Vec<&Path> = paths.iter().map(PathBuf::as_path).chain(others.iter().copied()).collect();
    all.sort_unstable();
    if let Some(twice) = all.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Error::Usage(format!("{} is to be written twice", twice[0].display())));
    }
    paths.iter().map(|path| OutputFile::reserve(path)).collect()
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
    let samples = goal::samples(args, sampler.sample_count);
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
        clamp: args.bias.clamp,
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
    let what = if rendered.is_complete() { "rendered" } else { "interrupted after" };
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

fn write_stats(file: Reserved, stats: &Stats<'_>) -> Result<()> {
    file.write(|file| {
        let text = serde_json::to_string_pretty(stats)?;
        writeln!(file, "{text}")
    })
}
