//! The buffer that one thread gathers a tile's samples in.

use super::exact::Scale;
use super::extras::{ExtraSums, Extras};
use super::kernel::{Kernel, ONE, product};
use super::{Dropped, Pixel, SampleId};
use crate::image::Area;
use crate::spectrum::Rgb;
use glam::Vec2;

/// Sums of the pixels that a tile's samples reach, since the tile was started.
pub struct Tile {
    bounds: Area,
    /// The pixels that have sums here: those of the picture that are in the tile or in its border.
    reach: Area,
    scale: Scale,
    /// The radiance that no channel of a sample exceeds.
    most: f32,
    kernel: Option<Kernel>,
    pixels: Vec<Pixel>,
    /// What is kept beside radiance, if anything is.
    extras: Option<Box<(Extras, ExtraSums)>>,
    dropped: Dropped,
}

impl Tile {
    pub(super) fn new(bounds: Area, reach: Area, (scale, most): (Scale, f32), kernel: Option<Kernel>) -> Self {
        let pixels = vec![Pixel::default(); reach.pixels() as usize];
        Self { bounds, reach, scale, most, kernel, pixels, extras: None, dropped: Dropped::default() }
    }

    pub(super) fn with_extras(self, extras: &Extras) -> Self {
        let sums = ExtraSums::new(extras, self.pixels.len());
        Self { extras: Some(Box::new((extras.clone(), sums))), ..self }
    }

    /// Adds what another tile of the same pixels of the same film gathered, which leaves that one empty.
    pub fn absorb(&mut self, other: &mut Self) {
        debug_assert_eq!(self.bounds, other.bounds, "another tile");
        for (pixel, o) in self.pixels.iter_mut().zip(&mut other.pixels) {
            pixel.add(&std::mem::take(o));
        }
        if let (Some(own), Some(others)) = (&mut self.extras, &mut other.extras) {
            let (extras, sums) = &mut **own;
            sums.absorb(extras, &mut others.1);
        }
        self.dropped.add(&std::mem::take(&mut other.dropped));
    }

    /// The pixels in which it takes samples, in the whole film's coordinates.
    pub fn bounds(&self) -> Area {
        self.bounds
    }

    /// The pixels that have sums here.
    pub(super) fn reach(&self) -> Area {
        self.reach
    }

    /// The sums of `count` pixels of a row from (x, y) on, all of them within its reach.
    pub(super) fn row(&self, x: i32, y: i32, count: u32) -> &[Pixel] {
        let first = self.reach.index(x, y);
        &self.pixels[first..first + count as usize]
    }

    /// The sums of all pixels within its reach, row by row.
    pub(super) fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    pub(super) fn pixels_mut(&mut self) -> &mut [Pixel] {
        &mut self.pixels
    }

    /// What it keeps beside radiance, and the sums of that.
    pub(super) fn kept(&self) -> Option<(&Extras, &ExtraSums)> {
        self.extras.as_deref().map(|(extras, sums)| (extras, sums))
    }

    pub(super) fn kept_mut(&mut self) -> Option<(&Extras, &mut ExtraSums)> {
        self.extras.as_deref_mut().map(|(extras, sums)| (&*extras, sums))
    }

    /// What it gathered beside radiance.
    pub(super) fn extras(&self) -> Option<&ExtraSums> {
        self.extras.as_deref().map(|(_, sums)| sums)
    }

    pub(super) fn dropped(&self) -> &Dropped {
        &self.dropped
    }

    /// Counts the radiance of one sample of one of the tile's pixels; `position` tells, if that matters, where in the
    /// pixel it was taken, in [0, 1)². A value that is not finite or does not fit counts as no sample at all, and is
    /// remembered, as is one that is negative, which counts.
    #[inline]
    pub fn add_sample(&mut self, id: SampleId, radiance: Rgb, position: impl FnOnce() -> Vec2) {
        let radiance = self.clamped(radiance);
        if let Some(kernel) = &self.kernel {
            let kernel = *kernel;
            return self.splat(&kernel, id, radiance, position());
        }
        let pixel = &mut self.pixels[self.reach.index(id.x, id.y)];
        if pixel.sum.push(radiance, self.scale) {
            pixel.weight += i128::from(ONE);
            self.dropped.look_at(id, radiance);
        } else {
            self.dropped.push(id, radiance);
        }
    }

    /// A radiance within what is allowed; what is not finite stays so.
    #[inline]
    fn clamped(&self, radiance: Rgb) -> Rgb {
        let brightest = radiance.0.max_element();
        if brightest > self.most && brightest.is_finite() { radiance * (self.most / brightest) } else { radiance }
    }

    fn splat(&mut self, kernel: &Kernel, id: SampleId, radiance: Rgb, position: Vec2) {
        let Some(value) = self.scale.factors(radiance) else { return self.dropped.push(id, radiance) };
        self.dropped.look_at(id, radiance);
        let (taps_x, taps_y) = (kernel.taps(position.x), kernel.taps(position.y));
        let Area { x: left, y: top, width, height } = self.reach;
        let (x, across) = taps_x.within(id.x, left, left + width.cast_signed());
        let (y, down) = taps_y.within(id.y, top, top + height.cast_signed());
        for (row, &wy) in (y..).zip(down) {
            let first = self.reach.index(x, row);
            for (pixel, &wx) in self.pixels[first..].iter_mut().zip(across) {
                let weight = product(wx, wy);
                pixel.sum.push_weighted(&value, weight);
                pixel.weight += i128::from(weight);
            }
        }
    }

    /// Counts a sample as [`Self::add_sample`] does and, if its radiance counts, the values of what the film keeps beside
    /// radiance.
    pub fn add_sample_with(&mut self, id: SampleId, radiance: Rgb, position: impl Fn() -> Vec2, values: &[f64]) {
        let dropped = self.dropped.count;
        self.add_sample(id, radiance, &position);
        if self.dropped.count > dropped {
            return;
        }
        let Some((extras, sums)) = self.extras.as_deref_mut() else { return };
        let reach = self.reach;
        if reach.contains(id.x, id.y) {
            sums.count(extras, reach.index(id.x, id.y));
        }
        let Some(kernel) = &self.kernel else {
            return sums.push(extras, reach.index(id.x, id.y), values, ONE);
        };
        let position = position();
        let (taps_x, taps_y) = (kernel.taps(position.x), kernel.taps(position.y));
        let (x, across) = taps_x.within(id.x, reach.x, reach.x + reach.width.cast_signed());
        let (y, down) = taps_y.within(id.y, reach.y, reach.y + reach.height.cast_signed());
        for (row, &wy) in (y..).zip(down) {
            let first = reach.index(x, row);
            for (pixel, &wx) in (first..).zip(across) {
                sums.push(extras, pixel, values, product(wx, wy));
            }
        }
    }

    /// Sets the whole numbers of a pixel, which its first sample tells; those of a pixel in the border are of no use.
    pub fn set_numbers(&mut self, x: i32, y: i32, numbers: &[u32]) {
        if let Some((extras, sums)) = self.extras.as_deref_mut()
            && self.reach.contains(x, y)
        {
            sums.set_numbers(extras, self.reach.index(x, y), numbers);
        }
    }
}
