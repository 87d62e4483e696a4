//! What was measured, as a bench writes it: every number is finite or left out as null.

use super::clock::Took;
use super::estimate::{LEAST_RATIO, Reference, Verdict};
use super::fit::{Spread, geometric_mean, slope};
use super::run::{Budget, Measured, Row};
use super::split::Split;
use crate::image::Picture;
use serde::Serialize;

/// Everything.
#[derive(Debug, Serialize)]
pub struct Report {
    /// What measured.
    pub version: &'static str,
    /// When it began.
    pub date: String,
    /// The words that asked for it, as a shell takes them.
    pub command: String,
    /// Where.
    pub machine: Machine,
    /// How.
    pub settings: Settings,
    /// Of what.
    pub scenes: Vec<Scene>,
    /// Of each configuration, how many times it is as efficient as the first: the geometric mean over all scenes, if all
    /// have it.
    pub efficiency_ratios: Vec<Option<f64>>,
    /// Rows that were refused, or not rendered because the one before was.
    pub refused: usize,
}

/// What it was measured on.
#[derive(Debug, Serialize)]
pub struct Machine {
    /// The processor's name, where the system tells.
    pub processor: Option<String>,
    /// What the system lets run at a time.
    pub cores: usize,
    /// What was used.
    pub threads: usize,
    /// Operating system and instruction set.
    pub system: String,
}

/// What was asked for.
#[derive(Debug, Serialize)]
pub struct Settings {
    /// `samples` or `cpu_seconds`.
    pub budget: &'static str,
    /// How many of these.
    pub costs: Vec<f64>,
    /// How often each was rendered.
    pub seeds: usize,
    /// What was varied, with its values, as on the command line.
    pub varied: Vec<String>,
    /// What relmse is.
    pub relmse: &'static str,
    /// What efficiency is.
    pub efficiency: &'static str,
}

impl Settings {
    /// For this budget.
    pub fn new(budget: &Budget, seeds: usize, varied: Vec<String>) -> Self {
        let (name, costs) = match budget {
            Budget::Samples(n) => ("samples", n.iter().copied().map(f64::from).collect()),
            Budget::Seconds(s) => ("cpu_seconds", s.clone()),
        };
        let relmse = "mean((x - r)^2 / (r^2 + 0.01)), less the reference's own error if that is known";
        let efficiency = "1 / (CPU seconds of rendering * relmse)";
        Self { budget: name, costs, seeds, varied, relmse, efficiency }
    }
}

/// A scene.
#[derive(Debug, Serialize)]
pub struct Scene {
    /// What it is called.
    pub name: String,
    /// Its file.
    pub file: String,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// What it was measured against.
    pub reference: ReferenceFacts,
    /// The ways it was rendered; the first is what the others are compared with.
    pub configurations: Vec<Configuration>,
    /// The reference, for those who show it.
    #[serde(skip)]
    pub picture: Option<Picture>,
}

/// What is known of a reference.
#[derive(Clone, Debug, Serialize)]
pub struct ReferenceFacts {
    /// Its file, if it has one.
    pub file: Option<String>,
    /// Samples per pixel, if it was rendered for this.
    pub samples: Option<u32>,
    /// Its own relmse.
    pub own_error: Option<f64>,
    /// How that is known.
    pub own_error_from: &'static str,
    /// The smallest error that it can measure.
    pub least_measurable: Option<f64>,
}

/// A way to render a scene.
#[derive(Debug, Serialize)]
pub struct Configuration {
    /// Its name: what it has of what is varied.
    pub name: String,
    /// Who finds what rays meet.
    pub accelerator: String,
    /// Where random numbers come from.
    pub sampler: String,
    /// How light is estimated.
    pub integrator: String,
    /// CPU seconds of loading the scene and building the accelerator, once.
    pub load_cpu_seconds: f64,
    /// Seconds of the same.
    pub load_wall_seconds: f64,
    /// By growing cost.
    pub rows: Vec<Figures>,
    /// The fitted exponent of relmse as a power of the samples.
    pub slope_samples: Option<f64>,
    /// The same of the CPU seconds.
    pub slope_seconds: Option<f64>,
    /// What is taken for the whole: the efficiency at the largest cost that counts.
    pub efficiency: Option<Spread>,
    /// How many times it is as efficient as the first configuration, at the largest cost that counts for both.
    pub efficiency_ratio: Option<Spread>,
    /// Its error taken apart.
    pub split: Option<Split>,
    /// Picture and map of errors, for those who show them.
    #[serde(skip)]
    pub shown: Option<(Picture, Vec<f32>)>,
}

