//! How far a render in passes is, as planes of whole numbers for files, and back.
//!
//! The pixels of all tiles come one after another, block by block, in each the halves of both sequences; as borders overlap, they are
//! more than the picture has. The words of which a pixel consists ([`Film::word_names`]) are rows of numbers, each cut into as many
//! planes of the picture's size as it takes: `snell.tile.sum.R.0.0` has the lowest bits of the first pixels' red. Another row,
//! `snell.samples.0` and so on, has the number of samples of every unit, and whether it is still to go on in the pass that has begun; a
//! third, `snell.vertices.0` and so on, those of their paths' vertices, the lower half of each number and then the upper one.

use super::block::{Blocks, FEWEST, MOST_LOG_SAMPLES};
use super::plan::Unit;
use crate::film::{Film, Tile};
use crate::image::{Plane, PlaneValues};
use crate::render::Done;
use std::sync::Arc;
use std::time::Duration;

/// Set in the number of samples of a unit that is still to go on.
const WAITING: u32 = 1 << 31;

/// The row of numbers of samples.
const SAMPLES: &str = "snell.samples";

/// The row of numbers of vertices, each of two words.
const VERTICES: &str = "snell.vertices";

/// How far a render in passes is: its blocks, as long as they stay as they are.
pub struct Passes {
    /// How many samples there were, over all pixels, when the estimate first was below the target.
    pub near: Option<u64>,
    pub(super) blocks: Arc<Blocks>,
    /// Units that are still to go on in the pass that has begun.
    pub(super) waiting: Vec<Unit>,
}

impl Passes {
    /// All sums and numbers, for a film that has put them together.
    pub fn to_planes(&self, film: &Film) -> Vec<Plane> {
        self.blocks.to_planes(film, &self.waiting)
    }
}

/// What is known of a render in passes that is to go on, beside its planes.
pub struct Earlier {
    /// Like that of the render, without samples but with those that were left out.
    pub film: Film,
    /// As in [`Passes`].
    pub near: Option<u64>,
    /// What was done.
    pub done: Done,
    /// The wall time that it took.
    pub time: Duration,
}

/// Why a render cannot go on from a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unfit {
    /// There is no plane of this name, or it has not the picture's size.
    Missing(String),
    /// It cannot be right.
    Contradiction,
    /// Its samples are those of one sequence, the same number everywhere, which do not tell well enough when a target is reached.
    OneSequence,
}

/// The picture that planes make if no filter mixes pixels and no paths are shared: for those who get files from strangers.
///
/// Fails where a render of that kind could not go on from them.
pub fn put_together<'p>(earlier: Earlier, plane: impl Fn(&str) -> Option<&'p [u32]>) -> Result<Film, Unfit> {
    let mut blocks = Blocks::new(&earlier.film, false);
    blocks.resume(&earlier, plane)?;
    Ok(blocks.put_together(earlier.film))
}

/// A long row of numbers in planes.
struct Row {
    /// What its planes are called, but for their numbers.
    name: String,
    planes: Vec<Vec<u32>>,
}

impl Row {
    fn new(name: String, size: usize, length: usize) -> Self {
        Self { name, planes: vec![vec![0; size]; length.div_ceil(size)] }
    }

    fn set(&mut self, at: usize, value: u32) {
        let size = self.planes[0].len();
        self.planes[at / size][at % size] = value;
    }

    fn into_planes(self) -> impl Iterator<Item = Plane> {
        let Self { name, planes } = self;
        let plane = move |(i, values)| Plane { name: format!("{name}.{i}"), values: PlaneValues::Whole(values) };
        planes.into_iter().enumerate().map(plane)
    }
}

/// The planes of such a row, in a file.
fn planes_of<'p>(
    name: &str,
    (size, length): (usize, usize),
    plane: &impl Fn(&str) -> Option<&'p [u32]>,
) -> Result<Vec<&'p [u32]>, Unfit> {
    let named = |i: usize| {
        let name = format!("{name}.{i}");
        plane(&name).filter(|p| p.len() == size).ok_or(Unfit::Missing(name))
    };
    (0..length.div_ceil(size)).map(named).collect()
}

fn row_name(word: &str) -> String {
    format!("snell.tile.{word}")
}

/// Whether a unit may have so many samples; `alone` where the first sequence has no other.
fn is_possible(sequence: usize, samples: u32, waiting: bool, alone: bool) -> bool {
    let most = 1 << MOST_LOG_SAMPLES;
    match (samples, sequence) {
        (0, 1) if alone => !waiting,
        (0, _) => waiting,
        _ => {
            (alone || samples.is_power_of_two()) && (FEWEST..=most).contains(&samples) && !(waiting && samples == most)
        }
    }
}

