//! A film's sums as planes of 32-bit whole numbers, for files: what a checkpoint or a shard keeps, bit for bit.
//!
//! Each 128-bit sum is four planes, the lowest bits first, in two's complement: `snell.sum.R.0` … `snell.sum.B.3` for radiance,
//! `snell.weight.0` … for weights, `snell.mean.0.0` … for each mean beside radiance, and `snell.number.0` … for whole numbers.
//! The second of a film's parts has `snell.1.sum.R.0` … and so on.

use super::exact::Scale;
use super::extras::ExtraSums;
use super::{Extras, Film, Pixel, lock};
use crate::image::{Plane, PlaneValues};

/// Planes that a 128-bit sum takes.
pub(super) const LIMBS: usize = 4;

/// Bits of one.
const LIMB_BITS: usize = 32;

/// What the four 128-bit sums of a pixel are called.
pub(super) const SUMS: [&str; LIMBS] = ["sum.R", "sum.G", "sum.B", "weight"];

/// Part `limb` of a sum.
pub(super) fn limb(sum: i128, limb: usize) -> u32 {
    (sum >> (limb * LIMB_BITS)) as u32
}

/// The sum that has these parts.
pub(super) fn from_limbs(limbs: [u32; LIMBS]) -> i128 {
    limbs.iter().rev().fold(0, |sum, &limb| sum << LIMB_BITS | u128::from(limb)).cast_signed()
}

impl Pixel {
    pub(super) fn sums(&self) -> [i128; LIMBS] {
        let [r, g, b] = self.sum.units();
        [r, g, b, self.weight]
    }

    pub(super) fn add_sums(&mut self, [r, g, b, weight]: [i128; LIMBS]) {
        self.sum.add_units([r, g, b]);
        self.weight = self.weight.wrapping_add(weight);
    }
}

impl Film {
    /// What it keeps: the scale of radiance, and whatever is beside it.
    pub fn kept(&self) -> (Scale, Option<&Extras>) {
        (self.scale, self.extras.as_ref().map(|film| &film.extras))
    }

    /// A copy of all sums, as they are now.
    #[must_use]
    pub fn copied(&self) -> Self {
        let copy = |tiles: &[std::sync::Mutex<Vec<Pixel>>]| tiles.iter().map(|t| lock(t).clone().into()).collect();
        Self {
            tiles: copy(&self.tiles),
            extras: self.extras.as_ref().map(super::ExtraFilm::copied),
            dropped: self.dropped().into(),
            kernel: self.kernel,
            ..*self
        }
    }

    /// All sums as planes of whole numbers, row by row; without the samples that were left out.
    pub fn to_planes(&self) -> Vec<Plane> {
        let mut planes = self.empty_planes();
        let means = self.extras.as_ref().map_or(0, |e| e.extras.means.len());
        let numbers = self.extras.as_ref().map_or(0, |e| 1 + e.extras.numbers);
        for index in 0..self.tiles.len() {
            let pixels = lock(&self.tiles[index]);
            let count = pixels.len() / self.parts;
            let places: Vec<usize> = (0..count).map(|i| self.flat_place(index, i)).collect();
            let mut put = |plane: usize, values: &mut dyn Iterator<Item = u32>| {
                let PlaneValues::Whole(to) = &mut planes[plane].values else { return };
                places.iter().zip(values).for_each(|(&place, value)| to[place] = value);
            };
            for (which, part) in (0..self.sums()).flat_map(|s| (0..LIMBS).map(move |l| (s, l))) {
                let pixels = pixels.iter().skip(which / SUMS.len() * count);
                put(which * LIMBS + part, &mut pixels.map(|p| limb(p.sums()[which % SUMS.len()], part)));
            }
            let Some(extras) = &self.extras else { continue };
            let tile = extras.tile(index);
            for (which, part) in (0..means).flat_map(|s| (0..LIMBS).map(move |l| (s, l))) {
                let plane = (self.sums() + which) * LIMBS + part;
                put(plane, &mut tile.sums().skip(which).step_by(means).map(|sum| limb(sum, part)));
            }
            for which in 0..numbers {
                let plane = (self.sums() + means) * LIMBS + which;
                put(plane, &mut tile.numbers().skip(which).step_by(numbers));
            }
        }
        planes
    }

    /// The planes that [`Self::to_planes`] fills, in its order.
    fn empty_planes(&self) -> Vec<Plane> {
        let zeros = || PlaneValues::Whole(vec![0; self.pixels.0.pixels() as usize]);
        self.plane_names().into_iter().map(|name| Plane { name, values: zeros() }).collect()
    }