/// One cost.
#[derive(Clone, Debug, Serialize)]
pub struct Figures {
    /// Samples per pixel.
    pub samples: u32,
    /// Whether it counts.
    pub accepted: bool,
    /// Why not.
    pub refusal: Option<String>,
    /// One for each seed; none if it was not rendered.
    pub runs: Vec<RunFigures>,
    /// Errors over seeds.
    pub relmse: Option<Spread>,
    /// CPU seconds of rendering, over seeds.
    pub cpu_seconds: Option<Spread>,
    /// 1/(CPU seconds × relmse), over seeds.
    pub efficiency: Option<Spread>,
    /// 1/(CPU seconds of rendering and loading × relmse): that of a whole process.
    pub whole_efficiency: Option<Spread>,
    /// Efficiency over that of the first configuration, of each seed.
    pub efficiency_ratio: Option<Spread>,
    /// CPU seconds of the first configuration over these.
    pub speed_ratio: Option<Spread>,
}

/// One render.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct RunFigures {
    /// Its seed.
    pub seed: u64,
    /// CPU seconds of rendering.
    pub cpu_seconds: f64,
    /// Seconds that passed.
    pub wall_seconds: f64,
    /// Its error.
    pub relmse: f64,
}

/// What a configuration is called, and what it took to load.
pub struct Label {
    /// See [`Configuration::name`].
    pub name: String,
    /// See [`Configuration::accelerator`].
    pub accelerator: String,
    /// See [`Configuration::sampler`].
    pub sampler: String,
    /// See [`Configuration::integrator`].
    pub integrator: String,
    /// Loading and building.
    pub load: Took,
}

/// Puts the configurations of a scene together, with their ratios to the first.
pub fn configurations(labels: Vec<Label>, measured: Vec<Measured>, reference: &ReferenceFacts) -> Vec<Configuration> {
    let mut all: Vec<Configuration> =
        labels.into_iter().zip(measured).map(|(label, m)| configuration(label, m, reference)).collect();
    let first: Vec<Figures> = all.first().map(|c| c.rows.clone()).unwrap_or_default();
    for configuration in &mut all {
        for (row, base) in configuration.rows.iter_mut().zip(&first) {
            if row.accepted && base.accepted {
                let pairs = || base.runs.iter().zip(&row.runs);
                row.efficiency_ratio =
                    positive(pairs().map(|(b, r)| b.cpu_seconds * b.relmse / (r.cpu_seconds * r.relmse)));
                row.speed_ratio = positive(pairs().map(|(b, r)| b.cpu_seconds / r.cpu_seconds));
            }
        }
        configuration.efficiency_ratio = configuration.rows.iter().rev().find_map(|row| row.efficiency_ratio);
    }
    all
}

/// The spread of positive values; `None` if one is not.
fn positive(values: impl Iterator<Item = f64>) -> Option<Spread> {
    Spread::of(values).filter(|s| s.low > 0.0)
}

