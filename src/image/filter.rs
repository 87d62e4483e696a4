//! Reconstruction filters: how much a sample counts for a pixel, as a function of their distance.
//!
//! All filters are separable: the weight of a sample for a pixel is `value(dx) · value(dy)`, with dx and dy the distances
//! of the sample from the middle of the pixel along the two axes, in pixels. A filter need not integrate to one, for a
//! pixel is the weighted mean of its samples.

use super::{Area, Crop};
use std::f64::consts::PI;

/// A reconstruction filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// Every sample counts fully for the pixel it falls into, and for no other.
    Box,
    /// 1 − |x| / radius.
    Tent {
        /// Where it reaches zero, in pixels; positive.
        radius: f64,
    },
    /// exp(−x² / 2σ²) − exp(−8): a Gaussian that is cut off, and reaches zero, at four standard deviations.
    Gaussian {
        /// Standard deviation σ in pixels; positive.
        stddev: f64,
    },
    /// The two-parameter family of cubics of D. P. Mitchell and A. N. Netravali, Reconstruction Filters in Computer
    /// Graphics, SIGGRAPH 1988, equation 8.
    Mitchell {
        /// B of the paper: blur.
        b: f64,
        /// C of the paper: ringing.
        c: f64,
    },
    /// The member of Mitchell's family that interpolates: B = 0, C = ½.
    CatmullRom,
    /// sinc(x) · sinc(x / lobes), with sinc(x) = sin(πx) / πx.
    Lanczos {
        /// Where the window reaches zero, in pixels; at least 1.
        lobes: u32,
    },
}

impl Filter {
    /// Mitsuba's filter where none is named.
    pub const DEFAULT: Self = Self::Gaussian { stddev: 0.5 };

    /// Widest radius in pixels. Reason: a thread gathers samples in a square of pixels that has a border as wide, and one
    /// sample is added to (2·radius)² pixels; what is wider than this blurs more than any picture needs.
    pub const MAX_RADIUS: f64 = 32.0;

    /// Standard deviations at which a Gaussian is cut off.
    const GAUSSIAN_CUT: f64 = 4.0;

    /// exp(−8), what a Gaussian still is there, and is subtracted so that it ends at zero.
    pub const GAUSSIAN_BIAS: f64 = 3.354_626_279_025_118_5e-4;

    /// Distance in pixels from which on it is zero.
    pub fn radius(&self) -> f64 {
        match *self {
            Self::Box => 0.5,
            Self::Tent { radius } => radius,
            Self::Gaussian { stddev } => Self::GAUSSIAN_CUT * stddev,
            Self::Mitchell { .. } | Self::CatmullRom => 2.0,
            Self::Lanczos { lobes } => f64::from(lobes),
        }
    }

    /// How many pixels beyond its own a sample can reach: pixel middles are half a pixel from the pixel's edge.
    pub fn border(&self) -> u32 {
        (self.radius() - 0.5).ceil().max(0.0) as u32
    }

    /// Value at distance `x` in pixels; zero from the radius on.
    pub fn value(&self, x: f64) -> f64 {
        let x = x.abs();
        match *self {
            // The middle of a pixel is less than half a pixel from a sample inside, or just that at its edge.
            Self::Box => f64::from(u8::from(x <= 0.5)),
            _ if x >= self.radius() => 0.0,
            Self::Tent { radius } => 1.0 - x / radius,
            Self::Gaussian { stddev } => libm::exp(-0.5 * (x / stddev) * (x / stddev)) - Self::GAUSSIAN_BIAS,
            Self::Mitchell { b, c } => mitchell(x, b, c),
            Self::CatmullRom => mitchell(x, 0.0, 0.5),
            Self::Lanczos { lobes } => sinc(x) * sinc(x / f64::from(lobes)),
        }
    }

    /// No value is larger in magnitude, but by rounding.
    pub fn bound(&self) -> f64 {
        let Self::Mitchell { b, c } = *self else { return 1.0 };
        // A cubic stays between its Bézier points: those of its pieces on [0, 1] and [1, 2], from the values and slopes
        // at the ends (1 − b/3 and 0; b/6 and −b/2 − c; 0 and 0).
        let (middle, end, third) = (1.0 - b / 3.0, b / 6.0, (0.5 * b + c) / 3.0);
        [middle, end, end + third, end - third].into_iter().fold(0.0, |m: f64, p| m.max(p.abs()))
    }

    /// The pixels in which samples are taken for the picture `crop`: its own, and with `sample_border` those around it
    /// from which a sample reaches into it.
    pub fn sampled_area(&self, crop: Crop, sample_border: bool) -> Area {
        let border = if sample_border { self.border() } else { 0 };
        Area::from(crop).grown(border)
    }
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { libm::sin(PI * x) / (PI * x) }
}

