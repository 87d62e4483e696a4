//! Renders in passes: after each it is estimated where the error is, and the next pass takes its samples there, until the error is
//! small enough, or time or samples are used up.
//!
//! # Blocks
//!
//! Samples are dealt out to blocks of pixels: of 8×8 where pixels share paths, which is what they share them in, so that sharing goes
//! on as ever, or where a filter mixes them, and else of 4×4. Every block keeps the sums of its own samples, with its border, and each
//! of its pixels has as many as the others. At the end blocks are put together with weights that make up for their numbers, which
//! are powers of two, so that the sums stay exact: under any filter, a pixel near the edge of a block is what it would be if both
//! blocks had the same number.
//!
//! # Replicates, and no bias
//!
//! A block has two independent sequences of samples, X and Y, and the picture is the mean of what the two show, with equal weights
//! whatever their numbers. How many more samples X gets is decided by the error of Y alone, and the other way round: were X's number
//! decided by X's own samples, those that happen to miss a small bright light would seem to need no more, and the picture would be too
//! dark. (An influence remains by the threshold, which is common to all blocks, and by what a block has to do with its
//! neighbours' numbers. Neither could be measured.) The two also tell the error: [`crate::error_estimate`].
//!
//! # Who gets how many
//!
//! To double the n samples of a sequence whose pixels have the variance v per sample, relative to their radiance, takes v/2n from the
//! error for n samples, each of which costs time in proportion to the c vertices of its path. So sequences are doubled in the order
//! of v/cn². Half of v is that of the blocks around, so that what a block has not seen yet, but its neighbours have, counts; and it is
//! not below a small part of the mean. Where rare bright samples make the error, which shows in how much halves of the samples are
//! surprised by each other, nobody knows where they will be next: then all blocks have the more of the mean, and in the end the same;
//! but not where what one sequence says of the error would have helped against what the other says, as at the edge of a lamp.
//!
//! # Whether at all
//!
//! Two sequences are less evenly spread than one of as many samples, and where the error is, may be everywhere, or where time goes.
//! So the first samples are X's alone. What half of their pixels say of the error is tried on the others: if samples by that would
//! not make clearly less error in the same time, X goes on alone, with the same number everywhere, and the picture is that of a render
//! without all this. Not so with a target, for which it takes two to tell when it is reached. (Here X's own samples decide something,
//! once for the whole picture: another influence that could not be measured.)

mod block;
mod kept;
mod plan;

pub use kept::{Earlier, Passes, Unfit, put_together};

use super::{Done, Ended, Progress, Reached, RenderSettings, Rendered, State, empty_film};
use crate::error_estimate::{Estimates, Parts, PictureError};
use crate::film::Film;
use crate::integrator::Work;
use crate::integrator::aov::Aovs;
use crate::scene::Scene;
use block::{Blocks, Even, FEWEST, MOST_LOG_SAMPLES, SEQUENCES, Step, open_growth, stages};
use plan::Unit;
use rayon::ThreadPool;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Samples a pixel before it is decided where more go: enough for halves of halves that tell something. Half of them, one sequence's,
/// decide whether there is another.
const FIRST_SAMPLES: u32 = 16;

/// The fewest samples a pixel: two halves of two sequences.
pub const FEWEST_SAMPLES: u32 = FEWEST * SEQUENCES as u32;

/// What part of all samples may be taken before it is decided where more go.
const FIRST_PART: u32 = 4;

/// There is no second sequence where there are not so many times the first samples of one, or not so many times their time: nothing
/// would be left to take where the error is.
const ROOM_FOR_TWO: u32 = 4;

/// Samples that are taken at a time: some waves of paths.
const BATCH: u64 = 4096;

/// By what part of the samples there are a pass adds to them at most: few enough that what is decided is not old, enough that
/// passes are not all waiting for the last thread.
const GROWTH: f64 = 0.5;

/// What part of the squared error a pass towards a target may leave: were it all, there would be no end.
const MOST_LEFT: f64 = 0.95;

/// Looks between a number of samples and twice that may be wrong as often as so many independent ones: they share most samples, and the
/// error itself falls meanwhile, so that later ones have less to be wrong about.
const LOOKS_A_DOUBLING: f64 = 1.5;

/// What part of the probability to be wrong the looks of the first doubling have: hardly any render needs more of them.
const FIRST_DOUBT: f64 = 0.8;