impl Blocks {
    /// The planes of the module's head, for a film of their pixels.
    fn to_planes(&self, film: &Film, waiting: &[Unit]) -> Vec<Plane> {
        let size = film.area().pixels() as usize;
        let units = self.all_units();
        let mut samples = Row::new(SAMPLES.into(), size, units.len());
        let mut vertices = Row::new(VERTICES.into(), size, 2 * units.len());
        for (i, unit) in units.iter().enumerate() {
            let block = &self.all[unit.block];
            // No more than 2²⁹.
            samples.set(i, block.samples(unit.sequence) as u32);
            let count = block.vertices(unit.sequence);
            vertices.set(2 * i, count as u32);
            vertices.set(2 * i + 1, (count >> u32::BITS) as u32);
        }
        for unit in waiting {
            let all = self.all[unit.block].samples(unit.sequence) as u32;
            samples.set(unit.number(), all | WAITING);
        }
        let length = self.tile_pixels();
        let row = |word: String| Row::new(row_name(&word), size, length);
        let mut rows: Vec<Row> = film.word_names().into_iter().map(row).collect();
        let mut first = 0;
        for unit in units {
            self.visit(unit, &mut |tile: &Tile| {
                tile.words(&mut |pixel, word, value| rows[word].set(first + pixel, value));
                first += tile.pixel_count();
            });
        }
        [samples, vertices].into_iter().chain(rows).flat_map(Row::into_planes).collect()
    }

