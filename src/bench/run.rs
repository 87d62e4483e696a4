//! Renders every configuration at growing cost with several seeds, in turn, and measures.

use super::clock::{Took, timed};
use super::estimate::{Errors, LEAST_RATIO, Reference, Verdict};
use super::split::{Split, split};
use crate::image::Picture;
use crate::integrator::{Integrator, PathReuse};
use crate::render::{Progress, RenderSettings, render};
use crate::sampler::{MOST_LOG_SAMPLES, SamplerKind};
use crate::scene::Scene;
use rayon::ThreadPool;

/// Somebody asked to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interrupted;

/// What renders need.
pub struct Stage<'a> {
    /// The threads.
    pub pool: &'a ThreadPool,
    /// Who may stop it all; counts the samples of all renders.
    pub progress: &'a Progress,
}

/// A way to render a scene.
pub struct Trial<'a> {
    /// What it is called.
    pub name: String,
    /// The scene.
    pub scene: &'a Scene,
    /// How; the number of samples and the seed are those of the plan.
    pub settings: RenderSettings,
}

/// What a render may cost.
#[derive(Clone, Debug, PartialEq)]
pub enum Budget {
    /// Samples per pixel, growing.
    Samples(Vec<u32>),
    /// Seconds of processor time, growing; as many samples as fit, by the time that a short render takes.
    Seconds(Vec<f64>),
}

impl Budget {
    /// How many costs there are.
    pub fn steps(&self) -> usize {
        match self {
            Self::Samples(steps) => steps.len(),
            Self::Seconds(steps) => steps.len(),
        }
    }
}

/// What to do.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Costs.
    pub budget: Budget,
    /// Seeds, at least one; pictures of different seeds are independent.
    pub seeds: Vec<u64>,
    /// Whether to take the error of the largest cost apart.
    pub split: bool,
}

/// A render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Its seed.
    pub seed: u64,
    /// What it took, without loading and building.
    pub took: Took,
    /// Its error, the reference's own subtracted if it is known.
    pub relmse: f64,
}

/// Renders of one cost.
pub struct Row {
    /// Samples per pixel.
    pub samples: u32,
    /// One for each seed; none where the row before was refused already.
    pub runs: Vec<Run>,
    /// Whether the reference can measure them; `None` where there are none.
    pub verdict: Option<Verdict>,
}

impl Row {
    /// The mean of the errors.
    pub fn mean_error(&self) -> f64 {
        self.runs.iter().map(|r| r.relmse).sum::<f64>() / self.runs.len().max(1) as f64
    }

    /// Whether they count.
    pub fn accepted(&self) -> bool {
        self.verdict.is_some_and(Verdict::accepts)
    }
}

/// What came of a trial.
#[derive(Default)]
pub struct Measured {
    /// From the cheapest to the dearest.
    pub rows: Vec<Row>,
    /// The picture of the first seed and the map of errors over all, at the largest cost that was rendered.
    pub shown: Option<(Picture, Vec<f32>)>,
    /// Its error taken apart.
    pub split: Option<Split>,
}

/// Something to tell while it goes on.
pub enum News<'a> {
    /// A row is done.
    Row(&'a str, &'a Row),
    /// The reference is going to be too noisy for the largest cost, where about this error is expected; so many times more
    /// samples would do.
    Foreseen(f64, f64),
}

/// Shortest processor time, in seconds, of the render that others are planned by: far above what clocks resolve and what
/// threads need to start.
const CALIBRATION: f64 = 0.2;

/// Renders with `samples` per pixel, and says what it took. A sampler that cannot have that many, which only a reference asks
/// of it, is replaced by Sobol' points.
pub fn rendered(
    stage: &Stage<'_>,
    scene: &Scene,
    settings: &RenderSettings,
    samples: u32,
    seed: u64,
) -> Result<(Picture, Took), Interrupted> {
    let mut settings = *settings;
    settings.samples = samples;
    settings.sampler.seed = seed;
    settings.sampler.kind = settings.sampler.kind.for_samples(samples).unwrap_or(SamplerKind::Sobol);
    let (result, took) = timed(|| {
        let rendered = render(scene, &settings, stage.pool, stage.progress);
        rendered.is_complete().then(|| rendered.film.develop())
    });
    result.map(|picture| (picture, took)).ok_or(Interrupted)
}

