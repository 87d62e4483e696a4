//! Decides which blocks get more samples.

use super::block::{Block, Blocks, MOST_LOG_SAMPLES, SEQUENCES};
use crate::error_estimate::Estimates;
use crate::film::Film;
use crate::image::Area;
use std::ops::RangeInclusive;

/// One sequence of one block, which is to go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Unit {
    pub(super) block: usize,
    pub(super) sequence: usize,
}

impl Unit {
    /// Its position among all units.
    pub(super) fn number(self) -> usize {
        self.block * SEQUENCES + self.sequence
    }
}

/// No block counts as having less than this part of the mean variance, and so none has less than its root, a sixteenth, of the mean
/// number of samples: where nothing has been seen yet, something may still come.
const LEAST_VARIANCE: f64 = 1.0 / 256.0;

/// At this surprise ([`crate::error_estimate::PictureError`]) of halves of the samples by each other, what has not been seen counts
/// as much as all that has; with its square more or less. Measured at 16 and 64 samples: up to 40 and 5 where samples are better where
/// the error seems to be, veach-ajar among these, 145 and 22 in Sponza, where they are first no better and then are, and 460 and 44 in
/// the classroom, where they are worse.
const EVEN_SURPRISE: f64 = 60.0;

/// If samples in proportion to what one sequence says of the error make what the other says of it so many times less, places with
/// errors are known, though they surprise: edges of what shines are where they are. Measured after 16 samples and more: 1.4 to 1.6 in the
/// Cornell box and the plates after Veach, no more than 1.16 in the classroom, Sponza and veach-ajar.
const KNOWN_GAIN: f64 = 1.25;

/// How many times less squared error in the same time samples where the error is must promise after the first ones to be taken: two
/// sequences are less evenly spread than one, numbers are powers of two, and the first samples are the same for all. What promises of
/// 15 scenes came to: docs/error.md.
const LEAST_PROMISE: f64 = 1.1;

/// The same where pixels are so smooth that evenly spread points serve them well, or so much is made by rare bright samples that
/// nobody knows where the next will be: there promises of up to 1.23 were not kept.
const LEAST_UNCLEAR_PROMISE: f64 = 1.25;

/// The same of fewer first samples than [`ENOUGH_SAMPLES`], whatever surprises: of two and four, promises of 1.29 came to 0.96 in the plates
/// after Veach, of 1.31 and more to 1.04 and more everywhere.
const LEAST_EARLY_PROMISE: f64 = 1.3;

/// With so many first samples their surprise tells something.
const ENOUGH_SAMPLES: u32 = 8;

/// The surprise of the first samples' halves ([`crate::error_estimate::PictureError`]) between the two. Measured: 1.6 to 4 in balls of
/// plain materials, 7 to 130 in rooms and stages, 690 to 3000 in Sponza.
const CLEAR_SURPRISE: RangeInclusive<f64> = 5.0..=400.0;

/// The part of a block's own variance in what decides; the rest is that of the blocks around it.
const OWN: f64 = 0.5;