fn configuration(label: Label, measured: Measured, reference: &ReferenceFacts) -> Configuration {
    let rows: Vec<Figures> = measured.rows.iter().map(|row| figures(row, label.load, reference)).collect();
    let points = |x: &dyn Fn(&Figures, &RunFigures) -> f64| -> Vec<(f64, f64)> {
        let accepted = rows.iter().filter(|row| row.accepted);
        accepted.flat_map(|row| row.runs.iter().map(|run| (x(row, run), run.relmse))).collect()
    };
    let slope_samples = slope(&points(&|row, _| f64::from(row.samples)));
    // Of one cost, the wobble of the clock would be taken for a difference.
    let slope_seconds = slope_samples.and_then(|_| slope(&points(&|_, run| run.cpu_seconds)));
    let efficiency = rows.iter().rev().find_map(|row| row.efficiency);
    Configuration {
        name: label.name,
        accelerator: label.accelerator,
        sampler: label.sampler,
        integrator: label.integrator,
        load_cpu_seconds: label.load.cpu,
        load_wall_seconds: label.load.wall,
        rows,
        slope_samples,
        slope_seconds,
        efficiency,
        efficiency_ratio: None,
        split: measured.split,
        shown: measured.shown,
    }
}

fn figures(row: &Row, load: Took, reference: &ReferenceFacts) -> Figures {
    let run = |r: &super::run::Run| RunFigures {
        seed: r.seed,
        cpu_seconds: r.took.cpu,
        wall_seconds: r.took.wall,
        relmse: r.relmse,
    };
    let runs: Vec<RunFigures> = row.runs.iter().map(run).collect();
    let accepted = row.verdict.is_some_and(Verdict::accepts);
    let efficiency = |more: f64| {
        let counts = runs.iter().filter(|_| accepted);
        positive(counts.map(|r| 1.0 / ((r.cpu_seconds + more) * r.relmse)))
    };
    Figures {
        samples: row.samples,
        accepted,
        refusal: refusal(row, reference),
        relmse: Spread::of(runs.iter().map(|r| r.relmse)),
        cpu_seconds: Spread::of(runs.iter().map(|r| r.cpu_seconds)),
        efficiency: efficiency(0.0),
        whole_efficiency: efficiency(load.cpu),
        efficiency_ratio: None,
        speed_ratio: None,
        runs,
    }
}

/// Why a row does not count.
fn refusal(row: &Row, reference: &ReferenceFacts) -> Option<String> {
    let Some(verdict) = row.verdict else {
        return Some("not rendered: the row before was refused, and errors only get smaller".into());
    };
    let measured = row.mean_error();
    let own = match verdict {
        Verdict::Fine(_) => return None,
        Verdict::Biased(shared) => {
            return Some(format!(
                "the pictures have an error of {shared:.1e} in common, of {measured:.1e} in all: more than the \
                 reference's noise explains, so they show something else"
            ));
        }
        Verdict::TooNoisy(own) => own,
    };
    // Of independent samples, errors fall as their number rises; those of a reference that has no number are measured by
    // pictures that have one.
    let needed = match reference.samples {
        Some(samples) if measured > 0.0 => f64::from(samples) * own * LEAST_RATIO / measured,
        _ => f64::from(row.samples) * LEAST_RATIO,
    };
    Some(format!(
        "the reference's own error is {own:.1e}, more than a tenth of the {measured:.1e} measured; a reference of about \
         {} samples would do",
        rounded_up(needed)
    ))
}

/// The smallest error that a reference can measure, if its own is known.
pub fn least_measurable(reference: &Reference) -> Option<f64> {
    reference.own_error().map(|own| own * LEAST_RATIO)
}

/// The next power of two.
pub fn rounded_up(samples: f64) -> u64 {
    // Saturates, as the power then does at a number that nobody will render.
    (samples.ceil() as u64).clamp(1, 1 << 62).next_power_of_two()
}

/// Each configuration's efficiency over that of the first: the geometric mean over scenes.
pub fn mean_ratios(scenes: &[Scene]) -> Vec<Option<f64>> {
    let count = scenes.first().map_or(0, |s| s.configurations.len());
    let ratios = |i: usize| {
        let medians = scenes.iter().map(|s| s.configurations.get(i)?.efficiency_ratio.map(|r| r.median));
        geometric_mean(&medians.collect::<Option<Vec<f64>>>()?)
    };
    (0..count).map(ratios).collect()
}

/// Rows that do not count.
pub fn refused(scenes: &[Scene]) -> usize {
    let rows = scenes.iter().flat_map(|s| &s.configurations).flat_map(|c| &c.rows);
    rows.filter(|row| !row.accepted).count()
}
