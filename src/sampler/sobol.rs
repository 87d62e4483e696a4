//! Owen-scrambled Sobol' points by hashing (Burley 2020, *Practical Hash-based Owen Scrambling*).
//!
//! Each set takes the first four Sobol' dimensions, visits them in an order of its own (a nested uniform scramble of the
//! lower sixteen bits of the sample's index, which keeps every aligned block of 2ᵏ samples together up to 2¹⁶, so that
//! any power-of-two prefix stays well distributed), and scrambles each dimension on its own. Sets are independent of
//! each other: padding.
//!
//! An Owen scramble flips each bit of a number by a random function of the bits above it. The Laine–Karras hash makes
//! each bit depend on the bits *below*, so it works on reversed numbers; its constants are those found by Vegdahl
//! (2021, *Building a Better LK Hash*). The generator matrices here take reversed indices and give reversed numbers, which
//! leaves one reversal a number.

use super::hash::keyed;
use super::word::Word;

/// Bits of an index, and of a number.
const BITS: usize = 32;

/// The lower bits of an index, which are shuffled. Those above choose among blocks of 2¹⁶ samples that are well
/// distributed each, and pay for their matrix columns only where a pixel has so many samples.
const SHUFFLED_BITS: u32 = 16;

/// Direction numbers of the first four dimensions (Joe and Kuo 2008, file new-joe-kuo-6.21201), with each column
/// bit-reversed: `REVERSED_COLUMNS[bit][dimension]`.
const REVERSED_COLUMNS: [[u32; 4]; BITS] = reversed_columns();

/// (degree s, coefficients a, initial m) of dimensions 2, 3 and 4; dimension 1 is the van der Corput sequence.
const PRIMITIVES: [(usize, u32, [u32; 3]); 3] = [(1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1])];

const fn reversed_columns() -> [[u32; 4]; BITS] {
    let mut columns = [[0u32; 4]; BITS];
    let mut k = 0;
    while k < BITS {
        // m = 1 for every k: the column is the bit below the binary point, reversed it is bit k itself.
        columns[k][0] = 1 << k;
        k += 1;
    }
    let mut d = 0;
    while d < 3 {
        let (s, a, initial) = PRIMITIVES[d];
        let mut m = [0u32; BITS];
        let mut k = 0;
        while k < BITS {
            if k < s {
                m[k] = initial[k];
            } else {
                // Joe and Kuo 2008, equation (3): coefficient a_j is bit s − 1 − j of a.
                let mut v = m[k - s] ^ (m[k - s] << s);
                let mut j = 1;
                while j < s {
                    if (a >> (s - 1 - j)) & 1 == 1 {
                        v ^= m[k - j] << j;
                    }
                    j += 1;
                }
                m[k] = v;
            }
            columns[k][d + 1] = (m[k] << (BITS - 1 - k)).reverse_bits();
            k += 1;
        }
        d += 1;
    }
    columns
}

/// The Laine–Karras style permutation with Vegdahl's constants: bit i of the result depends on bits 0..=i of `x`.
#[inline(always)]
pub(super) fn laine_karras<W: Word>(x: W, seed: W) -> W {
    let x = x.xor(x.scaled(0x3d20_adea));
    let x = x.plus(seed);
    let x = x.times(seed.right(16).or(1));
    let x = x.xor(x.scaled(0x0552_6c56));
    x.xor(x.scaled(0x53a2_2864))
}

/// The index of a sample, as the sets want it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Index<W> {
    /// The lower [`SHUFFLED_BITS`] bits, reversed.
    low: W,
    /// The others.
    high: W,
    /// Whether they are all zero.
    only_low: bool,
}

impl<W: Word> Index<W> {
    /// Of an index, or of indices that are all `below`.
    #[inline(always)]
    pub(super) fn new(index: W, below: u32) -> Self {
        let low = index.left(BITS as u32 - SHUFFLED_BITS).reversed();
        Self { low, high: index.right(SHUFFLED_BITS), only_low: below <= 1 << SHUFFLED_BITS }
    }
}

/// A set of which no number has been computed to its end.
#[derive(Clone, Copy, Debug)]
pub(super) struct SobolSet<W> {
    key: [W; 2],
    set: u32,
    /// The shuffled index; bit i is bit 15 − i of the index.
    low: W,
    index: Index<W>,
}

/// What the words of a set's key are for: shuffling the index, and from here on scrambling dimension 0, 1, 2 and 3.
pub(super) const PURPOSE_SHUFFLE: u32 = 0;
pub(super) const PURPOSE_SCRAMBLE: u32 = 1;

impl<W: Word> SobolSet<W> {
    /// Set number `set` of a sample.
    #[inline(always)]
    pub(super) fn new(key: [W; 2], index: Index<W>, set: u32) -> Self {
        let low = laine_karras(index.low, keyed(key, set, PURPOSE_SHUFFLE)).and((1 << SHUFFLED_BITS) - 1);
        Self { key, set, low, index }
    }

    /// The bits of number `d` of the set.
    #[inline(always)]
    pub(super) fn bits(&self, d: usize) -> W {
        let seed = keyed(self.key, self.set, PURPOSE_SCRAMBLE + d as u32);
        laine_karras(self.reversed_point(d), seed).reversed()
    }

    /// Dimension `d` of the point, bit-reversed.
    #[inline(always)]
    fn reversed_point(&self, d: usize) -> W {
        let zero = self.low.and(0);
        let point = reversed_product(zero, self.low, SHUFFLED_BITS, |bit| SHUFFLED_BITS - 1 - bit, d);
        if self.index.only_low {
            return point;
        }
        reversed_product(point, self.index.high, BITS as u32 - SHUFFLED_BITS, |bit| SHUFFLED_BITS + bit, d)
    }
}

/// Dimension `d` of a point, bit-reversed, of which `point` is what other bits of its index give: adds what `bits` bits of `index`
/// do, each of which is bit number `bit_of(bit)` of the point's index.
///
/// A loop: `Iterator::fold` is a function of its own that is not compiled for the vectors of its caller, and made all of a
/// render 1.4 times as long.
#[inline(always)]
pub(super) fn reversed_product<W: Word>(mut point: W, index: W, bits: u32, bit_of: impl Fn(u32) -> u32, d: usize) -> W {
    for bit in 0..bits {
        point = point.xor_where(index, bit, REVERSED_COLUMNS[bit_of(bit) as usize][d]);
    }
    point
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unscrambled_points_are_the_published_ones() {
        // The first eight points of dimensions 1 to 4 (Joe and Kuo's own generator prints them in Gray-code order; here
        // in natural order: point i of dimension 1 is the radical inverse of i).
        let unshuffled = |i: u32| {
            let index = Index::new(i, u32::MAX);
            SobolSet { key: [0; 2], set: 0, low: index.low, index }
        };
        let eighths = |i: u32| [0, 1, 2, 3].map(|d| unshuffled(i).reversed_point(d).reverse_bits() >> 29);
        assert_eq!((0..8).map(|i| eighths(i)[0]).collect::<Vec<_>>(), [0, 4, 2, 6, 1, 5, 3, 7]);
        assert_eq!((0..8).map(|i| eighths(i)[1]).collect::<Vec<_>>(), [0, 4, 6, 2, 5, 1, 3, 7]);
        for d in 0..4 {
            let mut seen = (0..8).map(|i| eighths(i)[d]).collect::<Vec<_>>();
            seen.sort_unstable();
            assert_eq!(seen, (0..8).collect::<Vec<_>>(), "dimension {d} is not a (0, 3, 1)-net");
        }
    }
}
