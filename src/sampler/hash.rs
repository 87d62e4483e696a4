//! Integer hashes.

/// A bijection of 64 bits in which every input bit moves every output bit: the finaliser of SplitMix64 (Steele, Lea and
/// Flood 2014, *Fast Splittable Pseudorandom Number Generators*, figure 16; Stafford's variant 13), after adding its
/// increment so that zero does not map to zero.
#[inline]
pub(super) fn mix64(x: u64) -> u64 {
    let mut z = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
