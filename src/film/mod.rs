//! Accumulates samples into pixels, exactly and in any order, and develops them into a picture.
//!
//! # Sums
//!
//! A sample's value is converted once to a fixed-point integer, and integers are added: the sum is exact, so no order of
//! threads, tiles, passes or shards can change a bit of it, and the millionth sample counts like the first. See
//! [`exact`] for the range.
//!
//! # Filters
//!
//! A sample is splatted into every pixel that the reconstruction filter reaches, as weight × value beside the weight,
//! into the buffer of its own tile (which has a border as wide as the filter); tiles are then added to the film. A pixel
//! is the quotient of its two sums. With the box filter the border is empty and every weight is one.
//!
//! Whatever else is to be known of the samples ([`Extras`]) is gathered in the same way, beside.
//!
//! A film may keep the samples of several *parts* of a render apart: by how much their pictures differ one knows how wrong
//! they are. The picture is that of all parts together.
//!
//! As in Mitsuba, samples are taken in the pixels of the picture only, so that those at its edge (or at that of a crop)
//! see but part of what the filter covers, unless the film asks for a border of samples around it.

pub mod exact;
mod extras;
mod gathered;
mod kernel;
mod sums;
mod tile;
mod words;

pub use extras::Extras;
pub use gathered::Gathered;
pub use tile::Tile;

use crate::image::{Area, Crop, Filter, Picture};
use crate::math::float;
use crate::spectrum::Rgb;
use exact::{ExactRgb, Scale};
use extras::ExtraFilm;
use kernel::{Kernel, WEIGHT_BITS};
use serde::{Deserialize, Serialize};
use std::sync::Mutex;

/// Edge length of a tile in pixels: its sums (32 KiB) stay in a core's cache.
pub const TILE_SIZE: u32 = 16;

/// Samples that could not be counted, as far as they are remembered one by one.
const MAX_REMEMBERED: usize = 16;

/// One sample of one pixel: what `--replay` takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct SampleId {
    /// Column in the whole film; negative, or beyond it, in the border that a film may have.
    pub x: i32,
    /// Row in the whole film; likewise.
    pub y: i32,
    /// Index of the sample.
    pub index: u32,
}

/// Samples that were left out because their value was not finite or did not fit, and those that count but were negative.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Dropped {
    /// How many.
    pub count: u64,
    /// How many of them were finite, but did not fit.
    pub oversized: u64,
    /// Samples beside these that were negative in some channel, as no light is: they count all the same.
    pub negative: u64,
    /// The first few, in the order of their ids.
    pub examples: Vec<SampleId>,
}

impl Dropped {
    /// Whether there is nothing to tell.
    pub fn is_empty(&self) -> bool {
        self.examples.is_empty()
    }

    /// How many were not finite.
    pub fn non_finite(&self) -> u64 {
        self.count.saturating_sub(self.oversized)
    }

    fn push(&mut self, id: SampleId, value: Rgb) {
        self.count += 1;
        self.oversized += u64::from(value.is_finite());
        self.examples.push(id);
        self.trim();
    }

    /// Remembers a sample that counts, if it is negative.
    #[inline]
    fn look_at(&mut self, id: SampleId, value: Rgb) {
        if value.0.min_element() < 0.0 {
            self.negative += u64::from(value.is_finite());
            self.examples.push(id);
            self.trim();
        }
    }

    /// Both together.
    pub fn add(&mut self, other: &Self) {
        self.count = self.count.saturating_add(other.count);
        self.oversized = self.oversized.saturating_add(other.oversized);
        self.negative = self.negative.saturating_add(other.negative);
        self.examples.extend_from_slice(&other.examples);
        self.trim();
    }

    /// Keeps the lowest ids, so that what is kept does not depend on the order of arrival.
    fn trim(&mut self) {
        self.examples.sort_unstable();
        self.examples.truncate(MAX_REMEMBERED);
    }
}

/// Sums of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pixel {
    sum: ExactRgb,
    /// Sum of the samples' weights, in units of 2⁻²⁸.
    weight: i128,
}

impl Pixel {
    /// Both together.
    pub fn add(&mut self, other: &Self) {
        self.sum.add(&other.sum);
        // As its sums: what a file claims may be anything.
        self.weight = self.weight.wrapping_add(other.weight);
    }

