//! Owen-scrambled Sobol' points by hashing (Burley 2020, *Practical Hash-based Owen Scrambling*).
//!
//! Each set takes the first four Sobol' dimensions, visits them in an order of its own (a nested uniform scramble of the
//! lower sixteen bits of the sample's index, which keeps every aligned block of 2ᵏ samples together up to 2¹⁶, so that
//! any power-of-two prefix stays well distributed), and scrambles each dimension on its own. Sets are independent of
//! each other: padding.
//!
//! An Owen scramble flips each bit of a number by a random function of the bits above it. The Laine–Karras hash makes
//! each bit depend on the bits *below*, so it works on reversed numbers; its constants are those found by Vegdahl
//! (2021, *Building a Better LK Hash*). The generator matrices here give reversed numbers, which leaves one reversal a number.
//!
//! # Generator matrices without matrices
//!
//! Joe and Kuo's direction numbers v of a dimension with the primitive polynomial xˢ + Σ aⱼ·xˢ⁻ʲ satisfy v_k = Σ aⱼ·v_(k−j) ⊕
//! (v_(k−s) >> s), and as squaring is linear over GF(2), the same with all of j, s and the shift doubled any number of times. So the
//! matrix of twice as many columns is the matrix of half of them, twice, behind a few sums of aligned groups of bits: n bits
//! take 2·log₂ n or so shifted sums instead of n columns (for the second dimension, Pascal's triangle modulo 2, this is known:
//! for example Ahmed 2024, *An Implementation Algorithm of 2D Sobol Sequence Fast, Elegant, and Compact*).

use super::hash::keyed;
use super::word::Word;

/// Bits of an index, and of a number.
const BITS: u32 = 32;

/// The lower bits of an index, which are shuffled. Those above choose among blocks of 2¹⁶ samples that are well
/// distributed each, and pay for their matrix columns only where a pixel has so many samples.
const SHUFFLED_BITS: u32 = 16;

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
        let low = index.left(BITS - SHUFFLED_BITS).reversed();
        Self { low, high: index.right(SHUFFLED_BITS), only_low: below <= 1 << SHUFFLED_BITS }
    }
}

/// A set of which no number has been computed to its end.
#[derive(Clone, Copy, Debug)]
pub(super) struct SobolSet<W> {
    key: [W; 2],
    set: u32,
    /// The shuffled index.
    index: W,
    /// Whether it may have more than [`SHUFFLED_BITS`] bits.
    is_long: bool,
}

/// What the words of a set's key are for: shuffling the index, and from here on scrambling dimension 0, 1, 2 and 3.
pub(super) const PURPOSE_SHUFFLE: u32 = 0;
pub(super) const PURPOSE_SCRAMBLE: u32 = 1;

impl<W: Word> SobolSet<W> {
    /// Set number `set` of a sample.
    #[inline(always)]
    pub(super) fn new(key: [W; 2], index: Index<W>, set: u32) -> Self {
        let low = laine_karras(index.low, keyed(key, set, PURPOSE_SHUFFLE)).reversed().right(BITS - SHUFFLED_BITS);
        let is_long = !index.only_low;
        Self { key, set, index: if is_long { low.xor(index.high.left(SHUFFLED_BITS)) } else { low }, is_long }
    }

    /// The bits of number `d` of the set.
    #[inline(always)]
    pub(super) fn bits(&self, d: usize) -> W {
        let seed = keyed(self.key, self.set, PURPOSE_SCRAMBLE + d as u32);
        laine_karras(reversed_point(self.index, self.is_long, d), seed).reversed()
    }
}

/// Dimension `d` of the point with this index, bit-reversed; `is_long` if the index may have more than [`SHUFFLED_BITS`] bits.
#[inline(always)]
pub(super) fn reversed_point<W: Word>(index: W, is_long: bool, d: usize) -> W {
    match d {
        0 => index,
        1 => {
            let x = if is_long { pascal::<16, W>(index) } else { index };
            pascal::<1, W>(pascal::<2, W>(pascal::<4, W>(pascal::<8, W>(x))))
        }
        2 => {
            let x = if is_long { second_degree::<8, W>(index) } else { index };
            pascal::<1, W>(second_degree::<1, W>(second_degree::<2, W>(second_degree::<4, W>(x))))
        }
        _ => {
            let x = if is_long { third_degree::<8, W>(index) } else { index };
            let x = third_degree::<1, W>(third_degree::<2, W>(third_degree::<4, W>(x)));
            // The first three columns: 1, 3 and 1, reversed.
            x.xor(x.right(1).and(const { groups(3, 0, 1) }))
        }
    }
}