    /// Sums of radiance and weights of a pixel, over all parts.
    fn sums(&self) -> usize {
        self.parts * SUMS.len()
    }

    /// What the planes are called.
    fn plane_names(&self) -> Vec<String> {
        let (means, numbers) = self.extras.as_ref().map_or((0, 0), |e| (e.extras.means.len(), 1 + e.extras.numbers));
        let of_part = |part: usize| if part == 0 { "snell".to_owned() } else { format!("snell.{part}") };
        let sums = (0..self.parts).flat_map(|p| SUMS.iter().map(move |name| format!("{}.{name}", of_part(p))));
        let sums = sums.chain((0..means).map(|m| format!("snell.mean.{m}")));
        let sums = sums.flat_map(|name| (0..LIMBS).map(move |l| format!("{name}.{l}")));
        sums.chain((0..numbers).map(|n| format!("snell.number.{n}"))).collect()
    }

    /// Adds what planes hold to the sums; `plane` gives the values of the plane of a name, row by row.
    ///
    /// Fails, with the name, where a plane is missing or has not one value for each pixel; nothing is added then.
    pub fn add_planes<'a>(&self, plane: impl Fn(&str) -> Option<&'a [u32]>) -> Result<(), String> {
        let size = self.pixels.0.pixels() as usize;
        let named = |name: &String| plane(name).filter(|p| p.len() == size).ok_or_else(|| name.clone());
        let planes: Vec<&[u32]> = self.plane_names().iter().map(named).collect::<Result<_, _>>()?;
        for index in 0..self.tiles.len() {
            let count = self.pixels.bounds(index).pixels() as usize;
            let places: Vec<usize> = (0..count).map(|i| self.flat_place(index, i)).collect();
            let sum = |which: usize, place: usize| {
                let limbs = &planes[which * LIMBS..][..LIMBS];
                from_limbs([limbs[0][place], limbs[1][place], limbs[2][place], limbs[3][place]])
            };
            let mut pixels = lock(&self.tiles[index]);
            pixels.resize(self.parts * count, Pixel::default());
            for (part, pixels) in pixels.chunks_mut(count).enumerate() {
                let first = part * SUMS.len();
                for (pixel, &place) in pixels.iter_mut().zip(&places) {
                    pixel.add_sums([0, 1, 2, 3].map(|which| sum(first + which, place)));
                }
            }
            if let Some(extras) = &self.extras {
                let means = extras.extras.means.len();
                let numbers = &planes[(self.sums() + means) * LIMBS..];
                let mut other = ExtraSums::new(&extras.extras, count);
                for (i, &place) in places.iter().enumerate() {
                    let means = (0..means).map(|m| sum(self.sums() + m, place));
                    other.set(i, means, numbers.iter().map(|n| n[place]));
                }
                extras.add_tile(index, &other, count);
            }
        }
        Ok(())
    }

    /// Adds the sums of a film of the same pixels that keeps the same; `None`, and nothing is added, where it is not such a one.
    pub fn add_film(&self, other: &Self) -> Option<()> {
        if self.pixels.0 != other.pixels.0 || self.parts != other.parts || self.kept() != other.kept() {
            return None;
        }
        for (index, (tile, others)) in self.tiles.iter().zip(&other.tiles).enumerate() {
            let count = self.pixels.bounds(index).pixels() as usize;
            let mut tile = lock(tile);
            tile.resize(self.parts * count, Pixel::default());
            tile.iter_mut().zip(lock(others).iter()).for_each(|(pixel, o)| pixel.add_sums(o.sums()));
            if let (Some(extras), Some(others)) = (&self.extras, &other.extras)
                && !others.tile(index).is_empty()
            {
                extras.add_tile(index, &others.tile(index), count);
            }
        }
        self.add_dropped(&other.dropped());
        Some(())
    }

    /// Adds samples that were left out elsewhere.
    pub fn add_dropped(&self, dropped: &super::Dropped) {
        lock(&self.dropped).add(dropped);
    }

    /// Position of pixel `i` of tile `index` among all pixels, row by row.
    pub(super) fn flat_place(&self, index: usize, i: usize) -> usize {
        let (x, y) = self.place(index, i);
        y as usize * self.pixels.0.width as usize + x as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_four_words() {
        for sum in [0, 1, -1, i128::MAX, i128::MIN, 0x0123_4567_89ab_cdef_0011_2233_4455_6677] {
            assert_eq!(from_limbs([0, 1, 2, 3].map(|l| limb(sum, l))), sum);
        }
        assert_eq!([0, 1, 2, 3].map(|l| limb(-2, l)), [u32::MAX - 1, u32::MAX, u32::MAX, u32::MAX]);
    }
}