    /// The same as of 2^`times` times as many samples.
    #[must_use]
    fn repeated(self, times: u32) -> Self {
        Self { sum: self.sum.repeated(times), weight: self.weight << times }
    }
}

/// An area cut into tiles, row by row.
#[derive(Clone, Copy, Debug)]
struct Grid(Area);

impl Grid {
    fn across(&self) -> usize {
        self.0.width.div_ceil(TILE_SIZE) as usize
    }

    fn count(&self) -> usize {
        self.across() * self.0.height.div_ceil(TILE_SIZE) as usize
    }

    fn bounds(&self, index: usize) -> Area {
        let (column, row) = ((index % self.across()) as u32, (index / self.across()) as u32);
        let (x, y) = (column * TILE_SIZE, row * TILE_SIZE);
        let size = |whole: u32, start: u32| TILE_SIZE.min(whole - start);
        Area {
            x: self.0.x + x.cast_signed(),
            y: self.0.y + y.cast_signed(),
            width: size(self.0.width, x),
            height: size(self.0.height, y),
        }
    }

    /// Every tile that shares pixels with `area`, which lies inside.
    fn touched(self, area: Area) -> impl Iterator<Item = usize> {
        let last = |start: i32, size: u32, origin: i32| ((start - origin) as u32 + size.max(1) - 1) / TILE_SIZE;
        let first = |start: i32, origin: i32| (start - origin) as u32 / TILE_SIZE;
        let columns = first(area.x, self.0.x)..=last(area.x, area.width, self.0.x);
        let rows = first(area.y, self.0.y)..=last(area.y, area.height, self.0.y);
        rows.flat_map(move |r| columns.clone().map(move |c| r as usize * self.across() + c as usize))
    }
}

/// The tile that pixel (x, y) is in, where samples are taken in `area`; of a pixel that is not in there, what would be one.
pub fn tile_around(area: Area, x: i32, y: i32) -> Area {
    let edge = TILE_SIZE.cast_signed();
    let start = |x: i32, origin: i32| origin + (x - origin).div_euclid(edge) * edge;
    let tile = Area { x: start(x, area.x), y: start(y, area.y), width: TILE_SIZE, height: TILE_SIZE };
    if area.contains(x, y) { tile.intersection(area) } else { tile }
}

/// The sums of every pixel of the crop window.
pub struct Film {
    /// The pixels that it holds.
    pixels: Grid,
    /// The pixels in which samples are taken.
    sampled: Grid,
    scale: Scale,
    kernel: Option<Kernel>,
    border: u32,
    /// How many parts are kept apart.
    parts: usize,
    /// The sums of each tile of pixels, part by part; none before the first are added.
    tiles: Vec<Mutex<Vec<Pixel>>>,
    /// The radiance that no channel of a sample exceeds.
    most: f32,
    /// What is kept beside radiance, if anything is.
    extras: Option<ExtraFilm>,
    dropped: Mutex<Dropped>,
}

impl Film {
    /// Most bytes that the sums of this many pixels take, in so many parts.
    pub fn bytes(pixels: u64, parts: u64) -> u64 {
        pixels * parts * size_of::<Pixel>() as u64
    }

    /// An empty film for the pixels of `crop`; with `sample_border`, samples are to be taken around it, too, wherever one
    /// reaches into it. `scale` fits the brightest light of the scene.
    pub fn new(crop: Crop, filter: Filter, sample_border: bool, scale: Scale) -> Self {
        let pixels = Grid(Area::from(crop));
        Self {
            pixels,
            sampled: Grid(filter.sampled_area(crop, sample_border)),
            scale,
            kernel: Kernel::new(filter),
            border: filter.border(),
            parts: 1,
            tiles: (0..pixels.count()).map(|_| Mutex::default()).collect(),
            most: f32::INFINITY,
            extras: None,
            dropped: Mutex::default(),
        }
    }

    /// This film, still empty, scaling every sample whose brightest channel is above the radiance `most` down to it. The
    /// picture is then biased: too dark wherever such samples were right.
    #[must_use]
    pub fn clamped(self, most: f32) -> Self {
        Self { most, ..self }
    }