    /// Puts these blocks, which have no samples, where a render was that left these planes; returns the units that wait.
    pub(super) fn resume<'p>(
        &mut self,
        earlier: &Earlier,
        plane: impl Fn(&str) -> Option<&'p [u32]>,
    ) -> Result<Vec<Unit>, Unfit> {
        let Earlier { film, near, done, .. } = earlier;
        let size = film.area().pixels() as usize;
        let units = self.all_units();
        let samples = planes_of(SAMPLES, (size, units.len()), &plane)?;
        let vertices = planes_of(VERTICES, (size, 2 * units.len()), &plane)?;
        let row = |word: String| planes_of(&row_name(&word), (size, self.tile_pixels()), &plane);
        let rows = film.word_names().into_iter().map(row).collect::<Result<Vec<_>, _>>()?;
        let word = |unit: &Unit| samples[unit.number() / size][unit.number() % size];
        let alone = units.iter().all(|unit| unit.sequence == 0 || word(unit) == 0);
        let (mut first, mut taken, mut waiting) = (0, 0, Vec::new());
        for (i, unit) in units.into_iter().enumerate() {
            let (samples, waits) = (word(&unit) & !WAITING, word(&unit) & WAITING != 0);
            if !is_possible(unit.sequence, samples, waits, alone) {
                return Err(Unfit::Contradiction);
            }
            if waits {
                waiting.push(unit);
            }
            taken += u64::from(samples) * self.all[unit.block].bounds.pixels();
            let [low, high] = [2 * i, 2 * i + 1].map(|at| u64::from(vertices[at / size][at % size]));
            if samples == 0 && (low, high) != (0, 0) {
                return Err(Unfit::Contradiction);
            }
            self.set(unit, (samples, high << u32::BITS | low), &mut |tile: &mut Tile| {
                if samples > 0 {
                    tile.set_words(&|pixel, word| rows[word][(first + pixel) / size][(first + pixel) % size]);
                }
                first += tile.pixel_count();
            });
        }
        if taken != done.samples || near.is_some_and(|near| near == 0 || near > taken) {
            return Err(Unfit::Contradiction);
        }
        Ok(waiting)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::exact::Scale;
    use crate::film::{Extras, SampleId};
    use crate::image::{Crop, Filter};
    use crate::spectrum::Rgb;
    use glam::Vec2;

    /// Of seven by six pixels, which do not fill their blocks, under a filter with a border.
    fn film() -> Film {
        let crop = Crop { x: 3, y: 5, width: 7, height: 6 };
        let extras = Extras { means: vec![Scale::for_exponent(0)], numbers: 1 };
        Film::new(crop, Filter::Gaussian { stddev: 0.5 }, true, Scale::for_exponent(2)).with_extras(extras)
    }

    /// Blocks with a sample of each half of all units but the last, which count as four.
    fn blocks() -> (Blocks, Vec<Unit>, u64) {
        let mut blocks = Blocks::new(&film(), false);
        let mut units = blocks.all_units();
        let last = units.pop().unwrap();
        let mut taken = 0;
        for unit in units {
            taken += 4 * blocks.all[unit.block].bounds.pixels();
            blocks.set(unit, (4, 5 << u32::BITS | 17), &mut |tile: &mut Tile| {
                let id = SampleId { x: tile.bounds().x, y: tile.bounds().y, index: 0 };
                let value = Rgb::new(0.3, unit.block as f32, unit.sequence as f32);
                tile.add_sample_with(id, value, || Vec2::splat(0.4), &[0.7]);
            });
        }
        (blocks, vec![Unit { block: 0, sequence: 1 }, last], taken)
    }

    fn resumed(planes: &[Plane], near: Option<u64>, samples: u64) -> Result<(Blocks, Vec<Unit>), Unfit> {
        let done = Done { samples, ..Done::default() };
        let earlier = Earlier { film: film(), near, done, time: Duration::ZERO };
        let mut blocks = Blocks::new(&film(), false);
        let named = |name: &str| planes.iter().find(|plane| plane.name == name).and_then(|plane| plane.values.whole());
        let waiting = blocks.resume(&earlier, named)?;
        Ok((blocks, waiting))
    }

    #[test]
    fn blocks_come_back_from_their_planes() {
        let (blocks, waiting, taken) = blocks();
        let planes = blocks.to_planes(&film(), &waiting);
        assert!(planes.iter().all(|plane| plane.values.whole().unwrap().len() == 42));
        let (back, waits) = resumed(&planes, Some(taken), taken).unwrap();
        assert_eq!(waits, waiting);
        assert_eq!(back.to_planes(&film(), &waiting), planes);
        assert_eq!(back.put_together(film()).to_planes(), blocks.put_together(film()).to_planes());
    }

    /// Any number is right for a sequence without another, and some may wait.
    #[test]
    fn a_lone_sequence_comes_back() {
        let mut blocks = Blocks::new(&film(), false);
        let units = blocks.units_of(0);
        let mut taken = 0;
        for (samples, &unit) in (12..).zip(&units) {
            taken += u64::from(samples) * blocks.all[unit.block].bounds.pixels();
            blocks.set(unit, (samples, 40), &mut |tile: &mut Tile| {
                let id = SampleId { x: tile.bounds().x, y: tile.bounds().y, index: 0 };
                tile.add_sample_with(id, Rgb::new(0.3, 0.1, 0.2), || Vec2::splat(0.4), &[0.7]);
            });
        }
        let planes = blocks.to_planes(&film(), &units[..1]);
        let (back, waiting) = resumed(&planes, None, taken).unwrap();
        assert_eq!(waiting, units[..1]);
        assert_eq!(back.to_planes(&film(), &units[..1]), planes);
        assert_eq!((back.has_one_sequence(), back.range_of_one()), (true, [12, 11 + units.len() as u32]));
        // None without samples and not waiting, nor a second sequence beside such numbers.
        for (unit, word) in
            [(units[0], 0), (Unit { block: 0, sequence: 1 }, WAITING), (Unit { block: 0, sequence: 1 }, 4)]
        {
            let mut planes = planes.clone();
            let PlaneValues::Whole(values) = &mut planes[0].values else { panic!("whole numbers") };
            values[unit.number()] = word;
            assert_eq!(resumed(&planes, None, taken).err(), Some(Unfit::Contradiction), "{unit:?} {word}");
        }
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let (blocks, waiting, taken) = blocks();
        let planes = blocks.to_planes(&film(), &waiting);
        let error = |planes: &[Plane], near, taken| resumed(planes, near, taken).err().unwrap();
        for (near, taken) in [(None, taken + 1), (Some(0), taken), (Some(taken + 1), taken)] {
            assert_eq!(error(&planes, near, taken), Unfit::Contradiction);
        }
        assert_eq!(error(&planes[1..], None, taken), Unfit::Missing("snell.samples.0".into()));
        let named = |name: &str| planes.iter().position(|plane| plane.name == name).unwrap();
        let sum = "snell.tile.sum.R.0.8";
        assert_eq!(error(&planes[..named(sum)], None, taken), Unfit::Missing(sum.into()));
        // Vertices of a unit without samples: the last one, whose upper words are the row's last ones.
        let mut odd = planes.clone();
        let units = blocks.all_units().len();
        let PlaneValues::Whole(values) = &mut odd[named("snell.vertices.0")].values else { panic!("whole numbers") };
        values[2 * units - 1] = 1;
        assert_eq!(error(&odd, None, taken), Unfit::Contradiction);
        // Numbers of samples that no pass leaves: none and not waiting, no power of two, too few, too many.
        for samples in [0, 12, 1, 1 << 30, WAITING | 1 << MOST_LOG_SAMPLES] {
            let mut planes = planes.clone();
            let PlaneValues::Whole(values) = &mut planes[0].values else { panic!("whole numbers") };
            values[0] = samples;
            assert_eq!(error(&planes, None, taken), Unfit::Contradiction, "{samples}");
        }
    }
}