impl Blocks {
    /// The units that take most from the error for what they cost: as many as fit among `room` samples, or one, if that is no more
    /// than `all`; and no more than it takes to leave the part `left` of the squared error. The largest first, so that threads end
    /// together. The `surprise` is that of the whole picture.
    pub(super) fn plan(
        &self,
        (film, estimates, surprise): (&Film, &Estimates, f64),
        ([room, all], left): ([u64; 2], f64),
    ) -> Vec<Unit> {
        let told = [0, 1].map(|sequence| self.variances(film, estimates, sequence));
        let mut variances = [0, 1].map(|sequence| self.smoothed(&told[sequence], &told[sequence]));
        let gain = |sequence: usize| self.gain(&variances[sequence], &told[1 - sequence], |_| 1.0);
        if gain(0).min(gain(1)) < KNOWN_GAIN {
            variances.iter_mut().for_each(|variances| add_unseen(variances, surprise));
        }
        let mut units: Vec<(f64, f64, Unit)> = Vec::with_capacity(self.all.len() * SEQUENCES);
        let mut error = 0.0;
        for unit in self.all_units() {
            let samples = self.all[unit.block].samples(unit.sequence);
            if samples >= 1 << MOST_LOG_SAMPLES {
                continue;
            }
            // What the other sequence says.
            let other = 1 - unit.sequence;
            let (variance, cost) = (variances[other][unit.block], self.all[unit.block].cost_of_sample(other));
            let gain = variance / (samples * samples) as f64;
            error += self.all[unit.block].bounds.pixels() as f64 * variance / samples as f64;
            units.push((gain / cost, gain, unit));
        }
        units.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.2.cmp(&b.2)));
        let (mut room, enough) = (room, error * (1.0 - left));
        let (mut taken, mut plan): (f64, Vec<(u64, Unit)>) = (0.0, Vec::new());
        for (_, gain, unit) in units {
            let block = &self.all[unit.block];
            let cost = block.samples(unit.sequence) * block.bounds.pixels();
            if cost <= room || plan.is_empty() && cost <= all {
                room = room.saturating_sub(cost);
                plan.push((cost, unit));
                // Half of this sequence's part.
                taken += gain * cost as f64 / 2.0;
            }
            if !plan.is_empty() && (room < self.pixels_of_smallest() || taken >= enough) {
                break;
            }
        }
        plan.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
        plan.into_iter().map(|(_, unit)| unit).collect()
    }

    fn pixels_of_smallest(&self) -> u64 {
        self.all.iter().map(|block| block.bounds.pixels()).min().unwrap_or(0)
    }

    /// Each block's mean variance per sample, relative to radiance, as one sequence's halves say; `None` where a block has no pixel
    /// of the picture.
    fn variances(&self, film: &Film, estimates: &Estimates, sequence: usize) -> Vec<Option<f64>> {
        let (whole, darkness) = (film.area(), estimates.darkness());
        let of = |block: &Block| {
            let area = block.bounds.intersection(whole);
            let mean = estimates.of_replicate(in_picture(area, whole), sequence, darkness);
            (area.pixels() > 0).then_some(mean * block.samples(sequence) as f64)
        };
        self.all.iter().map(of).collect()
    }

    /// How many times less squared error there would be in the same time, as the variances `told` say, if samples were dealt out by
    /// others and by what they cost.
    fn gain(&self, variances: &[f64], told: &[Option<f64>], cost: impl Fn(&Block) -> f64) -> f64 {
        let (mut even, mut uneven) = ([0.0; 2], [0.0; 2]);
        for ((block, variance), told) in self.all.iter().zip(variances).zip(told) {
            let Some(told) = told else { continue };
            let (pixels, cost) = (block.bounds.pixels() as f64, cost(block));
            let samples = (variance / cost).sqrt();
            even = [even[0] + pixels * cost, even[1] + pixels * told];
            if samples > 0.0 {
                uneven = [uneven[0] + pixels * cost * samples, uneven[1] + pixels * told / samples];
            }
        }
        let product = uneven[0] * uneven[1];
        if product > 0.0 { even[0] * even[1] / product } else { 1.0 }
    }

    /// The same of samples of the first sequence alone: what half of the pixels say of the error, as on a chessboard, is tried on
    /// the others.
    fn promise(&self, film: &Film, estimates: &Estimates) -> f64 {
        let (whole, darkness) = (film.area(), estimates.darkness());
        let of = |colour: usize| -> Vec<Option<f64>> {
            let of = |block: &Block| {
                let area = block.bounds.intersection(whole);
                if area.pixels() > 0 { estimates.of_colour(in_picture(area, whole), colour, darkness) } else { None }
            };
            self.all.iter().map(of).collect()
        };
        let told = [of(0), of(1)];
        let mean = |(a, b): (&Option<f64>, &Option<f64>)| a.zip(*b).map(|(a, b)| f64::midpoint(a, b)).or(*a).or(*b);
        let all: Vec<Option<f64>> = told[0].iter().zip(&told[1]).map(mean).collect();
        let tried = |one: usize| {
            let variances = self.smoothed(&told[one], &all);
            self.gain(&variances, &told[1 - one], |block| block.cost_of_sample(0))
        };
        f64::midpoint(tried(0), tried(1))
    }

    /// Whether samples where the error is are going to pay, as those of the first sequence say, whose halves' `surprise` is given.
    pub(super) fn pays(&self, (film, estimates, surprise): (&Film, &Estimates, f64)) -> bool {
        let needed = match CLEAR_SURPRISE.contains(&surprise) {
            _ if self.range_of_one()[0] < ENOUGH_SAMPLES => LEAST_EARLY_PROMISE,
            true => LEAST_PROMISE,
            false => LEAST_UNCLEAR_PROMISE,
        };
        self.promise(film, estimates) >= needed
    }

    /// Each block's own variance with what is `around` it, and not below a part of the mean.
    fn smoothed(&self, own: &[Option<f64>], around: &[Option<f64>]) -> Vec<f64> {
        let smooth = |block: usize| {
            let others = self.around(block).filter(|&other| other != block).filter_map(|other| around[other]);
            let (sum, count) = others.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
            let around = if count > 0.0 { Some(sum / count) } else { None };
            match (own[block], around) {
                (Some(own), Some(around)) => OWN * own + (1.0 - OWN) * around,
                (own, around) => own.or(around).unwrap_or(0.0),
            }
        };
        let smoothed: Vec<f64> = (0..own.len()).map(smooth).collect();
        let least = LEAST_VARIANCE * mean(&smoothed);
        smoothed.into_iter().map(|variance| variance.max(least)).collect()
    }
}

/// An area of the whole film in the picture's own rows and columns.
fn in_picture(area: Area, whole: Area) -> Area {
    Area { x: area.x - whole.x, y: area.y - whole.y, ..area }
}

/// Adds what nobody has seen, which may be anywhere, as a part of the mean: see [`EVEN_SURPRISE`].
fn add_unseen(variances: &mut [f64], surprise: f64) {
    let unseen = (surprise / EVEN_SURPRISE) * (surprise / EVEN_SURPRISE) * mean(variances);
    variances.iter_mut().for_each(|variance| *variance += unseen);
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
