//! Blocks of pixels with the sums of their own samples.

use super::plan::Unit;
use crate::error_estimate::PixelEstimate;
use crate::film::{Film, Gathered, PartMean, Tile};
use crate::image::Area;
use crate::integrator::BLOCK_SIZE;
use crate::render::Done;
use crate::sampler::first_of_run;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Independent sequences of samples.
pub(super) const SEQUENCES: usize = 2;

/// Samples of a sequence when it has any: one for each half.
const FIRST: u32 = 2;

/// Sums are added as if every sequence had 2 to the power of this many samples; none has more.
pub(super) const MOST_LOG_SAMPLES: u32 = 29;

/// Some pixels, each of which has the same number of samples.
pub(super) struct Block {
    /// In the whole film's coordinates.
    pub(super) bounds: Area,
    sequences: [Mutex<Sequence>; SEQUENCES],
}

/// The samples of one sequence.
struct Sequence {
    /// A power of two, or none.
    samples: u32,
    /// Those of the earlier and the later half.
    halves: [Tile; 2],
}

impl Block {
    fn sequence(&self, sequence: usize) -> MutexGuard<'_, Sequence> {
        self.sequences[sequence].lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// How many samples each pixel has of a sequence.
    pub(super) fn samples(&self, sequence: usize) -> u64 {
        self.sequence(sequence).samples.into()
    }

    /// Doubles the samples of a sequence, or takes the first ones, with a function that takes these of all pixels of a tile.
    pub(super) fn double(&self, sequence: usize, take: impl Fn(Range<u32>, &mut Tile) -> Done) -> Done {
        let first = first_of_run(sequence as u32);
        let mut own = self.sequence(sequence);
        let Sequence { samples, halves: [earlier, later] } = &mut *own;
        if *samples == 0 {
            let middle = first + FIRST / 2;
            let mut done = take(first..middle, earlier);
            done += take(middle..first + FIRST, later);
            *samples = FIRST;
            return done;
        }
        earlier.absorb(later);
        let done = take(first + *samples..first + 2 * *samples, later);
        *samples *= 2;
        done
    }
}

/// All blocks of a film, row by row.
pub(super) struct Blocks {
    pub(super) all: Vec<Block>,
    across: usize,
}

impl Blocks {
    /// Those of a film, without samples; they are aligned in the whole film, as the pixels are that share paths.
    pub(super) fn new(film: &Film) -> Self {
        let area = film.sampled_area();
        let size = BLOCK_SIZE.cast_signed();
        let starts = |from: i32, length: u32| (from.div_euclid(size) * size..from + length.cast_signed()).step_by(BLOCK_SIZE as usize);
        let block = |x: i32, y: i32| {
            let bounds = Area { x, y, width: BLOCK_SIZE, height: BLOCK_SIZE }.intersection(area);
            let sequence = || Sequence { samples: 0, halves: [film.start_area(bounds), film.start_area(bounds)] };
            Block { bounds, sequences: [Mutex::new(sequence()), Mutex::new(sequence())] }
        };
        let rows = starts(area.y, area.height);
        let all = rows.flat_map(|y| starts(area.x, area.width).map(move |x| block(x, y))).collect();
        Self { all, across: starts(area.x, area.width).count() }
    }

    /// How many pixels there are in all.
    pub(super) fn pixels(&self) -> u64 {
        self.all.iter().map(|block| block.bounds.pixels()).sum()
    }

    /// Every sequence of every block.
    pub(super) fn all_units(&self) -> Vec<Unit> {
        (0..self.all.len()).flat_map(|block| (0..SEQUENCES).map(move |sequence| Unit { block, sequence })).collect()
    }

    /// A block and those around it.
    pub(super) fn around(&self, block: usize) -> impl Iterator<Item = usize> + use<> {
        let (across, down) = (self.across, self.all.len() / self.across);
        let near = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
        let (rows, columns) = (near(block / across, down), near(block % across, across));
        rows.flat_map(move |row| columns.clone().map(move |column| row * across + column))
    }

    /// What is known of the pixels of a block that are in the picture, row by row.
    pub(super) fn pixel_estimates(&self, film: &Film, block: usize) -> Vec<PixelEstimate> {
        let area = self.all[block].bounds.intersection(film.area());
        let part = |part: usize| -> Vec<PartMean> {
            let mut gathered = Gathered::new(film, area);
            for near in self.around(block) {
                let own = self.all[near].sequence(part / 2);
                gathered.add(&own.halves[part % 2], times(own.samples));
            }
            gathered.means().collect()
        };
        let parts = [0, 1, 2, 3].map(part);
        (0..area.pixels() as usize).map(|i| PixelEstimate::from_replicates([0, 1, 2, 3].map(|p| parts[p][i]))).collect()
    }

    /// The film with all samples.
    pub(super) fn put_together(&self, film: Film) -> Film {
        for block in &self.all {
            for sequence in 0..SEQUENCES {
                let own = block.sequence(sequence);
                own.halves.iter().for_each(|half| film.add_repeated(half, 0, times(own.samples)));
            }
        }
        film
    }
}

/// How often a sequence's samples are to be doubled to be as many as any.
fn times(samples: u32) -> u32 {
    MOST_LOG_SAMPLES - samples.max(1).ilog2()
}
