//! Intervals for positive quantities, and the normal distribution's quantiles.

/// Where the relative error lies, with some confidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Its lower end.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
}

impl Interval {
    /// That of the root of a mean of squares that may be off by this part of itself: on a logarithmic scale, on which sums of squares
    /// are more nearly normal, and never below zero.
    pub(super) fn around(mean: f64, deviation: f64, confidence: f64) -> Self {
        if !(mean > 0.0) {
            return Self { low: 0.0, high: 0.0 };
        }
        let z = normal_quantile(f64::midpoint(1.0, confidence));
        // Half, for the root.
        let factor = libm::exp(z * deviation / 2.0);
        Self { low: mean.sqrt() / factor, high: mean.sqrt() * factor }
    }
}

/// The x below which a normal number of variance 1 lies with probability `p`, in (0, 1): by bisection of its distribution
/// ½·erfc(−x/√2), to the last bit or nearly so.
pub fn normal_quantile(p: f64) -> f64 {
    /// Beyond ±39 the distribution is 0 or 1 in f64.
    const FARTHEST: f64 = 39.0;
    let below = |x: f64| libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2) / 2.0;
    let (mut low, mut high) = (-FARTHEST, FARTHEST);
    loop {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            return middle;
        }
        if below(middle) < p { low = middle } else { high = middle }
    }
}
