//! 32-bit words, one or sixteen at a time: what the samplers are written in, so that a path's numbers are the same bits
//! whether they are asked for alone or for a whole wave.

use fearless_simd::prelude::*;
use fearless_simd::u32x16;

/// Spreads consecutive numbers over all words: 2³² over the golden ratio, made odd.
pub(super) const GOLDEN: u32 = 0x9e37_79b9;

/// A word, or a vector of words; arithmetic is modulo 2³².
pub(super) trait Word: Copy {
    /// x + y.
    fn plus(self, y: Self) -> Self;
    /// x + c.
    fn plus_constant(self, c: u32) -> Self;
    /// x · y.
    fn times(self, y: Self) -> Self;
    /// x · c.
    fn scaled(self, c: u32) -> Self;
    /// x ⊕ y.
    fn xor(self, y: Self) -> Self;
    /// x ⊕ c.
    fn xor_constant(self, c: u32) -> Self;
    /// x ∧ c.
    fn and(self, c: u32) -> Self;
    /// x ∨ c.
    fn or(self, c: u32) -> Self;
    /// x << n.
    fn left(self, n: u32) -> Self;
    /// x >> n.
    fn right(self, n: u32) -> Self;
    /// x where bit `bit` of `of` is set, else 0.
    fn where_bit(self, of: Self, bit: u32) -> Self;

    /// x ⊕ (x >> n).
    #[inline(always)]
    fn fold(self, n: u32) -> Self {
        self.xor(self.right(n))
    }

    /// The bits in reverse order.
    #[inline(always)]
    fn reversed(self) -> Self {
        let x = self.swapped(1, 0x5555_5555);
        let x = x.swapped(2, 0x3333_3333);
        let x = x.swapped(4, 0x0f0f_0f0f);
        let x = x.swapped(8, 0x00ff_00ff);
        x.left(16).xor(x.right(16))
    }

    /// Neighbouring groups of `n` bits exchanged; `mask` has the lower group of each pair.
    #[inline(always)]
    fn swapped(self, n: u32, mask: u32) -> Self {
        self.right(n).and(mask).xor(self.and(mask).left(n))
    }
}

impl Word for u32 {
    #[inline(always)]
    fn plus(self, y: Self) -> Self {
        self.wrapping_add(y)
    }
    #[inline(always)]
    fn plus_constant(self, c: u32) -> Self {
        self.wrapping_add(c)
    }
    #[inline(always)]
    fn times(self, y: Self) -> Self {
        self.wrapping_mul(y)
    }
    #[inline(always)]
    fn scaled(self, c: u32) -> Self {
        self.wrapping_mul(c)
    }
    #[inline(always)]
    fn xor(self, y: Self) -> Self {
        self ^ y
    }
    #[inline(always)]
    fn xor_constant(self, c: u32) -> Self {
        self ^ c
    }
    #[inline(always)]
    fn and(self, c: u32) -> Self {
        self & c
    }
    #[inline(always)]
    fn or(self, c: u32) -> Self {
        self | c
    }
    #[inline(always)]
    fn left(self, n: u32) -> Self {
        self << n
    }
    #[inline(always)]
    fn right(self, n: u32) -> Self {
        self >> n
    }
    #[inline(always)]
    fn where_bit(self, of: Self, bit: u32) -> Self {
        self & (of >> bit & 1).wrapping_neg()
    }
    #[inline(always)]
    fn reversed(self) -> Self {
        self.reverse_bits()
    }
}

impl<S: Simd> Word for u32x16<S> {
    #[inline(always)]
    fn plus(self, y: Self) -> Self {
        self + y
    }
    #[inline(always)]
    fn plus_constant(self, c: u32) -> Self {
        self + c
    }
    #[inline(always)]
    fn times(self, y: Self) -> Self {
        self * y
    }
    #[inline(always)]
    fn scaled(self, c: u32) -> Self {
        self * c
    }
    #[inline(always)]
    fn xor(self, y: Self) -> Self {
        self ^ y
    }
    #[inline(always)]
    fn xor_constant(self, c: u32) -> Self {
        self ^ c
    }
    #[inline(always)]
    fn and(self, c: u32) -> Self {
        self & c
    }
    #[inline(always)]
    fn or(self, c: u32) -> Self {
        self | c
    }
    #[inline(always)]
    fn left(self, n: u32) -> Self {
        self << n
    }
    #[inline(always)]
    fn right(self, n: u32) -> Self {
        self >> n
    }
    #[inline(always)]
    fn where_bit(self, of: Self, bit: u32) -> Self {
        (of & (1 << bit)).simd_eq(0).select(Word::xor(self, self), self)
    }
}
