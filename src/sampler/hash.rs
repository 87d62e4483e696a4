//! Integer hashes.

use super::word::Word;

/// A bijection of 64 bits in which every input bit moves every output bit: the finaliser of SplitMix64 (Steele, Lea and
/// Flood 2014, *Fast Splittable Pseudorandom Number Generators*, figure 16; Stafford's variant 13), after adding its
/// increment so that zero does not map to zero.
#[inline]
pub fn mix64(x: u64) -> u64 {
    let mut z = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A bijection of 32 bits in which every input bit moves every output bit: the finaliser of MurmurHash3 (Appleby 2011).
#[inline(always)]
pub(super) fn mix32<W: Word>(x: W) -> W {
    x.fold(16).scaled(0x85eb_ca6b).fold(13).scaled(0xc2b2_ae35).fold(16)
}

/// A word for purpose `purpose` of set `set`, from a stream's two words of key.
#[inline(always)]
pub(super) fn keyed<W: Word>(key: [W; 2], set: u32, purpose: u32) -> W {
    let salt = mix64(u64::from(set) << 32 | u64::from(purpose)) as u32;
    mix32(mix32(key[0].xor_constant(salt)).plus(key[1]))
}
