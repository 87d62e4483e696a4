//! Renders in passes: after each it is estimated where the error is, and the next pass takes its samples there, until the error is
//! small enough, or time or samples are used up.
//!
//! # Blocks
//!
//! Samples are dealt out to blocks of 8×8 pixels, which is what pixels share paths in, so that sharing goes on as ever. Every block
//! keeps the sums of its own samples, with its border, and each of its pixels has as many as the others. At the end blocks are put
//! together with weights that make up for their numbers, which are powers of two, so that the sums stay exact: under any filter,
//! a pixel near the edge of a block is what it would be if both blocks had the same number.
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
//! error for n samples. So sequences are doubled in the order of v/n². Half of v is that of the blocks around, so that what a block
//! has not seen yet, but its neighbours have, counts; and it is not below a small part of the mean.

mod block;
mod plan;

use super::{Done, Ended, Progress, RenderSettings, Rendered, empty_film};
use crate::error_estimate::{Estimates, Parts, PictureError};
use crate::film::Film;
use crate::integrator::aov::Aovs;
use crate::scene::Scene;
use block::{Block, Blocks, SEQUENCES};
use plan::Unit;
use rayon::ThreadPool;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Samples a pixel before it is decided anything: enough for halves of halves that tell something.
const FIRST_SAMPLES: u32 = 16;

/// The fewest samples a pixel: two halves of two sequences.
pub const FEWEST_SAMPLES: u32 = 4;

/// By what part of the samples there are a pass adds to them at most: few enough that what is decided is not old, enough that
/// passes are not all waiting for the last thread.
const GROWTH: f64 = 0.25;

/// What part of the squared error a pass towards a target may leave: were it all, there would be no end.
const MOST_LEFT: f64 = 0.95;

/// Looks at an error that is below so many times the target count as looks that may end the render.
const NEAR_TARGET: f64 = 1.5;

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

/// A render whose samples go where the error is.
struct Adaptive<'a> {
    scene: &'a Scene,
    settings: &'a RenderSettings,
    aovs: &'a Aovs,
    limits: &'a Limits,
    progress: &'a Progress,
    /// Without samples: it knows which pixels there are.
    film: Film,
    blocks: Blocks,
    done: Mutex<Done>,
    out_of_time: AtomicBool,
    start: Instant,
}

/// Renders on the threads of `pool` until one of the limits is reached.
pub fn render_adaptively(
    scene: &Scene,
    settings: &RenderSettings,
    aovs: &Aovs,
    limits: &Limits,
    (pool, progress): (&ThreadPool, &Progress),
) -> Rendered {
    let film = empty_film(scene, settings.clamp, aovs);
    let blocks = Blocks::new(&film);
    let (done, out_of_time, start) = (Mutex::default(), AtomicBool::new(false), Instant::now());
    progress.started.store(true, Ordering::Relaxed);
    Adaptive { scene, settings, aovs, limits, progress, film, blocks, done, out_of_time, start }.run(pool)
}

