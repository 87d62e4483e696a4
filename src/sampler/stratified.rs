//! Stratified numbers for any count of samples: correlated multi-jittered points (Kensler 2013, *Correlated Multi-Jittered
//! Sampling*), a pattern of its own for each pair of numbers, visited in an order of its own.
//!
//! Of N samples each has a row of its own out of N, and a cell of its own out of m × n with m·n ≥ N; where m·n = N it has a
//! column of its own out of N, too. Each sample alone is uniform, whatever N is, as are its row and, given that, its place in the
//! row. The first samples of N are a random subset of them, so a render that is stopped has the error of independent numbers
//! without replacement; samples beyond N belong to further patterns.

use super::hash::{keyed, mix32};
use super::word::GOLDEN;

/// The most strata; with more samples there are several patterns. Reason: numbers have 24 bits.
const MOST_STRATA: u32 = 1 << 24;

/// The bits of the numbers 2·`pair` and 2·`pair` + 1 of set `set` of sample `index` of `samples`.
pub(super) fn pair(key: [u32; 2], index: u32, samples: u32, set: u32, pair: u32) -> [u32; 2] {
    let strata = samples.clamp(1, MOST_STRATA);
    let (pattern, index) = (index / strata, index % strata);
    // Purposes of a pair: the order of samples, of columns, of rows, two offsets.
    let word = |purpose: u32| mix32(keyed(key, set, 5 * pair + purpose).wrapping_add(pattern.wrapping_mul(GOLDEN)));
    let columns = strata.isqrt();
    let rows = strata.div_ceil(columns);
    let sample = permuted(index, strata, word(0));
    let column = permuted(sample % columns, columns, word(1));
    let row = permuted(sample / columns, rows, word(2));
    let offset = |purpose| mix32(word(purpose).wrapping_add(mix32(sample.wrapping_mul(GOLDEN))));
    [within(column * rows + row, columns * rows, offset(3)), within(sample, strata, offset(4))]
}

/// The place within stratum `stratum` of `strata` that is `offset`·2⁻³² from its start, in units of 2⁻³².
fn within(stratum: u32, strata: u32, offset: u32) -> u32 {
    ((u64::from(stratum) << 32 | u64::from(offset)) / u64::from(strata)) as u32
}

/// A permutation of the numbers below `n`, chosen by `seed`: one of those below the next power of two, again and again until
/// the result is below n.
fn permuted(mut i: u32, n: u32, seed: u32) -> u32 {
    let mask = n.next_power_of_two() - 1;
    loop {
        i = permuted_bits(i, mask, seed);
        if i < n {
            return i;
        }
    }
}

/// A permutation of the numbers up to `mask`, which is 2ᵏ − 1. Sums, odd multiples and shifts to the right that are added are
/// one-to-one in k bits; the first two carry changes upwards, the last downwards.
fn permuted_bits(mut i: u32, mask: u32, seed: u32) -> u32 {
    /// Each takes a bit of what tells two bits' permutations from uniform ones.
    const ROUNDS: u32 = 8;
    /// Bits of the seed that are new in each round.
    const NEW: u32 = 4;
    let down = mask.count_ones() / 2;
    for round in 0..ROUNDS {
        let word = seed.rotate_right(NEW * round);
        i = i.wrapping_add(word >> 16).wrapping_mul(word | 1) & mask;
        if down > 0 {
            i ^= i >> down;
        }
    }
    // The last sum is the same for all numbers and uniform: so is the image of each.
    i.wrapping_add(mix32(seed)) & mask
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn permutations_are_one_to_one() {
        for n in (1..40).chain([64, 100, 257]) {
            for seed in 0..20 {
                let mut seen: Vec<u32> = (0..n).map(|i| permuted(i, n, seed)).collect();
                seen.sort_unstable();
                assert!(seen.into_iter().eq(0..n), "{n}");
            }
        }
    }

    #[test]
    fn permutations_take_each_number_everywhere() {
        // Hypothesis: over seeds the images of a number, and of a pair, are uniform. 20000 seeds; each bin is within six standard
        // deviations: some 400 bins at 2e-9 a bin.
        const SEEDS: u32 = 20_000;
        for n in [2, 3, 4, 5, 7, 8] {
            for (a, b) in [(0, 1), (n - 1, 0)] {
                let mut count = vec![0u32; (n * n) as usize];
                for seed in 0..SEEDS {
                    let seed = mix32(seed);
                    count[(permuted(a, n, seed) * n + permuted(b, n, seed)) as usize] += 1;
                }
                let p = 1.0 / f64::from(n * (n - 1));
                let bound = 6.0 * (f64::from(SEEDS) * p * (1.0 - p)).sqrt();
                for (i, &found) in count.iter().enumerate() {
                    let same = i as u32 / n == i as u32 % n;
                    let expected = if same { 0.0 } else { p * f64::from(SEEDS) };
                    let off = (f64::from(found) - expected).abs();
                    assert!(
                        off <= bound && (!same || found == 0),
                        "{n}, {a} and {b}, bin {i}: {found}, not {expected}"
                    );
                }
            }
        }
    }
}