/// x + 1: of each pair of groups of `N` bits the upper one is added to the lower one.
#[inline(always)]
fn pascal<const N: u32, W: Word>(x: W) -> W {
    x.xor(x.right(N).and(const { groups(2 * N, 0, N) }))
}

/// x² + x + 1. Of four groups of `N` bits, from the lowest l₀, l₁, h₀, h₁, it makes l₀ ⊕ h₀ ⊕ h₁, l₁ ⊕ h₀, h₀ ⊕ h₁, h₁.
#[inline(always)]
fn second_degree<const N: u32, W: Word>(x: W) -> W {
    let x = x.xor(x.right(N).and(const { groups(4 * N, N, 2 * N) }));
    x.xor(x.right(2 * N).and(const { groups(4 * N, 0, N) }))
}

/// x³ + x + 1. Of six groups of `N` bits, from the lowest l₀, l₁, l₂, h₀, h₁, h₂, it makes l₀ ⊕ h₀ ⊕ h₂, l₁ ⊕ h₀ ⊕ h₁ ⊕ h₂,
/// l₂ ⊕ h₁ ⊕ h₂, h₀ ⊕ h₂, h₁, h₂.
#[inline(always)]
fn third_degree<const N: u32, W: Word>(x: W) -> W {
    let x = x.xor(x.right(2 * N).and(const { groups(6 * N, 3 * N, N) }));
    let low = x.right(3 * N).and(const { groups(6 * N, 0, 3 * N) });
    x.xor(low).xor(x.right(2 * N).and(const { groups(6 * N, N, 2 * N) }))
}

/// Of every `period` bits, `count` from the bit `first` on.
const fn groups(period: u32, first: u32, count: u32) -> u32 {
    let (mut mask, mut bit) = (0, 0);
    while bit < BITS {
        if bit % period >= first && bit % period < first + count {
            mask |= 1 << bit;
        }
        bit += 1;
    }
    mask
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Direction numbers of the first four dimensions (Joe and Kuo 2008, file new-joe-kuo-6.21201), with each column
    /// bit-reversed: `REVERSED_COLUMNS[bit][dimension]`.
    const REVERSED_COLUMNS: [[u32; 4]; BITS as usize] = reversed_columns();

    /// (degree s, coefficients a, initial m) of dimensions 2, 3 and 4; dimension 1 is the van der Corput sequence.
    const PRIMITIVES: [(usize, u32, [u32; 3]); 3] = [(1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1])];

    const fn reversed_columns() -> [[u32; 4]; BITS as usize] {
        let mut columns = [[0u32; 4]; BITS as usize];
        let mut k = 0;
        while k < BITS as usize {
            // m = 1 for every k: the column is the bit below the binary point, reversed it is bit k itself.
            columns[k][0] = 1 << k;
            k += 1;
        }
        let mut d = 0;
        while d < 3 {
            let (s, a, initial) = PRIMITIVES[d];
            let mut m = [0u32; BITS as usize];
            let mut k = 0;
            while k < BITS as usize {
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
                columns[k][d + 1] = (m[k] << (BITS as usize - 1 - k)).reverse_bits();
                k += 1;
            }
            d += 1;
        }
        columns
    }

    #[test]
    fn unscrambled_points_are_the_published_ones() {
        // The first eight points of dimensions 1 to 4 (Joe and Kuo's own generator prints them in Gray-code order; here
        // in natural order: point i of dimension 1 is the radical inverse of i).
        let eighths = |i: u32| [0, 1, 2, 3].map(|d| reversed_point(i, false, d).reverse_bits() >> 29);
        assert_eq!((0..8).map(|i| eighths(i)[0]).collect::<Vec<_>>(), [0, 4, 2, 6, 1, 5, 3, 7]);
        assert_eq!((0..8).map(|i| eighths(i)[1]).collect::<Vec<_>>(), [0, 4, 6, 2, 5, 1, 3, 7]);
        for d in 0..4 {
            let mut seen = (0..8).map(|i| eighths(i)[d]).collect::<Vec<_>>();
            seen.sort_unstable();
            assert_eq!(seen, (0..8).collect::<Vec<_>>(), "dimension {d} is not a (0, 3, 1)-net");
        }
    }

    #[test]
    fn groups_of_bits_are_as_good_as_columns() {
        for (bit, columns) in REVERSED_COLUMNS.iter().enumerate() {
            for (d, column) in columns.iter().enumerate() {
                // All is linear.
                assert_eq!(reversed_point(1 << bit, true, d), *column, "{bit} {d}");
                assert!(bit >= SHUFFLED_BITS as usize || reversed_point(1 << bit, false, d) == *column, "{bit} {d}");
            }
        }
    }
}
