//! Independent uniform numbers: a hash of (pixel, sample, set), nothing carried along.

use super::hash::mix64;
use super::to_unit;

/// A set: two words of hash, two numbers in each.
#[derive(Clone, Copy, Debug)]
pub(super) struct IndependentSet([u64; 2]);

impl IndependentSet {
    /// Set number `set` of sample `index`.
    #[inline]
    pub(super) fn new(key: u64, index: u32, set: u32) -> Self {
        let first = mix64(key ^ mix64(u64::from(set) << 32 | u64::from(index)));
        Self([first, mix64(first)])
    }

    /// Number `d` of the set.
    #[inline]
    pub(super) fn get(&self, d: usize) -> f32 {
        to_unit((self.0[d / 2] >> (32 * (d % 2))) as u32)
    }
}
