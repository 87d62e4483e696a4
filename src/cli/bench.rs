//! `snell bench`: from scenes and options to a report.

mod jobs;

use super::args::{BenchArgs, RenderArgs, Vary};
use super::diff::{read_variance, variance_beside};
use super::prepare::{self, Prepared, Purpose};
use super::{EXIT_FAILED, EXIT_INTERRUPTED, interrupt, render};
use crate::bench::estimate::Reference;
use crate::bench::report::{
    Label, Machine, ReferenceFacts, Report, Scene, Settings, configurations, least_measurable, mean_ratios, refused,
    rounded_up,
};
use crate::bench::run::{Budget, Interrupted, Measured, News, Plan, Row, Stage, Trial, measure, rendered, samples_of};
use crate::bench::{Took, csv, page, table, timed, utc_now};
use crate::error::{Error, Result};
use crate::image::{Picture, PictureFile, Reserved, read_picture};
use crate::integrator::Estimator;
use crate::render::{Progress, RenderSettings};
use jobs::{Folder, Variant, budget, render_args, scene_names, variants};
use rayon::ThreadPool;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

/// How many times as many samples a reference has, if nobody says: more than it must be better, for what is measured may
/// converge faster than independent samples do.
const REFERENCE_FACTOR: u32 = 16;
/// Fewest of such a reference.
const LEAST_REFERENCE: u32 = 256;
/// How far the seeds of references are from those of what they measure.
const REFERENCE_SEEDS: u64 = 1 << 40;

/// Measures, prints, writes; 1 where a reference cannot measure what it should.
pub(super) fn run(args: &BenchArgs, command: &str) -> Result<ExitCode> {
    let (budget, variants) = (budget(args), variants(&args.vary));
    let references = references(args)?;
    let jobs = args.scenes.iter().map(|s| render_args(args, s, &variants)).collect::<Result<Vec<_>>>()?;
    let pool = prepare::pool(jobs[0][0].scene.threads)?;
    let folder = Folder::new(&args.out)?;
    let [page, json, csv] =
        ["bench.html", "bench.json", "bench.csv"].map(|name| Reserved::new(&args.out.join(name), "the report"));
    let files = [page?, json?, csv?];
    let progress = Arc::new(Progress::default());
    let temporaries =
        files.iter().filter_map(|f| f.temporary_path().map(Path::to_owned)).chain(folder.made().map(Path::to_owned));
    interrupt::handle(&progress, temporaries.collect());
    check_later_scenes(&jobs, &pool)?;
    let stage = Stage { pool: &pool, progress: &progress };
    let mut report = Report {
        version: env!("CARGO_PKG_VERSION"),
        date: utc_now(),
        command: command.to_owned(),
        machine: machine(&pool),
        settings: Settings::new(&budget, args.seeds as usize, args.vary.iter().map(Vary::text).collect()),
        scenes: Vec::new(),
        efficiency_ratios: Vec::new(),
        refused: 0,
    };
    for (i, (job, name)) in jobs.iter().zip(scene_names(&args.scenes)).enumerate() {
        let bench = Bench { args, budget: &budget, stage: &stage, variants: &variants, name };
        match bench.scene(job, references.get(i))? {
            Ok(scene) => report.scenes.push(scene),
            Err(Interrupted) => return Ok(ExitCode::from(EXIT_INTERRUPTED)),
        }
    }
    report.efficiency_ratios = mean_ratios(&report.scenes);
    report.refused = refused(&report.scenes);
    // Nobody may be reading.
    let _ = std::io::stdout().write_all(table::text(&report).as_bytes());
    write(&report, files)?;
    folder.keep();
    Ok(if report.refused == 0 { ExitCode::SUCCESS } else { ExitCode::from(EXIT_FAILED) })
}

fn write(report: &Report, [page, json, csv]: [Reserved; 3]) -> Result<()> {
    page.write(|file| file.write_all(page::html(report).as_bytes()))?;
    json.write(|file| {
        let text = serde_json::to_string_pretty(report)?;
        writeln!(file, "{text}")
    })?;
    csv.write(|file| file.write_all(csv::csv(report).as_bytes()))
}

/// Scenes whose turn comes late are read now, so that a fault in them shows before hours have passed.
fn check_later_scenes(jobs: &[Vec<RenderArgs>], pool: &ThreadPool) -> Result<()> {
    jobs.iter().skip(1).try_for_each(|job| prepare::prepare(&job[0].scene, Purpose::default(), pool).map(drop))
}

fn machine(pool: &ThreadPool) -> Machine {
    let told = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = told.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    Machine {
        processor: name.map(|(_, name)| name.trim().to_owned()),
        cores: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        threads: pool.current_num_threads(),
        system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
    }
}