/// How long between two estimates that are only shown.
const LOOK_INTERVAL: Duration = Duration::from_millis(500);

/// How samples are dealt out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// To one sequence, of which the first are to tell whether it pays to do otherwise.
    Trying,
    /// To two, where the error is.
    Adaptive,
    /// To one, the same number everywhere.
    Even,
}

/// When a render ends: at whichever is reached first.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Samples per pixel, in the mean.
    pub samples: Option<u32>,
    /// Wall time.
    pub time: Option<Duration>,
    /// Relative error, with the confidence below.
    pub error: Option<f64>,
    /// The probability with which the error is to be within its interval, and below the target.
    pub confidence: f64,
}

/// Whoever keeps a render's state from time to time.
pub trait Keeping: Sync {
    /// Whether it is time to.
    fn is_due(&self) -> bool;

    /// Keeps it, while nothing goes on.
    fn keep(&mut self, state: &dyn Fn() -> State);
}

/// A render whose samples go where the error is.
pub struct AdaptiveSession<'a> {
    scene: &'a Scene,
    settings: &'a RenderSettings,
    aovs: &'a Aovs,
    limits: &'a Limits,
    progress: &'a Progress,
    /// Without samples: it knows which pixels there are.
    film: Film,
    blocks: Arc<Blocks>,
    mode: Mode,
    /// What is still to go on in the pass that has begun.
    waiting: Vec<Unit>,
    /// How it goes on where all pixels get the same number.
    even: Option<Even>,
    /// How many samples there were when the estimate first was below the target.
    near: Option<u64>,
    estimates: Estimates,
    done: Mutex<Done>,
    out_of_time: AtomicBool,
    ended: Ended,
    start: Instant,
    /// Wall time of what was done in earlier runs.
    before: Duration,
}

/// Renders on the threads of `pool` until one of the limits is reached.
pub fn render_adaptively(
    scene: &Scene,
    settings: &RenderSettings,
    aovs: &Aovs,
    limits: &Limits,
    (pool, progress): (&ThreadPool, &Progress),
) -> Rendered {
    let mut session = AdaptiveSession::new(scene, settings, aovs, limits, progress);
    session.run(pool, None);
    session.finish()
}

impl<'a> AdaptiveSession<'a> {
    /// A render, not begun.
    pub fn new(
        scene: &'a Scene,
        settings: &'a RenderSettings,
        aovs: &'a Aovs,
        limits: &'a Limits,
        progress: &'a Progress,
    ) -> Self {
        let film = empty_film(scene, settings.clamp, aovs);
        let blocks = Blocks::new(&film, settings.integrator.shares(scene));
        let mode = if limits.error.is_some() { Mode::Adaptive } else { Mode::Trying };
        let waiting = if mode == Mode::Adaptive { blocks.all_units() } else { blocks.units_of(0) };
        Self {
            scene,
            settings,
            aovs,
            limits,
            progress,
            estimates: nothing_known(&film, mode),
            film,
            mode,
            waiting,
            even: None,
            blocks: Arc::new(blocks),
            near: None,
            done: Mutex::default(),
            out_of_time: AtomicBool::new(false),
            ended: Ended::Stopped,
            start: Instant::now(),
            before: Duration::ZERO,
        }
    }

