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

pub mod exact;
mod tile;

pub use tile::Tile;

use crate::image::{Crop, Picture};
use crate::math::float;
use crate::spectrum::Rgb;
use exact::{ExactRgb, Scale};
use std::sync::Mutex;

/// Edge length of a tile in pixels: its sums (32 KiB) stay in a core's cache.
pub const TILE_SIZE: u32 = 16;

/// Samples that could not be counted, as far as they are remembered one by one.
const MAX_REMEMBERED: usize = 16;

/// One sample of one pixel: what `--replay` takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SampleId {
    /// Column in the whole film.
    pub x: u32,
    /// Row in the whole film.
    pub y: u32,
    /// Index of the sample.
    pub index: u32,
}

/// Samples that were left out because their value was not finite or did not fit.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// How many.
    pub count: u64,
    /// The first few, in the order of their ids.
    pub examples: Vec<SampleId>,
}

impl Dropped {
    fn push(&mut self, id: SampleId) {
        self.count += 1;
        self.examples.push(id);
        self.trim();
    }

    fn add(&mut self, other: &Self) {
        self.count += other.count;
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
    /// Number of samples, each of weight one.
    weight: u64,
}

/// The sums of every pixel of the crop window.
pub struct Film {
    crop: Crop,
    scale: Scale,
    tiles: Vec<Mutex<Vec<Pixel>>>,
    dropped: Mutex<Dropped>,
}

impl Film {
    /// An empty film for the pixels of `crop`; `scale` fits the brightest light of the scene.
    pub fn new(crop: Crop, scale: Scale) -> Self {
        let mut film = Self { crop, scale, tiles: Vec::new(), dropped: Mutex::default() };
        film.tiles = (0..film.tile_count())
            .map(|i| {
                let c = film.tile_bounds(i);
                Mutex::new(vec![Pixel::default(); (c.width * c.height) as usize])
            })
            .collect();
        film
    }

    /// The pixels that it holds.
    pub fn crop(&self) -> Crop {
        self.crop
    }

    /// Number of tiles.
    pub fn tile_count(&self) -> usize {
        self.tiles_across() * self.crop.height.div_ceil(TILE_SIZE) as usize
    }

    fn tiles_across(&self) -> usize {
        self.crop.width.div_ceil(TILE_SIZE) as usize
    }

    /// The pixels of tile `index`, in the whole film's coordinates.
    pub fn tile_bounds(&self, index: usize) -> Crop {
        let (column, row) = ((index % self.tiles_across()) as u32, (index / self.tiles_across()) as u32);
        let (x, y) = (column * TILE_SIZE, row * TILE_SIZE);
        Crop {
            x: self.crop.x + x,
            y: self.crop.y + y,
            width: TILE_SIZE.min(self.crop.width - x),
            height: TILE_SIZE.min(self.crop.height - y),
        }
    }

    /// An empty buffer for the samples of tile `index`.
    pub fn start_tile(&self, index: usize) -> Tile {
        Tile::new(index, self.tile_bounds(index), self.scale)
    }

    /// Adds what a tile gathered.
    pub fn add(&self, tile: &Tile) {
        let mut pixels = lock(&self.tiles[tile.index()]);
        for (p, t) in pixels.iter_mut().zip(tile.pixels()) {
            p.sum.add(&t.sum);
            p.weight += t.weight;
        }
        drop(pixels);
        if tile.dropped().count > 0 {
            lock(&self.dropped).add(tile.dropped());
        }
    }

    /// Samples left out so far.
    pub fn dropped(&self) -> Dropped {
        lock(&self.dropped).clone()
    }

    /// The picture: mean radiance per pixel in W·sr⁻¹·m⁻² per channel; black where there is no sample yet.
    pub fn develop(&self) -> Picture {
        let mut picture = Picture::new(self.crop.width, self.crop.height);
        for (index, tile) in self.tiles.iter().enumerate() {
            let c = self.tile_bounds(index);
            for (i, p) in lock(tile).iter().enumerate() {
                let (x, y) = (i as u32 % c.width + c.x - self.crop.x, i as u32 / c.width + c.y - self.crop.y);
                picture.set(x, y, p.mean(self.scale));
            }
        }
        picture
    }
}

impl Pixel {
    fn mean(&self, scale: Scale) -> Rgb {
        if self.weight == 0 {
            return Rgb::BLACK;
        }
        let [r, g, b] = self.sum.to_f64(scale).map(|s| float::saturate_to_f32(s / self.weight as f64));
        Rgb::new(r, g, b)
    }
}

/// A poisoned lock means that a thread panicked; the sums are still whole, for they are added without failing.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

#[cfg(test)]
mod tests;
