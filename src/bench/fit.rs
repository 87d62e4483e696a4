//! Medians, and straight lines through points on logarithmic axes.

use serde::Serialize;

/// Where several measurements of the same lie.
#[derive(Clone, Copy, Debug, Serialize, PartialEq)]
pub struct Spread {
    /// The one in the middle; of an even number, the mean of the two in the middle.
    pub median: f64,
    /// The smallest.
    pub low: f64,
    /// The largest.
    pub high: f64,
}

impl Spread {
    /// Of these; `None` if there are none, or one is not finite.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        if sorted.is_empty() || !sorted.iter().all(|v| v.is_finite()) {
            return None;
        }
        sorted.sort_unstable_by(f64::total_cmp);
        let (low, high) = (sorted[0], sorted[sorted.len() - 1]);
        let middle = sorted.len() / 2;
        let median = if sorted.len() % 2 == 1 { sorted[middle] } else { 0.5 * (sorted[middle - 1] + sorted[middle]) };
        Some(Self { median, low, high })
    }
}

/// The exponent s of the power law y = c·xˢ that fits best: the slope on logarithmic axes, by least squares. `None` unless
/// two points differ in x and all coordinates are positive.
pub fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let is_positive = |v: f64| v > 0.0 && v.is_finite();
    if !points.iter().all(|&(x, y)| is_positive(x) && is_positive(y)) {
        return None;
    }
    let logarithms: Vec<(f64, f64)> = points.iter().map(|&(x, y)| (libm::log(x), libm::log(y))).collect();
    let n = logarithms.len() as f64;
    let (mean_x, mean_y) = (mean(&logarithms, n, |p| p.0), mean(&logarithms, n, |p| p.1));
    let across = mean(&logarithms, n, |p| (p.0 - mean_x) * (p.0 - mean_x));
    let along = mean(&logarithms, n, |p| (p.0 - mean_x) * (p.1 - mean_y));
    Some(along / across).filter(|s| s.is_finite())
}

fn mean(points: &[(f64, f64)], n: f64, f: impl Fn(&(f64, f64)) -> f64) -> f64 {
    points.iter().map(f).sum::<f64>() / n
}

/// The geometric mean; `None` if there is nothing, or something that is not positive.
pub fn geometric_mean(values: &[f64]) -> Option<f64> {
    let sum: f64 = values.iter().map(|&v| libm::log(v)).sum();
    Some(libm::exp(sum / values.len() as f64)).filter(|m| m.is_finite() && *m > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_is_found() {
        let law = |exponent: f64| -> Vec<(f64, f64)> {
            [1.0, 4.0, 16.0, 256.0].into_iter().map(|x: f64| (x, 3.0 * x.powf(exponent))).collect()
        };
        for exponent in [-1.5, -1.0, 0.0, 2.0] {
            // Rounding of eight logarithms.
            const TOLERANCE: f64 = 1e-12;
            assert!((slope(&law(exponent)).unwrap() - exponent).abs() < TOLERANCE, "{exponent}");
        }
    }

    #[test]
    fn a_line_through_noise_is_that_of_least_squares() {
        // By hand: x = 0, 1, 2 and y = 1, 0, 2 on logarithmic axes have the slope 1/2.
        let e = |v: f64| v.exp();
        let s = slope(&[(e(0.0), e(1.0)), (e(1.0), e(0.0)), (e(2.0), e(2.0))]).unwrap();
        const TOLERANCE: f64 = 1e-12;
        assert!((s - 0.5).abs() < TOLERANCE, "{s}");
    }

    #[test]
    fn no_line_where_there_is_none() {
        assert_eq!(slope(&[]), None);
        assert_eq!(slope(&[(2.0, 1.0)]), None);
        assert_eq!(slope(&[(2.0, 1.0), (2.0, 3.0)]), None);
        assert_eq!(slope(&[(1.0, 1.0), (2.0, 0.0)]), None);
        assert_eq!(slope(&[(1.0, 1.0), (2.0, f64::NAN)]), None);
    }

    #[test]
    fn medians_and_means() {
        let spread = |v: &[f64]| Spread::of(v.iter().copied());
        assert_eq!(spread(&[3.0, 1.0, 2.0]), Some(Spread { median: 2.0, low: 1.0, high: 3.0 }));
        assert_eq!(spread(&[4.0, 1.0, 2.0, 9.0]), Some(Spread { median: 3.0, low: 1.0, high: 9.0 }));
        assert_eq!(spread(&[]), None);
        assert_eq!(spread(&[1.0, f64::INFINITY]), None);
        const TOLERANCE: f64 = 1e-12;
        assert!((geometric_mean(&[1.0, 4.0, 2.0]).unwrap() - 2.0).abs() < TOLERANCE);
        assert_eq!(geometric_mean(&[]), None);
        assert_eq!(geometric_mean(&[1.0, 0.0]), None);
    }
}
