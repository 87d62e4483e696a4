//! Blocks of pixels with the sums of their own samples.

use super::plan::Unit;
use crate::error_estimate::{Parts, PixelEstimate};
use crate::film::{Film, Gathered, PartMean, Tile};
use crate::image::Area;
use crate::integrator::{BLOCK_SIZE, Work};
use crate::render::Done;
use crate::sampler::first_of_run;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Independent sequences of samples.
pub(super) const SEQUENCES: usize = 2;

/// The fewest samples of a sequence: one for each half.
pub(super) const FEWEST: u32 = 2;

/// Edge of a block where pixels do not share paths, and no filter mixes them: where the error is, is known the better, the larger
/// blocks are, but within one all get the same. With edges of 8 the error falls less (docs/error.md); under a filter blocks have
/// borders, of which smaller ones would have more.
const SMALL_EDGE: u32 = 4;

/// The edge of a film's blocks: no filter may reach beyond a block's neighbours.
fn edge(film: &Film, shares: bool) -> u32 {
    if film.border() == 0 && !shares { SMALL_EDGE } else { BLOCK_SIZE.max(film.border().next_multiple_of(BLOCK_SIZE)) }
}

/// What the segment from the camera, with the film, costs of one from a surface, on which light is sampled and a bsdf. Measured: 0.38, 0.31 and
/// 0.23 (balls of rough plastic and of wood under a picture of the sky, and of glass under an even one).
const COST_OF_FIRST: f64 = 0.3;

/// Sums are added as if every sequence had 2 to the power of this many samples; none has more.
pub(super) const MOST_LOG_SAMPLES: u32 = 29;

/// How sequences go on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// How many samples those take that have none: a power of two.
    pub(super) first: u32,
    /// Where those that have some go on evenly; else they are doubled.
    pub(super) even: Option<Even>,
}

/// How a sequence goes on that is alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Even {
    /// How many samples all have in the end.
    pub(super) end: u32,
    /// How many there are to be after all, if that is known.
    pub(super) all: Option<u32>,
}

/// Which half of a sequence its next samples belong to.
enum Place {
    /// Those before this number to the earlier half, with what the later one had; the others to the later one.
    Around(u32),
    Earlier,
    Later,
}

/// By what part a sequence grows at a time of which it is not known how long it will be.
const OPEN_PART: u32 = 8;

impl Step {
    /// How many samples a sequence has after it that had so many before.
    fn end(self, samples: u32) -> u32 {
        match (samples, self.even) {
            (0, _) => self.first,
            (_, Some(even)) => even.end.max(samples),
            (_, None) => 2 * samples,
        }
    }

    /// Which half the samples from this number on belong to. Halves depend on how many there are and are to be, not on how many
    /// came at a time: the later one begins at the largest of the numbers below that all are halved to, again and again; if it is
    /// not known how many there will be, the smaller half takes what comes.
    fn place(self, samples: u32) -> Place {
        match (samples, self.even) {
            (0, _) => Place::Around(self.first / 2),
            (_, None) => Place::Around(samples),
            (_, Some(Even { end, all: Some(all) })) => {
                let stage = stages(all).find(|&stage| stage < end.max(samples)).unwrap_or(0);
                Place::Around(if stage < self.first { self.first / 2 } else { stage })
            }
            (_, Some(Even { all: None, .. })) => {
                let mut sizes = [self.first / 2; 2];
                while sizes[0] + sizes[1] < samples {
                    let all = sizes[0] + sizes[1];
                    let smaller = usize::from(sizes[1] < sizes[0]);
                    sizes[smaller] += open_growth(all).min(samples - all);
                }
                if sizes[1] < sizes[0] { Place::Later } else { Place::Earlier }
            }
        }
    }
}

/// Numbers of samples: all of them, half of these, and so on, rounded up.
pub(super) fn stages(all: u32) -> impl Iterator<Item = u32> {
    std::iter::successors(Some(all), |&stage| (stage > 1).then(|| stage.div_ceil(2)))
}

/// How many samples a sequence of so many takes next, if it is not known how many there will be.
pub(super) fn open_growth(samples: u32) -> u32 {
    (samples / OPEN_PART).max(1)
}

/// Some pixels, each of which has the same number of samples.
pub(super) struct Block {
    /// In the whole film's coordinates.
    pub(super) bounds: Area,
    sequences: [Mutex<Sequence>; SEQUENCES],
}

/// The samples of one sequence.
struct Sequence {
    /// A power of two, or none; any number where it is alone.
    samples: u32,
    /// How many vertices their paths had, over all pixels.
    vertices: u64,
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

    /// How many vertices the paths of a sequence had, over all pixels.
    pub(super) fn vertices(&self, sequence: usize) -> u64 {
        self.sequence(sequence).vertices
    }

