//! The buffer that one thread gathers a tile's samples in.

use super::exact::Scale;
use super::{Dropped, Pixel, SampleId};
use crate::image::Crop;
use crate::spectrum::Rgb;

/// Sums of a tile's pixels since the tile was started.
pub struct Tile {
    index: usize,
    bounds: Crop,
    scale: Scale,
    pixels: Vec<Pixel>,
    dropped: Dropped,
}

impl Tile {
    pub(super) fn new(index: usize, bounds: Crop, scale: Scale) -> Self {
        let pixels = vec![Pixel::default(); (bounds.width * bounds.height) as usize];
        Self { index, bounds, scale, pixels, dropped: Dropped::default() }
    }

    /// The pixels, in the whole film's coordinates.
    pub fn bounds(&self) -> Crop {
        self.bounds
    }

    pub(super) fn index(&self) -> usize {
        self.index
    }

    pub(super) fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    pub(super) fn dropped(&self) -> &Dropped {
        &self.dropped
    }

    /// Counts the radiance of one sample of one of the tile's pixels. A value that is not finite or does not fit counts
    /// as no sample at all, and is remembered.
    #[inline]
    pub fn add_sample(&mut self, id: SampleId, radiance: Rgb) {
        let pixel = &mut self.pixels[((id.y - self.bounds.y) * self.bounds.width + id.x - self.bounds.x) as usize];
        if pixel.sum.push(radiance, self.scale) {
            pixel.weight += 1;
        } else {
            self.dropped.push(id);
        }
    }
}