/// A reference from a file, with its variance if that lies beside it.
struct FromFile {
    path: PathBuf,
    file: PictureFile,
    variance: Option<Picture>,
}

/// The references that are given: none, or one for each scene.
fn references(args: &BenchArgs) -> Result<Vec<FromFile>> {
    let (given, scenes) = (args.reference.len(), args.scenes.len());
    if given > 0 && given != scenes {
        return Err(Error::Usage(format!("--reference: expected one for each scene, {scenes}; there are {given}")));
    }
    let read = |path: &PathBuf| {
        let file = read_picture(path)?;
        let variance = variance_beside(path).map(|beside| read_variance(&beside, path, &file)).transpose()?;
        if variance.is_none() && args.seeds < 2 {
            let path = path.display();
            return Err(Error::Usage(format!(
                "--seeds 1 cannot tell how good {path} is: expected its variance in a file beside it whose name ends in \
                 _var.exr, or more seeds"
            )));
        }
        Ok(FromFile { path: path.clone(), file, variance })
    };
    args.reference.iter().map(read).collect()
}

/// A scene that is ready to render in one or several of the ways.
struct Loaded {
    prepared: Prepared,
    took: Took,
}

/// What the parts of a scene's bench share.
struct Bench<'a> {
    args: &'a BenchArgs,
    budget: &'a Budget,
    stage: &'a Stage<'a>,
    variants: &'a [Variant],
    /// Of the scene.
    name: String,
}