impl Adaptive<'_> {
    fn run(self, pool: &ThreadPool) -> Rendered {
        let area = self.film.area();
        let mut estimates = Estimates::new(area.width, area.height, Parts::Replicates);
        let first = self.limits.samples.map_or(FIRST_SAMPLES, |most| most.clamp(FEWEST_SAMPLES, FIRST_SAMPLES));
        let (mut samples, mut looks) = (FEWEST_SAMPLES, 0);
        let ended = loop {
            let units = if samples <= first {
                samples *= 2;
                self.blocks.all_units()
            } else {
                if self.has_reached_target(&estimates, &mut looks) {
                    break Ended::Error;
                }
                let plan = self.blocks.plan(&self.film, &estimates, self.room_and_left(&estimates));
                if plan.is_empty() {
                    break Ended::Samples;
                }
                plan
            };
            let changed = self.take(pool, &units);
            self.estimate(pool, &changed, &mut estimates);
            self.progress.set_error(estimates.error());
            if self.progress.is_cancelled() {
                break Ended::Stopped;
            }
            if self.out_of_time.load(Ordering::Relaxed) {
                break Ended::Time;
            }
        };
        self.finish(ended, estimates)
    }

    /// How many samples, over all pixels, the next pass may take, and what part of the squared error it may leave.
    fn room_and_left(&self, estimates: &Estimates) -> (u64, f64) {
        let taken = self.done().samples;
        let left = self.limits.error.map_or(0.0, |target| {
            let over = target / estimates.whole(self.limits.confidence).interval.high;
            (over * over).min(MOST_LEFT)
        });
        let room = (taken as f64 * GROWTH) as u64;
        let most = self.limits.samples.map_or(u64::MAX, |samples| u64::from(samples) * self.blocks.pixels());
        (room.min(most.saturating_sub(taken)), left)
    }

    /// Whether the error is below the target with the confidence asked for, however often it is looked at: the k-th look may be wrong
    /// with the probability 6/π²k² of all that may be.
    fn has_reached_target(&self, estimates: &Estimates, looks: &mut u32) -> bool {
        let Some(target) = self.limits.error else { return false };
        if estimates.error() > NEAR_TARGET * target {
            return false;
        }
        *looks += 1;
        let k = PI * f64::from(*looks);
        let doubt = (1.0 - self.limits.confidence) * 6.0 / (k * k);
        // Only the upper end counts.
        estimates.whole(1.0 - 2.0 * doubt).interval.high <= target
    }

    /// Takes the samples of some units; returns the blocks that have more than before.
    fn take(&self, pool: &ThreadPool, units: &[Unit]) -> BTreeSet<usize> {
        let (next, changed) = (AtomicUsize::new(0), Mutex::new(BTreeSet::new()));
        pool.broadcast(|_| {
            while !self.progress.is_cancelled()
                && let Some(&unit) = units.get(next.fetch_add(1, Ordering::Relaxed))
                && self.has_time_for(unit)
            {
                let (block, sequence) = (&self.blocks.all[unit.block], unit.sequence);
                let done = block.double(sequence, |samples, tile| {
                    super::sample_tile(self.scene, self.settings, self.aovs, samples, tile)
                });
                *self.done.lock().unwrap_or_else(PoisonError::into_inner) += done;
                self.progress.count(&done);
                changed.lock().unwrap_or_else(PoisonError::into_inner).insert(unit.block);
            }
        });
        changed.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a unit may begin: the first of all always, later ones if they may be done in time.
    fn has_time_for(&self, unit: Unit) -> bool {
        let block = &self.blocks.all[unit.block];
        let more = block.samples(unit.sequence) * block.bounds.pixels();
        let Some(limit) = self.limits.time.filter(|_| more > 0) else { return true };
        let (elapsed, taken) = (self.start.elapsed(), self.done().samples);
        let threads = rayon::current_num_threads() as f64;
        let needed = elapsed.as_secs_f64() * (1.0 + threads * more as f64 / taken.max(1) as f64);
        let has = needed <= limit.as_secs_f64();
        if !has {
            self.out_of_time.store(true, Ordering::Relaxed);
        }
        has
    }

    /// Brings the estimates of all pixels up to date that samples of the blocks `changed` reach.
    fn estimate(&self, pool: &ThreadPool, changed: &BTreeSet<usize>, estimates: &mut Estimates) {
        let reached: Vec<usize> = if self.film.border() == 0 {
            changed.iter().copied().collect()
        } else {
            let reached: BTreeSet<usize> = changed.iter().flat_map(|&block| self.blocks.around(block)).collect();
            reached.into_iter().collect()
        };
        let whole = self.film.area();
        let of_block = |&block: &usize| (block, self.blocks.pixel_estimates(&self.film, block));
        let new: Vec<_> = pool.install(|| reached.par_iter().map(of_block).collect());
        for (block, pixels) in new {
            let area = self.blocks.all[block].bounds.intersection(whole);
            for (i, pixel) in pixels.into_iter().enumerate() {
                let (x, y) = (i % area.width as usize, i / area.width as usize);
                estimates.set((area.x - whole.x) as usize + x, (area.y - whole.y) as usize + y, pixel);
            }
        }
    }

    fn done(&self) -> Done {
        *self.done.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn finish(self, ended: Ended, estimates: Estimates) -> Rendered {
        let Done { samples, rays } = self.done();
        let film = self.blocks.put_together(self.film);
        let (dropped, time) = (film.dropped(), self.start.elapsed());
        let has_all = self.blocks.all.iter().all(|block| (0..SEQUENCES).all(|s| block.samples(s) > 0));
        Rendered { film, samples, rays, dropped, time, ended, estimates: has_all.then_some(estimates) }
    }
}

/// The picture's error with the confidence of a render's limits.
pub fn error_of(rendered: &Rendered, confidence: f64) -> Option<PictureError> {
    rendered.estimates.as_ref().map(|estimates| estimates.whole(confidence))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_hold_what_their_tiles_do() {
        assert_eq!(FEWEST_SAMPLES, 2 * SEQUENCES as u32);
        let _: fn(&Block) -> u64 = |block| block.samples(0);
    }
}
