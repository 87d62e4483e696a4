//! Independent uniform numbers: a hash of (pixel, sample, set), nothing carried along.

use super::hash::mix64;
use super::{Set, to_unit};

/// The four numbers of a set.
#[inline]
pub(super) fn set(key: u64, index: u32, set: u32) -> Set {
    let base = mix64(key ^ mix64(u64::from(set) << 32 | u64::from(index)));
    let (a, b) = (base, mix64(base));
    [to_unit(a as u32), to_unit((a >> 32) as u32), to_unit(b as u32), to_unit((b >> 32) as u32)]
}
