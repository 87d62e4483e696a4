//! A tile's sums as 32-bit words, pixel by pixel, for files: what a checkpoint keeps of samples whose number is not the same everywhere.
//!
//! Sums are cut into words as those of a film are ([`super::sums`]).

use super::sums::{LIMBS, SUMS, from_limbs, limb};
use super::{Film, Pixel, Tile};

impl Film {
    /// What the words of one pixel of its tiles are called, in the order of their numbers: those of sums and weights, of means beside
    /// radiance, and whole numbers.
    pub fn word_names(&self) -> Vec<String> {
        let (_, extras) = self.kept();
        let (means, numbers) = extras.map_or((0, 0), |e| (e.means.len(), 1 + e.numbers));
        let sums = SUMS.into_iter().map(String::from).chain((0..means).map(|m| format!("mean.{m}")));
        let words = sums.flat_map(|sum| (0..LIMBS).map(move |l| format!("{sum}.{l}")));
        words.chain((0..numbers).map(|n| format!("number.{n}"))).collect()
    }
}

impl Tile {
    /// How many pixels have sums here.
    pub fn pixel_count(&self) -> usize {
        self.reach().pixels() as usize
    }

    /// Tells `put` every word: the number of its pixel, its own number as in [`Film::word_names`], and its value.
    pub fn words(&self, put: &mut impl FnMut(usize, usize, u32)) {
        for (i, pixel) in self.pixels().iter().enumerate() {
            let words = pixel.sums().into_iter().flat_map(|sum| (0..LIMBS).map(move |l| limb(sum, l)));
            words.enumerate().for_each(|(word, value)| put(i, word, value));
        }
        let Some((extras, sums)) = self.kept() else { return };
        let (first, means, numbers) = (SUMS.len() * LIMBS, extras.means.len(), 1 + extras.numbers);
        for (i, sum) in sums.sums().enumerate() {
            (0..LIMBS).for_each(|l| put(i / means, first + i % means * LIMBS + l, limb(sum, l)));
        }
        let first = first + means * LIMBS;
        sums.numbers().enumerate().for_each(|(i, number)| put(i / numbers, first + i % numbers, number));
    }

    /// Puts sums in the place of its own, of which `word` gives the words: of a pixel and a number, as [`Self::words`] has them.
    pub fn set_words(&mut self, word: &impl Fn(usize, usize) -> u32) {
        let sum = |pixel: usize, first: usize| from_limbs([0, 1, 2, 3].map(|l| word(pixel, first + l)));
        for (i, pixel) in self.pixels_mut().iter_mut().enumerate() {
            *pixel = Pixel::default();
            pixel.add_sums([0, 1, 2, 3].map(|which| sum(i, which * LIMBS)));
        }
        let count = self.pixel_count();
        let Some((extras, sums)) = self.kept_mut() else { return };
        let (first, means, numbers) = (SUMS.len() * LIMBS, extras.means.len(), 1 + extras.numbers);
        for i in 0..count {
            let of_means = (0..means).map(|m| sum(i, first + m * LIMBS));
            sums.set(i, of_means, (0..numbers).map(|n| word(i, first + means * LIMBS + n)));
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::film::exact::Scale;
    use crate::film::{Extras, Film, SampleId};
    use crate::image::{Crop, Filter};
    use crate::spectrum::Rgb;
    use glam::Vec2;
    use std::collections::BTreeMap;

    #[test]
    fn a_tile_is_its_words() {
        let crop = Crop { x: 0, y: 0, width: 20, height: 20 };
        let film = Film::new(crop, Filter::Gaussian { stddev: 0.5 }, false, Scale::for_exponent(3));
        let film = film.with_extras(Extras { means: vec![Scale::for_exponent(0), Scale::for_exponent(1)], numbers: 1 });
        let mut tile = film.start_tile(0);
        let id = SampleId { x: 2, y: 1, index: 0 };
        tile.add_sample_with(id, Rgb::new(1.0, -0.3, 1e-7), || Vec2::new(0.1, 0.7), &[0.3, -1.7]);
        tile.set_numbers(2, 1, &[77]);
        let mut words = BTreeMap::new();
        tile.words(&mut |pixel, word, value| assert!(words.insert((pixel, word), value).is_none()));
        assert_eq!(words.len(), tile.pixel_count() * film.word_names().len());
        let mut back = film.start_tile(0);
        back.set_words(&|pixel, word| words[&(pixel, word)]);
        let other = Film::new(crop, Filter::Gaussian { stddev: 0.5 }, false, Scale::for_exponent(3));
        let other = other.with_extras(film.kept().1.unwrap().clone());
        film.add(&tile, 0);
        other.add(&back, 0);
        assert_eq!(film.to_planes(), other.to_planes());
    }
}
