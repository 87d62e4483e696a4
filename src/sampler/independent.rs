//! Independent uniform numbers: a hash of (pixel, sample, set, dimension), nothing carried along.

use super::hash::{keyed, mix32};
use super::word::{GOLDEN, Word};

/// The bits of number `d` of set `set` of sample `index`.
#[inline(always)]
pub(super) fn bits<W: Word>(key: [W; 2], index: W, set: u32, d: usize) -> W {
    mix32(keyed(key, set, d as u32).plus(mix32(index.scaled(GOLDEN))))
}
