//! Numerical integration.

use std::f64::consts::PI;

/// Newton steps from a guess that is off by some n⁻²: each doubles the digits, so these are more than f64 has.
const NEWTON_STEPS: u32 = 6;

/// Nodes in (0, 1) and weights, which sum to 1, of the Gauss–Legendre rule that integrates polynomials of degree below 2`n`
/// over [0, 1] exactly (Davis and Rabinowitz 1984, *Methods of Numerical Integration*, section 2.7).
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let node = |i: usize| {
        // The i-th root of Legendre's polynomial in (−1, 1) by Newton's method; the guess is Tricomi's, to first order.
        let mut x = -libm::cos(PI * (i as f64 + 0.75) / (n as f64 + 0.5));
        for _ in 0..NEWTON_STEPS {
            let (p, slope) = legendre(n, x);
            x -= p / slope;
        }
        let (_, slope) = legendre(n, x);
        (0.5 + 0.5 * x, 1.0 / ((1.0 - x) * (1.0 + x) * slope * slope))
    };
    (0..n).map(node).collect()
}

/// Legendre's polynomial of degree `n` at `x` in (−1, 1), and its derivative.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut p) = (0.0, 1.0);
    for k in 0..n {
        let k = k as f64;
        (before, p) = (p, ((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0));
    }
    (p, n as f64 * (before - x * p) / ((1.0 - x) * (1.0 + x)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_integrated_exactly() {
        for n in [1, 2, 5, 32, 128] {
            let rule = gauss_legendre(n);
            for power in [0, 1, n, 2 * n - 1] {
                let sum: f64 = rule.iter().map(|(x, w)| w * x.powi(power as i32)).sum();
                let expected = 1.0 / (power as f64 + 1.0);
                assert!((sum - expected).abs() < 1e-13, "{n} nodes, x^{power}: {sum} instead of {expected}");
            }
            assert!(rule.windows(2).all(|w| w[0].0 < w[1].0) && rule[0].0 > 0.0 && rule[n - 1].0 < 1.0);
        }
    }
}
