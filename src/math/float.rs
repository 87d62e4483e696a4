//! Floating-point facts that error bounds are built from.

/// The unit roundoff of f32, 2⁻²⁴: one rounded operation has a relative error of at most this.
pub const UNIT_ROUNDOFF: f32 = f32::EPSILON * 0.5;

/// The unit roundoff of f64, 2⁻⁵³.
pub const UNIT_ROUNDOFF_F64: f64 = f64::EPSILON * 0.5;

/// The largest f32 below one; uniform numbers never exceed it.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - UNIT_ROUNDOFF;

/// Bound on the relative error of `n` rounded operations in sequence: n·u / (1 − n·u)
/// (Higham 2002, *Accuracy and Stability of Numerical Algorithms*, lemma 3.1; pbrt-v4 section 6.8.1).
pub const fn gamma(n: u32) -> f32 {
    let nu = n as f32 * UNIT_ROUNDOFF;
    nu / (1.0 - nu)
}

/// The smaller of two numbers; `b` where either is NaN. Compiles to one instruction, unlike `f32::min`.
#[inline(always)]
pub fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger of two numbers; `b` where either is NaN. Compiles to one instruction, unlike `f32::max`.
#[inline(always)]
pub fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// √max(x, 0): the square root of something that only rounding can have made negative.
#[inline(always)]
pub fn safe_sqrt(x: f32) -> f32 {
    max(x, 0.0).sqrt()
}

/// x².
#[inline(always)]
pub fn sqr(x: f32) -> f32 {
    x * x
}

/// Rounds to f32; what is beyond its range becomes its largest number of that sign.
#[inline]
pub fn saturate_to_f32(x: f64) -> f32 {
    (x as f32).clamp(f32::MIN, f32::MAX)
}

/// `x` rounded to f32 so that the result is not below it.
#[inline]
pub fn round_up(x: f64) -> f32 {
    let y = x as f32;
    if f64::from(y) < x { y.next_up() } else { y }
}

/// `x` rounded to f32 so that the result is not above it.
#[inline]
pub fn round_down(x: f64) -> f32 {
    let y = x as f32;
    if f64::from(y) > x { y.next_down() } else { y }
}