    /// What a sample of a sequence costs in the mean, where a segment from one surface to the next costs 1.
    pub(super) fn cost_of_sample(&self, sequence: usize) -> f64 {
        let own = self.sequence(sequence);
        let count = u64::from(own.samples) * self.bounds.pixels();
        COST_OF_FIRST + own.vertices.saturating_sub(count) as f64 / count.max(1) as f64
    }
}

/// The sequences of some units, ready to take their next samples.
pub(super) struct Batch<'a>(Vec<(usize, MutexGuard<'a, Sequence>)>);

impl Batch<'_> {
    /// Takes the next samples of all of them with a function that does some work.
    pub(super) fn go_on(&mut self, step: Step, take: impl Fn(&mut [Work<'_>]) -> Done) -> Done {
        let (mut work, mut counters) = (Vec::with_capacity(2 * self.0.len()), Vec::with_capacity(self.0.len()));
        for (sequence, own) in &mut self.0 {
            let start = first_of_run(*sequence as u32);
            let Sequence { samples, vertices, halves: [earlier, later] } = &mut **own;
            let before = work.len();
            let (from, end) = (*samples, step.end(*samples));
            match step.place(from) {
                Place::Earlier => work.push(Work::new(start + from..start + end, earlier)),
                Place::Later => work.push(Work::new(start + from..start + end, later)),
                Place::Around(middle) => {
                    if from <= middle {
                        earlier.absorb(later);
                    }
                    if from < middle {
                        work.push(Work::new(start + from..start + middle, earlier));
                    }
                    work.push(Work::new(start + middle.max(from)..start + end, later));
                }
            }
            counters.push((work.len() - before, vertices));
            *samples = end;
        }
        let done = take(&mut work);
        let mut taken = work.iter().map(|work| work.vertices);
        for (parts, vertices) in counters {
            *vertices = vertices.saturating_add(taken.by_ref().take(parts).sum());
        }
        done
    }
}

/// All blocks of a film, row by row.
pub(super) struct Blocks {
    pub(super) all: Vec<Block>,
    across: usize,
}

impl Blocks {
    /// Those of a film, without samples; they are aligned in the whole film, as the pixels are that share paths, if they do.
    pub(super) fn new(film: &Film, shares: bool) -> Self {
        let area = film.sampled_area();
        let edge = edge(film, shares);
        let starts = |from: i32, length: u32| {
            let first = from - from.rem_euclid(edge.cast_signed());
            (first..from + length.cast_signed()).step_by(edge as usize)
        };
        let block = |x: i32, y: i32| {
            let bounds = Area { x, y, width: edge, height: edge }.intersection(area);
            let sequence =
                || Sequence { samples: 0, vertices: 0, halves: [film.start_area(bounds), film.start_area(bounds)] };
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

    /// The sequences of some units, none of which any other thread works on.
    pub(super) fn batch(&self, units: &[Unit]) -> Batch<'_> {
        Batch(units.iter().map(|unit| (unit.sequence, self.all[unit.block].sequence(unit.sequence))).collect())
    }

    /// How many samples a unit takes next, over all its pixels.
    pub(super) fn cost(&self, unit: Unit, step: Step) -> u64 {
        let block = &self.all[unit.block];
        let samples = block.sequence(unit.sequence).samples;
        block.bounds.pixels() * u64::from(step.end(samples) - samples)
    }

    /// Every sequence of every block.
    pub(super) fn all_units(&self) -> Vec<Unit> {
        (0..self.all.len()).flat_map(|block| (0..SEQUENCES).map(move |sequence| Unit { block, sequence })).collect()
    }

    /// One sequence of every block.
    pub(super) fn units_of(&self, sequence: usize) -> Vec<Unit> {
        (0..self.all.len()).map(|block| Unit { block, sequence }).collect()
    }

    /// How many pixels have sums in all tiles.
    pub(super) fn tile_pixels(&self) -> usize {
        let mut count = 0;
        self.all_units().into_iter().for_each(|unit| self.visit(unit, &mut |tile| count += tile.pixel_count()));
        count
    }

    /// Shows the tiles of a unit: the earlier half, then the later one.
    pub(super) fn visit(&self, unit: Unit, look: &mut impl FnMut(&Tile)) {
        self.all[unit.block].sequence(unit.sequence).halves.iter().for_each(look);
    }

    /// Sets the numbers of a unit's samples and their vertices, and its tiles by what `fill` makes of each, as [`Self::visit`] shows
    /// them.
    pub(super) fn set(&mut self, unit: Unit, (samples, vertices): (u32, u64), fill: &mut impl FnMut(&mut Tile)) {
        let mut own = self.all[unit.block].sequence(unit.sequence);
        (own.samples, own.vertices) = (samples, vertices);
        own.halves.iter_mut().for_each(fill);
    }

    /// A block and those around it.
    pub(super) fn around(&self, block: usize) -> impl Iterator<Item = usize> + use<> {
        let (across, down) = (self.across, self.all.len() / self.across);
        let near = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
        let (rows, columns) = (near(block / across, down), near(block % across, across));
        rows.flat_map(move |row| columns.clone().map(move |column| row * across + column))
    }

    /// The blocks whose samples reach the pixels of one, or the other way round: without a filter that mixes them, itself alone.
    pub(super) fn reaching(&self, film: &Film, block: usize) -> impl Iterator<Item = usize> + use<> {
        let mixes = film.border() > 0;
        self.around(block).filter(move |&near| mixes || near == block)
    }

    /// What is known of the pixels of a block that are in the picture, row by row: of two sequences, or of one that is alone.
    pub(super) fn pixel_estimates(&self, film: &Film, block: usize, parts: Parts) -> Vec<PixelEstimate> {
        let area = self.all[block].bounds.intersection(film.area());
        let part = |part: usize| -> Vec<PartMean> {
            let mut gathered = Gathered::new(film, area);
            for near in self.reaching(film, block) {
                let own = self.all[near].sequence(part / 2);
                gathered.add(&own.halves[part % 2], times(own.samples, parts));
            }
            gathered.means().collect()
        };
        let pixels = 0..area.pixels() as usize;
        match parts {
            Parts::Replicates => {
                let parts = [0, 1, 2, 3].map(part);
                pixels.map(|i| PixelEstimate::from_replicates(parts.each_ref().map(|part| part[i]))).collect()
            }
            Parts::Halves => {
                let parts = [0, 1].map(part);
                pixels.map(|i| PixelEstimate::from_halves(parts.each_ref().map(|part| part[i]))).collect()
            }
        }
    }

    /// Whether there are samples of the first sequence alone, or none.
    pub(super) fn has_one_sequence(&self) -> bool {
        self.all.iter().all(|block| block.samples(1) == 0)
    }

    /// The fewest and the most samples that any block has of the first sequence.
    pub(super) fn range_of_one(&self) -> [u32; 2] {
        let samples = || self.all.iter().map(|block| block.sequence(0).samples);
        [samples().min().unwrap_or(0), samples().max().unwrap_or(0)]
    }

    /// The film with all samples.
    pub(super) fn put_together(&self, film: Film) -> Film {
        let parts = if self.has_one_sequence() { Parts::Halves } else { Parts::Replicates };
        for block in &self.all {
            for sequence in 0..SEQUENCES {
                let own = block.sequence(sequence);
                own.halves.iter().for_each(|half| film.add_repeated(half, 0, times(own.samples, parts)));
            }
        }
        film
    }
}

/// How often a sequence's samples are to be doubled to be as many as any; those of one that is alone count as they are.
fn times(samples: u32, parts: Parts) -> u32 {
    match parts {
        Parts::Replicates => MOST_LOG_SAMPLES - samples.max(1).ilog2(),
        Parts::Halves => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Which samples are in either half after passes that end so.
    fn halves(first: u32, all: Option<u32>, ends: impl IntoIterator<Item = u32>) -> [Vec<u32>; 2] {
        let (mut samples, mut halves) = (0, [Vec::new(), Vec::new()]);
        for end in [first].into_iter().chain(ends) {
            let even = (samples > 0).then_some(Even { end, all });
            let step = Step { first, even };
            assert_eq!(step.end(samples), end);
            match step.place(samples) {
                Place::Earlier => halves[0].extend(samples..end),
                Place::Later => halves[1].extend(samples..end),
                Place::Around(middle) => {
                    if samples <= middle {
                        let later = std::mem::take(&mut halves[1]);
                        halves[0].extend(later);
                    }
                    halves[0].extend(samples..middle.max(samples));
                    halves[1].extend(middle.max(samples)..end);
                }
            }
            samples = end;
        }
        halves
    }

    #[test]
    fn halves_do_not_depend_on_passes() {
        for all in [32, 33, 51, 100, 1000] {
            let planned = stages(all).filter(|&stage| stage > 8).collect::<Vec<_>>().into_iter().rev();
            let whole = halves(8, Some(all), planned);
            let middle = all.div_ceil(2);
            assert_eq!(whole, [(0..middle).collect::<Vec<_>>(), (middle..all).collect()], "{all}");
            for step in [1, 3, 7, 40] {
                let ends = (8 + step..all).step_by(step as usize).chain([all]);
                assert_eq!(halves(8, Some(all), ends), whole, "{all} by {step}");
            }
        }
    }

    #[test]
    fn halves_of_what_has_no_end_are_alike() {
        let ends = || std::iter::successors(Some(8), |&samples| Some(samples + open_growth(samples))).skip(1);
        for passes in 1..60 {
            let halves = halves(8, None, ends().take(passes));
            let [earlier, later] = halves.each_ref().map(|half| half.len() as u32);
            assert!(earlier.abs_diff(later) <= open_growth(earlier + later), "{earlier} and {later}");
            let mut all = halves.concat();
            all.sort_unstable();
            assert!(all.iter().copied().eq(0..earlier + later));
        }
    }
}
