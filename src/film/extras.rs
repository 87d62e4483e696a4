//! What a film keeps beside radiance, if asked to: means of other quantities of the same samples, and whole numbers.
//!
//! A mean is weighted by the reconstruction filter, as radiance is, and its sum is as independent of order
//! ([`super::exact`]). A whole number belongs to a pixel, not to what the filter reaches: how many samples it has, or
//! something that its first sample tells. Numbers of different samples are never mixed.

use super::exact::Scale;
use super::lock;
use crate::image::Area;
use std::sync::Mutex;

/// What to keep.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Extras {
    /// A scale for each mean.
    pub means: Vec<Scale>,
    /// How many whole numbers a pixel's first sample tells.
    pub numbers: usize,
}

impl Extras {
    /// Bytes that a pixel takes.
    pub fn bytes(&self) -> u64 {
        (self.means.len() * size_of::<i128>() + (1 + self.numbers) * size_of::<u32>()) as u64
    }
}

/// The sums of some pixels.
#[derive(Clone, Debug, Default)]
pub(super) struct ExtraSums {
    /// Pixel by pixel: a sum for each mean.
    sums: Vec<i128>,
    /// Pixel by pixel: the count of samples, and the numbers.
    numbers: Vec<u32>,
}

impl ExtraSums {
    /// Nothing yet, for so many pixels.
    pub(super) fn new(extras: &Extras, pixels: usize) -> Self {
        Self { sums: vec![0; pixels * extras.means.len()], numbers: vec![0; pixels * (1 + extras.numbers)] }
    }

    /// Adds a sample's values to the means of `pixel`.
    #[inline]
    pub(super) fn push(&mut self, extras: &Extras, pixel: usize, values: &[f64], weight: i64) {
        let n = extras.means.len();
        for ((sum, scale), &value) in self.sums[pixel * n..(pixel + 1) * n].iter_mut().zip(&extras.means).zip(values) {
            // Cannot wrap below 2³² samples.
            *sum = sum.wrapping_add(scale.weighted(value, weight));
        }
    }

    /// Counts a sample of `pixel`.
    pub(super) fn count(&mut self, extras: &Extras, pixel: usize) {
        self.numbers[pixel * (1 + extras.numbers)] += 1;
    }

    /// Sets the numbers of `pixel`, once and for all.
    pub(super) fn set_numbers(&mut self, extras: &Extras, pixel: usize, numbers: &[u32]) {
        let first = pixel * (1 + extras.numbers) + 1;
        self.numbers[first..first + extras.numbers].copy_from_slice(numbers);
    }

    /// Puts sums and numbers into their places of `pixel`.
    pub(super) fn set(
        &mut self,
        pixel: usize,
        sums: impl ExactSizeIterator<Item = i128>,
        numbers: impl ExactSizeIterator<Item = u32>,
    ) {
        let (first_sum, first_number) = (pixel * sums.len(), pixel * numbers.len());
        self.sums[first_sum..].iter_mut().zip(sums).for_each(|(to, sum)| *to = sum);
        self.numbers[first_number..].iter_mut().zip(numbers).for_each(|(to, number)| *to = number);
    }

    /// Whether there is no pixel.
    pub(super) fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    /// All sums, pixel by pixel.
    pub(super) fn sums(&self) -> impl Iterator<Item = i128> {
        self.sums.iter().copied()
    }

    /// All numbers, pixel by pixel, the count of samples first.
    pub(super) fn numbers(&self) -> impl Iterator<Item = u32> {
        self.numbers.iter().copied()
    }

    /// Adds all of another, and leaves that one empty.
    pub(super) fn absorb(&mut self, extras: &Extras, other: &mut Self) {
        let pixels = self.numbers.len() / (1 + extras.numbers);
        self.add(extras, 0, (other, 0), 0, pixels);
        *other = Self::new(extras, pixels);
    }

    /// Adds `count` pixels of another: its pixels from `theirs` on, each sum 2^`times` times, to those from `mine` on.
    fn add(&mut self, extras: &Extras, mine: usize, (other, times): (&Self, u32), theirs: usize, count: usize) {
        let n = extras.means.len();
        let sums = self.sums[mine * n..].iter_mut().zip(&other.sums[theirs * n..(theirs + count) * n]);
        sums.for_each(|(sum, o)| *sum = sum.wrapping_add(*o << times));
        let n = 1 + extras.numbers;
        let numbers = self.numbers[mine * n..].iter_mut().zip(&other.numbers[theirs * n..(theirs + count) * n]);
        // Only one buffer has the first sample, and with it the numbers; all others have zeros.
        numbers.for_each(|(number, o)| *number = number.wrapping_add(*o));
    }
}

/// The sums of a whole film, tile by tile.
pub(super) struct ExtraFilm {
    pub(super) extras: Extras,
    /// Empty before the first are added.
    tiles: Vec<Mutex<ExtraSums>>,
}

impl ExtraFilm {
    pub(super) fn new(extras: Extras, tiles: usize) -> Self {
        Self { extras, tiles: (0..tiles).map(|_| Mutex::default()).collect() }
    }

    /// A copy of everything, as it is now.
    pub(super) fn copied(&self) -> Self {
        Self { extras: self.extras.clone(), tiles: self.tiles.iter().map(|t| lock(t).clone().into()).collect() }
    }

    /// The sums of tile `index`; empty before the first are added.
    pub(super) fn tile(&self, index: usize) -> std::sync::MutexGuard<'_, ExtraSums> {
        lock(&self.tiles[index])
    }

    /// Adds the sums of all `pixels` of tile `index`.
    pub(super) fn add_tile(&self, index: usize, sums: &ExtraSums, pixels: usize) {
        self.started(index, pixels).add(&self.extras, 0, (sums, 0), 0, pixels);
    }

    /// The sums of tile `index`, which has so many pixels, ready to be added to.
    fn started(&self, index: usize, pixels: usize) -> std::sync::MutexGuard<'_, ExtraSums> {
        let mut tile = lock(&self.tiles[index]);
        if tile.is_empty() {
            *tile = ExtraSums::new(&self.extras, pixels);
        }
        tile
    }

    /// Adds to tile `index`, which has the pixels `bounds`, what it shares with a buffer of the pixels `reach`, each sum 2 to
    /// the power of the number beside times.
    pub(super) fn add(&self, index: usize, bounds: Area, sums: (&ExtraSums, u32), reach: Area) {
        let mut tile = self.started(index, bounds.pixels() as usize);
        let shared = bounds.intersection(reach);
        for y in shared.y..shared.y + shared.height.cast_signed() {
            let (mine, theirs) = (bounds.index(shared.x, y), reach.index(shared.x, y));
            tile.add(&self.extras, mine, sums, theirs, shared.width as usize);
        }
    }

    /// The sums of mean `which` in tile `index`; none where no sample was taken.
    pub(super) fn sums(&self, index: usize, which: usize) -> Vec<f64> {
        let tile = lock(&self.tiles[index]);
        let scale = self.extras.means[which];
        tile.sums.iter().skip(which).step_by(self.extras.means.len()).map(|&sum| scale.value(sum)).collect()
    }

    /// Number `which` of the pixels of tile `index`, 0 being the count of samples.
    pub(super) fn numbers(&self, index: usize, which: usize) -> Vec<u32> {
        let tile = lock(&self.tiles[index]);
        tile.numbers.iter().skip(which).step_by(1 + self.extras.numbers).copied().collect()
    }
}