/// Samples per pixel of each cost for a trial.
pub fn samples_of(stage: &Stage<'_>, trial: &Trial<'_>, budget: &Budget, seed: u64) -> Result<Vec<u32>, Interrupted> {
    let seconds = match budget {
        Budget::Samples(samples) => return Ok(samples.clone()),
        Budget::Seconds(seconds) => seconds,
    };
    let enough = CALIBRATION.min(seconds.first().copied().unwrap_or(0.0));
    let mut samples = 1;
    let each = loop {
        let (_, took) = rendered(stage, trial.scene, &trial.settings, samples, seed)?;
        if took.cpu >= enough || samples > u32::MAX / 2 {
            break took.cpu / f64::from(samples);
        }
        samples *= 2;
    };
    let kind = trial.settings.sampler.kind;
    let fitting = |seconds: &f64| {
        // Saturates.
        let most = ((seconds / each) as u32).max(1);
        if kind.for_samples(most).is_some() { most } else { (1 << most.ilog2()).min(1 << MOST_LOG_SAMPLES) }
    };
    Ok(seconds.iter().map(fitting).collect())
}

/// Measures all trials of a scene. Trials take turns, so that what slows the machine down for a while slows all of them.
pub fn measure(
    stage: &Stage<'_>,
    trials: &[Trial<'_>],
    reference: &Reference,
    plan: &Plan,
    tell: &mut dyn FnMut(News<'_>),
) -> Result<Vec<Measured>, Interrupted> {
    let first = plan.seeds.first().copied().unwrap_or(0);
    let costs: Vec<Vec<u32>> =
        trials.iter().map(|t| samples_of(stage, t, &plan.budget, first)).collect::<Result<_, _>>()?;
    let mut all: Vec<Measured> = trials.iter().map(|_| Measured::default()).collect();
    for step in 0..plan.budget.steps() {
        let samples: Vec<u32> = costs.iter().map(|c| c[step]).collect();
        measure_step(stage, trials, (reference, plan), &samples, &mut all)?;
        for (trial, measured) in trials.iter().zip(&all) {
            tell(News::Row(&trial.name, &measured.rows[step]));
        }
        if step == 0
            && let Some(news) = foresee(&all, &costs, reference)
        {
            tell(news);
        }
    }
    if plan.split {
        for (trial, measured) in trials.iter().zip(&mut all) {
            let Some(samples) = measured.rows.iter().rev().find(|r| !r.runs.is_empty()).map(|r| r.samples) else {
                continue;
            };
            // What paths that share owe to neighbours is not told.
            let integrator = Integrator { reuse: PathReuse::Off, ..trial.settings.integrator };
            let settings = RenderSettings { samples, integrator, ..trial.settings };
            measured.split = Some(split(stage, trial.scene, &settings, &plan.seeds, reference)?);
        }
    }
    Ok(all)
}

/// One cost of every trial, unless its last was refused: the errors to come are smaller still.
fn measure_step(
    stage: &Stage<'_>,
    trials: &[Trial<'_>],
    (reference, plan): (&Reference, &Plan),
    samples: &[u32],
    all: &mut [Measured],
) -> Result<(), Interrupted> {
    let mut errors = vec![Errors::default(); trials.len()];
    let goes_on: Vec<bool> = all.iter().map(|m| m.rows.last().is_none_or(Row::accepted)).collect();
    for (m, &samples) in all.iter_mut().zip(samples) {
        m.rows.push(Row { samples, runs: Vec::new(), verdict: None });
    }
    for (nth, &seed) in plan.seeds.iter().enumerate() {
        for (i, trial) in trials.iter().enumerate().filter(|(i, _)| goes_on[*i]) {
            let (picture, took) = rendered(stage, trial.scene, &trial.settings, samples[i], seed)?;
            errors[i].add(&picture, reference);
            let relmse = reference.error_of(&picture);
            if let Some(row) = all[i].rows.last_mut() {
                row.runs.push(Run { seed, took, relmse });
            }
            if nth == 0 {
                all[i].shown = Some((picture, Vec::new()));
            }
        }
    }
    for (m, errors) in all.iter_mut().zip(&errors) {
        let Some(row) = m.rows.last_mut().filter(|row| !row.runs.is_empty()) else { continue };
        row.verdict = Verdict::of(row.mean_error(), reference, errors);
        if let Some((_, map)) = &mut m.shown {
            *map = errors.map();
        }
    }
    Ok(())
}

/// Whether the reference's error will be more than a tenth of what is to be measured at the largest cost, if errors fall no
/// faster than those of independent samples.
fn foresee(all: &[Measured], costs: &[Vec<u32>], reference: &Reference) -> Option<News<'static>> {
    let own = reference.own_error()?;
    let expected = all.iter().zip(costs).filter_map(|(m, costs)| {
        let row = m.rows.first().filter(|row| row.accepted())?;
        Some(row.mean_error() * f64::from(row.samples) / f64::from(*costs.last()?))
    });
    let least = expected.min_by(f64::total_cmp)?;
    (least > 0.0 && own * LEAST_RATIO > least).then(|| News::Foreseen(least, own * LEAST_RATIO / least))
}