    /// This film, still empty, keeping the samples of so many parts apart, at least one.
    #[must_use]
    pub fn with_parts(self, parts: usize) -> Self {
        Self { parts: parts.max(1), ..self }
    }

    /// This film, still empty, keeping something beside radiance.
    #[must_use]
    pub fn with_extras(self, extras: Extras) -> Self {
        let extras = Some(ExtraFilm::new(extras, self.pixels.count()));
        Self { extras, ..self }
    }

    /// Number of tiles in which samples are taken.
    pub fn tile_count(&self) -> usize {
        self.sampled.count()
    }

    /// The pixels of tile `index` in which samples are taken, in the whole film's coordinates.
    pub fn tile_bounds(&self, index: usize) -> Area {
        self.sampled.bounds(index)
    }

    /// The pixels that it holds, in the whole film's coordinates.
    pub fn area(&self) -> Area {
        self.pixels.0
    }

    /// How much farther than its own pixel a sample may reach, in pixels.
    pub fn border(&self) -> u32 {
        self.border
    }

    /// All pixels in which samples are taken, in the whole film's coordinates.
    pub fn sampled_area(&self) -> Area {
        self.sampled.0
    }

    /// An empty buffer for the samples of tile `index`.
    pub fn start_tile(&self, index: usize) -> Tile {
        self.start_area(self.tile_bounds(index))
    }

    /// An empty buffer for the samples of these pixels, which are some of those in which samples are taken.
    pub fn start_area(&self, bounds: Area) -> Tile {
        let reach = bounds.grown(self.border).intersection(self.pixels.0);
        let tile = Tile::new(bounds, reach, (self.scale, self.most), self.kernel);
        match &self.extras {
            None => tile,
            Some(film) => tile.with_extras(&film.extras),
        }
    }

    /// Adds what a tile gathered to a part.
    pub fn add(&self, tile: &Tile, part: usize) {
        self.add_repeated(tile, part, 0);
    }

    /// Adds what a tile gathered to a part as if each of its samples had been there 2^`times` times, so that tiles with fewer
    /// samples than others count as much where filters mix them. The count of samples stays what it is.
    pub fn add_repeated(&self, tile: &Tile, part: usize, times: u32) {
        debug_assert!(part < self.parts, "no such part");
        for index in self.pixels.touched(tile.reach()) {
            let bounds = self.pixels.bounds(index);
            let (shared, count) = (bounds.intersection(tile.reach()), bounds.pixels() as usize);
            let mut pixels = lock(&self.tiles[index]);
            pixels.resize(self.parts * count, Pixel::default());
            for y in shared.y..shared.y + shared.height.cast_signed() {
                let first = part * count + bounds.index(shared.x, y);
                for (p, t) in pixels[first..].iter_mut().zip(tile.row(shared.x, y, shared.width)) {
                    p.add(&t.repeated(times));
                }
            }
            if let (Some(film), Some(sums)) = (&self.extras, tile.extras()) {
                film.add(index, bounds, (sums, times), tile.reach());
            }
        }
        if !tile.dropped().is_empty() {
            lock(&self.dropped).add(tile.dropped());
        }
    }

    /// Samples left out so far.
    pub fn dropped(&self) -> Dropped {
        lock(&self.dropped).clone()
    }

    /// The picture: weighted mean of the radiance per pixel in W·sr⁻¹·m⁻² per channel; black where the weights are zero,
    /// as where there is no sample yet.
    pub fn develop(&self) -> Picture {
        let whole = self.pixels.0;
        let mut picture = Picture::new(whole.width, whole.height);
        for index in 0..self.tiles.len() {
            for (i, p) in self.whole_pixels(index).iter().enumerate() {
                let (x, y) = self.place(index, i);
                picture.set(x, y, p.mean(self.scale));
            }
        }
        picture
    }

    /// Whether every part has samples.
    pub fn has_parts(&self) -> bool {
        let has = |(index, tile): (usize, &Mutex<Vec<Pixel>>)| {
            let tile = lock(tile);
            let mut parts = tile.chunks(self.pixels.bounds(index).pixels() as usize);
            !tile.is_empty() && parts.all(|part| part.iter().any(|pixel| pixel.weight != 0))
        };
        self.tiles.iter().enumerate().all(has)
    }