impl Bench<'_> {
    fn say(&self, text: std::fmt::Arguments<'_>) {
        if !self.args.quiet {
            // Nobody may be reading.
            let _ = writeln!(std::io::stderr(), "{}: {text}", self.name);
        }
    }

    /// Loads the scene of `job`, which has the arguments of each variant, renders and measures.
    fn scene(&self, job: &[RenderArgs], given: Option<&FromFile>) -> Result<std::result::Result<Scene, Interrupted>> {
        let (loaded, which) = self.load(job)?;
        let of_variant =
            |(args, &w): (&RenderArgs, &usize)| render::settings(args, &loaded[w].prepared, self.stage.pool);
        let settings = job.iter().zip(&which).map(of_variant).collect::<Result<Vec<_>>>()?;
        let trial = |((variant, &settings), &w): ((&Variant, &RenderSettings), &usize)| Trial {
            name: variant.name.clone(),
            scene: &loaded[w].prepared.scene,
            settings,
        };
        let trials: Vec<Trial<'_>> =
            self.variants.iter().zip(settings.iter().map(|s| &s.0)).zip(&which).map(trial).collect();
        let reference = match given {
            Some(given) => Ok(self.given(given, &trials[0])?),
            None => self.rendered(&trials[0]),
        };
        let measured = reference.and_then(|(reference, facts)| {
            let measured = self.measure(&trials, &reference, &facts)?;
            Ok((reference, facts, measured))
        });
        let (reference, facts, measured) = match measured {
            Ok(all) => all,
            Err(Interrupted) => return Ok(Err(Interrupted)),
        };
        let label = |(i, args): (usize, &RenderArgs)| Label {
            name: self.variants[i].name.clone(),
            accelerator: loaded[which[i]].prepared.scene.accel.name(),
            sampler: args.sampler.text().into(),
            integrator: settings[i].1.text().into(),
            load: loaded[which[i]].took,
        };
        let labels = job.iter().enumerate().map(label).collect();
        let picture = reference.picture().clone();
        Ok(Ok(Scene {
            name: self.name.clone(),
            file: job[0].scene.scene.display().to_string(),
            width: picture.width(),
            height: picture.height(),
            configurations: configurations(labels, measured, &facts),
            reference: facts,
            picture: Some(picture),
        }))
    }

    /// The scene, once for every accelerator and with regularized paths apart, and which of them each variant uses.
    fn load(&self, job: &[RenderArgs]) -> Result<(Vec<Loaded>, Vec<usize>)> {
        let mut loaded: Vec<Loaded> = Vec::new();
        let mut which = Vec::new();
        // One scene for all numbers of samples, so that only what is varied differs.
        let limits_depth = job.iter().any(|args| Purpose::of(args, None).limits_depth);
        let purpose = Purpose { samples: Some(u32::MAX), limits_depth, ..Purpose::default() };
        let of = |args: &RenderArgs| (args.scene.accel, args.bias.regularize);
        for (i, args) in job.iter().enumerate() {
            if let Some(same) = job[..i].iter().position(|a| of(a) == of(args)) {
                which.push(which[same]);
                continue;
            }
            let (prepared, took) = timed(|| prepare::prepare(&args.scene, purpose, self.stage.pool));
            let mut prepared = prepared?;
            if args.bias.regularize {
                self.stage.pool.install(|| prepared.scene.regularize());
            }
            if i == 0 {
                prepared.warnings.iter().for_each(|warning| self.say(format_args!("warning: {warning}")));
            }
            which.push(loaded.len());
            loaded.push(Loaded { prepared, took });
        }
        Ok((loaded, which))
    }

    /// A reference that was given, if it is of the scene's size.
    fn given(&self, given: &FromFile, trial: &Trial<'_>) -> Result<(Reference, ReferenceFacts)> {
        let (picture, crop) = (&given.file.picture, trial.scene.film.crop);
        if (picture.width(), picture.height()) != (crop.width, crop.height) {
            let (path, name) = (given.path.display(), &self.name);
            let (width, height) = (picture.width(), picture.height());
            return Err(Error::Usage(format!(
                "{path} has {width}x{height} pixels, but the picture of {name} has {}x{}",
                crop.width, crop.height
            )));
        }
        let reference = Reference::new(picture.clone(), given.variance.as_ref());
        let from = match &given.variance {
            Some(_) => "by the variance beside it",
            None => "estimated from what pictures of different seeds have in common",
        };
        let facts = ReferenceFacts {
            file: Some(given.path.display().to_string()),
            samples: None,
            own_error: reference.own_error(),
            own_error_from: from,
            least_measurable: least_measurable(&reference),
        };
        Ok((reference, facts))
    }

    /// A reference rendered in two halves, by the first way to render but with all techniques.
    fn rendered(&self, trial: &Trial<'_>) -> std::result::Result<(Reference, ReferenceFacts), Interrupted> {
        let mut settings = trial.settings;
        settings.integrator.estimator = Estimator::Path;
        let seed = settings.sampler.seed;
        let samples = match self.args.reference_spp {
            Some(samples) => samples,
            None => {
                let costs = samples_of(self.stage, trial, self.budget, seed)?;
                let most = costs.into_iter().max().unwrap_or(1);
                most.saturating_mul(REFERENCE_FACTOR).max(LEAST_REFERENCE).checked_next_power_of_two().unwrap_or(most)
            }
        };
        self.say(format_args!("rendering a reference of {samples} samples"));
        let half = |nth: u64| {
            let seed = seed.wrapping_add(REFERENCE_SEEDS).wrapping_add(nth);
            rendered(self.stage, trial.scene, &settings, samples / 2, seed).map(|(picture, _)| picture)
        };
        let reference = Reference::of_halves(&half(0)?, &half(1)?);
        let facts = ReferenceFacts {
            file: None,
            samples: Some(samples / 2 * 2),
            own_error: reference.own_error(),
            own_error_from: "by the difference of its halves",
            least_measurable: least_measurable(&reference),
        };
        Ok((reference, facts))
    }

    fn measure(
        &self,
        trials: &[Trial<'_>],
        reference: &Reference,
        facts: &ReferenceFacts,
    ) -> std::result::Result<Vec<Measured>, Interrupted> {
        let seed = trials[0].settings.sampler.seed;
        let seeds = (0..u64::from(self.args.seeds)).map(|k| seed.wrapping_add(k)).collect();
        let plan = Plan { budget: self.budget.clone(), seeds, split: self.args.split };
        measure(self.stage, trials, reference, &plan, &mut |news| match news {
            News::Row(name, row) => self.tell_row(name, row),
            News::Foreseen(expected, factor) => {
                let own = facts.own_error.unwrap_or(0.0);
                let needed = facts.samples.map_or(String::new(), |n| {
                    format!("; about {} samples would do", rounded_up(f64::from(n) * factor))
                });
                self.say(format_args!(
                    "warning: the reference's own error is {own:.1e}, too much for the largest cost, where about \
                     {expected:.1e} is expected{needed}"
                ));
            }
        })
    }

    fn tell_row(&self, name: &str, row: &Row) {
        let (samples, count) = (row.samples, row.runs.len().max(1) as f64);
        let cpu: f64 = row.runs.iter().map(|r| r.took.cpu).sum::<f64>() / count;
        let state = if row.accepted() { "" } else { ", refused" };
        if row.runs.is_empty() {
            self.say(format_args!("{name}, {samples} samples: not rendered{state}"));
        } else {
            let error = row.mean_error();
            self.say(format_args!("{name}, {samples} samples: relMSE {error:.2e} in {cpu:.2} CPU s{state}"));
        }
    }
}
