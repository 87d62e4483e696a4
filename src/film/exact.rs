//! Exact sums of radiance: 128-bit fixed point, scaled to the scene's brightest light.
//!
//! With 2ᴱ above the largest radiance that any light of the scene emits, a sum counts in units of 2^(E − 64):
//!
//! - A sample is rounded once to that unit (to nearest, ties to even), before anything is added: a function of the
//!   sample alone. f32 values of at least 2^(E − 41), that is 5·10⁻¹³ of the brightest light, are not rounded at all.
//! - Every value below 2^(E + 31) fits, two billion times the brightest light, and 2³² of them can be added without
//!   overflow (31 + 64 + 32 = 127 bits). A value that does not fit is refused, like one that is not finite, and counted.
//! - Weights of a reconstruction filter are integers, too, so that a value times a weight is exact before it is rounded
//!   to the unit.
//!
//! Quantities other than radiance have scales of their own, and are f64 when they come ([`Scale::weighted`]).

use super::kernel::WEIGHT_BITS;
use crate::spectrum::Rgb;

/// Bits below the scale's 2ᴱ.
const FRACTION_BITS: i32 = 64;
/// Bits that a value may have above the scale's 2ᴱ.
const HEADROOM_BITS: i32 = 31;
/// Bits of an f32 mantissa without the hidden one, and the bias of its exponent.
const MANTISSA_BITS: i32 = 23;
const EXPONENT_BIAS: i32 = 127;

/// The exponent E of a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    exponent: i32,
}

impl Scale {
    /// The scale for a scene whose brightest light emits `radiance` (in its largest channel); for a scene without light
    /// any scale serves.
    pub fn for_radiance(radiance: f32) -> Self {
        if !(radiance > 0.0 && radiance.is_finite()) {
            return Self { exponent: 0 };
        }
        // The smallest E with radiance < 2ᴱ.
        Self { exponent: libm::frexpf(radiance).1 }
    }

    /// The scale for a quantity whose magnitude is expected to be below 2 to the power of `exponent`.
    pub fn for_exponent(exponent: i32) -> Self {
        Self { exponent }
    }

    /// The exponent E.
    pub fn exponent(self) -> i32 {
        self.exponent
    }

    /// `value` times a weight in units of 2^(E − 64), rounded to nearest: a function of the two alone, so that sums do not
    /// depend on the order. What does not fit becomes the largest that does, and what is not a number becomes zero.
    #[inline]
    pub(super) fn weighted(self, value: f64, weight: i64) -> i128 {
        /// Just below 2^(64 + 31): as many samples can be added as of radiance.
        const LARGEST: f64 = ((1u128 << (FRACTION_BITS + HEADROOM_BITS)) - (1u128 << 42)) as f64;
        // A weight has 28 bits; where the product has more than 53 it is rounded here already.
        let product = libm::ldexp(value * weight as f64, FRACTION_BITS - WEIGHT_BITS.cast_signed() - self.exponent);
        product.clamp(-LARGEST, LARGEST).round_ties_even() as i128
    }

    /// A sum in units of 2^(E − 64), rounded once.
    #[inline]
    pub(super) fn value(self, sum: i128) -> f64 {
        /// Bias of an f64's exponent, and bits of its mantissa.
        const BIAS: i32 = 1023;
        const MANTISSA_BITS: u32 = 52;
        // A normal number, as exponents are those of f32: the product is exact.
        let unit = f64::from_bits(((self.exponent - FRACTION_BITS + BIAS) as u64) << MANTISSA_BITS);
        sum as f64 * unit
    }

    /// Magnitude of `value` and the power of two that makes it units of 2^(E − 64); `None` where it is not finite or
    /// does not fit.
    #[inline]
    fn split(self, value: f32) -> Option<(u32, i32)> {
        let bits = value.to_bits();
        let biased = ((bits >> MANTISSA_BITS) & 0xff) as i32;
        let fraction = bits & ((1 << MANTISSA_BITS) - 1);
        // Denormals have the exponent of the smallest normal number and no hidden bit.
        let (mantissa, exponent) = if biased == 0 {
            (fraction, 1 - EXPONENT_BIAS)
        } else {
            (fraction | 1 << MANTISSA_BITS, biased - EXPONENT_BIAS)
        };
        if biased == 0xff || exponent >= self.exponent + HEADROOM_BITS {
            return None;
        }
        Some((mantissa, exponent - MANTISSA_BITS - self.exponent + FRACTION_BITS))
    }