    /// The same render, not begun, where another run of it left these planes; fails where that cannot have been.
    pub fn resume<'p>(mut self, earlier: &Earlier, plane: impl Fn(&str) -> Option<&'p [u32]>) -> Result<Self, Unfit> {
        if earlier.film.area() != self.film.area() || earlier.film.kept() != self.film.kept() {
            return Err(Unfit::Contradiction);
        }
        // Nobody else has them yet.
        let mut waiting = Arc::get_mut(&mut self.blocks).ok_or(Unfit::Contradiction)?.resume(earlier, plane)?;
        self.mode = self.mode_of(&waiting)?;
        if self.mode == Mode::Even {
            // A new pass brings all to the same number, whatever the one that was stopped was to add.
            waiting.clear();
        }
        self.estimates = nothing_known(&self.film, self.mode);
        self.film.add_dropped(&earlier.film.dropped());
        let &Earlier { near, done, time, .. } = earlier;
        self.progress.resume(&done);
        Ok(Self { waiting, near, done: Mutex::new(done), before: time, ..self })
    }

    /// Takes samples on the threads of `pool` until one of the limits is reached, or the progress is cancelled.
    pub fn run(&mut self, pool: &ThreadPool, mut keeping: Option<&mut (dyn Keeping + '_)>) {
        self.progress.started.store(true, Ordering::Relaxed);
        // Whatever an earlier run knew of them, it is as good as new.
        let mut changed: BTreeSet<usize> = (0..self.blocks.all.len()).collect();
        let mut looked = Instant::now();
        self.ended = loop {
            self.pass(pool, &mut changed, keeping.as_deref_mut());
            // Where nothing is decided by it, it is only shown.
            let known = (self.mode != Mode::Even || looked.elapsed() >= LOOK_INTERVAL).then(|| {
                looked = Instant::now();
                self.look(pool, &mut changed)
            });
            if self.progress.is_cancelled() {
                break Ended::Stopped;
            }
            if self.out_of_time.load(Ordering::Relaxed) {
                break Ended::Time;
            }
            if let Some(ended) = self.plan(known) {
                break ended;
            }
        };
        if !changed.is_empty() {
            self.look(pool, &mut changed);
        }
    }

    /// Estimates the error after the blocks `changed` got more samples, and tells whoever looks at the progress.
    fn look(&mut self, pool: &ThreadPool, changed: &mut BTreeSet<usize>) -> PictureError {
        self.estimate(pool, changed);
        changed.clear();
        let known = self.estimates.whole(self.limits.confidence);
        self.progress.set_error(known.error);
        known
    }

    /// Decides what the next pass takes, or that there is none; `known` if anything is to be decided.
    fn plan(&mut self, known: Option<PictureError>) -> Option<Ended> {
        match (self.mode, known) {
            (Mode::Trying, Some(known))
                if self.has_room_for_two() && self.blocks.pays((&self.film, &self.estimates, known.surprise)) =>
            {
                self.mode = Mode::Adaptive;
                self.estimates = nothing_known(&self.film, self.mode);
                self.waiting = self.blocks.units_of(1);
                None
            }
            (Mode::Adaptive, Some(known)) => {
                let left = self.left_to_target(known.error);
                if left.is_some_and(|left| left >= 1.0) {
                    return Some(Ended::Error);
                }
                let left = left.unwrap_or(0.0).min(MOST_LEFT);
                self.waiting = self.blocks.plan((&self.film, &self.estimates, known.surprise), (self.room(), left));
                self.waiting.is_empty().then_some(Ended::Samples)
            }
            _ => {
                self.mode = Mode::Even;
                self.plan_evenly()
            }
        }
    }

    /// The same with one sequence: its samples are doubled or nearly so, such that the last pass is half of all; with a limit of time
    /// a part is added, if there is time for it.
    fn plan_evenly(&mut self) -> Option<Ended> {
        let [fewest, most] = self.blocks.range_of_one();
        let all = self.limits.samples.map(|samples| samples.min(1 << MOST_LOG_SAMPLES));
        let wanted = all.unwrap_or(1 << MOST_LOG_SAMPLES);
        if fewest >= wanted {
            return Some(Ended::Samples);
        }
        let doubled = || stages(wanted).take_while(|&stage| stage > fewest).last().unwrap_or(wanted);
        let end = if self.limits.time.is_some() { fewest + open_growth(fewest) } else { doubled() };
        let end = end.min(wanted).max(most);
        let needed = self.time().as_secs_f64() * f64::from(end) / f64::from(fewest);
        if self.limits.time.is_some_and(|limit| needed > limit.as_secs_f64()) {
            return Some(Ended::Time);
        }
        self.even = Some(Even { end, all });
        self.waiting = self.blocks.units_of(0);
        self.waiting.retain(|unit| self.blocks.all[unit.block].samples(0) < u64::from(end));
        None
    }

    /// Whether anything would be left after the first samples of a second sequence.
    fn has_room_for_two(&self) -> bool {
        let needed = ROOM_FOR_TWO * self.step().first;
        self.limits.samples.is_none_or(|samples| samples >= needed)
            && self.limits.time.is_none_or(|limit| ROOM_FOR_TWO * self.time() <= limit)
    }

    /// How a render stands that goes on with these units.
    fn mode_of(&self, waiting: &[Unit]) -> Result<Mode, Unfit> {
        let samples = |unit: &Unit| self.blocks.all[unit.block].samples(unit.sequence);
        let (first, all) = (u64::from(self.step().first), self.blocks.units_of(0));
        let is_alone = self.blocks.has_one_sequence() && waiting.iter().all(|unit| unit.sequence == 0);
        match is_alone {
            false => Ok(Mode::Adaptive),
            true if self.limits.error.is_some() => Err(Unfit::OneSequence),
            // Whoever waits and has some goes on with what was decided.
            true if waiting.iter().all(|unit| samples(unit) == 0)
                && all.iter().all(|unit| [0, first].contains(&samples(unit))) =>
            {
                Ok(Mode::Trying)
            }
            true => Ok(Mode::Even),
        }
    }

    /// Takes the samples of a pass, until it is cancelled or time is up; adds the blocks that have more than before to `changed`.
    fn pass(&mut self, pool: &ThreadPool, changed: &mut BTreeSet<usize>, mut keeping: Option<&mut (dyn Keeping + '_)>) {
        loop {
            changed.extend(self.take(pool, keeping.as_deref()));
            if self.progress.is_cancelled() || self.out_of_time.load(Ordering::Relaxed) {
                return;
            }
            if let Some(keeping) = keeping.as_deref_mut().filter(|keeping| keeping.is_due()) {
                keeping.keep(&|| self.state());
            }
            if self.waiting.is_empty() {
                return;
            }
        }
    }

    /// How far it is. The state shares the blocks, and is right as long as nothing goes on.
    pub fn state(&self) -> State {
        let blocks = Arc::clone(&self.blocks);
        let passes = Passes { near: self.near, blocks, waiting: self.waiting.clone() };
        State {
            film: self.blocks.put_together(self.film.copied()),
            reached: Reached::Passes(passes),
            done: self.done(),
            time: self.time(),
        }
    }

    /// Wall time so far, with that of earlier runs.
    fn time(&self) -> Duration {
        self.before + self.start.elapsed()
    }

    /// How sequences go on: first by a power of two of samples, before anything is decided.
    fn step(&self) -> Step {
        let all =
            self.limits.samples.map_or(FIRST_SAMPLES, |most| most / FIRST_PART).clamp(FEWEST_SAMPLES, FIRST_SAMPLES);
        Step { first: 1 << (all / SEQUENCES as u32).ilog2(), even: self.even }
    }

    /// How many samples, over all pixels, the next pass should take at most, and how many there may be at all.
    fn room(&self) -> [u64; 2] {
        let taken = self.done().samples;
        let most = self.limits.samples.map_or(u64::MAX, |samples| u64::from(samples) * self.blocks.pixels());
        let left = most.saturating_sub(taken);
        [left.min((taken as f64 * GROWTH) as u64), left]
    }

    /// What part of the squared error, which is the square of `error`, may be left: 1 or more where it is below the target with the confidence asked for, however
    /// often it was looked at since the estimate first was below the target; before, no look can end anything. The looks of the
    /// first doubling of the samples since then may be wrong with the part [`FIRST_DOUBT`] of the probability there is for it, those of
    /// the k-th one after it with the part 6/π²k² of the rest.
    fn left_to_target(&mut self, error: f64) -> Option<f64> {
        let target = self.limits.error?;
        let estimates = &self.estimates;
        if error > target && self.near.is_none() {
            let left = target / error;
            return Some(left * left);
        }
        let taken = self.done().samples;
        let since = *self.near.get_or_insert(taken);
        let later = libm::log2(taken as f64 / since as f64).ceil() - 1.0;
        let part = if later < 1.0 { FIRST_DOUBT } else { (1.0 - FIRST_DOUBT) * 6.0 / (PI * later * (PI * later)) };
        let doubt = (1.0 - self.limits.confidence) * part / LOOKS_A_DOUBLING;
        // Only the upper end counts.
        let high = estimates.whole(1.0 - 2.0 * doubt).interval.high;
        Some(if high > 0.0 { (target / high) * (target / high) } else { 1.0 })
    }

    /// Takes samples of the units that wait, until they are all done, it is cancelled, time is up, or the state is to be kept, but of
    /// some in any case; returns the blocks that have more than before.
    fn take(&mut self, pool: &ThreadPool, keeping: Option<&dyn Keeping>) -> BTreeSet<usize> {
        let (own, step) = (&*self, self.step());
        let (left, changed) = (Mutex::new(own.waiting.as_slice()), Mutex::new(BTreeSet::new()));
        pool.broadcast(|_| {
            while !own.progress.is_cancelled() {
                // A statement of its own: in the condition the lock would be held while samples are taken.
                let batch = own.next_batch(&mut lock(&left), step);
                if batch.is_empty() {
                    break;
                }
                let take = |work: &mut [Work<'_>]| super::take_samples(own.scene, own.settings, own.aovs, work);
                let done = own.blocks.batch(batch).go_on(step, take);
                *lock(&own.done) += done;
                own.progress.count(&done);
                lock(&changed).extend(batch.iter().map(|unit| unit.block));
                if keeping.is_some_and(Keeping::is_due) {
                    break;
                }
            }
        });
        let left = lock(&left).to_vec();
        self.waiting = left;
        changed.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes as many of the units that are left as make a batch; none where there is no time for them.
    fn next_batch<'u>(&self, left: &mut &'u [Unit], step: Step) -> &'u [Unit] {
        let (mut samples, mut count) = (0, 0);
        while samples < BATCH
            && let Some(&unit) = left.get(count)
        {
            (samples, count) = (samples + self.blocks.cost(unit, step), count + 1);
        }
        let (batch, rest) = left.split_at(count);
        if !self.has_time_for(batch, step) {
            return &[];
        }
        *left = rest;
        batch
    }

    /// Whether a batch may begin: the first samples always, later ones if they may be done in time.
    fn has_time_for(&self, batch: &[Unit], step: Step) -> bool {
        let taken = self.done().samples;
        let is_first = |unit: &Unit| self.blocks.all[unit.block].samples(unit.sequence) == 0;
        // Even passes are begun only where there is time, and then ended.
        let has_limit = self.mode != Mode::Even && !batch.is_empty() && !batch.iter().any(is_first);
        let Some(limit) = self.limits.time.filter(|_| has_limit) else { return true };
        let more: u64 = batch.iter().map(|&unit| self.blocks.cost(unit, step)).sum();
        let threads = rayon::current_num_threads() as f64;
        let needed = self.time().as_secs_f64() * (1.0 + threads * more as f64 / taken.max(1) as f64);
        let has = needed <= limit.as_secs_f64();
        if !has {
            self.out_of_time.store(true, Ordering::Relaxed);
        }
        has
    }

    /// Brings the estimates of all pixels up to date that samples of the blocks `changed` reach.
    fn estimate(&mut self, pool: &ThreadPool, changed: &BTreeSet<usize>) {
        let reached: BTreeSet<usize> =
            changed.iter().flat_map(|&block| self.blocks.reaching(&self.film, block)).collect();
        let reached: Vec<usize> = reached.into_iter().collect();
        let whole = self.film.area();
        let parts = parts(self.mode);
        let of_block = |&block: &usize| (block, self.blocks.pixel_estimates(&self.film, block, parts));
        let new: Vec<_> = pool.install(|| reached.par_iter().map(of_block).collect());
        for (block, pixels) in new {
            let area = self.blocks.all[block].bounds.intersection(whole);
            for (i, pixel) in pixels.into_iter().enumerate() {
                let (x, y) = (i % area.width as usize, i / area.width as usize);
                self.estimates.set((area.x - whole.x) as usize + x, (area.y - whole.y) as usize + y, pixel);
            }
        }
    }

    fn done(&self) -> Done {
        *lock(&self.done)
    }

    /// What came of it.
    pub fn finish(self) -> Rendered {
        let (Done { samples, rays }, time, ended) = (self.done(), self.time(), self.ended);
        let film = self.blocks.put_together(self.film);
        let dropped = film.dropped();
        let is_adaptive = self.mode == Mode::Adaptive;
        let sequences = if is_adaptive { SEQUENCES } else { 1 };
        let has_all = self.blocks.all.iter().all(|block| (0..sequences).all(|s| block.samples(s) > 0));
        let estimates = has_all.then_some(self.estimates);
        Rendered { film, samples, rays, dropped, time, ended, is_adaptive, estimates }
    }
}

fn parts(mode: Mode) -> Parts {
    match mode {
        Mode::Trying | Mode::Even => Parts::Halves,
        Mode::Adaptive => Parts::Replicates,
    }
}

/// Estimates of a film's pixels before any is made.
fn nothing_known(film: &Film, mode: Mode) -> Estimates {
    let area = film.area();
    Estimates::new(area.width, area.height, parts(mode))
}

/// A thread that panicked left nothing half done behind this.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
