//! A reconstruction filter as tiles use it: the weights of one sample for the pixels around it, in fixed point.

use crate::image::Filter;
use std::f64::consts::PI;

/// Bits of a weight below one. With them a weight of at most one times an f32 is exact in 64 bits (1 + 28 + 24 bits and a
/// sign), and a weight is as fine as the f32 that Mitsuba has.
pub(super) const WEIGHT_BITS: u32 = 28;

/// The weight of a sample where every sample counts fully.
pub(super) const ONE: i64 = 1 << WEIGHT_BITS;

/// Most pixels along an axis that one sample reaches.
const MAX_TAPS: usize = 2 * Filter::MAX_RADIUS as usize + 1;

/// A filter other than the box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kernel {
    filter: Filter,
    radius: f64,
    /// Factor to fixed point: a power of two that makes the largest weight at most [`ONE`]. That a pixel is a quotient
    /// takes the power out again.
    scale: f64,
    /// What the filter needs for every sample and can be computed once: see [`gaussian`] and [`lanczos`].
    constants: [f64; 2],
}

/// Weights along one axis for the pixels from `first` on, relative to the sample's own pixel.
pub(super) struct Taps {
    pub(super) first: i32,
    count: usize,
    weights: [i64; MAX_TAPS],
}

impl Taps {
    /// Those for the pixels from `start` to before `end`, when the sample's own pixel is `pixel`; and the first of these.
    #[inline]
    pub(super) fn within(&self, pixel: i32, start: i32, end: i32) -> (i32, &[i64]) {
        let first = pixel + self.first;
        let from = start.max(first).min(end);
        let to = end.min(first + self.count as i32).max(from);
        (from, &self.weights[(from - first).max(0) as usize..(to - first).max(0) as usize])
    }
}

impl Kernel {
    /// `None` for the box filter, which needs no weights.
    pub(super) fn new(filter: Filter) -> Option<Self> {
        let constants = match filter {
            Filter::Box => return None,
            Filter::Gaussian { stddev } => [1.0 / (stddev * stddev), libm::exp(-1.0 / (stddev * stddev))],
            Filter::Lanczos { lobes } => [libm::sin(PI / f64::from(lobes)), libm::cos(PI / f64::from(lobes))],
            _ => [0.0; 2],
        };
        // The smallest power of two that no value exceeds.
        let exponent = libm::frexp(filter.bound().next_down()).1;
        let scale = libm::ldexp(1.0, WEIGHT_BITS.cast_signed() - exponent);
        Some(Self { filter, radius: filter.radius(), scale, constants })
    }

    /// The weights of a sample at `u` in [0, 1) within its pixel.
    #[inline]
    pub(super) fn taps(&self, u: f32) -> Taps {
        // Distance from the sample to the middle of its own pixel; u has 24 bits, so that nothing here is rounded.
        let own = 0.5 - f64::from(u);
        let first = (-own - self.radius).ceil();
        let count = ((self.radius - own).floor() - first) as usize + 1;
        let mut taps = Taps { first: first as i32, count: count.min(MAX_TAPS), weights: [0; MAX_TAPS] };
        let out = &mut taps.weights[..count.min(MAX_TAPS)];
        let put = |slot: &mut i64, value: f64| *slot = (value * self.scale).round_ties_even() as i64;
        let x = first + own;
        match self.filter {
            Filter::Gaussian { .. } => {
                out.iter_mut().zip(gaussian(x, self.constants)).for_each(|(slot, v)| put(slot, v));
            }
            Filter::Lanczos { lobes } => {
                out.iter_mut().zip(lanczos(x, lobes, self.constants)).for_each(|(slot, v)| put(slot, v));
            }
            filter => out.iter_mut().enumerate().for_each(|(i, slot)| put(slot, filter.value(x + i as f64))),
        }
        taps
    }
}

/// The product of two weights.
#[inline]
pub(super) fn product(a: i64, b: i64) -> i64 {
    (a * b + (ONE >> 1)) >> WEIGHT_BITS
}