    /// `value` in units of 2^(E − 64); `None` where it is not finite or does not fit.
    #[inline]
    fn quantize(self, value: f32) -> Option<i128> {
        let (mantissa, shift) = self.split(value)?;
        let magnitude = if shift >= 0 { i128::from(mantissa) << shift } else { round_shift(mantissa, -shift) };
        Some(if value.is_sign_negative() { -magnitude } else { magnitude })
    }

    /// A colour to be added with weights; `None` if a channel is not finite or does not fit.
    #[inline]
    pub(super) fn factors(self, value: Rgb) -> Option<[Factor; 3]> {
        let [r, g, b] = value.to_array().map(|v| self.factor(v));
        Some([r?, g?, b?])
    }

    #[inline]
    fn factor(self, value: f32) -> Option<Factor> {
        let (mantissa, shift) = self.split(value)?;
        let shift = shift - WEIGHT_BITS.cast_signed();
        if shift < -MAX_ROUNDED_BITS {
            return Some(Factor { mantissa: 0, shift: 0 });
        }
        let magnitude = i64::from(mantissa);
        Some(Factor { mantissa: if value.is_sign_negative() { -magnitude } else { magnitude }, shift })
    }
}

/// Bits of a product of an f32's mantissa and a weight; whatever is shifted farther down is below half a unit.
const MAX_ROUNDED_BITS: i32 = MANTISSA_BITS + 1 + WEIGHT_BITS.cast_signed() + 1;

/// A value that is going to be multiplied by weights: mantissa · 2^shift, in units of the sum and of weights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factor {
    mantissa: i64,
    shift: i32,
}

impl Factor {
    /// Its product with a weight of at most one, in units of the sum: exact, or rounded once, to nearest.
    #[inline]
    fn times(self, weight: i64) -> i128 {
        let product = self.mantissa * weight;
        if self.shift >= 0 {
            return i128::from(product) << self.shift;
        }
        i128::from((product + (1 << (-self.shift - 1))) >> -self.shift)
    }
}

/// mantissa / 2^shift, to nearest, ties to even.
fn round_shift(mantissa: u32, shift: i32) -> i128 {
    if shift > MANTISSA_BITS + 2 {
        return 0;
    }
    let (m, half) = (u64::from(mantissa), 1u64 << (shift - 1));
    let (quotient, rest) = (m >> shift, m & ((1 << shift) - 1));
    let up = rest > half || (rest == half && quotient & 1 == 1);
    i128::from(quotient + u64::from(up))
}

/// An exact sum of colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExactRgb([i128; 3]);

impl ExactRgb {
    /// Adds a colour; refuses it whole, and says so, if a channel is not finite or does not fit.
    #[inline]
    #[must_use]
    pub fn push(&mut self, value: Rgb, scale: Scale) -> bool {
        let [r, g, b] = value.to_array();
        let (Some(r), Some(g), Some(b)) = (scale.quantize(r), scale.quantize(g), scale.quantize(b)) else {
            return false;
        };
        self.add(&Self([r, g, b]));
        true
    }

    /// Adds a colour times a weight.
    #[inline]
    pub(super) fn push_weighted(&mut self, value: &[Factor; 3], weight: i64) {
        self.add(&Self(value.map(|v| v.times(weight))));
    }

    /// Adds another sum of the same scale.
    #[inline]
    pub fn add(&mut self, other: &Self) {
        for (s, o) in self.0.iter_mut().zip(other.0) {
            // Cannot wrap below 2³² samples, which is more than a pixel's samples can be numbered.
            *s = s.wrapping_add(o);
        }
    }

    /// 2^`times` times the sums.
    #[inline]
    #[must_use]
    pub(super) fn repeated(self, times: u32) -> Self {
        Self(self.0.map(|s| s << times))
    }

    /// The sums in units of the scale.
    pub(super) fn units(&self) -> [i128; 3] {
        self.0
    }

