//! What several tiles, each with samples of its own number, show together of some pixels.

use super::{Film, PartMean, Pixel, Tile};
use crate::film::exact::Scale;
use crate::image::Area;

/// Sums of some pixels over tiles.
pub struct Gathered {
    area: Area,
    scale: Scale,
    pixels: Vec<Pixel>,
}

impl Gathered {
    /// Nothing yet, for some pixels of a film.
    pub fn new(film: &Film, area: Area) -> Self {
        Self { area, scale: film.scale, pixels: vec![Pixel::default(); area.pixels() as usize] }
    }

    /// Adds what a tile has of these pixels, as if each of its samples had been there 2^`times` times.
    pub fn add(&mut self, tile: &Tile, times: u32) {
        let shared = self.area.intersection(tile.reach());
        for y in shared.y..shared.y + shared.height.cast_signed() {
            let first = self.area.index(shared.x, y);
            for (pixel, own) in self.pixels[first..].iter_mut().zip(tile.row(shared.x, y, shared.width)) {
                pixel.add(&own.repeated(times));
            }
        }
    }

    /// What all of that shows, row by row.
    pub fn means(&self) -> impl Iterator<Item = PartMean> {
        self.pixels.iter().map(|pixel| pixel.part_mean(self.scale))
    }
}