/// The Gaussian at x, x + 1, x + 2, …: with a = 1/σ², g(x + 1) = g(x)·exp(−a(2x + 1)/2), and that factor itself shrinks
/// by exp(−a) at each step, so that two exponentials serve for all.
fn gaussian(x: f64, [a, shrink]: [f64; 2]) -> impl Iterator<Item = f64> {
    let cut = Filter::GAUSSIAN_BIAS;
    let mut g = libm::exp(-0.5 * a * x * x);
    let mut factor = libm::exp(-0.5 * a * (2.0 * x + 1.0));
    std::iter::repeat_with(move || {
        let value = (g - cut).max(0.0);
        g *= factor;
        factor *= shrink;
        value
    })
}

/// The Lanczos filter at x, x + 1, x + 2, …: sin(πx) changes its sign at each step, and sin(πx / lobes) is turned by the
/// angle π/lobes, of which sine and cosine are given.
fn lanczos(x: f64, lobes: u32, [sine, cosine]: [f64; 2]) -> impl Iterator<Item = f64> {
    let lobes = f64::from(lobes);
    let mut x = x;
    let mut wave = libm::sin(PI * x);
    let (mut s, mut c) = libm::sincos(PI * x / lobes);
    std::iter::repeat_with(move || {
        let value = if x == 0.0 {
            1.0
        } else if x.abs() >= lobes {
            0.0
        } else {
            wave * s * lobes / (PI * PI * x * x)
        };
        x += 1.0;
        wave = -wave;
        (s, c) = (s * cosine + c * sine, c * cosine - s * sine);
        value
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Weights are the filter's values to one unit of the fixed point, wherever the sample lies.
    #[test]
    fn taps_are_the_filters_values() {
        for filter in [
            Filter::Tent { radius: 1.0 },
            Filter::Tent { radius: 0.25 },
            Filter::Tent { radius: 7.3 },
            Filter::Gaussian { stddev: 0.5 },
            Filter::Gaussian { stddev: 0.01 },
            Filter::Gaussian { stddev: 8.0 },
            Filter::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 },
            Filter::Mitchell { b: -20.0, c: 7.0 },
            Filter::CatmullRom,
            Filter::Lanczos { lobes: 1 },
            Filter::Lanczos { lobes: 3 },
            Filter::Lanczos { lobes: 32 },
        ] {
            let kernel = Kernel::new(filter).unwrap();
            for u in (0..1 << 24).step_by(99_991).map(|i| i as f32 / (1 << 24) as f32).chain([0.5, 1e-7]) {
                let taps = kernel.taps(u);
                let border = filter.border() as i32;
                let (start, all) = taps.within(0, -border, border + 1);
                assert!(start == taps.first.max(-border) && all.len() <= MAX_TAPS);
                for k in -border..=border {
                    let got = usize::try_from(k - start).ok().and_then(|i| all.get(i)).copied().unwrap_or(0);
                    let want = filter.value(f64::from(k) + 0.5 - f64::from(u)) * kernel.scale;
                    assert!((got as f64 - want).abs() <= 1.0, "{filter:?}, u {u}, pixel {k}: {got}, not {want}");
                    assert!(got.abs() <= ONE, "{filter:?}: {got}");
                }
            }
        }
    }

    #[test]
    fn taps_are_cut_to_the_pixels_that_there_are() {
        let taps = Kernel::new(Filter::Tent { radius: 2.0 }).unwrap().taps(0.5);
        assert_eq!(taps.first, -2);
        let whole = taps.within(10, 0, 100);
        assert_eq!((whole.0, whole.1.len()), (8, 5));
        assert_eq!(taps.within(10, 9, 11), (9, &whole.1[1..3]));
        assert_eq!(taps.within(10, 30, 40).1, [0_i64; 0]);
        assert_eq!(taps.within(10, 0, 5).1, [0_i64; 0]);
    }
}