    /// Adds sums in units of the scale.
    pub(super) fn add_units(&mut self, units: [i128; 3]) {
        self.add(&Self(units));
    }

    /// The sum, rounded once.
    pub fn to_f64(&self, scale: Scale) -> [f64; 3] {
        self.0.map(|s| scale.value(s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_exactly() {
        for radiance in [1.0f32, 18.4, 1e30, 1e-30] {
            let scale = Scale::for_radiance(radiance);
            for factor in [1.0f32, -1.0, 0.3, 1e-10, 12345.678, 2e8] {
                let v = radiance * factor;
                let mut sum = ExactRgb::default();
                assert!(sum.push(Rgb::splat(v), scale), "{v}");
                assert_eq!(sum.to_f64(scale)[0], f64::from(v), "radiance {radiance}");
            }
        }
    }

    #[test]
    fn products_with_weights_are_exact_or_rounded_once() {
        let scale = Scale::for_radiance(1.0);
        let one = 1 << WEIGHT_BITS;
        for weight in [one, one / 2 + 1, -(one / 7), 1, 0, -1] {
            let w = weight as f64 / one as f64;
            for v in [0.0f32, 1.0, -0.3, 1e9, -1e-7, 1.7e-15, 3e-20, 1e-30, f32::from_bits(1)] {
                let mut sum = ExactRgb::default();
                sum.push_weighted(&scale.factors(Rgb::splat(v)).unwrap(), weight);
                // 53 bits hold the product; half a unit is 2⁻⁶⁴.
                let error = (sum.to_f64(scale)[0] - f64::from(v) * w).abs();
                assert!(error <= libm::ldexp(1.0, -64), "{v} times {w}: off by {error}");
                if v.abs() > 1e-2 {
                    assert_eq!(error, 0.0, "{v} times {w}");
                }
            }
        }
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e13] {
            assert!(scale.factors(Rgb::new(1.0, bad, 1.0)).is_none(), "{bad}");
        }
    }

    #[test]
    fn values_that_do_not_fit_are_refused_whole() {
        let scale = Scale::for_radiance(1.0);
        let mut sum = ExactRgb::default();
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e13] {
            assert!(!sum.push(Rgb::new(1.0, bad, 1.0), scale), "{bad}");
        }
        assert_eq!(sum, ExactRgb::default());
    }

    #[test]
    fn doubles_are_summed_with_their_weights_and_clamped() {
        let one = 1 << WEIGHT_BITS;
        for exponent in [-30, 0, 7] {
            let scale = Scale::for_exponent(exponent);
            let unit = libm::ldexp(1.0, exponent);
            for v in [0.0, 0.3, -0.7, 1e9, -1e-12].map(|v| v * unit) {
                for weight in [one, -one / 3, 1, 0] {
                    let got = scale.value(scale.weighted(v, weight));
                    let want = v * (weight as f64 / one as f64);
                    // The product and the unit of the sum, and its conversion.
                    assert!((got - want).abs() <= f64::EPSILON * want.abs() + unit * libm::ldexp(1.0, -65));
                }
            }
            let most = libm::ldexp(1.0, exponent + HEADROOM_BITS);
            assert_eq!(scale.value(scale.weighted(f64::NAN, one)), 0.0);
            for (v, sign) in [(f64::INFINITY, 1.0), (f64::NEG_INFINITY, -1.0), (2.0 * most, 1.0)] {
                let clamped = scale.value(scale.weighted(v, one)) * sign;
                assert!(clamped < most && clamped > 0.999 * most, "{v}: {clamped}");
            }
        }
    }

    #[test]
    fn small_values_round_to_nearest_even() {
        let scale = Scale { exponent: 0 };
        let unit = libm::ldexpf(1.0, -FRACTION_BITS);
        for (v, expected) in [(0.5, 0), (0.50001, 1), (1.5, 2), (2.5, 2), (2.75, 3), (1e-30, 0), (-1.5, -2)] {
            assert_eq!(scale.quantize(v * unit), Some(expected), "{v} units");
        }
        assert_eq!(scale.quantize(f32::from_bits(1)), Some(0));
        assert_eq!(scale.quantize(-0.0), Some(0));
    }
}