    /// What part `part` alone shows, row by row.
    pub fn part_means(&self, part: usize) -> Vec<PartMean> {
        let mut means = vec![PartMean::default(); self.pixels.0.pixels() as usize];
        for (index, tile) in self.tiles.iter().enumerate() {
            let count = self.pixels.bounds(index).pixels() as usize;
            for (i, p) in lock(tile).iter().skip(part * count).take(count).enumerate() {
                means[self.flat_place(index, i)] = p.part_mean(self.scale);
            }
        }
        means
    }

    /// The sums of the pixels of tile `index`, all parts together; none where nothing was added.
    fn whole_pixels(&self, index: usize) -> Vec<Pixel> {
        let tile = lock(&self.tiles[index]);
        let mut parts = tile.chunks(self.pixels.bounds(index).pixels() as usize);
        let mut pixels = parts.next().unwrap_or_default().to_vec();
        parts.for_each(|part| pixels.iter_mut().zip(part).for_each(|(pixel, p)| pixel.add(p)));
        pixels
    }

    /// Weighted means of quantity `which` of those kept beside radiance, row by row; zero where the weights are zero.
    pub fn means(&self, which: usize) -> Vec<f64> {
        self.plane(|film, index| {
            let sums = film.sums(index, which);
            let pixels = self.whole_pixels(index);
            sums.iter().zip(&pixels).map(|(sum, p)| if p.weight == 0 { 0.0 } else { sum / p.weight() }).collect()
        })
    }

    /// Whole number `which` of each pixel, row by row; zero where there is no sample yet.
    pub fn numbers(&self, which: usize) -> Vec<u32> {
        self.plane(|film, index| film.numbers(index, 1 + which))
    }

    /// How many samples of each pixel count, row by row; zeros if nothing is kept beside radiance.
    pub fn sample_counts(&self) -> Vec<u32> {
        self.plane(|film, index| film.numbers(index, 0))
    }

    /// The pixels of all tiles, row by row, from those of each (or none, where nothing was added).
    fn plane<T: Copy + Default>(&self, tile: impl Fn(&ExtraFilm, usize) -> Vec<T>) -> Vec<T> {
        let mut plane = vec![T::default(); self.pixels.0.pixels() as usize];
        if let Some(film) = &self.extras {
            for index in 0..self.tiles.len() {
                for (i, value) in tile(film, index).into_iter().enumerate() {
                    let (x, y) = self.place(index, i);
                    plane[y as usize * self.pixels.0.width as usize + x as usize] = value;
                }
            }
        }
        plane
    }

    /// Column and row in the picture of pixel `i` of tile `index`.
    fn place(&self, index: usize, i: usize) -> (u32, u32) {
        let (whole, c) = (self.pixels.0, self.pixels.bounds(index));
        let (left, top) = ((c.x - whole.x).cast_unsigned(), (c.y - whole.y).cast_unsigned());
        (left + i as u32 % c.width, top + i as u32 / c.width)
    }
}

/// What one part of a render shows of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PartMean {
    /// Weighted mean of the radiance in W·sr⁻¹·m⁻², per channel; zero where the weights are.
    pub radiance: [f64; 3],
    /// The sum of the samples' weights: with the box filter their count.
    pub weight: f64,
}

impl Pixel {
    fn part_mean(&self, scale: Scale) -> PartMean {
        let weight = self.weight();
        let mean = |sum| if self.weight == 0 { 0.0 } else { sum / weight };
        PartMean { radiance: self.sum.to_f64(scale).map(mean), weight }
    }

    fn weight(&self) -> f64 {
        libm::ldexp(self.weight as f64, -WEIGHT_BITS.cast_signed())
    }

    fn mean(&self, scale: Scale) -> Rgb {
        if self.weight == 0 {
            return Rgb::BLACK;
        }
        let weight = self.weight();
        let [r, g, b] = self.sum.to_f64(scale).map(|s| float::saturate_to_f32(s / weight));
        Rgb::new(r, g, b)
    }
}

/// A poisoned lock means that a thread panicked; the sums are still whole, for they are added without failing.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

#[cfg(test)]
mod tests;
