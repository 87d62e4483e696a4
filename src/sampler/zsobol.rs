//! Sobol' points dealt out to neighbouring pixels along a Z-order curve, so that what one pixel lacks its neighbours have (Ahmed
//! and Wonka 2020, *Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels*).
//!
//! The film is cut into blocks of [`SIDE`]² pixels, each of which takes one Owen-scrambled Sobol' sequence for each set of numbers: 2ᵐ
//! consecutive points for each pixel, pixels in the order of the curve. So the points of each aligned square of 2ᵏ × 2ᵏ pixels
//! are a digital net, too: errors of neighbours make up for each other, and what is left of them is of high frequency. Within
//! each square the order of its four quadrants is a random one that depends on the square and on the set; without that sets
//! would be correlated, and neighbours in a row would be better spread than those in a column.
//!
//! It takes a count of samples that is known in advance and a power of two: with fewer, pixels are as well sampled as by
//! [`super::sobol`], but their errors have nothing to do with each other.

use super::hash::{keyed, mix32};
use super::sobol::{PURPOSE_SCRAMBLE, PURPOSE_SHUFFLE, laine_karras, reversed_point};
use super::word::{GOLDEN, Word};

/// Levels of the curve. Reason: errors are independent of each other only at distances of 32 pixels and more, where nobody looks
/// for noise; and with [`MOST_LOG_SAMPLES`] an index has 32 bits.
const LEVELS: u32 = 5;

/// Pixels along the side of a block.
const SIDE: u32 = 1 << LEVELS;

/// The largest binary logarithm of the number of samples a pixel.
pub const MOST_LOG_SAMPLES: u32 = 32 - 2 * LEVELS;

/// What a word of the set's key is for: the order of quadrants. Beyond those of [`super::sobol`].
const PURPOSE_ORDER: u32 = 0x100;

/// The block that a pixel is in.
pub(super) fn block(x: u32, y: u32) -> [u32; 2] {
    [x, y].map(|v| v >> LEVELS)
}

/// Sample `index` of a pixel with 2^`log_samples` of them: its number within the block, along the curve.
pub(super) fn index(x: u32, y: u32, index: u32, log_samples: u32) -> u32 {
    let place = spread(x % SIDE) | spread(y % SIDE) << 1;
    place << log_samples | index & ((1 << log_samples) - 1)
}

/// The lower bits of `v`, each followed by a zero.
fn spread(v: u32) -> u32 {
    (0..LEVELS).fold(0, |sum, bit| sum | (v >> bit & 1) << (2 * bit))
}

/// A set of which no number has been computed to its end.
#[derive(Clone, Copy, Debug)]
pub(super) struct ZSobolSet<W> {
    key: [W; 2],
    set: u32,
    /// The shuffled number of the pixel within its block, and below it that of the sample within its pixel.
    index: W,
}

impl<W: Word> ZSobolSet<W> {
    /// Set number `set` of the sample with number `index` in the block with this key.
    #[inline(always)]
    pub(super) fn new(key: [W; 2], index: W, log_samples: u32, set: u32) -> Self {
        let place = shuffled_place(keyed(key, set, PURPOSE_ORDER), index.right(log_samples));
        // The order of samples is each pixel's own.
        let seed = mix32(keyed(key, set, PURPOSE_SHUFFLE).plus(place.scaled(GOLDEN)));
        let mask = (1 << log_samples) - 1;
        let sample = laine_karras(index.and(mask).reversed().right(31 - log_samples).right(1), seed).and(mask);
        let sample = sample.reversed().right(31 - log_samples).right(1);
        Self { key, set, index: sample.xor(place.left(log_samples)) }
    }

    /// The bits of number `d` of the set.
    #[inline(always)]
    pub(super) fn bits(&self, d: usize) -> W {
        let point = reversed_point(self.index, true, d);
        laine_karras(point, keyed(self.key, self.set, PURPOSE_SCRAMBLE + d as u32)).reversed()
    }
}

/// A pixel's number along the curve, each digit of base 4 permuted as those above it and the key `seed` say.
#[inline(always)]
fn shuffled_place<W: Word>(seed: W, place: W) -> W {
    let mut shuffled = place.and(0);
    for level in (0..LEVELS).rev() {
        // The digits above with a one before them, so that no two levels have the same.
        let above = place.right(2 * level + 2).or(1 << (2 * (LEVELS - 1 - level)));
        let digit = permuted_digit(place.right(2 * level).and(3), mix32(seed.plus(above.scaled(GOLDEN))));
        shuffled = shuffled.xor(digit.left(2 * level));
    }
    shuffled
}

/// One of the 24 permutations of {0, 1, 2, 3}, chosen by `hash`: these are the affine maps of two bits, x ↦ A·x ⊕ b with a
/// regular A. Each has the same probability, within 2⁻¹⁶.
#[inline(always)]
fn permuted_digit<W: Word>(digit: W, hash: W) -> W {
    // The first column of A is one of 1, 2 and 3, ...
    let first = hash.right(16).scaled(3).right(16).plus_constant(1);
    // ... the second one of the other two: the next in the circle 1, 2, 3, or the one before, which is the sum of both.
    let next = first.plus_constant(1);
    let next = next.plus(next.right(2)).and(3);
    let second = next.xor(first.where_bit(hash, 0));
    hash.right(1).and(3).xor(first.where_bit(digit, 0)).xor(second.where_bit(digit, 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_permuted_in_all_ways_equally_often() {
        // Hypothesis: 24 permutations of equal probability. 24000 hashes, bins of 1000 ± 31: six standard deviations are a
        // false-alarm rate of 5e-8.
        let mut count = std::collections::BTreeMap::new();
        for i in 0..24_000u32 {
            let permuted: [u32; 4] = std::array::from_fn(|digit| permuted_digit(digit as u32, mix32(i)));
            let mut sorted = permuted;
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3]);
            *count.entry(permuted).or_insert(0i32) += 1;
        }
        assert!(count.len() == 24 && count.values().all(|n| (n - 1000).abs() < 186), "{count:?}");
    }

    #[test]
    fn places_are_shuffled_one_to_one() {
        let mut seen: Vec<u32> = (0..SIDE * SIDE).map(|place| shuffled_place(77, place)).collect();
        assert!(seen.iter().zip(0..).any(|(&a, b)| a != b));
        seen.sort_unstable();
        assert!(seen.into_iter().eq(0..SIDE * SIDE));
    }
}
