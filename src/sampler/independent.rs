//! Independent uniform numbers: a hash of (pixel, sample, set, dimension), nothing carried along.

use super::hash::{keyed, mix32};
use super::word::Word;

/// Spreads consecutive indices over all words before they are mixed in: 2³² over the golden ratio, made odd.
const GOLDEN: u32 = 0x9e37_79b9;

/// The bits of number `d` of set `set` of sample `index`.
#[inline(always)]
pub(super) fn bits<W: Word>(key: [W; 2], index: W, set: u32, d: usize) -> W {
    mix32(keyed(key, set, d as u32).plus(mix32(index.scaled(GOLDEN))))
}