/// Equation 8 of the paper, for 0 ≤ x < 2.
fn mitchell(x: f64, b: f64, c: f64) -> f64 {
    let polynomial = if x < 1.0 {
        [6.0 - 2.0 * b, 0.0, -18.0 + 12.0 * b + 6.0 * c, 12.0 - 9.0 * b - 6.0 * c]
    } else {
        [8.0 * b + 24.0 * c, -12.0 * b - 48.0 * c, 6.0 * b + 30.0 * c, -b - 6.0 * c]
    };
    polynomial.iter().rev().fold(0.0, |sum, k| sum * x + k) / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILTERS: [Filter; 8] = [
        Filter::Box,
        Filter::Tent { radius: 1.0 },
        Filter::Tent { radius: 0.3 },
        Filter::DEFAULT,
        Filter::Gaussian { stddev: 0.8 },
        Filter::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 },
        Filter::CatmullRom,
        Filter::Lanczos { lobes: 3 },
    ];

    /// Values that Mitsuba 3.9.1 prints at these distances. It computes in single precision, and its Gaussian by a
    /// polynomial that is off by up to 5·10⁻⁴.
    #[test]
    fn values_are_mitsubas() {
        const X: [f64; 6] = [0.0, 0.25, 0.75, 1.3, 1.9, 2.2];
        for (filter, tolerance, want) in [
            (FILTERS[1], 1e-7, [1.0, 0.75, 0.25, 0.0, 0.0, 0.0]),
            (FILTERS[3], 5e-4, [0.999247, 0.882167, 0.324243, 0.033705, 0.000388, 0.0]),
            (FILTERS[5], 1e-6, [0.8888889, 0.7821181, 0.2560764, -0.0299446, -0.0029445, 0.0]),
            (FILTERS[6], 1e-6, [1.0, 0.8671875, 0.2265625, -0.0735003, -0.0045001, 0.0]),
            (FILTERS[7], 1e-6, [1.0, 0.8900670, 0.2701898, -0.1423301, -0.0237699, 0.0274327]),
            (Filter::Lanczos { lobes: 2 }, 1e-6, [1.0, 0.8773541, 0.2353467, -0.0864335, -0.0027135, 0.0]),
        ] {
            for (x, w) in X.into_iter().zip(want) {
                for x in [x, -x] {
                    let v = filter.value(x);
                    assert!((v - w).abs() <= tolerance, "{filter:?} at {x}: {v}, Mitsuba has {w}");
                }
            }
        }
    }

    #[test]
    fn values_in_closed_form() {
        let gaussian = Filter::Gaussian { stddev: 0.5 };
        assert_eq!(gaussian.value(0.0), 1.0 - Filter::GAUSSIAN_BIAS);
        assert_eq!(libm::exp(-8.0), Filter::GAUSSIAN_BIAS);
        assert_eq!(gaussian.value(0.5), libm::exp(-0.5) - libm::exp(-8.0));
        assert_eq!(Filter::CatmullRom.value(0.5), 9.0 / 16.0);
        assert_eq!(Filter::CatmullRom.value(1.5), -1.0 / 16.0);
        assert_eq!(Filter::CatmullRom.value(1.0), 0.0);
        assert_eq!(Filter::Mitchell { b: 1.0, c: 0.0 }.value(0.0), 4.0 / 6.0);
        let sinc2 = 2.0 / PI * (4.0 / PI) * libm::sin(PI / 4.0);
        assert!((Filter::Lanczos { lobes: 2 }.value(0.5) - sinc2).abs() < 1e-15);
    }

    #[test]
    fn the_bound_holds_and_is_close() {
        for filter in FILTERS.into_iter().chain([(9.0, -4.0), (-2.0, 3.0)].map(|(b, c)| Filter::Mitchell { b, c })) {
            let largest = (0..4000).map(|i| filter.value(f64::from(i) / 1000.0).abs()).fold(0.0, f64::max);
            assert!(largest <= filter.bound() * (1.0 + 4.0 * f64::EPSILON));
            assert!(filter.bound() <= 2.0 * largest, "{filter:?}: {largest}");
        }
    }

    #[test]
    fn every_filter_ends_at_its_radius_inside_its_border() {
        for filter in FILTERS {
            let r = filter.radius();
            assert_eq!(filter.value(r.next_up()), 0.0, "{filter:?}");
            // The pixel just beyond the border has its middle at least the radius away from any sample inside.
            assert!(f64::from(filter.border()) + 0.5 >= r, "{filter:?}");
        }
        let borders: Vec<u32> = FILTERS.iter().map(Filter::border).collect();
        // Those that Mitsuba 3.9.1 prints.
        assert_eq!(borders, [0, 1, 0, 2, 3, 2, 2, 3]);
    }
}
