//! Owen-scrambled Sobol' points by hashing (Burley 2020, *Practical Hash-based Owen Scrambling*).
//!
//! Each set takes the first four Sobol' dimensions, visits them in an order of its own (a nested uniform scramble of
//! the sample's index, which keeps every aligned block of 2ᵏ samples together, so that any power-of-two prefix stays
//! well distributed), and scrambles each dimension on its own. Sets are independent of each other: padding.
//!
//! An Owen scramble flips each bit of a number by a random function of the bits above it. The Laine–Karras hash makes
//! each bit depend on the bits *below*, so it works on reversed numbers; its constants are those found by Vegdahl
//! (2021, *Building a Better LK Hash*). The generator matrices here give Sobol' numbers already reversed, which saves
//! one of the two reversals.

use super::hash::mix64;
use super::to_unit;

/// Bits of an index, and of a number.
const BITS: usize = 32;

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

/// Sums of [`REVERSED_COLUMNS`] over the sixteen values of each four bits of the index: 2 KiB that stay in the cache.
static NIBBLES: [[[u32; 4]; 16]; BITS / 4] = nibbles();

const fn nibbles() -> [[[u32; 4]; 16]; BITS / 4] {
    let mut table = [[[0u32; 4]; 16]; BITS / 4];
    let mut n = 0;
    while n < BITS / 4 {
        let mut v = 0;
        while v < 16 {
            let mut bit = 0;
            while bit < 4 {
                if (v >> bit) & 1 == 1 {
                    let mut d = 0;
                    while d < 4 {
                        table[n][v][d] ^= REVERSED_COLUMNS[4 * n + bit][d];
                        d += 1;
                    }
                }
                bit += 1;
            }
            v += 1;
        }
        n += 1;
    }
    table
}

/// The Laine–Karras style permutation with Vegdahl's constants: bit i of the result depends on bits 0..=i of `x`.
#[inline]
fn laine_karras(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x
}

/// The first four Sobol' dimensions of point `index`, each bit-reversed.
#[inline]
fn reversed_points(index: u32) -> [u32; 4] {
    let mut p = [0u32; 4];
    for (n, table) in NIBBLES.iter().enumerate() {
        let entry = &table[(index >> (4 * n)) as usize & 15];
        for d in 0..4 {
            p[d] ^= entry[d];
        }
    }
    p
}

/// A set of which no number has been computed to its end: the point, and what its dimensions are scrambled by.
#[derive(Clone, Copy, Debug)]
pub(super) struct SobolSet {
    points: [u32; 4],
    seeds: [u32; 4],
}

impl SobolSet {
    /// Set number `set` of sample `index`.
    #[inline]
    pub(super) fn new(key: u64, index: u32, set: u32) -> Self {
        let h = mix64(key ^ u64::from(set));
        let g = mix64(h);
        let shuffled = laine_karras(index.reverse_bits(), h as u32).reverse_bits();
        // Four words of hash, and one derived: five seeds that look independent to the scramble.
        let seeds = [(h >> 32) as u32, g as u32, (g >> 32) as u32, (g >> 16) as u32 ^ (h >> 16) as u32];
        Self { points: reversed_points(shuffled), seeds }
    }

    /// Number `d` of the set.
    #[inline]
    pub(super) fn get(&self, d: usize) -> f32 {
        to_unit(laine_karras(self.points[d], self.seeds[d]).reverse_bits())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unscrambled_points_are_the_published_ones() {
        // The first eight points of dimensions 1 to 4 (Joe and Kuo's own generator prints them in Gray-code order; here
        // in natural order: point i of dimension 1 is the radical inverse of i).
        let eighths = |i: u32| reversed_points(i).map(|v| v.reverse_bits() >> 29);
        assert_eq!((0..8).map(|i| eighths(i)[0]).collect::<Vec<_>>(), [0, 4, 2, 6, 1, 5, 3, 7]);
        assert_eq!((0..8).map(|i| eighths(i)[1]).collect::<Vec<_>>(), [0, 4, 6, 2, 5, 1, 3, 7]);
        for d in 0..4 {
            let mut seen = (0..8).map(|i| eighths(i)[d]).collect::<Vec<_>>();
            seen.sort_unstable();
            assert_eq!(seen, (0..8).collect::<Vec<_>>(), "dimension {d} is not a (0, 3, 1)-net");
        }
    }
}
